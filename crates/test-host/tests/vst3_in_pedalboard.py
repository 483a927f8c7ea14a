"""The bundled VST3 without MIDI controllers inside pedalboard: python vst3_in_pedalboard.py Chalumeau.vst3"""

import resource
import sys
import time

import mido
import numpy as np
from pedalboard import load_plugin

BUNDLE = sys.argv[1]
RATE = 48_000
NOTES_ONLY = "Chalumeau (notes only)"
# Processor time and memory that loading may cost.
LOAD_S = 3.0
LOAD_MIB = 200


def memory_mib():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def play(plugin, block=512):
    notes = [mido.Message("note_on", note=58, velocity=100, time=0.1), mido.Message("note_off", note=58, time=0.8)]
    return plugin(notes, duration=1.2, sample_rate=RATE, num_channels=2, buffer_size=block)


before_s, before_mib = time.process_time(), memory_mib()
clarinet = load_plugin(BUNDLE, plugin_name=NOTES_ONLY)
loaded_s, loaded_mib = time.process_time() - before_s, memory_mib() - before_mib


def it_loads_quickly():
    assert loaded_s <= LOAD_S, f"{loaded_s:.1f} s"
    assert loaded_mib <= LOAD_MIB, f"{loaded_mib:.0f} MiB"
    assert clarinet.is_instrument
    hidden = [name for name in clarinet.parameters if name.startswith("midi_ch")]
    assert not hidden, hidden[:3]


def without_a_name_it_says_which_plugins_there_are():
    try:
        load_plugin(BUNDLE)
    except ValueError as error:
        assert NOTES_ONLY in str(error), error
    else:
        raise AssertionError("loaded without a name")


def a_key_sounds_the_same_in_blocks_of_any_size():
    heard = play(clarinet)
    first = int(np.argmax(np.abs(heard[0]) > 1e-6))
    assert 4800 <= first < 4800 + 480, first
    assert np.sqrt(np.mean(heard[0, 24_000:36_000] ** 2)) > 1e-2
    for block in (17, 4096):
        assert np.array_equal(play(clarinet, block), heard), block


def parameters_and_state_make_the_round_trip():
    clarinet.embouchure = 0.5
    play(clarinet)  # a change takes effect with the next block
    kept, sound = clarinet.raw_state, play(clarinet)
    clarinet.embouchure = 0.3
    play(clarinet)
    clarinet.raw_state = kept
    assert abs(clarinet.embouchure - 0.5) < 1e-3, clarinet.embouchure
    assert np.array_equal(play(clarinet), sound)


TESTS = [
    it_loads_quickly,
    without_a_name_it_says_which_plugins_there_are,
    a_key_sounds_the_same_in_blocks_of_any_size,
    parameters_and_state_make_the_round_trip,
]

print(f"loaded in {loaded_s:.2f} s of processor time, {loaded_mib:.0f} MiB, {len(clarinet.parameters)} parameters")
failed = 0
for test in TESTS:
    try:
        test()
        print(f"test {test.__name__} ... ok", flush=True)
    except Exception as error:  # each test is to be heard
        failed += 1
        print(f"test {test.__name__} ... FAILED: {type(error).__name__} {error}", flush=True)
print(f"pedalboard: {len(TESTS) - failed} passed, {failed} failed")
sys.exit(failed != 0)
