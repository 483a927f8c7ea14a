"""Sound: a clarinet that is played live, and whole renderings."""

from __future__ import annotations

import inspect
import os
import warnings
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, SupportsIndex, Union

import numpy as np
import numpy.typing as npt

from chalumeau import _native
from chalumeau.arguments import InstrumentLike, NoteLike, Value, instrument_of, is_only_of_render, note, number, pairs, parameters, setting_id, whole

#: 32-bit float samples, full scale 1.0.
Samples = npt.NDArray[np.float32]


class Note(NamedTuple):
    """A note of a list that `render` plays."""

    #: When it begins, s.
    from_s: float
    #: How long it is held, s. Where it touches the next note, the two are slurred.
    seconds: float
    #: Its sounding pitch.
    note: NoteLike
    #: How hard the key is struck, 0 to 1; without other breath it sets how loud the note is.
    velocity: float = 0.8


#: What `render` plays: the path of a standard MIDI file, its bytes, or notes.
Score = Union[str, "os.PathLike[str]", bytes, Iterable[Union[Note, tuple[Any, ...]]]]


def render(
    score: Score | None = None,
    *,
    instrument: InstrumentLike | None = None,
    settings: Mapping[str, Value] | None = None,
    rate: int = 48_000,
    channels: int | None = None,
    players: int | None = None,
    **named: Value,
) -> Samples:
    """Renders offline what the plugin would play, and what ``chalumeau render`` writes, sample for sample.

    ``score`` is the path of a standard MIDI file, its bytes, or a list of `Note` or tuples
    ``(from_s, seconds, note, velocity)``, with sounding pitches. Without it, say ``written="C4"`` or ``sounding=58`` for one
    note or ``scale="E3:C6"`` for a scale.

    Every flag of ``chalumeau render`` that does not name an output is an argument here, with underscores for hyphens:
    ``no_noise=True``, ``slurred=True``, ``preset``, ``quality="high"``, ``scl``, ``unison=True`` ...; and

    - ``seconds``: length of the note, 0.01..3600 s, without it 2; of each note of a scale, without it 0.5; ``tail``: time to fade
      after the end, 0..60 s;
    - ``gamma``: constant mouth pressure over the closing pressure, 0..3. Without any breath it is 0.5, or the breath of the score;
    - ``breath``: the same over time, ``"ramp:0:1:4"`` (from, to, seconds), or the path of a CSV file ``t_s,gamma``. A number is the
      same as ``gamma``, except that with most presets ``breath`` and ``crescendo`` are shares of full breath, 0..1. With
      ``breath_response="Played"`` all of them are;
    - ``crescendo``: from one gamma to another over the whole length, ``"0.4:0.9"``;
    - ``dynamic``: how loud, as a player plays, ``"mf"`` or ``"pp:ff"``.

    So is every setting by its id, name or flag (see `parameters`). ``settings`` takes them as a dict, also by names with
    spaces.

    ``instrument`` is the clarinet in B flat unless one is chosen (see `chalumeau.instrument`). The first rendering with an
    instrument of your own, or with ``a4`` outside 430..450 Hz, prepares it, up to a minute; the result is kept in your cache
    folder, and what the preparation found is told as a warning. ``rate`` is 1000..1536000 Hz.
    ``players`` is 1..16. ``channels`` is 1 or 2; without it there are two in a room, for several players and from two places, else one,
    as the command has it.

    Returns float32 of shape ``(samples,)``, or ``(samples, 2)`` of two channels: the memory that was rendered into.
    Python's other threads run meanwhile.

    Raises `ValueError`, with what was given and what would be right, and `MemoryError` where the samples do not fit. A list of notes lasts at
    most six hours. Warns of notes that stay silent, of settings that have no effect, and of a room that one channel leaves out.

    Source: ``docs/model.md`` in the repository. The reed's law is that of Wilson and Beavers (1974), the bore a lattice after
    Kelly and Lochbaum (1962), with holes after Dubos et al. (1999).

    >>> import chalumeau
    >>> duet = [(0.0, 0.2, "Bb3"), (0.2, 0.2, "C4", 0.5)]
    >>> chalumeau.render(duet, tail=0.1).shape
    (24000,)
    >>> chalumeau.render(written="G4", seconds=0.1, settings={"Reed strength": 3, "Full breath": "7 kPa"}).shape
    (4800,)
    >>> chalumeau.render(written="G4", strenght=3)
    Traceback (most recent call last):
    ValueError: no flag here and no parameter is called "strenght"; do you mean strength?
    """
    made = played(score, instrument=instrument, settings=settings, rate=rate, channels=channels, players=players, named=named)
    samples: Samples = made["samples"]
    return samples


def played(
    score: Score | None = None,
    *,
    instrument: InstrumentLike | None = None,
    settings: Mapping[str, Value] | None = None,
    rate: int = 48_000,
    channels: int | None = None,
    players: int | None = None,
    named: Mapping[str, Value] | None = None,
) -> dict[str, Any]:
    """What `render` plays, with its rate and with ``wanted_hz``, the pitch that the longest note is to have."""
    midi, path, notes = None, None, None
    if isinstance(score, (bytes, bytearray, memoryview)):
        midi = bytes(score)
    elif isinstance(score, (str, os.PathLike)):
        if score == "":
            raise ValueError('the score is an empty text; give the path of a MIDI file, or written="C4" for one note')
        try:
            midi, path = Path(score).read_bytes(), score
        except FileNotFoundError:
            if not _is_note(score):
                raise
            raise FileNotFoundError(f'there is no file {score}; for one note say written="{score}"') from None
    elif score is not None:
        if not isinstance(score, Iterable):
            raise TypeError(f"a score is the path of a MIDI file, its bytes or a list of notes, not {score!r}; for one note say written={score!r}")
        notes = [_listed(one) for one in score]
        if not notes:
            warnings.warn("the list has no notes, so nothing is heard", stacklevel=3)
    made = _native.render(
        pairs(settings, named, {"rate": rate, "players": players}),
        None if instrument is None else instrument_of(instrument),
        midi,
        path,
        notes,
        None if channels is None else whole("channels", channels),
    )
    for warning in made["warnings"]:
        warnings.warn(warning, stacklevel=3)
    if made["resets"]:
        warnings.warn(
            f"the calculation broke down and the instrument was reset {made['resets']} times; please report this",
            stacklevel=3,
        )
    return made


def _is_note(name: Any) -> bool:
    try:
        return isinstance(name, str) and note(name) >= 0
    except ValueError:
        return False


def _listed(one: Any) -> tuple[float, float, int, float]:
    try:
        from_s, seconds, key, velocity = Note(*one)
    except TypeError:
        raise TypeError(
            f"a note is (from_s, seconds, note) or (from_s, seconds, note, velocity), not {one!r}"
        ) from None
    return number("from_s", from_s), number("seconds", seconds), note(key), number("velocity", velocity)


def _within(name: str, value: Any, low: float, high: float) -> float:
    found = number(name, value)
    if not low <= found <= high:
        raise ValueError(f"{name} must lie in {low}..{high}, got {value}")
    return found


def _velocity(velocity: Any) -> float:
    return _within("velocity", velocity, 0, 1)


def _breath(share: Any) -> float:
    return _within("breath", share, 0, 1)


def _bend(cents: Any) -> float:
    return _within("bend", cents, -2400, 2400)


def _slap(strength: Any) -> float:
    return _within("slap", strength, 0, 1)


#: What checks an argument of an event, by its name.
_CHECKS: dict[str, Callable[[Any], Any]] = {
    "key": note,
    "velocity": _velocity,
    "share": _breath,
    "cents": _bend,
    "strength": _slap,
}


def _refuse_idle(settings: Mapping[str, Value] | None, named: Mapping[str, Value]) -> None:
    """Refuses what a live clarinet would ignore, or cannot do."""
    pairs(settings, named)
    idle = {each["id"]: each["group"] for each in parameters() if each["group"] in ("Players", "Room")}
    for name, value in {**(settings or {}), **named}.items():
        spelt = name.replace("-", "_")
        if value is None:
            continue
        if spelt in ("rate", "instrument"):
            raise ValueError(f"{name} is chosen when a Clarinet is made: Clarinet({name}=...)")
        if setting_id(name) in idle or spelt == "unison":
            raise ValueError(f"{name} does nothing here: a Clarinet is one player, mono and without a room; use chalumeau.render")
        if is_only_of_render(name):
            raise ValueError(
                f"{name} is an argument of chalumeau.render, which plays a whole score; "
                "a Clarinet takes settings of the sound (chalumeau.parameters()), and is played by breath, note_on ..."
            )


def _set_by(name: str) -> str:
    """The id of the setting that a name sets, short names among them."""
    short = {"no_noise": "noise", "tempered": "tune", "natural": "tune"}
    return short.get(name.replace("-", "_"), setting_id(name))


def _changed(now: dict[str, Value], settings: Mapping[str, Value] | None = None, **named: Value) -> dict[str, Value]:
    """The settings of a live clarinet after `Clarinet.set`."""
    _refuse_idle(settings, named)
    changes = {**(settings or {}), **named}
    fixed = [name for name in changes if name in ("quality", "untuned")]
    if fixed:
        raise ValueError(f"{fixed[0]} cannot change while a Clarinet plays; make another: Clarinet({fixed[0]}=...)")
    changed = {_set_by(name) for name in changes}
    wanted = {name: value for name, value in now.items() if _set_by(name) not in changed}
    return wanted | {name: value for name, value in changes.items() if value is not None}


#: What `Clarinet.play` plays.
_EVENTS = ("note_on", "note_off", "breath", "bend", "slap", "hole", "panic", "set")


class Clarinet:
    """A clarinet that is played event by event: what a host's audio thread does, at your pace.

    ``instrument`` and the settings of the sound are as in `render`; what only a whole rendering has (scores, presets, several
    players, a room) is refused. As there, the first one with ``a4`` outside 430..450 Hz, or with an instrument of your own, is prepared
    for up to a minute. Sound is made only by `render`, `render_into` and
    `play`; events act between the samples. How the time is cut into pieces does not change a bit of the sound. Mono; for a
    room or several players use `chalumeau.render`.

    Threads may share one, and take turns. Two clarinets render at the same time on two cores.

    >>> import chalumeau, numpy
    >>> clarinet = chalumeau.Clarinet(noise=0)
    >>> clarinet.breath(0.6)
    >>> clarinet.note_on("Bb3")
    >>> first = clarinet.render(0.25)
    >>> second = clarinet.render(0.25)
    >>> again = chalumeau.Clarinet(noise=0)
    >>> again.breath(0.6); again.note_on("Bb3")
    >>> bool((numpy.concatenate([first, second]) == again.render(0.5)).all())
    True
    """

    def __init__(
        self,
        instrument: InstrumentLike = "b-flat",
        *,
        rate: int = 48_000,
        settings: Mapping[str, Value] | None = None,
        **named: Value,
    ) -> None:
        self._instrument = instrument_of(instrument)
        _refuse_idle(settings, named)
        self._settings: dict[str, Value] = {**(settings or {}), **named}
        self._voice = _native.Voice(pairs(self._settings, {"rate": rate}), self._instrument)

    @property
    def rate(self) -> int:
        """Sample rate, Hz."""
        return self._voice.rate_hz

    @property
    def instrument(self) -> _native.Instrument:
        """What is played."""
        return self._instrument

    @property
    def settings(self) -> dict[str, Value]:
        """The settings that were named; all others are at their defaults (see `parameters`)."""
        return dict(self._settings)

    @property
    def is_silent(self) -> bool:
        """Whether nothing sounds, and nothing will before the next event."""
        return self._voice.is_silent

    def set(self, settings: Mapping[str, Value] | None = None, **named: Value) -> None:
        """Sets what is named, and leaves the rest. Heard from the next control tick (a fraction of a millisecond) on.

        None puts a setting back to its default. Raises `ValueError` and changes nothing if a name or a value is wrong.

        >>> import chalumeau
        >>> clarinet = chalumeau.Clarinet(strength=3)
        >>> clarinet.set({"Full breath": "7 kPa"}, lip=1.1)
        >>> clarinet.set(lip=9)
        Traceback (most recent call last):
        ValueError: invalid value '9' for '--lip <X>': must lie in 0.6..1.4
        >>> clarinet.set({"Reed strength": 4, "Full breath": None})
        >>> clarinet.settings
        {'lip': 1.1, 'Reed strength': 4}
        """
        wanted = _changed(self._settings, settings, **named)
        self._voice.set(pairs(wanted), self._instrument)
        self._settings = wanted

    def note_on(self, key: NoteLike, velocity: float = 0.8) -> None:
        """A key or fingering goes down: sounding pitch, velocity 0..1. Beside a held key it is slurred."""
        pitch = note(key)
        self._voice.note_on(pitch, _velocity(velocity))
        for warning in self._voice.silent(pitch):
            warnings.warn(warning, stacklevel=2)

    def note_off(self, key: NoteLike) -> None:
        """A key comes up."""
        self._voice.note_off(note(key))

    def breath(self, share: float) -> None:
        """Breath, 0..1 of full breath. From the first one on, it blows in place of the keys' velocity."""
        self._voice.breath(_breath(share))

    def bend(self, cents: float) -> None:
        """Pitch bend, -2400..2400 cents: near the note by the lip, beyond by the size of the bore."""
        self._voice.bend(_bend(cents))

    def slap(self, strength: float = 1.0) -> None:
        """The tongue slaps the reed, 0..1."""
        self._voice.slap(_slap(strength))

    def hole(self, name: str, opening: float | None) -> None:
        """Opens one hole 0..1, whatever is fingered: half-holes, shadings. None goes back to the fingering.

        >>> import chalumeau
        >>> clarinet = chalumeau.Clarinet()
        >>> clarinet.hole("nothing", 0.5)
        Traceback (most recent call last):
        ValueError: no hole is called 'nothing'; the holes are ...
        """
        self._voice.hole(*self._hole(name, opening))

    def _hole(self, name: str, opening: float | None) -> tuple[int, float | None]:
        names = [hole[0] for hole in self._instrument.holes()]
        if name not in names:
            raise ValueError(f"no hole is called {name!r}; the holes are {', '.join(names)}")
        return names.index(name), None if opening is None else _within("opening", opening, 0, 1)

    def panic(self) -> None:
        """Releases all notes and silences them at once; breath and settings stay as they were set."""
        self._voice.panic()

    def reset(self) -> None:
        """Silence, as before the first note; the settings stay."""
        self._voice.reset()

    def render(self, seconds: float) -> Samples:
        """The next seconds, rounded to whole samples, in a new array of shape ``(samples,)``."""
        return self._voice.render(self._samples(seconds))

    def render_into(self, out: Samples) -> None:
        """Overwrites a contiguous float32 array of one dimension with the next samples; allocates nothing."""
        if not isinstance(out, np.ndarray) or out.dtype != np.float32 or out.ndim != 1:
            got = f"{out.ndim} dimensions of {out.dtype}" if isinstance(out, np.ndarray) else repr(out)
            raise TypeError(f"out must be an array of one dimension of float32, such as numpy.empty(480, numpy.float32), got {got}")
        self._voice.render_into(out)

    def play(self, events: Iterable[tuple[Any, ...]], seconds: float) -> Samples:
        """Renders, with events at their times: ``(at_s, method, *arguments)``, for example ``(0.1, "note_on", "C4")``.

        Times are counted from now, up to ``seconds``, and rounded to whole samples. All events are checked before the first is played.

        Raises `ValueError` or `TypeError` for an event that is none, and plays nothing then.

        >>> import chalumeau
        >>> events = [(0.0, "breath", 0.5), (0.0, "note_on", "C4"), (0.1, "set", {"lip": 1.1}), (0.2, "note_off", "C4")]
        >>> chalumeau.Clarinet().play(events, 0.3).shape
        (14400,)
        """
        length = self._samples(seconds)
        timed = self._checked(events, length, seconds)
        out = np.zeros(length, np.float32)
        done = 0
        for at, name, arguments in timed:
            self._voice.render_into(out[done:at])
            getattr(self, name)(*arguments)
            done = at
        self._voice.render_into(out[done:])
        return out

    def _checked(
        self, events: Iterable[tuple[Any, ...]], length: int, seconds: float
    ) -> list[tuple[int, str, tuple[Any, ...]]]:
        """Events in the order of their times, each of which can be played."""
        timed = []
        for event in events:
            try:
                at_s, name, *given = event
            except (TypeError, ValueError):
                raise TypeError(f"an event is (at_s, method, *arguments), not {event!r}") from None
            if name not in _EVENTS:
                raise ValueError(f"no event is called {name!r}; the events are {', '.join(_EVENTS)}")
            at = self._samples(at_s, "the time of an event")
            if at > length:
                raise ValueError(f"event at {at_s} s is after the end, {seconds} s")
            timed.append((at, name, tuple(given)))
        timed.sort(key=lambda one: one[0])
        settings = self._settings
        for at, name, arguments in timed:
            where = f"event {name} at {at / self.rate:g} s"
            try:
                bound = inspect.signature(getattr(self, name)).bind(*arguments).arguments
                if name == "set":
                    settings = _changed(settings, *arguments)
                    self._voice.check(pairs(settings), self._instrument)
                elif name == "hole":
                    self._hole(*arguments)
                else:
                    for argument, value in bound.items():
                        _CHECKS[argument](value)
            except (TypeError, ValueError) as error:
                raise type(error)(f"{where}: {error}") from error
        return timed

    def _samples(self, seconds: float, what: str = "seconds") -> int:
        seconds = number(what, seconds)
        if not 0.0 <= seconds <= 86_400.0:
            raise ValueError(f"{what} must lie in 0..86400, got {seconds}")
        return round(seconds * self.rate)

    def __reduce_ex__(self, protocol: SupportsIndex) -> Any:
        """Refuses `copy` and `pickle`: a copy would share the sound."""
        raise TypeError(
            "a Clarinet that plays cannot be copied; make another: Clarinet(old.instrument, rate=old.rate, settings=old.settings)"
        )

    def __repr__(self) -> str:
        return f"Clarinet({self._instrument!r}, rate={self.rate}, settings={self._settings})"
