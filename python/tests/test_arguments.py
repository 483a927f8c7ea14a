"""What is given: forms that are meant alike are taken, and what is wrong is refused."""

import os
import signal
import subprocess
import sys
import time

import chalumeau
import numpy as np
import pytest
from chalumeau import datasets


def test_numbers_of_numpy_and_whole_floats_are_taken():
    plain = chalumeau.render(written=60, gamma=0.5, seconds=0.05, rate=44_100)
    for written, gamma, rate in [(60.0, np.array(0.5), 44_100.0), (np.int64(60), np.float64(0.5), np.int32(44_100))]:
        assert (chalumeau.render(written=written, gamma=gamma, seconds=0.05, rate=rate) == plain).all()
    assert (chalumeau.render(written="E♭4", seconds=0.05) == chalumeau.render(written="Eb4", seconds=0.05)).all()
    with pytest.raises(TypeError, match="gamma must be one value"):
        chalumeau.render(written=60, gamma=np.array([0.4, 0.5]))
    assert [chalumeau.note(one) for one in ("E♭4", "C♯4", " C4 ", 60.0, np.uint8(60))] == [63, 61, 60, 60, 60]


def test_ones_are_switches():
    by = [chalumeau.render(written="C4", seconds=0.05, no_noise=on) for on in (True, 1)]
    assert (by[0] == by[1]).all()


def test_nan_stays_nan():
    flow = chalumeau.reed_flow([np.nan, 0.5])
    assert np.isnan(flow[0]) and flow[1] > 0
    assert np.isnan(chalumeau.torque("C5", [np.nan]))[0]
    for values in ([None], np.ma.masked_array([0.5], [True])):
        with pytest.raises(ValueError, match="masked"):
            chalumeau.reed_flow(values)
    with pytest.raises(ValueError, match="NaN"):
        chalumeau.features([0.0, np.nan])


def test_wrong_values_of_a_live_clarinet_are_refused():
    live = chalumeau.Clarinet()
    for make in [
        lambda: live.breath(float("nan")),
        lambda: live.breath(2),
        lambda: live.note_on("C4", 2),
        lambda: live.note_on("C4", float("nan")),
        lambda: live.bend(1e9),
        lambda: live.slap(-1),
        lambda: live.hole(live.instrument.holes()[0][0], float("nan")),
    ]:
        with pytest.raises(ValueError, match="must lie in"):
            make()
    with pytest.warns(UserWarning, match="1 note has no fingering"):
        live.note_on(20)


@pytest.mark.parametrize(
    "named, says",
    [
        (dict(players=3), "one player"),
        (dict(room=0.5), "without a room"),
        (dict(preset="Growl"), "chalumeau.render"),
        (dict(seconds=2), "chalumeau.render"),
        (dict(h=2), "do you mean H"),
    ],
)
def test_what_a_live_clarinet_cannot_do_is_refused(named, says):
    with pytest.raises(ValueError, match=says):
        chalumeau.Clarinet(**named)
    with pytest.raises(ValueError, match=says):
        chalumeau.Clarinet().set(named)


def test_settings_that_cannot_change_are_refused():
    chalumeau.Clarinet(untuned=True, H=2)
    for name, value in [("rate", 44_100), ("quality", "high")]:
        with pytest.raises(ValueError, match=name):
            chalumeau.Clarinet().set({name: value})


@pytest.mark.parametrize(
    "make, kind, says",
    [
        (lambda: chalumeau.render(""), ValueError, "empty"),
        (lambda: chalumeau.render(5), TypeError, "written=5"),
        (lambda: chalumeau.render(written="C4", settings="strength=3"), TypeError, "dict"),
        (lambda: chalumeau.render(written="C4", preset="Growl"), ValueError, "chalumeau.presets()"),
        (lambda: chalumeau.render(written="C4", qqq=1), ValueError, "help(chalumeau.render)"),
        (lambda: chalumeau.impedance_peaks("E3", -1), ValueError, "1..30"),
        (lambda: chalumeau.rows([{"written": "C4", "qqq": 1}]), ValueError, "qqq"),
        (lambda: chalumeau.rows({"vary": {"gamma": [0.4, float("nan")]}}), ValueError, "['gamma'][1]"),
        (lambda: chalumeau.dataset([{"written": "C4"}], "never", workers=0), ValueError, "at least 1"),
    ],
)
def test_mistakes_are_told_in_words_of_python(make, kind, says):
    with pytest.raises(kind) as raised:
        make()
    assert says in str(raised.value), str(raised.value)


def test_plans_take_arrays_and_ranges():
    given = {"same": {"seconds": np.float64(0.5)}, "vary": {"written": range(60, 62), "gamma": np.array([0.4, 0.5])}}
    plain = {"same": {"seconds": 0.5}, "vary": {"written": [60, 61], "gamma": [0.4, 0.5]}}
    assert chalumeau.rows(given) == chalumeau.rows(plain)


def test_equal_instruments_have_equal_hashes():
    bass = chalumeau.instrument("bass")
    assert {bass: 1}[chalumeau.instrument(bass.to_toml())] == 1 and bass not in {chalumeau.instrument("a")}


def test_a_script_without_main_is_told_to_have_one(tmp_path):
    pytest.importorskip("pyarrow")
    (tmp_path / "script.py").write_text(
        "import chalumeau\nchalumeau.dataset([{'written': 'C4', 'seconds': 0.05}], 'set', workers=2)\n"
    )
    said = subprocess.run([sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert said.returncode != 0 and "call dataset under if __name__" in said.stderr, said.stderr
    assert datasets.dataset([{"written": "C4", "seconds": 0.05}], tmp_path / "set").rows == 1


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize(
    "call",
    [
        "bifurcation('F3', seconds=600)",
        "impedance('F3', numpy.linspace(100, 2000, 2_000_000))",
        # Prepared first, for some ten seconds.
        "render(written='C4', seconds=0.1, instrument='examples/instruments/alto-chalumeau.toml')",
    ],
)
def test_ctrl_c_stops_it(call, root, tmp_path):
    # A shell that starts the tests in the background has them ignore SIGINT; Python then keeps ignoring it.
    heard = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    code = f"{heard}; import chalumeau, numpy; print(1, flush=True); chalumeau.{call}"
    nothing_kept = os.environ | {"CHALUMEAU_CACHE_DIR": str(tmp_path)}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    running = subprocess.Popen([sys.executable, "-c", code], cwd=root, env=nothing_kept, **pipes)
    try:
        running.stdout.readline()
        time.sleep(1)
        running.send_signal(signal.SIGINT)
        _, said = running.communicate(timeout=20)
    finally:
        running.kill()
    assert "KeyboardInterrupt" in said, said
