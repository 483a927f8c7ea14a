"""The bundled VST3 inside DawDreamer (JUCE's host): python vst3_in_dawdreamer.py Chalumeau.vst3"""

import pathlib
import struct
import sys
import tempfile

import dawdreamer
import numpy as np

RATE = 48_000
BUNDLE = sys.argv[1]
SCRATCH = pathlib.Path(tempfile.mkdtemp())
OURS = [
    "Breath", "Full breath", "Tongue", "Legato", "Breath response", "Breath curve", "Softest breath", "Loudest breath",
    "Breath from", "Breath deadband",
    "Reed strength", "Lip opening", "Embouchure", "Lip damping", "Reed H", "Reed k", "Reed coupled", "Reed A", "Facing",
    "A4", "Tuning", "Temperature", "Vent loss", "Transpose", "Beyond the range", "Breath noise", "Gain", "Panic",
]


def load(block=512):
    engine = dawdreamer.RenderEngine(RATE, block)
    return engine, engine.make_plugin_processor("chalumeau", BUNDLE)


def render(engine, plugin, seconds):
    engine.load_graph([(plugin, [])])
    engine.render(seconds)
    left, right = engine.get_audio()
    assert np.array_equal(left, right), "both channels carry the same voice"
    return left


def restore(plugin, path):
    try:
        plugin.load_state(path)
    except RuntimeError as error:
        # DawDreamer 0.9 loads the state, then wants to open an editor to make the plugin notice it.
        assert "no available editor" in str(error), error


def index(plugin, name):
    return next(p["index"] for p in plugin.get_parameters_description() if p["name"] == name)


def midi_file(messages):
    """A MIDI file of (milliseconds, bytes), one tick a millisecond."""
    track, last = b"\x00\xff\x51\x03\x07\xa1\x20", 0
    for at, message in sorted(messages, key=lambda m: m[0]):
        delta, last = at - last, at
        track += bytes([0x80 | delta >> 7 & 127, delta & 127]) + bytes(message)
    track += b"\x00\xff\x2f\x00"
    path = SCRATCH / "notes.mid"
    path.write_bytes(b"MThd" + struct.pack(">IHHH", 6, 0, 1, 500) + b"MTrk" + struct.pack(">I", len(track)) + track)
    return str(path)


def level_db(x):
    return 10 * np.log10(np.mean(np.square(x, dtype=np.float64)) + 1e-30)


def pitch_hz(x):
    """Strongest of all pitches: the summed levels of eight harmonics."""
    spectrum = np.abs(np.fft.rfft(x * np.hanning(len(x)), 8 * len(x)))
    step = RATE / (8 * len(x))
    candidates = np.arange(100, 500, 0.1)
    score = [sum(np.log(spectrum[round(h * f / step)] + 1e-9) for h in (1, 3, 5, 7)) for f in candidates]
    return candidates[int(np.argmax(score))]


def parameters_are_listed_in_order():
    _, plugin = load()
    names = [p["name"] for p in plugin.get_parameters_description()]
    assert names[: len(OURS)] == OURS, names[: len(OURS)]
    assert plugin.get_num_output_channels() == 2


def a_key_sounds_at_its_sample():
    engine, plugin = load()
    plugin.add_midi_note(58, 100, 0.1, 1.0)
    heard = render(engine, plugin, 1.5)
    first = int(np.argmax(np.abs(heard) > 1e-6))
    assert 4800 <= first < 4800 + 480, first
    assert level_db(heard[24_000:48_000]) > -40


def block_size_is_inaudible():
    heard = []
    for block in (17, 64, 512, 4096):
        engine, plugin = load(block)
        for key, start in ((58, 0.1), (62, 0.3), (70, 0.55)):
            plugin.add_midi_note(key, 90, start, 0.2)
        heard.append(render(engine, plugin, 0.9)[: int(0.8 * RATE)])
    assert all(np.array_equal(heard[0], other) for other in heard[1:])


def breath_controller_blows():
    engine, plugin = load()
    breath = [(time, (0xB0, 2, value)) for time, value in ((0, 1), (50, 0), (500, 90), (1500, 0))]
    path = midi_file(sorted([*breath, (100, (0x90, 58, 100))]))
    plugin.load_midi(path, all_events=True)
    heard = render(engine, plugin, 3.0)
    assert level_db(heard[11_000:23_000]) < -90, level_db(heard[11_000:23_000])  # after the thump of keys and tongue
    assert level_db(heard[48_000:70_000]) > -40, level_db(heard[48_000:70_000])
    assert level_db(heard[int(2.6 * RATE) :]) < -120, level_db(heard[int(2.6 * RATE) :])


def the_wheel_bends():
    engine, plugin = load()
    path = midi_file([(0, (0xB0, 2, 80)), (1, (0x90, 60, 100)), (1000, (0xE0, 0, 72)), (2000, (0xE0, 0, 64))])
    plugin.load_midi(path, all_events=True)
    heard = render(engine, plugin, 3.0)
    plain, bent, back = (pitch_hz(heard[int(t * RATE) : int((t + 0.5) * RATE)]) for t in (0.4, 1.4, 2.4))
    assert 10 < 1200 * np.log2(bent / plain) < 40, (plain, bent)
    assert abs(1200 * np.log2(back / plain)) < 3, (plain, back)


def the_breath_parameter_follows_automation():
    engine, plugin = load()
    swell = np.concatenate([np.linspace(0, 0.7, RATE), np.linspace(0.7, 0, RATE)]).astype(np.float32)
    plugin.set_automation(index(plugin, "Breath"), swell)
    plugin.add_midi_note(58, 100, 0.0, 2.0)
    heard = render(engine, plugin, 2.0)
    # 27 dB for all of the breath, and 17.5 between these two.
    assert level_db(heard[40_000:56_000]) > level_db(heard[1000:8000]) + 16


def state_makes_the_round_trip():
    engine, plugin = load()
    zeta, coupled = index(plugin, "Embouchure"), index(plugin, "Reed coupled")
    plugin.set_parameter(zeta, 0.625)
    plugin.set_parameter(coupled, 0.0)
    render(engine, plugin, 0.1)  # a change takes effect with the next block
    path = str(SCRATCH / "state")
    plugin.save_state(path)
    other_engine, other = load()
    restore(other, path)
    render(other_engine, other, 0.1)
    assert abs(other.get_parameter(zeta) - 0.625) < 1e-5 and other.get_parameter(coupled) == 0.0
    assert other.get_parameter_text(coupled) == "Free"


def values_set_live_sound_like_the_same_values_from_a_state():
    random = np.random.default_rng(7)
    for _ in range(3):
        engine, plugin = load()
        for parameter in plugin.get_parameters_description():
            # Switches of the knob, and another instrument, which is exchanged while it plays.
            if parameter["name"] in OURS[:-1]:
                plugin.set_parameter(parameter["index"], float(random.uniform()))
        heard = []
        for _ in range(2):
            plugin.clear_midi()
            plugin.add_midi_note(58, 100, 0.05, 0.4)
            plugin.add_midi_note(62, 90, 0.5, 0.3)
            heard.append(render(engine, plugin, 1.0))
        assert np.array_equal(heard[0], heard[1]), "from the first start of processing on"
        path = str(SCRATCH / "live")
        plugin.save_state(path)
        other_engine, other = load()
        restore(other, path)
        other.add_midi_note(58, 100, 0.05, 0.4)
        other.add_midi_note(62, 90, 0.5, 0.3)
        assert np.array_equal(render(other_engine, other, 1.0), heard[0]), "from the saved state"


TESTS = [
    parameters_are_listed_in_order,
    a_key_sounds_at_its_sample,
    block_size_is_inaudible,
    breath_controller_blows,
    the_wheel_bends,
    the_breath_parameter_follows_automation,
    state_makes_the_round_trip,
    values_set_live_sound_like_the_same_values_from_a_state,
]

failed = 0
for test in TESTS:
    try:
        test()
        print(f"test {test.__name__} ... ok", flush=True)
    except Exception as error:  # each test is to be heard
        failed += 1
        print(f"test {test.__name__} ... FAILED: {type(error).__name__} {error}", flush=True)
print(f"DawDreamer: {len(TESTS) - failed} passed, {failed} failed")
sys.exit(failed != 0)
