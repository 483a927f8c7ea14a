"""What functions of this package take: instruments, notes, settings."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, Union

from chalumeau import _native
from chalumeau._native import Instrument

#: An instrument: the id of a bundled one, the path or the text of a TOML file, the same as a dict, or an `Instrument`.
InstrumentLike = Union[str, "os.PathLike[str]", Mapping[str, Any], Instrument]
#: A MIDI number, 0 to 127, or a name such as ``"C4"``.
NoteLike = Union[int, str]
#: A value of a setting: a number, a switch, or a text with a unit, such as ``"7 kPa"``.
Value = Union[bool, int, float, str, None]


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
    ('B flat bass clarinet, Boehm system', 1.335)
    >>> chalumeau.instrument(bass.to_toml()) == bass
    True
    """
    if isinstance(what, Instrument):
        return what
    if isinstance(what, Mapping):
        return Instrument.of_json(json.dumps(what))
    if isinstance(what, str):
        if "\n" in what:
            return Instrument.parse(what)
        if not what.lower().endswith(".toml"):
            return Instrument.bundled(what)
    if isinstance(what, (str, os.PathLike)):
        return Instrument.parse(Path(what).read_text(encoding="utf-8"))
    raise TypeError(
        f"an instrument is an id ({', '.join(Instrument.ids())}), a path, a text, a dict or an Instrument, "
        f"not {type(what).__name__}"
    )


def fingerings(instrument: InstrumentLike = "b-flat") -> list[dict[str, Any]]:
    """The fingering chart, from the lowest note to the highest.

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


def note(what: NoteLike) -> int:
    """The MIDI number of a note. Raises `ValueError` if there is none.

    >>> import chalumeau
    >>> chalumeau.note("C4"), chalumeau.note("Bb3"), chalumeau.note(60)
    (60, 58, 60)
    """
    if isinstance(what, bool) or not (isinstance(what, str) or hasattr(what, "__index__")):
        raise TypeError(f"a note is a MIDI number or a name such as 'C4', not {type(what).__name__}")
    return _native.note(what if isinstance(what, str) else str(what.__index__()))


# Where an argument is called `instrument`, the function of this name is not in sight.
instrument_of = instrument


def text_of(name: str, value: Value) -> str:
    """A value as the command line would have it."""
    if isinstance(value, str):
        return value
    if value is None:
        return ""
    # numpy's booleans are no `bool`.
    if isinstance(value, bool) or type(value).__name__ in ("bool_", "bool"):
        return "true" if value else "false"
    if hasattr(value, "__index__"):
        return str(value.__index__())
    if hasattr(value, "__float__"):
        return repr(float(value))
    raise TypeError(f"{name} must be a number, a text, True or False, not {type(value).__name__}")


@cache
def _ids() -> dict[str, str]:
    known = parameters()
    ids = {spelling.casefold(): each["id"] for each in known for spelling in (each["name"], each["id"])}
    # Where a flag and an id are spelt alike, it is the flag.
    return ids | {each["flag"]: each["id"] for each in known if each["flag"]}


def setting_id(name: str) -> str:
    """The id of a setting that is named by its id, name or flag; the name itself if there is no such setting."""
    spelling = name.casefold()
    return _ids().get(spelling, _ids().get(spelling.replace("-", "_"), name))


def pairs(*named: Mapping[str, Value] | None) -> list[tuple[str, str]]:
    """Names and values as texts; what is None is left out."""
    return [
        (name, text_of(name, value))
        for group in named
        for name, value in (group or {}).items()
        if value is not None
    ]
