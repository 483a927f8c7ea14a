"""The physics: bore, thresholds, reed, what a hand feels of them, and measurements of sound."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Union, cast

import numpy as np
import numpy.typing as npt

from chalumeau import _native
from chalumeau.arguments import InstrumentLike, NoteLike, Value, instrument_of, is_only_of_render, note, number, pairs, switch, whole

#: A written note, or the names of the open holes.
FingeringLike = Union[NoteLike, Sequence[str]]
_Floats = npt.NDArray[np.float64]


def _fingering(fingering: FingeringLike) -> int | list[str]:
    if isinstance(fingering, (list, tuple)):
        return [str(name) for name in fingering]
    return note(cast(NoteLike, fingering))


def _numbers(name: str, values: npt.ArrayLike) -> tuple[_Floats, tuple[int, ...]]:
    given = values if isinstance(values, np.ndarray) else np.asarray(values)
    if np.ma.is_masked(given) or given.dtype == object and any(value is None for value in given.flat):
        raise ValueError(f"{name}: None and masked values are no numbers; leave them out, or give nan")
    if given.dtype.kind == "c":
        raise ValueError(f"{name} must be real numbers, got complex ones; take their real part")
    try:
        return np.ascontiguousarray(given, np.float64).reshape(-1), given.shape
    except (TypeError, ValueError) as error:
        raise type(error)(f"{name} must be numbers: {error}") from None


def impedance(
    fingering: FingeringLike,
    frequencies_hz: npt.ArrayLike,
    *,
    instrument: InstrumentLike = "b-flat",
    model: str = "tmm",
    reed_volume: bool = False,
    temperature: float = 25.0,
) -> npt.NDArray[np.complex128]:
    """Input impedance Z/Zc of the bore at the reed, for each frequency.

    ``fingering`` is a written note, or a list of the names of the open holes. Frequencies are 1..20000 Hz. ``model`` is
    ``"tmm"`` (transfer matrices with exact wall losses, the reference; 10..40 °C, with the air that moves with the reed if
    ``reed_volume``) or ``"lattice"`` (the waveguide that sounds, at 96 kHz and 25 °C). Zc = rho c / S of the nominal bore.

    Returns complex128 of the shape of ``frequencies_hz``.

    Source: transfer matrices, with wall losses after Zwikker and Kosten (1949) and holes after Dubos et al. (1999); see
    ``docs/model.md`` in the repository. ``chalumeau impedance --model tmm`` gives the same numbers (its own default is the lattice).

    >>> import chalumeau, numpy
    >>> f_hz = numpy.arange(100.0, 1000.0, 0.5)
    >>> z = chalumeau.impedance("F3", f_hz)
    >>> float(f_hz[abs(z).argmax()]) == round(chalumeau.impedance_peaks("F3")["f_hz"][0] * 2) / 2
    True
    """
    if model not in ("tmm", "lattice"):
        raise ValueError(f"model must be 'tmm' or 'lattice', got {model!r}")
    flat, shape = _numbers("frequencies_hz", frequencies_hz)
    z = _native.impedance(
        instrument_of(instrument),
        _fingering(fingering),
        flat,
        model == "lattice",
        switch("reed_volume", reed_volume),
        number("temperature", temperature),
    )
    return z.reshape(shape)


def impedance_peaks(
    fingering: FingeringLike,
    count: int = 8,
    *,
    instrument: InstrumentLike = "b-flat",
    reed_volume: bool = False,
    temperature: float = 25.0,
) -> dict[str, _Floats]:
    """The first peaks of \\|Z\\|/Zc of the transfer matrices: ``f_hz``, ``mag_over_zc`` and ``q``, at most ``count`` of each.

    ``count`` is 1..30; the other arguments are as in `impedance`.

    >>> import chalumeau
    >>> f_hz = chalumeau.impedance_peaks("E3", 2)["f_hz"]
    >>> bool(2.8 < f_hz[1] / f_hz[0] < 3.2)     # a closed tube: odd multiples
    True
    """
    count = whole("count", count)
    if count < 1:
        raise ValueError(f"count must lie in 1..30, got {count}")
    return _native.impedance_peaks(
        instrument_of(instrument), _fingering(fingering), count, switch("reed_volume", reed_volume), number("temperature", temperature)
    )


def find_fingerings(
    written: NoteLike,
    count: int = 10,
    *,
    instrument: InstrumentLike = "b-flat",
    temperature: float = 25.0,
    a4: float = 440.0,
) -> dict[str, Any]:
    """Fingerings for a written note, best first: every combination of holes that the fingers of a Boehm clarinet can make is looked through.

    ``count`` is 1..1000. Returns lists and arrays of equal length, at most ``count``:

    - ``fingers``: keys and holes that the hands press; ``open``: the names of the open holes, as `impedance` and `render` take them;
    - ``f_hz`` and ``cents``: the resonance with the air that moves with the reed, and how far it is from the note. A played note lies
      some 20 to 60 cents lower; the difference from the fingering of the chart is what one hears;
    - ``gamma_on``: the mouth pressure at which it begins, over the closing pressure; ``mode``: which peak of the impedance it plays, 0 if none is near;
    - ``evenness_db``: how far that resonance stands above the next lower one, 6 at most, nan for the lowest;
    - ``cost``: what the ranking goes by, 0 the best; ``of_chart``: whether the chart has it for this note;

    and ``unmoved``, the names of holes that neither finger nor key moves. Takes a few seconds. Source: by transfer matrices, after Botros,
    Smith and Wolfe (2006). ``chalumeau fingerings`` does the same, and adds the fingering of the chart where it is not among the best.

    >>> import chalumeau
    >>> found = chalumeau.find_fingerings("B5", 5)
    >>> len(found["open"]), bool((abs(found["cents"]) < 40).all()), bool((found["cost"][1:] >= found["cost"][:-1]).all())
    (5, True, True)
    """
    return _native.find_fingerings(
        instrument_of(instrument), note(written), whole("count", count), number("temperature", temperature), number("a4", a4)
    )


def check_instrument(
    instrument: InstrumentLike, *, temperature: float = 25.0, a4: float = 440.0
) -> dict[str, Any]:
    """Whether the notes of an instrument are where its chart says, before it is played.

    Returns arrays with one value for each fingering: ``written_midi``, ``mode`` (the peak of the impedance that is to sound), ``wanted_hz``
    (equal temperament), ``f_hz`` (that peak, with the air that moves with the reed) and ``cents`` (how far the peak is above the note; nan
    without a peak). Then ``concerns``, sentences about what a maker should look at; ``is_usable``, whether the instrument can be played; and
    ``common_cents``, how far nearly all notes are off, where that is more than 20 cents, else None.

    ``temperature`` is 10..40 °C, ``a4`` 415..466 Hz. ``chalumeau instrument check`` does the same.

    >>> import chalumeau
    >>> found = chalumeau.check_instrument("b-flat")
    >>> found["is_usable"], found["concerns"], bool(abs(found["cents"]).max() < 35)
    (True, [], True)
    """
    return _native.check_instrument(instrument_of(instrument), number("temperature", temperature), number("a4", a4))


def thresholds(*, instrument: InstrumentLike = "b-flat", **reed: Value) -> dict[str, Any]:
    """The mouth pressures between which each note of the chart sounds, over the closing pressure of the reed.

    The reed is that of ``chalumeau haptic``: ``zeta`` (0.05..0.9, 0.3), ``strength`` (1.5..5, 2.5), ``lip`` (0.6..1.4, 1),
    ``H``, ``k``, and ``temperature`` (°C).

    Returns arrays with one value for each fingering. A note for which the theory finds no pressures has nan; a note whose key is silent, such as
    C#7, has numbers:

    - ``written_midi``;
    - ``gamma_on``: the oscillation threshold of a reed without inertia, at least 1/3;
    - ``gamma_sounding``: the lowest pressure at which the reed, as it moves under the lip, begins to sound on any resonance; ``sounding_hz``, its
      frequency, which for some notes, such as D#5 to F#5, is that of a lower register;
    - ``gamma_own``: where the note itself begins;
    - ``gamma_beat``: where the reed begins to touch the lay;
    - ``gamma_off``: extinction, where a note that sounds chokes as the pressure rises; as it falls, the note returns only lower, near 1.2;
    - ``p_req_pa``: ``gamma_on`` in Pa; and ``p_closing_pa``, one number.

    Takes a second. Source: the linear threshold of Wilson and Beavers (1974); extinction after the two-state model of Dalmont,
    Gilbert, Kergomard and Ollivier (2005). `bifurcation` looks for the same by playing.

    >>> import chalumeau
    >>> found = chalumeau.thresholds(zeta=0.3)
    >>> len(found["gamma_on"]), bool((found["gamma_on"][:30] >= 1 / 3).all()), round(found["p_closing_pa"])
    (46, True, 6000)
    """
    return _native.thresholds(pairs(reed), instrument_of(instrument))


def bifurcation(
    written: NoteLike,
    *,
    to: float = 2.0,
    seconds: float = 20.0,
    instrument: InstrumentLike = "b-flat",
    rate: int = 48_000,
    **settings: Value,
) -> dict[str, Any]:
    """Plays a written note with breath that rises slowly from 0 to gamma ``to`` (0.2..3) in ``seconds`` (0.5..600), and falls.

    ``settings`` are those of the sound, as in `render` (see `parameters`). Returns arrays of equal length: ``direction`` (1 rising, -1 falling), ``gamma``, ``rms``
    (pressure in the mouthpiece over the closing pressure), ``shut`` (share of time in which the reed is shut) and ``own`` (share of
    power at the note's frequency: near 0, another register sounds); and the gammas at which the note
    ``begins``, the reed ``shuts`` for a part of each period, the note ``chokes`` and ``returns``, the reed ``opens`` for good, and the note ``ends``; None
    where it does not. On a curved lay the reed shuts later than at the ``gamma_beat`` of `thresholds`.

    A moving breath passes a threshold before the note has grown or died (Bergeot, Almeida, Vergez and Gazengel, 2013), so
    these depend on ``seconds``. The same as ``chalumeau bifurcation``.

    >>> import chalumeau
    >>> ramp = chalumeau.bifurcation("F3", to=1.0, seconds=4.0)
    >>> bool(1 / 3 < ramp["begins"] < 0.6), ramp["chokes"]
    (True, None)
    """
    for name, value in settings.items():
        if value is not None and is_only_of_render(name):
            raise ValueError(
                f"{name} is an argument of chalumeau.render, which plays a score with a breath of its choice; "
                "bifurcation blows one note from 0 to gamma `to` and back, and takes settings of the sound (chalumeau.parameters())"
            )
    return _native.bifurcation(
        pairs(settings, {"rate": rate}), instrument_of(instrument), note(written), number("to", to), number("seconds", seconds)
    )


def reed_tables() -> dict[str, npt.NDArray[Any]]:
    """The reed's tables, which sound, touch and the knob's firmware share: ``p``, ``x_a`` = sqrt(p), ``x_b`` = p^1.5, ``sgn``.

    Shape ``(3601,)``: one entry for each tenth of a degree of one turn; ``p`` is the pressure difference over the closing
    pressure. The arrays are copies.

    Source: the notebook of the repository Maxw3llGM/TorqueTuner_Reed-Model_DMI.

    >>> import chalumeau
    >>> tables = chalumeau.reed_tables()
    >>> [float(tables[name][900]) for name in ("p", "x_a", "x_b")]
    [0.25, 0.5, 0.125]
    """
    return _native.reed_tables()


def reed_flow(
    p: npt.ArrayLike, *, H: float | None = None, k: float | None = None, A: float = 1.0
) -> _Floats:
    """Flow through the reed, u = A (H sqrt(p) - p^1.5 / k), and 0 from closure at p = H k on; of the shape of ``p``.

    ``p`` is the pressure difference over the closing pressure of the reference reed; where it is negative the air flows
    back. ``H`` (0.5..10, sqrt(27)/2) is the opening at rest, ``k`` (0.01..20) the stiffness: without it 27/(4 H^3), which makes
    the peak of the flow A (0..10).

    Source: Wilson and Beavers (1974), with the constants of Maxw3llGM/TorqueTuner_Reed-Model_DMI.

    >>> import chalumeau
    >>> [round(float(u), 3) for u in chalumeau.reed_flow([0, 1 / 3, 1, 1.2])]
    [0.0, 1.0, 0.0, 0.0]
    """
    flat, shape = _numbers("p", p)
    opening, stiffness = (None if value is None else number(name, value) for name, value in (("H", H), ("k", k)))
    return _native.reed_flow(flat, opening, stiffness, number("A", A)).reshape(shape)


def feel(written: NoteLike, *, instrument: InstrumentLike = "b-flat", **design: Value) -> dict[str, Any]:
    """What a force-feedback knob is sent for a written note.

    ``design`` are the flags of ``chalumeau haptic``: ``law`` ("flow", "pressure"), ``contrast`` (1..5), ``place`` (1..5),
    ``equal_travel``, ``order``, ``reference``, ``torque`` (mNm), ``travel`` (degrees), ``detent`` (mNm), ``ceiling`` (mNm), and
    the reed's ``zeta``, ``strength``, ``lip``, ``H``, ``k``, ``temperature``.

    Returns ``law``, ``h``, ``k``, ``scale_mnm``, ``stretch``, ``offset_deg``, ``wall_deg``, ``wall_mnm_per_deg``,
    ``slap_mnm_per_deg``, ``damping_mnms``, ``friction_mnm``, ``detent_mnm``, ``morph_ms``, ``most_mnm`` (the most torque up to the wall, mark and friction included), and the angles from rest in degrees
    at which the note starts, beats, closes and stops: ``a_on_deg``, ``a_beat_deg``, ``a_close_deg``, ``a_off_deg``.

    Raises `ValueError` for a feel that a knob would refuse. Takes a second. Model and sources: ``docs/feel.md``.

    >>> import chalumeau
    >>> c5 = chalumeau.feel("C5")
    >>> c5["law"], round(c5["a_on_deg"]), round(c5["a_close_deg"])
    ('flow', 120, 360)
    """
    return _native.feel(pairs(design), instrument_of(instrument), note(written))


def torque(
    written: NoteLike, angles_deg: npt.ArrayLike, *, instrument: InstrumentLike = "b-flat", **design: Value
) -> _Floats:
    """The torque of a note at rest at each angle (degrees), in mNm, positive against the breath; of the shape of ``angles_deg``.

    ``design`` is as in `feel`. As the firmware computes it.

    >>> import chalumeau
    >>> torques = chalumeau.torque("C5", [0, 120, 240, 355])
    >>> bool(torques[1] > torques[2] > torques[3])
    True
    """
    flat, shape = _numbers("angles_deg", angles_deg)
    return _native.torque(pairs(design), instrument_of(instrument), note(written), flat).reshape(shape)


def features(samples: npt.ArrayLike, rate: float = 48_000, *, near: float | None = None) -> dict[str, Any]:
    """Measures a note: mono samples of shape ``(samples,)``, full scale 1.0, with its beginning; only its first 4 s count.

    Samples that are whole numbers, as 16-bit files have them, are refused: divide them by 32768. ``near`` is what the note is to be, Hz,
    10..5000; notes below 50 Hz are found only with it.

    Returns ``f0_hz`` (of the steady part), ``steady_dbfs`` (its rms level), ``centroid_hz`` (power-weighted mean frequency),
    ``attack_s`` (from 10 to 90 % of the loudest moment) and ``harmonics_db``: the levels of harmonics 1 to 12 over the strongest
    of them. Without a steady part of 200 ms the first three are nan or -inf, and there are no harmonics.

    >>> import chalumeau
    >>> note = chalumeau.render(written="E3", seconds=0.6, gamma=0.5, no_noise=True)
    >>> levels = chalumeau.features(note)["harmonics_db"]
    >>> levels[1] < levels[2]    # the second harmonic is weaker than the third
    True
    """
    return _native.features(_mono(samples), number("rate", rate), None if near is None else number("near", near))


def find_notes(samples: npt.ArrayLike, rate: float = 48_000) -> list[dict[str, Any]]:
    """Finds the notes of a recording of one voice, as ``chalumeau measure`` does: mono samples of shape ``(samples,)``, full scale 1.0.

    Returns for each note, in their order, ``start_s``, ``end_s``, ``f0_hz`` (mean fundamental of the steady part), ``level_dbfs`` (its rms
    level), ``t90_s`` (from the beginning until 90 % of the steady level, short in a slur), ``centroid_hz`` (power-weighted mean frequency)
    and ``harmonics_db``: the levels of harmonics 1 to 12 over the strongest of them. A note lasts some 50 ms or more and has a pitch
    between 50 and 2500 Hz. Chords give wrong notes or none. Raises `ValueError` for what `features` refuses.

    >>> import chalumeau
    >>> two = [chalumeau.Note(0.1, 0.4, "C4"), chalumeau.Note(0.6, 0.4, "D4")]
    >>> [round(note["f0_hz"], -1) for note in chalumeau.find_notes(chalumeau.render(two))]
    [260.0, 290.0]
    """
    return _native.find_notes(_mono(samples), number("rate", rate))


def _mono(samples: npt.ArrayLike) -> npt.NDArray[np.float32]:
    kind = np.asarray(samples).dtype.kind
    if kind in "iub" and np.size(samples):
        raise ValueError("samples are whole numbers, and full scale is 1.0; of 16 bits, divide them by 32768")
    if kind == "c":
        raise ValueError("samples are complex numbers, which have no level; take their real part")
    array = _numbers("samples", samples)[0].reshape(np.shape(samples)).astype(np.float32)
    if not np.isfinite(array).all():
        raise ValueError("samples hold NaN or infinity, which has no pitch or level; measure a part without them")
    if array.ndim != 1:
        raise ValueError(f"samples must have one dimension, got the shape {array.shape}; take one channel")
    return array
