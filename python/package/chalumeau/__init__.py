"""A clarinet as physics: a reed coupled to a bore with tone holes.

The same model that plays in the Chalumeau plugin, for research and teaching:

- `render` and `Clarinet` make sound, as 32-bit float arrays, full scale 1.0;
- `impedance`, `impedance_peaks`, `thresholds`, `bifurcation` show the physics;
- `check_instrument` and `find_fingerings` help a maker;
- `reed_tables`, `reed_flow` are the reed's law, `feel` and `torque` are what a knob makes of it;
- `features` measures a note, `find_notes` those of a recording, `dataset` renders and measures thousands.

The same arguments give the same samples, to the bit. Notes are MIDI numbers or names such as ``"C4"``, ``"F#5"``, ``"Bb3"``.
A clarinet in B flat sounds two semitones below what is written. Arguments called ``written`` are what a player reads, those
called ``sounding`` and all notes of events and files are what is heard. ``gamma`` is mouth pressure over the pressure that
shuts the reed; ``zeta`` is the strength of the flow through it.

>>> import chalumeau
>>> c4 = chalumeau.render(written="C4", gamma=0.5, seconds=0.5, no_noise=True)
>>> c4.dtype, c4.shape
(dtype('float32'), (24000,))
>>> round(chalumeau.features(c4)["f0_hz"])    # B flat 3
233
"""

import importlib
from typing import TYPE_CHECKING, Any

from chalumeau._native import Instrument, __version__
from chalumeau.acoustics import (
    bifurcation,
    check_instrument,
    features,
    feel,
    find_fingerings,
    find_notes,
    impedance,
    impedance_peaks,
    reed_flow,
    reed_tables,
    thresholds,
    torque,
)
from chalumeau.arguments import fingerings, instrument, instruments, note, parameters, presets
from chalumeau.measuring import measure, rows
from chalumeau.playing import Clarinet, Note, render

if TYPE_CHECKING:
    from chalumeau.datasets import dataset
else:

    def __getattr__(name: str) -> Any:
        # Loaded when it is asked for: ``python -m chalumeau.datasets`` runs it by itself.
        if name in ("dataset", "datasets"):
            module = importlib.import_module("chalumeau.datasets")
            return module if name == "datasets" else module.dataset
        raise AttributeError(f"module 'chalumeau' has no attribute {name!r}")

    def __dir__() -> list[str]:
        return [*__all__]


__all__ = [
    "Clarinet",
    "Instrument",
    "Note",
    "__version__",
    "bifurcation",
    "check_instrument",
    "dataset",
    "features",
    "feel",
    "find_fingerings",
    "find_notes",
    "fingerings",
    "impedance",
    "impedance_peaks",
    "instrument",
    "instruments",
    "measure",
    "note",
    "parameters",
    "presets",
    "reed_flow",
    "reed_tables",
    "render",
    "rows",
    "thresholds",
    "torque",
]
