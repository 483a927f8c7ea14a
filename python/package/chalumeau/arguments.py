"""What functions of this package take: instruments, notes, settings."""

from __future__ import annotations

import json
import math
import operator
import os
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, SupportsFloat, SupportsIndex, Union, cast

import numpy as np

from chalumeau import _native
from chalumeau._native import Instrument

#: An instrument: the id of a bundled one, the path or the text of a TOML file, the same as a dict, or an `Instrument`.
InstrumentLike = Union[str, "os.PathLike[str]", Mapping[str, Any], Instrument]
#: A MIDI number, 0 to 127, or a name such as ``"C4"``.
NoteLike = Union[SupportsIndex, SupportsFloat, str]
#: A value of a setting: a number, a switch, or a text with a unit, such as ``"7 kPa"``.
Value = Union[SupportsIndex, SupportsFloat, str, "os.PathLike[str]", None]


def instruments() -> list[str]:
    """Ids of the instruments that come with the package.

    >>> import chalumeau
    >>> chalumeau.instruments()
    ['b-flat', 'a', 'e-flat', 'c', 'bass']
    """
    return Instrument.ids()


def instrument(what: InstrumentLike) -> Instrument:
    """An instrument from its id, the path of a TOML file, the text of one, or a dict with the same tables and keys.

    ``docs/instrument-file.md`` in the repository describes the file. Lengths in it are in mm, lengths of an `Instrument` in m.

    Raises `ValueError` if it is no instrument, with the place and what would be right, and `OSError` if a file cannot be read.

    Source: the bundled B flat clarinet is a Yamaha CX1, measured by Montserrat Pamies-Vila; the others are that clarinet,
    larger or smaller.

    >>> import chalumeau
    >>> bass = chalumeau.instrument("bass")
    >>> bass.name, round(bass.length_m, 3)
    ('B flat bass clarinet to low C, Boehm system', 1.632)
    >>> chalumeau.instrument(bass.to_toml()) == bass
    True
    """
    if isinstance(what, Instrument):
        return what
    if isinstance(what, Mapping):
        return Instrument.of_json(json.dumps(as_json("instrument", what)))
    if isinstance(what, str):
        if "\n" in what:
            return Instrument.parse(what)
        if what in Instrument.ids() or not what.lower().endswith(".toml") and not Path(what).is_file():
            return Instrument.bundled(what)
    if isinstance(what, (str, os.PathLike)):
        try:
            return Instrument.parse(Path(what).read_text(encoding="utf-8"))
        except UnicodeDecodeError:
            raise ValueError(f"{os.fspath(what)}: it is not in UTF-8; save it as UTF-8 text in your editor") from None
        except ValueError as error:
            raise ValueError(f"{os.fspath(what)}: {error}") from None
    raise TypeError(
        f"an instrument is an id ({', '.join(Instrument.ids())}), a path, a text, a dict or an Instrument, "
        f"not {type(what).__name__}"
    )


def fingerings(instrument: InstrumentLike = "b-flat") -> list[dict[str, Any]]:
    """The fingering chart, from the lowest note to the highest. The command ``chalumeau fingerings`` searches for others.

    Each fingering has ``written_midi`` and ``written`` (its name), ``sounding_midi``, ``register``, ``mode`` (which
    resonance of the bore sounds, 1 the lowest), ``fingers`` (for a reader) and ``open`` (names of the open holes).

    >>> import chalumeau
    >>> lowest = chalumeau.fingerings()[0]
    >>> lowest["written"], lowest["sounding_midi"], lowest["open"]
    ('E3', 50, [])
    """
    return instrument_of(instrument).fingerings()


def parameters() -> list[dict[str, Any]]:
    """All settings of the sound: ``id``, ``name``, ``group``, ``flag``, ``unit``, ``range``, ``default``, ``meaning``, ``sound``.

    A setting can be named by each of ``id``, ``name`` and ``flag``. A number given to a ``flag`` is plain (a percentage is
    0 to 1, as on the command line); one given to an id or a name is in ``unit``, and a text may have the unit with it. Where a
    flag and an id are spelt alike, it is the flag.

    >>> import chalumeau
    >>> strength = next(p for p in chalumeau.parameters() if p["id"] == "stren")
    >>> strength["name"], strength["flag"], strength["range"], strength["default"]
    ('Reed strength', 'strength', '1.5..5', '2.50')
    """
    return _native.parameters()


def presets() -> list[dict[str, Any]]:
    """All presets, those of the program and your own: ``name``, ``tags``, ``author`` and what it ``shows``.

    ``chalumeau.render(..., preset=name)`` plays with one.

    >>> import chalumeau
    >>> [preset["name"] for preset in chalumeau.presets() if "subtone" in preset["name"].lower()]
    ['Subtone ballad', 'Subtone bass']
    """
    return _native.presets()


def plain(name: str, value: Any) -> Any:
    """A number of numpy as Python has it. Refuses arrays of several values, and masked and missing ones."""
    # Of pandas, which is not needed here.
    if type(value).__name__ == "NAType":
        raise ValueError(f"{name} is missing ({value}); give a value, or None to leave it out")
    if not isinstance(value, (np.ndarray, np.generic)):
        return value
    if value.shape != ():
        raise TypeError(f"{name} must be one value, got an array of the shape {value.shape}; call once for each of its values")
    if np.ma.is_masked(value):
        raise ValueError(f"{name} is masked; give a number")
    return value.item()


def number(name: str, value: Any) -> float:
    """An argument that is a number."""
    value = plain(name, value)
    if isinstance(value, str) or not hasattr(value, "__float__") and not hasattr(value, "__index__"):
        raise TypeError(f"{name} must be a number, not {type(value).__name__}")
    return float(value)


def whole(name: str, value: Any) -> int:
    """An argument that is a whole number; 2.0 is one."""
    found = number(name, value)
    if not found.is_integer():
        raise ValueError(f"{name} must be a whole number, got {value}")
    return int(found)


def at_least_1(name: str, value: Any) -> int:
    """An argument that is a number of things."""
    found = whole(name, value)
    if found < 1:
        raise ValueError(f"{name} must be at least 1, got {value}")
    return found


def switch(name: str, value: Any) -> bool:
    """An argument that is True or False; 1 and 0 are the same."""
    value = plain(name, value)
    if not isinstance(value, (bool, int, float)) or value not in (0, 1):
        raise TypeError(f"{name} must be True or False, got {value!r}")
    return bool(value)


def whole_of(name: str, value: Any) -> int:
    """The same, also written as a text: a field of a plan."""
    try:
        return whole(name, float(value) if isinstance(value, str) else value)
    except (ValueError, OverflowError):
        raise ValueError(f"{name} must be a whole number, got {value!r}") from None


def as_json(place: str, value: Any) -> Any:
    """Tables with lists and numbers as JSON has them; what is None is left out."""
    if isinstance(value, Mapping):
        return {name: as_json(f"{place}[{name!r}]", each) for name, each in value.items() if each is not None}
    if hasattr(value, "__array__") and np.ndim(value) > 0:
        # Arrays, and the columns of a table of pandas.
        value = list(value)
    if isinstance(value, (list, tuple, range)):
        return [as_json(f"{place}[{at}]", each) for at, each in enumerate(value)]
    value = plain(place, value)
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{place} is {value}; give a finite number, or leave it out")
    return os.fspath(value) if isinstance(value, os.PathLike) else value


def note(what: NoteLike) -> int:
    """The MIDI number of a note. Raises `ValueError` if there is none.

    >>> import chalumeau
    >>> chalumeau.note("C4"), chalumeau.note("Bb3"), chalumeau.note(60)
    (60, 58, 60)
    """
    what = plain("a note", what)
    if isinstance(what, float) and what.is_integer():
        what = int(what)
    if isinstance(what, str):
        what = _spelt(what)
    if isinstance(what, float):
        raise TypeError(f"a note is a MIDI number or a name such as 'C4'; {what} is not a whole number")
    if isinstance(what, bool) or not (isinstance(what, str) or hasattr(what, "__index__")):
        raise TypeError(f"a note is a MIDI number or a name such as 'C4', not {type(what).__name__}")
    return _native.note(what if isinstance(what, str) else str(operator.index(cast(SupportsIndex, what))))


def _spelt(name: str) -> str:
    """The name of a note as the command line has it."""
    return name.strip().replace("\u266d", "b").replace("\u266f", "#")


# Where an argument is called `instrument`, the function of this name is not in sight.
instrument_of = instrument


#: Arguments that are whole numbers, also if they are given as 60.0.
_WHOLE = ("written", "sounding", "rate", "players")


def text_of(name: str, value: Value) -> str:
    """A value as the command line would have it."""
    if name.replace("-", "_") == "open_holes" and isinstance(value, (list, tuple)):
        # An empty text leaves the argument out; without a hole, all are shut.
        return " ".join(value) or " "
    value = plain(name, value)
    if isinstance(value, os.PathLike):
        return os.fsdecode(value)
    if isinstance(value, str):
        return _spelt(value) if name in ("written", "sounding") else value
    if value is None:
        return ""
    if isinstance(value, bool) or value in (0, 1) and _is_switch(name):
        return "true" if value else "false"
    if hasattr(value, "__index__"):
        return str(value.__index__())
    if hasattr(value, "__float__"):
        found = float(value)
        return str(int(found)) if name in _WHOLE and found.is_integer() else repr(found)
    raise TypeError(f"{name} must be a number, a text, True or False, not {type(value).__name__}")


@cache
def _is_switch(name: str) -> bool:
    """Whether a flag takes True or False."""
    try:
        _native.check([(name, "neither")])
    except ValueError as error:
        return "must be true or false" in str(error)
    return False


@cache
def is_of_render(name: str) -> bool:
    """Whether `render` knows this name."""
    try:
        _native.check([(name, "")])
    except ValueError as error:
        return " is called " not in str(error)
    return True


#: Settings of a single clarinet that are no parameters.
_OF_SOUND = ("no_noise", "tempered", "natural", "quality", "untuned")


def is_only_of_render(name: str) -> bool:
    """Whether a name is an argument of `render` and no setting of the sound."""
    spelt = name.replace("-", "_")
    if spelt in _OF_SOUND or spelt.startswith("reed_") or setting_id(name) in _ids().values():
        return False
    return spelt in ("score", "channels") or is_of_render(name)


@cache
def _ids() -> dict[str, str]:
    known = parameters()
    ids = {spelling.casefold(): each["id"] for each in known for spelling in (each["name"], each["id"])}
    # Where a flag and an id are spelt alike, it is the flag.
    return ids | {each["flag"].casefold(): each["id"] for each in known if each["flag"]}


def setting_id(name: str) -> str:
    """The id of a setting that is named by its id, name or flag; the name itself if there is no such setting."""
    spelling = name.casefold()
    return _ids().get(spelling, _ids().get(spelling.replace("-", "_"), name))


def pairs(*named: Mapping[str, Value] | None) -> list[tuple[str, str]]:
    """Names and values as texts; what is None is left out."""
    for group in named:
        if group is not None and not isinstance(group, Mapping):
            raise TypeError(f"settings must be a dict such as {{'strength': 3}}, got {group!r}")
    return [
        (name, text_of(name, value))
        for group in named
        for name, value in (group or {}).items()
        if value is not None
    ]
