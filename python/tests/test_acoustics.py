"""The physics: the numbers of the command line, and what must hold of them."""

import csv

import chalumeau
import numpy as np
import pytest


def test_impedance_is_that_of_the_command_line(table):
    grid = ["--from", "100", "--to", "1000", "--step", "50"]
    for model in ("tmm", "lattice"):
        said = table("impedance", "--written", "F4", "--model", model, *grid)
        z = chalumeau.impedance("F4", said["f_hz"], model=model)
        assert z.dtype == np.complex128
        np.testing.assert_allclose(z.real, said["re_z_over_zc"], atol=1e-8)
        np.testing.assert_allclose(z.imag, said["im_z_over_zc"], atol=1e-8)
    grown = chalumeau.impedance("F4", [[200.0, 300.0]], reed_volume=True, temperature=20)
    assert grown.shape == (1, 2)
    said = table("impedance", "--written", "F4", "--model", "tmm", "--reed-volume", "--temperature", "20", *grid)
    np.testing.assert_allclose(grown[0].real, [said["re_z_over_zc"][2], said["re_z_over_zc"][4]], atol=1e-8)


def test_holes_by_name_are_the_fingering():
    chart = {one["written"]: one for one in chalumeau.fingerings()}
    f_hz = np.linspace(100, 2_000, 50)
    by_name = chalumeau.impedance(chart["G4"]["open"], f_hz)
    assert (by_name == chalumeau.impedance("G4", f_hz)).all()
    assert (by_name != chalumeau.impedance([], f_hz)).any()


def test_peaks_are_those_of_the_command_line(table):
    said = table("impedance", "--written", "E3", "--model", "tmm", "--peaks", "5")
    peaks = chalumeau.impedance_peaks(52, 5)
    np.testing.assert_allclose(peaks["f_hz"], said["f_hz"], atol=1e-4)
    np.testing.assert_allclose(peaks["mag_over_zc"], said["mag_over_zc"], atol=1e-6)
    np.testing.assert_allclose(peaks["q"], said["q"], atol=1e-4)


def test_a_fingering_outside_the_chart_is_that_of_the_command_line(table):
    open_holes = ["THUMB", "L1", "L2"]
    said = table("impedance", "--open-holes", " ".join(open_holes), "--model", "tmm", "--peaks", "4")
    peaks = chalumeau.impedance_peaks(open_holes, 4)
    np.testing.assert_allclose(peaks["f_hz"], said["f_hz"], atol=1e-4)


def test_found_fingerings_are_those_of_the_command_line(table):
    said = table("fingerings", "--note", "B5", "--count", "8")
    found = chalumeau.find_fingerings("B5", 8)
    ours = len(found["open"])
    assert 0 < ours <= 8 and found["unmoved"] == []
    np.testing.assert_allclose(found["f_hz"], said["hz"][:ours], atol=0.05)
    np.testing.assert_allclose(found["cost"], said["cost"][:ours], atol=0.005)
    assert list(found["mode"]) == said["mode"][:ours] and found["fingers"] == said["fingers"][:ours]
    assert [" ".join(holes) for holes in found["open"]] == said["open"][:ours]
    chart = {one["written"]: one["open"] for one in chalumeau.fingerings()}
    of_chart = [holes for holes, is_chart in zip(found["open"], found["of_chart"]) if is_chart]
    assert of_chart in ([], [chart["B5"]])
    with pytest.raises(ValueError, match="1..1000"):
        chalumeau.find_fingerings("B5", 0)


def test_a_hole_in_a_wrong_place_is_named():
    assert chalumeau.check_instrument("bass")["concerns"] == []
    text = chalumeau.instrument("b-flat").to_toml()
    place = next(x for name, x, _ in chalumeau.instrument("b-flat").holes() if name == "L3")
    shown = f"x_mm = {1e3 * place:.3f}".rstrip("0")
    assert shown in text
    moved = chalumeau.instrument(text.replace(shown, f"x_mm = {1e3 * place - 10:.3f}"))
    found = chalumeau.check_instrument(moved)
    assert found["is_usable"] and found["concerns"]
    assert all(concern.endswith("the first hole that it opens is L3") for concern in found["concerns"])
    with pytest.raises(ValueError, match="415..466"):
        chalumeau.check_instrument("b-flat", a4=500)


def test_thresholds_are_those_of_the_command_line(table):
    said = table("haptic", "--all", "--zeta", "0.25", "--contrast", "1")
    found = chalumeau.thresholds(zeta=0.25)
    assert list(found["written_midi"]) == said["written_midi"]
    for name, digits in (("gamma_on", 1e-6), ("gamma_sounding", 1e-6), ("gamma_off", 1e-4), ("p_req_pa", 1e-2)):
        np.testing.assert_allclose(found[name], said[name], atol=digits, err_msg=name)
    assert found["written_midi"].dtype == np.int64 and (found["written_midi"] - 69).min() < 0
    low, high = list(found["written_midi"]).index(75), list(found["written_midi"]).index(81)
    # The onset of D#5 is that of a lower register, its own is its own.
    assert found["sounding_hz"][low] < 300 and found["gamma_own"][low] > found["gamma_sounding"][low]
    assert found["gamma_own"][high] == found["gamma_sounding"][high]
    # `threshold` finds the peak a little differently.
    linear = table("threshold", "--all", "--zeta", "0.25")
    np.testing.assert_allclose(found["gamma_on"][:40], linear["gamma_on"][:40], atol=2e-3)


def test_feel_and_torque_are_those_of_the_command_line(table):
    said = table("haptic", "--written", "G4", "--law", "pressure")
    feel = chalumeau.feel("G4", law="pressure")
    for name in ("a_on_deg", "a_off_deg", "a_close_deg", "scale_mnm", "h", "k"):
        assert feel[name] == pytest.approx(said[name][0], abs=1e-4), name
    assert feel["most_mnm"] == pytest.approx(said["most_mnm"][0], abs=6e-3)
    assert feel["wall_deg"] == pytest.approx(said["wall_deg"][0], abs=1e-4)
    # The step at the threshold is no friction.
    asked = chalumeau.feel("G4", law="pressure", detent=7)
    assert asked["detent_mnm"] == pytest.approx(7.0) and asked["friction_mnm"] == feel["friction_mnm"] < 7
    curve = table("haptic", "--written", "G4", "--law", "pressure", "--curve")
    torques = chalumeau.torque("G4", curve["angle_deg"], law="pressure")
    np.testing.assert_allclose(torques, curve["torque_mnm"], atol=1e-5)


def test_bifurcation_is_that_of_the_command_line(table):
    said = table("bifurcation", "--written", "F3", "--to", "1", "--seconds", "4", "--zeta", "0.4")
    ramp = chalumeau.bifurcation("F3", to=1, seconds=4, zeta=0.4)
    assert list(ramp["direction"]) == said["direction"]
    np.testing.assert_allclose(ramp["gamma"], said["gamma"], atol=1e-6)
    np.testing.assert_allclose(ramp["rms"], said["rms"], rtol=1e-6, atol=1e-12)
    up = ramp["direction"] == 1
    assert ramp["begins"] in ramp["gamma"][up] and ramp["ends"] in ramp["gamma"][~up]


def test_reed_tables_and_flow_are_those_of_the_command_line(table):
    said = table("reed", "--table")
    tables = chalumeau.reed_tables()
    for name, column in (("p", "p"), ("x_a", "x_a"), ("x_b", "x_b"), ("sgn", "sgn")):
        np.testing.assert_allclose(tables[name], said[column], rtol=1e-15, err_msg=name)
    pressures = np.linspace(-1, 1, 9)
    np.testing.assert_allclose(chalumeau.reed_flow(pressures, A=2), 2 * chalumeau.reed_flow(pressures))
    law = table("reed", "--law", "--H", "3", "--k", "0.3849")
    np.testing.assert_allclose(chalumeau.reed_flow(law["p"], H=3, k=0.3849), law["u"], rtol=1e-12, atol=1e-12)


def test_the_notes_of_a_recording_are_those_of_the_command(tmp_path, root, chalumeau_says):
    melody = root / "examples" / "melody.mid"
    sound = chalumeau.render(melody)
    found = chalumeau.find_notes(sound)
    # The command reads a WAV file of the same samples.
    wav = tmp_path / "melody.wav"
    chalumeau_says("render", str(melody), "--out", str(wav))
    lines = chalumeau_says("measure", str(wav)).splitlines()
    said = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert len(found) == len(said) > 50
    for name, column, places in (("f0_hz", "f_hz", 3), ("start_s", "start_s", 3), ("level_dbfs", "level_dbfs", 2), ("centroid_hz", "centroid_hz", 1)):
        columns = [float(row[column]) for row in said]
        np.testing.assert_allclose([note[name] for note in found], columns, rtol=0, atol=0.51 * 10.0**-places, err_msg=name)
    with pytest.raises(ValueError, match="rate must lie in"):
        chalumeau.find_notes(sound, 10)
    assert chalumeau.find_notes(np.zeros(48_000)) == []


def test_features_of_a_synthetic_tone():
    t = np.arange(48_000) / 48_000
    tone = 0.5 * np.sin(2 * np.pi * 220 * t) + 0.05 * np.sin(2 * np.pi * 660 * t)
    found = chalumeau.features(tone)
    assert found["f0_hz"] == pytest.approx(220, abs=0.05)
    assert found["harmonics_db"][0] == 0 and found["harmonics_db"][2] == pytest.approx(-20, abs=0.1)
    assert found["steady_dbfs"] == pytest.approx(10 * np.log10(0.5 * (0.25 + 0.0025)), abs=0.05)
    low = 0.3 * np.sin(2 * np.pi * 36.7 * t) + 0.3 * np.sin(2 * np.pi * 3 * 36.7 * t)
    assert chalumeau.features(low, near=36.7)["f0_hz"] == pytest.approx(36.7, abs=0.05)
    with pytest.raises(ValueError, match="near must lie in"):
        chalumeau.features(low, near=0)
    silent = chalumeau.features(np.zeros(48_000))
    assert np.isnan(silent["f0_hz"]) and silent["harmonics_db"] == []
