"""Some rows of a data set, which become one Parquet file: what a worker renders."""

from __future__ import annotations

import hashlib
import json
import math
import os
import time
import uuid
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from chalumeau import _native
from chalumeau.arguments import at_least_1
from chalumeau.measuring import PlanLike, measure, rows

#: The folder of the files, in that of the data set.
PARQUET = "parquet"


@dataclass(frozen=True)
class Part:
    """Some rows of a data set, which become one Parquet file."""

    #: The folder of the data set. All workers must see it.
    into: str
    #: Path of the file in it.
    file: str
    #: Number of the first row, from 1.
    first: int
    #: The rows.
    rows: tuple[tuple[tuple[str, str], ...], ...]
    #: Names of the columns that hold numbers.
    numbers: tuple[str, ...]
    #: Whether the file has the samples.
    sound: bool

    @property
    def digest(self) -> str:
        """A hash of everything that the file depends on, files and presets that rows name among it."""
        named = sorted({value for row in self.rows for _, value in row if os.path.isfile(value)})
        files = {name: hashlib.sha256(Path(name).read_bytes()).hexdigest() for name in named}
        chosen = sorted({value for row in self.rows for name, value in row if name == "preset" and value})
        presets = {name: _native.preset_text(name) for name in chosen}
        about = {**asdict(self), "into": "", "version": _native.__version__}
        about |= {"files": files} if files else {}
        about |= {"presets": presets} if presets else {}
        return hashlib.sha256(json.dumps(about, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class Done:
    """What has become of a part."""

    file: str
    #: Rows in it.
    rows: int
    #: Time of the processor, s; 0 if the file was there.
    cpu_s: float
    #: Sound in it, s; 0 if the file was there.
    sound_s: float


def parts(plan: PlanLike, into: str | os.PathLike[str], *, sound: bool = False, rows_per_part: int = 25) -> list[Part]:
    """A plan cut into parts, which workers may render in any order, and more than once."""
    rows_per_part = at_least_1("rows_per_part", rows_per_part)
    all_rows = rows(plan)
    if not all_rows:
        raise ValueError("the plan has no rows")
    digits = max(4, len(str(len(all_rows))))
    numbers = tuple(name for name in all_rows[0] if all(_is_number(row[name]) for row in all_rows))
    cut = []
    for begin in range(0, len(all_rows), rows_per_part):
        some = tuple(tuple(row.items()) for row in all_rows[begin : begin + rows_per_part])
        # In a folder of their own, which readers of Parquet take as one table.
        file = f"{PARQUET}/part-{begin + 1:0{digits}}.parquet"
        cut.append(Part(os.path.abspath(into), file, begin + 1, some, numbers, sound))
    return cut


def _is_number(text: str) -> bool:
    try:
        return text == "" or math.isfinite(float(text))
    except ValueError:
        return False


def load_parquet() -> Any:
    """pyarrow and its Parquet, or an `ImportError` that says how to get it."""
    try:
        import pyarrow.parquet
    except ImportError as error:
        raise ImportError("a data set needs pyarrow; pip install pyarrow") from error
    return pyarrow, pyarrow.parquet


def is_there(part: Part) -> bool:
    """Whether the part's file is there, whole and of the same rows."""
    _, parquet = load_parquet()
    try:
        schema = parquet.read_schema(Path(part.into, part.file))
    except (OSError, ValueError):
        return False
    return (schema.metadata or {}).get(b"chalumeau") == part.digest.encode()


def render_part(part: Part) -> Done:
    """Renders and measures the rows of a part into its file. It appears when it is whole, so a worker may die at any time.

    Does nothing if the file is there. Two workers with the same part write the same bytes; one file remains.
    """
    pyarrow, parquet = load_parquet()
    if is_there(part):
        return Done(part.file, len(part.rows), 0.0, 0.0)
    began, columns = time.thread_time(), []
    for at, pairs in enumerate(part.rows):
        row = dict(pairs)
        try:
            measured = measure(row, part.sound)
        except ValueError as error:
            raise ValueError(f"row {part.first + at} {row}: {error}") from error
        typed = {name: _typed(value, name in part.numbers) for name, value in row.items()}
        if part.sound:
            measured["samples"] = measured["samples"].ravel()
        columns.append({"row": part.first + at, "file": part.file, **typed, **measured})
    kinds = {"row": pyarrow.int64(), "rate_hz": pyarrow.int64(), "samples": pyarrow.list_(pyarrow.float32())}
    texts = {"file", "sha256", *(name for name in dict(part.rows[0]) if name not in part.numbers)}
    fields = [
        pyarrow.field(name, kinds.get(name, pyarrow.string() if name in texts else pyarrow.float64()))
        for name in columns[0]
    ]
    schema = pyarrow.schema(fields, metadata={"chalumeau": part.digest})
    table = pyarrow.Table.from_pylist(columns, schema=schema)
    whole = Path(part.into, part.file)
    whole.parent.mkdir(parents=True, exist_ok=True)
    growing = whole.with_name(f".{whole.name}.{uuid.uuid4().hex}")
    try:
        parquet.write_table(table, growing)
        os.replace(growing, whole)
    finally:
        growing.unlink(missing_ok=True)
    return Done(part.file, len(columns), time.thread_time() - began, sum(row["length_s"] for row in columns))


def _typed(text: str, is_number: bool) -> float | str | None:
    if text == "":
        return None
    return float(text) if is_number else text
