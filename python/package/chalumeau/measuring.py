"""The rows of a plan, and the measurement of one."""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Union

import numpy as np

from chalumeau import _native
from chalumeau.acoustics import features
from chalumeau.arguments import Value, as_json, is_of_render, pairs, text_of, whole_of
from chalumeau.playing import played

#: A plan: the path of a TOML or CSV file, the text of a TOML plan, a dict of its tables, or rows.
PlanLike = Union[str, "os.PathLike[str]", Mapping[str, Any], Sequence[Mapping[str, Value]]]

#: Harmonics of which the level is measured.
HARMONICS = 12


def rows(plan: PlanLike) -> list[dict[str, str]]:
    """The rows of a plan, in the order of ``chalumeau batch``: for each the names of flags or parameters, with their values.

    Of ``same`` every row has all, of ``vary`` every combination is a row; ``{"from": 0.4, "to": 0.6, "steps": 5}`` are equal
    steps. Raises `ValueError` for a name that is none, or a plan in which nothing varies.

    >>> import chalumeau
    >>> plan = {"same": {"seconds": 0.3}, "vary": {"written": ["E3", "C4"], "gamma": {"from": 0.4, "to": 0.6, "steps": 3}}}
    >>> len(chalumeau.rows(plan)), chalumeau.rows(plan)[1]
    (6, {'seconds': '0.3', 'gamma': '0.4', 'written': 'C4'})
    """
    if isinstance(plan, Mapping):
        names, values = _native.rows(json=json.dumps(as_json("plan", plan)))
    elif isinstance(plan, str) and "\n" in plan:
        names, values = _native.rows(text=plan)
    elif isinstance(plan, (str, os.PathLike)):
        names, values = _native.rows(path=os.fspath(plan))
    elif hasattr(plan, "to_dict"):
        raise TypeError(f"a plan is not a {type(plan).__name__}; of a table of pandas give its rows: frame.to_dict(\"records\")")
    elif not isinstance(plan, Iterable):
        raise TypeError(f"a plan is a path, a text, a dict of its tables or a list of rows, not {plan!r}")
    else:
        given = [{name: text_of(name, value) for name, value in _row(row).items()} for row in plan]
        names = list(dict.fromkeys(name for row in given for name in row))
        for name in names:
            if name not in ("channels", "bits", "out", "force") and not is_of_render(name):
                _native.check([(name, "")])
        return [{name: row.get(name, "") for name in names} for row in given]
    return [dict(zip(names, of_row)) for of_row in values]


def _row(row: Any) -> Mapping[str, Value]:
    if not isinstance(row, Mapping):
        raise TypeError(f"a row is a dict such as {{'written': 'C4', 'seconds': 1}}, not {row!r}")
    return row


#: Columns of plans of ``chalumeau batch`` that are of its files.
_OF_FILES = ("bits", "out", "force")


def split(row: Mapping[str, Value]) -> tuple[Any, dict[str, Any], int | None, int]:
    """What a row plays, its settings, its channels (None: as many as the command would write) and its rate."""
    named: dict[str, Any] = {
        name: value for name, value in _row(row).items() if value is not None and not (isinstance(value, str) and value == "")
    }
    for own in _OF_FILES:
        if own in named:
            raise ValueError(f"{own} is of files of chalumeau batch; samples here are always 32-bit floats")
    score, channels = named.pop("midi", None), named.pop("channels", None)
    channels = None if channels is None else whole_of("channels", channels)
    if channels not in (None, 1, 2):
        raise ValueError(f"channels must be 1 or 2, got {channels}")
    return score, named, channels, whole_of("rate", named.pop("rate", 48_000))


def check(row: Mapping[str, Value]) -> None:
    """Raises `ValueError` if a row cannot be rendered, as far as that can be known without its instrument: for notes, values, files."""
    score, named, _, rate = split(row)
    about = [("midi", os.fspath(score))] if score is not None else []
    _native.check_rendering([*about, *pairs(named), ("rate", str(rate))])


def measure(row: Mapping[str, Value], sound: bool = False) -> dict[str, Any]:
    """Renders one row and measures it: a pure function, the same on every machine.

    Returns the columns that ``chalumeau batch`` has, ``length_s``, ``rate_hz``, ``peak_dbfs``, ``rms_dbfs``; then those of
    `features` (of the mean of both channels, if there are two, as in a room or for several players): ``f0_hz``, ``steady_dbfs``, ``centroid_hz``, ``attack_s``,
    ``h1_db`` to ``h12_db``; and ``sha256``, of the samples as little-endian 32-bit floats. With ``sound`` the samples too.

    >>> import chalumeau
    >>> c4 = chalumeau.measure({"written": "C4", "gamma": 0.5, "seconds": 0.5, "no-noise": True})
    >>> round(c4["f0_hz"]), c4["length_s"]
    (233, 0.5)
    """
    score, named, channels, rate = split(row)
    # What is no text is an instrument itself; a row of a file names it.
    own = named["instrument"] if not isinstance(named.get("instrument", ""), str) else None
    if own is not None:
        del named["instrument"]
    made = played(score, instrument=own, settings=named, rate=rate, channels=channels)
    samples = made["samples"]
    power = float(np.mean(np.square(samples, dtype=np.float64))) if samples.size else 0.0
    peak = float(np.abs(samples).max(initial=0.0))
    mono = samples if samples.ndim == 1 else samples.mean(axis=1, dtype=np.float32)
    heard = features(mono, rate, near=made["wanted_hz"] if made["wanted_hz"] > 0 else None)
    harmonics = heard.pop("harmonics_db")
    levels = harmonics + [math.nan] * (HARMONICS - len(harmonics))
    measured = {
        "length_s": len(samples) / rate,
        "rate_hz": rate,
        "peak_dbfs": _db(peak),
        "rms_dbfs": _db(math.sqrt(power)),
        **heard,
        **{f"h{n}_db": level for n, level in enumerate(levels, 1)},
        "sha256": hashlib.sha256(samples.astype("<f4", copy=False).tobytes()).hexdigest(),
    }
    return {**measured, "samples": samples} if sound else measured


def _db(amplitude: float) -> float:
    return 20.0 * math.log10(amplitude) if amplitude > 0.0 else -math.inf
