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


def test_no_open_hole_shuts_all_and_paths_are_taken(tmp_path):
    render = {"written": "C4", "seconds": 0.1}
    shut = chalumeau.render(open_holes=[], **render)
    assert (shut != chalumeau.render(**render)).any()
    [lowest] = [each["open"] for each in chalumeau.fingerings() if each["written"] == "E3"]
    assert lowest == [] and (shut == chalumeau.render(open_holes=lowest, **render)).all()
    curve = tmp_path / "breath.csv"
    curve.write_text("t_s,gamma\n0,0.5\n1,0.5\n")
    assert (chalumeau.render(breath=curve, **render) == chalumeau.render(breath=str(curve), **render)).all()


def test_notes_of_one_key_that_overlap_each_last_until_their_own_end():
    sound = chalumeau.render([(0, 0.4, "C4", 0.6), (0.2, 0.4, "C4", 0.6)], channels=1)
    level = np.sqrt(np.mean(np.square(sound[int(0.5 * 48_000) : int(0.58 * 48_000)])))
    # The end of the first one, at 0.4 s, ends nothing.
    assert level > 1e-2


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
        (lambda: chalumeau.dataset([{"written": "C4"}], "never", workers=2.5), ValueError, "workers must be a whole number, got 2.5"),
        (lambda: chalumeau.dataset([{"written": "C4"}], "never", workers=float("nan")), ValueError, "workers must be a whole number"),
        (lambda: chalumeau.dataset([{"written": "C4"}], "never", workers="2"), TypeError, "workers must be a number"),
        (lambda: chalumeau.render(written="C4", breath="50 %"), ValueError, "ramp:FROM:TO:SECONDS"),
        (lambda: chalumeau.bifurcation("F3", gamma=0.5), ValueError, "gamma is an argument of chalumeau.render"),
        (lambda: chalumeau.bifurcation("F3", preset="Growl"), ValueError, "preset is an argument of chalumeau.render"),
        (lambda: chalumeau.Clarinet(channels=2), ValueError, "channels is an argument of chalumeau.render"),
        (lambda: chalumeau.thresholds(gamma=1), ValueError, '"gamma"; there are zeta, strength, lip, H, k, temperature'),
        (lambda: chalumeau.feel("C5", foo=1), ValueError, "contrast"),
        (lambda: chalumeau.feel("C5", contrst=2), ValueError, "do you mean contrast?"),
        (lambda: chalumeau.impedance("E3", [100 + 50j]), ValueError, "frequencies_hz must be real numbers"),
        (lambda: chalumeau.torque("C5", [1j]), ValueError, "angles_deg must be real numbers"),
        (lambda: chalumeau.reed_flow([1j]), ValueError, "p must be real numbers"),
        (lambda: chalumeau.reed_flow(["loud"]), ValueError, "p must be numbers"),
        (lambda: chalumeau.impedance("E3", [200.0], reed_volume="no"), TypeError, "reed_volume must be True or False, got 'no'"),
        (lambda: chalumeau.rows([1]), TypeError, "a row is a dict"),
        (lambda: chalumeau.rows(5), TypeError, "not 5"),
        (lambda: chalumeau.measure(None), TypeError, "a row is a dict"),
        (lambda: chalumeau.Clarinet().render_into(np.zeros(10)), TypeError, "float32"),
        (lambda: chalumeau.Clarinet().render_into(np.zeros((2, 10), np.float32)), TypeError, "2 dimensions"),
        (lambda: chalumeau.instrument({"name": "x", "bore": [], "length": 3}), ValueError, "the dict is no instrument: length = 3: unknown"),
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


class Missing:
    """As pandas marks a value that is missing."""

    def __bool__(self):
        raise TypeError("boolean value of NA is ambiguous")

    def __repr__(self):
        return "<NA>"


class Column(list):
    """A column of a table, as pandas has it."""

    def __array__(self, dtype=None, copy=None):
        return np.array(list(self), dtype)


def test_columns_and_missing_values_of_tables():
    Missing.__name__ = "NAType"
    with pytest.raises(ValueError, match="gamma is missing"):
        chalumeau.measure({"written": "C4", "gamma": Missing()})
    with pytest.raises(ValueError, match="gamma is missing"):
        chalumeau.rows([{"written": "C4", "gamma": Missing()}])
    given = {"vary": {"written": ["C4", "D4"], "gamma": Column([0.4, 0.5])}}
    assert len(chalumeau.rows(given)) == 4


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
