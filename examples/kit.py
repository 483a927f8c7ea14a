"""Functions shared by the plots of the study kit: tables of the command line as numpy arrays, and saving of figures."""

import itertools
import pathlib
import re
import sys

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from study_log import BadInput, numbers, read_table

# Okabe and Ito's colours, distinct for all common kinds of colour vision.
BLUE, RED, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "0.55"

NAMES = ("C", "C#", "D", "D#", "E", "F", "F#", "G", "G#", "A", "A#", "B")


def table(path, *columns):
    """Columns of a table as arrays of floats, in the given order; `nan` in the file is nan. Raises BadInput."""
    whole = sound(path, columns)
    if whole is not None:
        return whole
    cells, lines = read_table(path, columns)
    emptied = ([("" if cell.strip() == "nan" else cell) for cell in cells[name]] for name in columns)
    return [numbers(path, name, column, lines, True) for name, column in zip(columns, emptied)]


def sound(path, columns):
    """The same, fast, for a table without errors; None for any other. Half a minute of a probe is three million rows."""
    try:
        with open(path, encoding="utf-8-sig") as file:
            names = file.readline().strip().split(",")
            places = [names.index(name) for name in columns]
            read = np.loadtxt(file, delimiter=",", usecols=places, ndmin=2, quotechar='"')
    except (OSError, ValueError):
        return None
    return list(read.T) if len(read) and not np.isinf(read).any() else None


def remark(path, words, unit):
    """The number between `words` and `unit` in the remarks (#) of a table. Raises BadInput."""
    with open(path, encoding="utf-8-sig") as file:
        # Remarks are at the top of the file.
        head = itertools.takewhile(lambda line: line.startswith("#") or not line[:1].isdigit(), file)
        text = " ".join(line for line in head if line.startswith("#"))
    found = re.search(rf"{re.escape(words)} ([-+.0-9e]+) ?{re.escape(unit)}", text)
    if not found:
        raise BadInput(f"{path}: no remark says `{words} .. {unit}`; was it made by this version of chalumeau?")
    return float(found.group(1))


def name(written):
    """Name of a written note: 60 is C4."""
    written = int(written)
    return f"{NAMES[written % 12]}{written // 12 - 1}"


def save(figure, path):
    """Saves a figure as PNG, SVG or PDF, by the ending of the name. Raises BadInput."""
    endings = sorted(figure.canvas.get_supported_filetypes())
    if pathlib.Path(path).suffix.lstrip(".").lower() not in endings:
        raise BadInput(f"--out {path}: the name must end in one of .{', .'.join(endings)}")
    try:
        figure.savefig(path, dpi=130)
    except OSError as reason:
        raise BadInput(f"--out {path}: cannot be written: {reason.strerror}") from reason
    plt.close(figure)
    print(path)


def run(program, draw, args):
    """Draws, or prints the error. Returns the exit code."""
    try:
        draw(args)
    except BadInput as reason:
        print(f"{program}: {reason}", file=sys.stderr)
        return 2
    return 0
