"""Data sets: many renderings, measured, on one core or on many machines.

A *plan* is that of ``chalumeau batch``: a TOML or CSV file, its text, or a dict ``{"same": {...}, "vary": {...}}``. `rows` makes
it a list of dicts, `measure` is a pure function of one of them, and `dataset` maps over all, writes Parquet files and
``manifest.csv``. It goes on where it was stopped.

``python -m chalumeau.datasets plan.toml --into set --workers 2`` does so from a terminal, and reports the throughput.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import os
import re
import tempfile
import time
import uuid
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chalumeau.arguments import at_least_1
from chalumeau.measuring import PlanLike, check, measure, rows
from chalumeau.parquet_parts import PARQUET, Done, Part, is_there, load_parquet, parts, render_part

__all__ = ["Done", "Part", "Report", "dataset", "growth", "measure", "parts", "render_part", "rows"]

#: The table of a data set, as ``chalumeau batch`` writes it, with more columns at the end of each line.
MANIFEST = "manifest.csv"
#: A hash of the rows that a folder is for.
PLAN = "plan.sha256"


#: What makes a field of a table a quoted one.
_QUOTED = re.compile(r'[,"\n\r#]')

#: Calls a function with each of a list, in any order, on whatever does the work.
MapLike = Callable[[Callable[[Part], Done], Sequence[Part]], Iterable[Done]]


@dataclass(frozen=True)
class Report:
    """What a run of `dataset` did."""

    #: The folder.
    into: str
    #: Rows of the plan, all of which are in the folder once.
    rows: int
    #: Rows that this run rendered; the others were there.
    rendered: int
    #: Time of this run, s.
    seconds: float
    #: Rows that were rendered in a second of one core's time, by the workers that reported theirs.
    rows_per_core_s: float
    #: Sound that was rendered in a second of one core's time, s.
    sound_per_core_s: float

    def __str__(self) -> str:
        if not self.rendered:
            return f"{self.into}: {self.rows} rows, all there already"
        return (
            f"{self.into}: {self.rows} rows, {self.rendered} rendered in {self.seconds:.1f} s: "
            f"{self.rendered / self.seconds:.1f} rows a second, {self.rows_per_core_s:.1f} rows and "
            f"{self.sound_per_core_s:.1f} s of sound a second of one core"
        )


def dataset(
    plan: PlanLike,
    into: str | os.PathLike[str],
    *,
    sound: bool = False,
    workers: int = 1,
    map: MapLike | None = None,
    rows_per_part: int = 25,
) -> Report:
    """Renders and measures every row of a plan into a folder: ``parquet/`` with the table, and ``manifest.csv``.

    ``workers`` are processes on this machine; they load your script, so call `dataset` under ``if __name__ == "__main__":`` there.
    ``map`` takes the work elsewhere, in two lines; all workers must see ``into``::

        client = dask.distributed.Client(...)                                    # Dask
        dataset(plan, into, map=lambda work, parts: client.gather(client.map(work, parts)))

        work = ray.remote(chalumeau.datasets.render_part)                        # Ray
        dataset(plan, into, map=lambda _, parts: ray.get([work.remote(part) for part in parts]))

    Each file has some rows, ``rows_per_part``, and appears when it is whole. Whatever is stopped or dies, the same call, with the same
    ``rows_per_part``, goes on where it was, and at the end every row is there once: that is checked. Rows whose files (instrument, MIDI, scale ...) or presets have
    changed are rendered again. All rows that are left are checked before the first is rendered. A folder that holds the rows of another plan,
    or a manifest.csv that is of none, is refused.

    ``manifest.csv`` has the columns of ``chalumeau batch`` (``file``, the names of the plan, ``length_s``, ``rate_hz``,
    ``peak_dbfs``, ``rms_dbfs``) without its ``warnings``, and then those of `measure`. ``file`` is the Parquet file of the row. With ``sound`` the Parquet
    files have a column ``samples``, lists of float32; of two channels left and right in turn.

    Raises `ValueError` for a wrong plan or row, `RuntimeError` if a row is missing or twice.

    >>> import chalumeau, tempfile
    >>> plan = {"same": {"seconds": 0.1, "no-noise": True}, "vary": {"written": ["E3", "C4"], "gamma": [0.4, 0.5]}}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     first = chalumeau.dataset(plan, folder)
    ...     again = chalumeau.dataset(plan, folder)
    >>> first.rows, first.rendered, again.rendered
    (4, 4, 0)
    """
    began = time.monotonic()
    workers, rows_per_part = at_least_1("workers", workers), at_least_1("rows_per_part", rows_per_part)
    cut = parts(plan, into, sound=sound, rows_per_part=rows_per_part)
    planned, stamp = _digest(cut), Path(into, PLAN)
    # The plan is written before any file. Files without one are those of an older version, which kept none.
    begun = stamp.read_text() if stamp.exists() else None
    if begun == planned:
        _refuse_another_cut(cut, into, rows_per_part)
    ours = {part.file for part in cut}
    foreign = sorted(path.name for path in Path(into).glob(f"{PARQUET}/*.parquet") if f"{PARQUET}/{path.name}" not in ours)
    if foreign:
        raise ValueError(f"{into} has files of another data set: {', '.join(foreign[:3])} ...; take another folder")
    left = [part for part in cut if not is_there(part)]
    is_begun = any(Path(into, part.file).exists() for part in cut)
    # Where nothing was made, as by a plan with a mistake, another plan may begin.
    if begun != planned and is_begun:
        raise ValueError(f"{into} holds a data set of another plan; take another folder, or remove this one first")
    if not stamp.exists() and Path(into, MANIFEST).exists():
        raise ValueError(f"{into} holds a {MANIFEST} that is not of a data set; take another folder")
    if left:
        # A wrong name or value is told before anything is made.
        _check(left)
        os.makedirs(into, exist_ok=True)
        growing = Path(into, f".{PLAN}.{uuid.uuid4().hex}")
        growing.write_text(planned)
        os.replace(growing, stamp)
    if map is not None:
        done = list(map(render_part, left))
    elif workers > 1:
        done = _in_processes(left, workers)
    else:
        done = [render_part(part) for part in left]
    count = _write_manifest(cut, into)
    timed = [one for one in done if one.cpu_s > 0.0]
    core_s = sum(one.cpu_s for one in timed)
    return Report(
        into=os.fspath(into),
        rows=count,
        rendered=sum(len(part.rows) for part in left),
        seconds=time.monotonic() - began,
        rows_per_core_s=sum(one.rows for one in timed) / core_s if timed else math.nan,
        sound_per_core_s=sum(one.sound_s for one in timed) / core_s if timed else math.nan,
    )


def _digest(cut: Sequence[Part]) -> str:
    rows = [row for part in cut for row in part.rows]
    return hashlib.sha256(json.dumps(rows).encode()).hexdigest()


def _refuse_another_cut(cut: Sequence[Part], into: str | os.PathLike[str], rows_per_part: int) -> None:
    """Refuses to go on with other ``rows_per_part`` than the folder was begun with: all would be rendered again, beside the old files."""
    _, parquet = load_parquet()
    ours, begun_with, is_another = {part.file: len(part.rows) for part in cut}, 0, False
    for path in Path(into).glob(f"{PARQUET}/part-*.parquet"):
        try:
            rows_there = parquet.read_metadata(path).num_rows
        except (OSError, ValueError):
            continue
        begun_with = max(begun_with, rows_there)
        is_another |= ours.get(f"{PARQUET}/{path.name}") != rows_there
    if is_another:
        raise ValueError(
            f"{into} was begun with rows_per_part={begun_with}, got rows_per_part={rows_per_part}; "
            f"give rows_per_part={begun_with}, or take another folder"
        )


def _check(left: Sequence[Part]) -> None:
    """Whether every row can be rendered, as far as that can be known without its instrument."""
    for part in left:
        for at, pairs in enumerate(part.rows):
            row = dict(pairs)
            try:
                check(row)
            except ValueError as error:
                raise ValueError(f"row {part.first + at} {row}: {error}") from error


def _in_processes(left: Sequence[Part], workers: int) -> list[Done]:
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor
    from concurrent.futures.process import BrokenProcessPool

    # Threads of this process are not copied into a worker.
    context = multiprocessing.get_context("spawn")
    try:
        with ProcessPoolExecutor(workers, mp_context=context) as pool:
            return list(pool.map(render_part, left))
    except BrokenProcessPool as error:
        raise RuntimeError(
            'a worker ended before its work was done. Workers run your script again, so call dataset under '
            'if __name__ == "__main__": there; if it is so, the memory may be full: take fewer workers'
        ) from error


def _write_manifest(cut: Sequence[Part], into: str | os.PathLike[str]) -> int:
    """Writes the table of all rows, in their order, if each is there once. Returns how many they are."""
    _, parquet = load_parquet()
    missing = [part.file for part in cut if not is_there(part)]
    if missing:
        raise RuntimeError(f"{into}: {len(missing)} of {len(cut)} files are missing, {missing[0]} the first; run it again")
    expected, growing = 1, Path(into, f".{MANIFEST}.{uuid.uuid4().hex}")
    try:
        with open(growing, "w", newline="", encoding="utf-8") as file:
            for part in cut:
                path = Path(part.into, part.file)
                names = [name for name in parquet.read_schema(path).names if name != "samples"]
                for row in parquet.read_table(path, columns=names).to_pylist():
                    number = row.pop("row")
                    if number != expected:
                        raise RuntimeError(f"{path}: row {expected} expected, row {number} found")
                    if number == 1:
                        file.write(_line(row))
                    # What was asked for stands as it was written.
                    row |= dict(part.rows[number - part.first])
                    file.write(_line(_shown(name, value) for name, value in row.items()))
                    expected += 1
        os.replace(growing, Path(into, MANIFEST))
    finally:
        growing.unlink(missing_ok=True)
    return expected - 1


def _line(fields: Iterable[str]) -> str:
    """A line of a table. Fields are quoted as ``chalumeau batch`` does it: also where a reader would take # for a remark, as in C#4."""
    quoted = (field if _QUOTED.search(field) is None else '"' + field.replace('"', '""') + '"' for field in fields)
    return ",".join(quoted) + "\n"


def _shown(name: str, value: Any) -> str:
    """A value as ``chalumeau batch`` writes it; what was asked for is a text already."""
    if isinstance(value, str):
        return value
    if name == "length_s":
        return f"{value:.4f}"
    if name.endswith(("_dbfs", "_db")):
        return f"{value:.2f}"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def growth(plan: PlanLike, workers: int, rows_most: int = 200) -> list[tuple[int, float]]:
    """Rows a second with 1, 2, 4 ... ``workers`` processes, each on the first rows of a plan anew, starts left out."""
    some = rows(plan)[:rows_most]
    counts = sorted({count for count in (2**n for n in range(workers.bit_length())) if count < workers} | {workers})
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    measured = []
    for count in counts:
        with tempfile.TemporaryDirectory() as folder, ProcessPoolExecutor(
            count, mp_context=multiprocessing.get_context("spawn")
        ) as pool:
            # Small parts, so that the last ones do not leave workers idle.
            cut = parts(some, folder, rows_per_part=max(1, len(some) // (8 * workers)))
            list(pool.map(_start, range(4 * count)))
            began = time.monotonic()
            for _ in pool.map(render_part, cut):
                pass
            measured.append((count, len(some) / (time.monotonic() - began)))
    return measured


def _start(_: int) -> None:
    """Loads what a worker needs before its first part."""
    load_parquet()
    measure({"written": "C4", "seconds": 0.05})
    time.sleep(0.2)


def main(arguments: Sequence[str] | None = None) -> None:
    """``python -m chalumeau.datasets``."""
    parser = argparse.ArgumentParser(prog="python -m chalumeau.datasets", description=__doc__.split("\n\n")[0])
    parser.add_argument("plan", help="plan of chalumeau batch: a TOML or CSV file")
    parser.add_argument("--into", required=True, metavar="FOLDER", help="folder of the Parquet files and manifest.csv")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="N", help="processes [default: one for each core]")
    parser.add_argument("--sound", action="store_true", help="keep the samples too")
    parser.add_argument("--growth", action="store_true", help="then measure how the throughput grows with the processes")
    chosen = parser.parse_args(arguments)
    try:
        print(dataset(chosen.plan, chosen.into, sound=chosen.sound, workers=chosen.workers))
        if chosen.growth:
            measured = growth(chosen.plan, chosen.workers)
            alone = measured[0][1]
            for count, rows_per_s in measured:
                print(f"{count} processes: {rows_per_s:.1f} rows a second, {rows_per_s / alone:.2f} times one process")
    except (ValueError, RuntimeError, OSError, ImportError) as error:
        parser.exit(2, f"error: {error}\n")


if __name__ == "__main__":
    # By its own name, so that workers find what is sent to them.
    from chalumeau.datasets import main as command

    command()
