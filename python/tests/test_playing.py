"""Sound: the same bits as the golden hashes, the command line and every cut of time."""

import hashlib
import os
import subprocess
import sys
import threading
import time
import warnings

import chalumeau
import numpy as np
import pytest


def digest(samples):
    return hashlib.sha256(samples.astype("<f4").tobytes()).hexdigest()[:16]


@pytest.mark.parametrize("column, rate", list(enumerate([44_100, 48_000, 96_000], 1)))
def test_the_melody_has_the_golden_bits(root, column, rate):
    golden = (root / "tests/golden/renders.tsv").read_text().splitlines()
    melody = next(line.split("\t") for line in golden if line.startswith("melody\t"))
    samples = chalumeau.render(
        root / "examples/melody.mid", rate=rate, tail=0, breath_response="physical", heard="One point"
    )
    assert digest(samples) == melody[column]


@pytest.mark.parametrize(
    "words, named",
    [
        ("--written G4 --gamma 0.55 --seconds 0.3 --zeta 0.4", dict(written="G4", gamma=0.55, zeta=0.4)),
        ("--scale E3:G3 --slurred --seconds 0.3 --no-noise", dict(scale="E3:G3", slurred=True, no_noise=True)),
        ("--written C4 --instrument bass --seconds 0.3 --set vent=2.5", dict(written=60, instrument="bass", vent=2.5)),
        ("--written C4 --seconds 0.3 --players 3 --unison", dict(written="C4", players=3, unison=True)),
        ("--written C4 --seconds 0.3 --channels 2", dict(written="C4", channels=2)),
        ("--written C4 --seconds 0.3 --room 0.3", dict(written="C4", room=0.3)),
        ("--written C4 --seconds 0.3 --set heard=position", dict(written="C4", heard="Position")),
    ],
)
def test_a_rendering_is_that_of_the_command_line(chalumeau_says, tmp_path, words, named):
    chalumeau_says("render", *words.split(), "--out", "note.wav", cwd=tmp_path)
    data = (tmp_path / "note.wav").read_bytes()
    written = np.frombuffer(data[data.index(b"data") + 8 :], "<f4")
    samples = chalumeau.render(seconds=0.3, **named)
    assert samples.flags.c_contiguous and samples.dtype == np.float32
    assert samples.shape == ((len(written) // 2, 2) if set(named) & {"channels", "players", "room", "heard"} else written.shape)
    assert (samples.ravel() == written).all() and np.abs(written).max() > 0.01


def play(cuts):
    clarinet = chalumeau.Clarinet("a", rate=44_100)
    clarinet.breath(0.6)
    clarinet.note_on("A3")
    out = np.empty(12_000, np.float32)
    edges = [0, *cuts, 6_000]
    for begin, end in zip(edges, edges[1:]):
        clarinet.render_into(out[begin:end])
    clarinet.bend(-30.0)
    clarinet.note_on("B3")
    clarinet.note_off("A3")
    out[6_000:] = clarinet.render(6_000 / 44_100)
    return out


def test_how_time_is_cut_changes_no_bit():
    whole = play([])
    assert np.abs(whole).max() > 0.01
    for cuts in ([1], [17, 18, 5_999], list(range(512, 6_000, 512))):
        assert (play(cuts) == whole).all()


def test_events_are_played_at_their_samples():
    events = [(0.1, "note_off", "Bb3"), (0.0, "breath", 0.5), (0.0, "note_on", "Bb3")]
    played = chalumeau.Clarinet().play(events, 0.2)
    live = chalumeau.Clarinet()
    live.breath(0.5)
    live.note_on(58)
    first = live.render(0.1)
    live.note_off(58)
    assert (played == np.concatenate([first, live.render(0.1)])).all()


def pitch_hz(samples, near):
    """Frequency of a steady tone within 40 cents of another, by its autocorrelation some periods away."""
    periods = 20
    middle = round(periods * 48_000 / near)
    half = middle // periods // 2 - 1
    lags = np.arange(middle - half, middle + half)
    samples = samples.astype(float)
    values = [np.dot(samples[:-lag], samples[lag:]) / (len(samples) - lag) for lag in lags]
    top = int(np.argmax(values))
    a, b, c = values[top - 1 : top + 2]
    return periods * 48_000 / (lags[top] + (a - c) / (2 * (a - 2 * b + c)))


def test_what_is_done_to_a_live_clarinet_is_heard():
    held = [(0.0, "breath", 0.6), (0.0, "note_on", "Bb3", 0.7)]
    still = {"noise": 0, "life": 0}

    def played(*events, **settings):
        return chalumeau.Clarinet(settings=still | settings).play([*held, *events], 0.8)

    plain = played()
    steady = slice(24_000, None)
    near = 233.08

    def cents(samples):
        return 1_200 * np.log2(pitch_hz(samples[steady], near) / pitch_hz(plain[steady], near))

    # Settings: before the first note as from the start, later from the moment on.
    clarinet = chalumeau.Clarinet(settings=still)
    clarinet.set(lip=1.1)
    assert (clarinet.play(held, 0.8) == played(lip=1.1)).all()
    later = played((0.4, "set", {"lip": 1.3}))
    assert (later[:19_000] == plain[:19_000]).all() and (later[20_000:] != plain[20_000:]).any()
    assert abs(cents(played((0.0, "bend", 20.0))) - 20) < 2 and abs(cents(played((0.0, "bend", -20.0))) + 20) < 2
    # Each hole that is opened changes the sound in a way of its own.
    holes = [name for name, *_ in chalumeau.instrument("b-flat").holes()]
    opened = [played((0.0, "hole", hole, 1.0)) for hole in holes[5:8]]
    sounds = {digest(one) for one in opened} | {digest(plain)}
    assert len(sounds) == 4
    back = played((0.3, "hole", holes[5], 1.0), (0.31, "hole", holes[5], None))
    assert abs(cents(back)) < 1
    # A slap sounds without breath, the harder the louder.
    soft, hard = (np.abs(chalumeau.Clarinet(settings=still).play([(0.0, "slap", s)], 0.2)).max() for s in (0.2, 1.0))
    assert hard > 1.5 * soft > 0
    clarinet = chalumeau.Clarinet(settings=still)
    clarinet.play(held, 0.4)
    clarinet.panic()
    clarinet.render(0.5)
    assert np.abs(clarinet.render(0.1)).max() < 1e-4
    clarinet.reset()
    assert (clarinet.play(held, 0.8) == plain).all(), "as a new one"


def test_notes_and_the_same_notes_live_are_the_same():
    listed = chalumeau.render([(0.0, 0.2, "C4", 0.6), (0.2, 0.2, "D4", 0.6)], tail=0.1)
    events = [
        (0.0, "note_on", "C4", 0.6),
        (0.2, "note_on", "D4", 0.6),
        (0.2, "note_off", "C4"),
        (0.4, "note_off", "D4"),
    ]
    assert (listed == chalumeau.Clarinet().play(events, 0.5)).all()


def test_midi_bytes_are_the_file(root):
    path = root / "examples/melody.mid"
    assert (chalumeau.render(path) == chalumeau.render(path.read_bytes())).all()


def test_instruments_come_as_path_text_dict_and_object(tmp_path):
    tomllib = pytest.importorskip("tomllib")
    bass = chalumeau.instrument("bass")
    text = bass.to_toml()
    (tmp_path / "mine.toml").write_text(text)
    forms = [tmp_path / "mine.toml", str(tmp_path / "mine.toml"), text, tomllib.loads(text), bass]
    assert all(chalumeau.instrument(form) == bass for form in forms)
    sounds = {digest(chalumeau.render(written="E3", seconds=0.2, instrument=form)) for form in forms}
    # The text writes numbers so that they read back as the bundled instrument's.
    assert sounds == {digest(chalumeau.render(written="E3", seconds=0.2, instrument="bass"))}


def test_a_short_name_and_its_setting_are_one():
    clarinet = chalumeau.Clarinet(no_noise=True, tempered=True)
    clarinet.set(noise=0.3, natural=True)
    assert clarinet.settings == {"noise": 0.3, "natural": True}


def test_a_room_on_one_channel_is_warned_of():
    with pytest.warns(UserWarning, match="channels=2"):
        chalumeau.render(written="C4", seconds=0.1, room=0.4, channels=1)


def test_settings_without_an_effect_are_warned_of():
    with pytest.warns(UserWarning, match="--vibrato-rate has no effect"):
        chalumeau.render(written="C4", seconds=0.05, vibrato_rate=6)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        chalumeau.render(written="C4", seconds=0.05, vibrato_rate=6, vibrato=0.5)
        # A live clarinet may get a vibrato later.
        chalumeau.Clarinet(vibrato_rate=6).note_on("C4")


def test_events_are_checked_before_the_first_is_played():
    good = [(0.0, "breath", 0.6), (0.0, "note_on", "C4")]
    alone = chalumeau.Clarinet(noise=0).play(good, 0.2)
    hole = chalumeau.instrument("b-flat").holes()[0][0]
    for wrong, kind, says in [
        ((0.5, "note_off", "C4"), ValueError, "event at 0.5 s is after the end, 0.2 s"),
        ((0.1, "jump"), ValueError, 'no event is called \'jump\''),
        ((0.1, "breath", 2), ValueError, "event breath at 0.1 s: breath must lie in 0..1"),
        ((0.1, "breath"), TypeError, "share"),
        ((0.1, "note_on", "H4"), ValueError, "event note_on at 0.1 s"),
        ((0.1, "note_on", "C4", 2), ValueError, "velocity"),
        ((0.1, "bend", 1e6), ValueError, "bend"),
        ((0.1, "slap", -1), ValueError, "slap"),
        ((0.1, "hole", "nothing", 1), ValueError, "the holes are"),
        ((0.1, "hole", hole, 3), ValueError, "opening"),
        ((0.1, "set", {"lip": 9}), ValueError, "0.6..1.4"),
        ((0.1, "set", {"strenght": 2}), ValueError, "strength"),
        ((0.1, "set", {"rate": 2}), ValueError, "rate"),
        ((-0.1, "panic"), ValueError, "0..86400"),
        (("soon", "panic"), TypeError, "time of an event"),
        (3, TypeError, "an event is"),
    ]:
        clarinet = chalumeau.Clarinet(noise=0)
        with pytest.raises(kind) as raised:
            clarinet.play([*good, wrong], 0.2)
        assert says in str(raised.value), str(raised.value)
        # Nothing has been played: it begins as a new one does.
        assert clarinet.settings == {"noise": 0}
        assert (clarinet.play(good, 0.2) == alone).all()
    # The end itself is a time.
    chalumeau.Clarinet().play([(0.1, "note_on", "C4")], 0.1)


def test_what_does_not_fit_into_memory_is_an_exception():
    notes = [(0.0, 3_600.0, "C4")]
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (8_000_000_000, before[1]))
    try:
        with pytest.raises(MemoryError, match="GB of memory"):
            chalumeau.render(notes, rate=1_536_000, channels=2)
        with pytest.raises(MemoryError, match="GB of memory"):
            chalumeau.Clarinet().render(80_000)
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)
    for from_s, seconds in [(0.0, 21_601.0), (20_000.0, 2_000.0)]:
        with pytest.raises(ValueError, match="21600 s"):
            chalumeau.render([(from_s, seconds, "C4")])


def test_silent_notes_are_warned_of():
    with pytest.warns(UserWarning, match="1 note has no fingering"):
        chalumeau.render([(0.0, 0.1, 20)])


def test_mistakes_say_what_was_given_and_what_to_do(tmp_path):
    text = tmp_path / "text.mid"
    text.write_text("once upon a time")
    for make, kind, says in [
        (lambda: chalumeau.render(), ValueError, "nothing to play"),
        (lambda: chalumeau.render(written="H4"), ValueError, "a name like E3"),
        (lambda: chalumeau.render(written="C4", zeta=3), ValueError, "0.05..0.9"),
        (lambda: chalumeau.render(written="C4", settings={"Embouchure": "loud"}), ValueError, "zeta"),
        (lambda: chalumeau.render(written="C1"), ValueError, "written 24 (C1) has no fingering"),
        (lambda: chalumeau.render(tmp_path / "none.mid"), FileNotFoundError, "none.mid"),
        (lambda: chalumeau.render(b"no midi"), ValueError, "the given bytes"),
        (lambda: chalumeau.render(text), ValueError, "text.mid"),
        (lambda: chalumeau.render(written="C4", contrast=2), ValueError, "--contrast is of the knob's feel"),
        (lambda: chalumeau.bifurcation("C#7", seconds=0.5), ValueError, "the key of C#7 is silent"),
        (lambda: chalumeau.features(np.zeros(48_000, np.int16)), ValueError, "divide them by 32768"),
        (lambda: chalumeau.features(np.zeros(48_000, complex)), ValueError, "real part"),
        (lambda: chalumeau.render([(0, 1)]), TypeError, "(from_s, seconds, note)"),
        (lambda: chalumeau.render(written="C4", channels=3), ValueError, "1 or 2"),
        (lambda: chalumeau.render(written="C4", rate=10), ValueError, "10"),
        (lambda: chalumeau.instrument("tuba"), ValueError, "b-flat"),
        (lambda: chalumeau.instrument("name = 3\n"), ValueError, "name"),
        (lambda: chalumeau.instrument({"name": "x"}), ValueError, "missing"),
        (lambda: chalumeau.instrument(3), TypeError, "an id"),
        (lambda: chalumeau.note(3.5), TypeError, "MIDI number"),
        (lambda: chalumeau.note(128), ValueError, "0..127"),
        (lambda: chalumeau.Clarinet(strenght=2), ValueError, "strength"),
        (lambda: chalumeau.Clarinet().render(-1), ValueError, "0..86400"),
        (lambda: chalumeau.Clarinet().render_into(np.zeros(8, np.float32)[::2]), ValueError, "contiguous"),
        (lambda: chalumeau.Clarinet().play([(0, "jump")], 1), ValueError, "note_on"),
        (lambda: chalumeau.impedance("E3", [0.0]), ValueError, "1..20000"),
        (lambda: chalumeau.impedance(["nothing"], [100.0]), ValueError, "the holes are"),
        (lambda: chalumeau.thresholds(temperature=90), ValueError, "10..40"),
        (lambda: chalumeau.feel("C5", torque=900), ValueError, "0..450"),
        (lambda: chalumeau.feel("C5", torque=450), ValueError, "mNm"),
        (lambda: chalumeau.reed_flow([0.5], H=-1), ValueError, "H"),
        (lambda: chalumeau.features(np.zeros((4, 2))), ValueError, "one dimension"),
    ]:
        with pytest.raises(kind) as raised:
            make()
        assert says in str(raised.value), str(raised.value)


def test_two_threads_render_at_the_same_time():
    """While one thread is inside a long rendering, this one runs Python."""
    clarinet = chalumeau.Clarinet()
    clarinet.breath(0.5)
    clarinet.note_on("Bb3")
    inside = threading.Event()
    times = {}

    def render():
        inside.set()
        times["begin"] = time.monotonic()
        clarinet.render(100.0)
        times["end"] = time.monotonic()

    thread = threading.Thread(target=render)
    thread.start()
    inside.wait()
    ticks = []
    while thread.is_alive():
        ticks.append(time.monotonic())
        time.sleep(0.001)
    thread.join()
    within = [tick for tick in ticks if times["begin"] < tick < times["end"]]
    # Were the lock held, this thread would get a turn once for each second of sound, when the rendering looks for Ctrl-C.
    assert len(within) > 200, len(within)


def test_threads_may_share_a_clarinet():
    clarinet = chalumeau.Clarinet()
    clarinet.breath(0.5)
    clarinet.note_on("Bb3")
    pieces = []
    threads = [threading.Thread(target=lambda: pieces.append(clarinet.render(0.2))) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sum(len(piece) for piece in pieces) == 4 * 9_600


def test_samples_are_the_memory_that_was_rendered_into():
    samples = chalumeau.render(written="C4", seconds=0.1)
    both = chalumeau.render(written="C4", seconds=0.1, channels=2)
    owners = [samples.base, both.base.base, chalumeau.Clarinet().render(0.1).base, chalumeau.impedance("E3", [90.0]).base.base]
    # What the compiled part hands over, and no copy of it.
    assert all(type(owner).__name__ == "PySliceContainer" for owner in owners), owners
    samples[:] = 0.0


def test_speed_is_that_of_the_command_line(program, tmp_path):
    """Time of the processor for the same sound, the best of three in turn, so that what else runs here matters little."""
    import resource

    words = ["--written", "C4", "--seconds", "60", "--gamma", "0.5"]

    def native():
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([program, "render", *words, "--out", "x.wav", "--force"], cwd=tmp_path, check=True, capture_output=True)
        return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before.ru_utime

    def ours():
        began = time.process_time()
        chalumeau.render(written="C4", seconds=60, gamma=0.5)
        return time.process_time() - began

    times = [(native(), ours()) for _ in range(3)]
    ratio = min(one for one, _ in times) / min(one for _, one in times)
    print(f"speed over that of the command line: {ratio:.2f}")
    # It is 1 but for what else runs on the machine; a copy of each sample by Python would make it a tenth.
    assert ratio > 0.8, times


def test_a_list_of_notes_plays_chords_as_a_midi_file_does():
    # One beat is 0.5 s, and so are both notes.
    track = bytes([0, 0x90, 60, 102, 0, 0x90, 64, 102, 96, 0x80, 60, 0, 0, 0x80, 64, 0, 0, 0xFF, 0x2F, 0])
    midi = b"MThd" + bytes([0, 0, 0, 6, 0, 0, 0, 1, 0, 96]) + b"MTrk" + len(track).to_bytes(4, "big") + track
    velocity = 102 / 127
    chord = [(0, 0.5, 60, velocity), (0, 0.5, 64, velocity)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        of_list = chalumeau.render(chord, players=2, tail=0.2)
    of_file = chalumeau.render(midi, players=2, tail=0.2)
    assert (of_list == of_file).all() and np.abs(of_list).max() > 0.05
    with pytest.warns(UserWarning, match="players=2 or more play chords"):
        alone = chalumeau.render(chord, tail=0.2)
    assert alone.ndim == 1


def test_a_clarinet_is_not_copied_and_a_list_without_notes_is_told():
    import copy
    import pickle

    clarinet = chalumeau.Clarinet()
    for make in (copy.copy, copy.deepcopy, pickle.dumps):
        with pytest.raises(TypeError, match="make another: Clarinet"):
            make(clarinet)
    with pytest.warns(UserWarning, match="no notes"):
        chalumeau.render([], tail=0.1)
    with pytest.raises(FileNotFoundError, match='say written="C4"'):
        chalumeau.render("C4")
    with pytest.raises(ValueError, match="nothing to play"):
        chalumeau.render()


def test_warnings_name_the_line_that_called():
    with pytest.warns(UserWarning) as told:
        chalumeau.render([(0, 0.1, 60), (0, 0.1, 64)], tail=0.1)
    assert told[0].filename == __file__
