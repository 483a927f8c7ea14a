"""Reads the logs of a study for analyse_study.py: pieces of one side of a trial, and the thresholds of their notes."""

import csv
import dataclasses
import math

import numpy as np

NUMBERS = (
    "t_us", "angle_deg", "torque_mnm", "written_midi", "gamma", "feel_id", "h", "k", "participant", "trial",
)
WORDS = ("side", "condition")
# These may be empty: no note is fingered, no study runs, or the reed is unknown.
MAY_BE_EMPTY = ("written_midi", "feel_id", "h", "k", "participant", "trial")
# Columns that older logs, and logs without sound, do not have.
OPTIONAL = ("gamma_sounding", "level_db", "f0_hz", "heard_us", "armed")
SIDES = ("A", "B")
CONDITIONS = ("coupled", "free")

# The reference reed of the notebook: H = sqrt(27)/2 and k = 27 / (4 H^3).
H_REFERENCE = math.sqrt(27) / 2
K_REFERENCE = 27 / (4 * H_REFERENCE**3)
# Rows further apart than this are a gap in the link (a knob sends 25 to 1000 rows a second). No measure spans a gap.
GAP_S = 0.1


class BadInput(Exception):
    """A file that cannot be used; the text says which file, where and why."""


def read_table(path, needed, optional=()):
    """The columns of a CSV file, by name in lower case, and the line number of each row. Optional columns may be missing.

    Lines that begin with # are remarks. Raises BadInput.
    """
    rows, lines, header = [], [], None
    try:
        with open(path, encoding="utf-8-sig", newline="") as file:
            for line, row in enumerate(csv.reader(file), 1):
                if not row or row[0].lstrip().startswith("#"):
                    continue
                if header is None:
                    header = [name.strip().lower() for name in row]
                    missing = [name for name in needed if name not in header]
                    if missing:
                        raise BadInput(f"{path}: the first line has no column {', '.join(missing)}")
                    twice = {name for name in (*needed, *optional) if header.count(name) > 1}
                    if twice:
                        raise BadInput(f"{path}: the first line has {', '.join(sorted(twice))} twice")
                elif len(row) < len(header):
                    raise BadInput(f"{path}: line {line} has {len(row)} cells, the first line has {len(header)}")
                else:
                    rows.append(row)
                    lines.append(line)
    except OSError as reason:
        raise BadInput(f"{path}: cannot be read: {reason.strerror}") from reason
    except UnicodeDecodeError as reason:
        raise BadInput(f"{path}: is not UTF-8 text (byte {reason.start})") from reason
    except csv.Error as reason:
        raise BadInput(f"{path}: is no CSV table: {reason}") from reason
    if header is None:
        raise BadInput(f"{path}: is empty; a table begins with the names of its columns")
    if not rows:
        raise BadInput(f"{path}: has no rows")
    columns = list(zip(*rows))
    present = (*needed, *(name for name in optional if name in header))
    return {name: columns[header.index(name)] for name in present}, lines


def numbers(path, name, cells, lines, may_be_empty):
    """A column as floats, nan for empty cells. Raises BadInput with the line of the first bad cell."""
    found = np.full(len(cells), np.nan)
    for row, cell in enumerate(cells):
        cell = cell.strip()
        if not cell and may_be_empty:
            continue
        try:
            found[row] = float(cell)
        except ValueError:
            pass
        if not math.isfinite(found[row]):
            wanted = "a number, or empty" if may_be_empty else "a number"
            raise BadInput(f"{path}: line {lines[row]}: {name} is `{cell}`; it must be {wanted}")
    return found


@dataclasses.dataclass
class Piece:
    """Consecutive rows of one side of one trial, without a gap."""

    participant: int
    trial: int
    side: str
    condition: str
    t_s: np.ndarray
    angle_deg: np.ndarray
    torque_mnm: np.ndarray
    written: np.ndarray
    gamma: np.ndarray
    gamma_on: np.ndarray
    feel_id: np.ndarray
    # What was heard: level, pitch, and when the latest onset was heard, on the clock of t_s; nan where not known.
    level_db: np.ndarray
    f0_hz: np.ndarray
    heard_s: np.ndarray
    h: float
    k: float
    # True if the log says where its notes begin to sound.
    has_threshold: bool
    # False if the piece only continues after a gap, or after the knob was armed or let go.
    is_visit: bool
    # False while the knob makes no torque: the hand then compares nothing. Older logs do not say, and count as armed.
    is_armed: bool
    # Number of the log, so that times of two logs are never subtracted.
    log: int


def read_log(path, log, onset):
    """The pieces of a log, in order of time. Raises BadInput."""
    cells, lines = read_table(path, NUMBERS + WORDS, OPTIONAL)
    data = {name: numbers(path, name, cells[name], lines, name in MAY_BE_EMPTY) for name in NUMBERS}
    for name in OPTIONAL:
        data[name] = numbers(path, name, cells[name], lines, True) if name in cells else np.full(len(lines), np.nan)
    words = {name: np.array([cell.strip() for cell in cells[name]]) for name in WORDS}
    back = np.flatnonzero(np.diff(data["t_us"]) < 0)
    if back.size:
        raise BadInput(f"{path}: line {lines[back[0] + 1]}: t_us goes back; a log runs forward")
    # A study is on in rows that name a participant.
    on = np.isfinite(data["participant"])
    if not on.any():
        raise BadInput(f"{path}: no row belongs to a study; was Study on while the take was recorded?")
    for name, allowed in (("side", SIDES), ("condition", CONDITIONS)):
        bad = np.flatnonzero(on & ~np.isin(words[name], allowed))
        if bad.size:
            found = words[name][bad[0]]
            raise BadInput(f"{path}: line {lines[bad[0]]}: {name} is `{found}`; it must be {' or '.join(allowed)}")
    bad = np.flatnonzero(on & ~np.isfinite(data["trial"]))
    if bad.size:
        raise BadInput(f"{path}: line {lines[bad[0]]}: trial is empty, but a participant is named")

    t_s, heard_s = (1e-6 * (data[name] - data["t_us"][0]) for name in ("t_us", "heard_us"))
    key = [(p, n, s, c) for p, n, s, c in zip(data["participant"], data["trial"], words["side"], words["condition"])]
    changes = np.array([now != before for before, now in zip(key, key[1:])], dtype=bool)
    armed = data["armed"] != 0
    cuts = np.flatnonzero(changes | (np.diff(t_s) > GAP_S) | (armed[1:] != armed[:-1])) + 1
    pieces = []
    for begin, end in zip([0, *cuts], [*cuts, len(t_s)]):
        if not on[begin] or end - begin < 2:
            continue
        rows = slice(begin, end)
        participant, trial, side, condition = key[begin]
        h, k, written = data["h"][rows], data["k"][rows], data["written_midi"][rows]
        sounding = data["gamma_sounding"][rows]
        pieces.append(
            Piece(
                int(participant), int(trial), str(side), str(condition), t_s[rows], data["angle_deg"][rows],
                data["torque_mnm"][rows], written, data["gamma"][rows],
                np.where(np.isfinite(sounding), sounding, onset.gamma(written, h, k)),
                data["feel_id"][rows], data["level_db"][rows], data["f0_hz"][rows], heard_s[rows],
                # Side and parameters do not change at exactly the same time, so the median of the rows counts.
                float(np.median(h)), float(np.median(k)), bool(np.isfinite(sounding).any()),
                begin == 0 or bool(changes[begin - 1]), bool(armed[begin]), log,
            )
        )
    return pieces


class Onset:
    """gamma_on of a note, from the table of `chalumeau haptic --all --csv`; without a table 1/3, as for a bore without losses."""

    def __init__(self, path=None):
        self.losses = {}
        if path is None:
            return
        names = ("written_midi", "gamma_on", "h", "k")
        cells, lines = read_table(path, names)
        table = [numbers(path, name, [c.replace("nan", "") for c in cells[name]], lines, True) for name in names]
        for line, written, gamma, h, k in zip(lines, *table):
            if not math.isfinite(gamma):
                continue
            if not (1 / 3 <= gamma <= 1 and written == int(written) and h > 0 and k > 0):
                raise BadInput(f"{path}: line {line}: gamma_on must lie in 1/3..1, H and k above 0, the note be whole")
            # sqrt(g) = (b + sqrt(3 + b^2)) / 3 is solved for b = Zc / (zeta Zpeak), then multiplied by the strength of
            # the table's reed. The result depends only on the note.
            root = math.sqrt(gamma)
            self.losses[int(written)] = (3 * gamma - 1) / (2 * root) * self.strength(h, k)
        if not self.losses:
            raise BadInput(f"{path}: has no gamma_on; write it with `chalumeau haptic --all --csv FILE`")

    @staticmethod
    def strength(h, k):
        """Flow strength of a reed relative to the reference reed: zeta is proportional to H / sqrt(H k)."""
        return h * K_REFERENCE / np.sqrt(h * k)

    def gamma(self, written, h, k):
        """gamma_on row by row; nan where no note is fingered or the table lacks the note."""
        known = np.isfinite(written)
        if not self.losses:
            return np.where(known, 1 / 3, np.nan)
        # A log without H and k is taken as one of the reference reed.
        h, k = np.where(np.isfinite(h), h, H_REFERENCE), np.where(np.isfinite(k), k, K_REFERENCE)
        notes = np.where(known, written, -1).astype(int)
        b = np.array([self.losses.get(note, np.nan) for note in notes]) / self.strength(h, k)
        return ((b + np.sqrt(3 + b * b)) / 3) ** 2
