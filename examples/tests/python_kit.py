"""The study kit's plots in examples/ on tables the command line makes. Run by python_examples.py."""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

import matplotlib.image
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
SCRATCH = pathlib.Path(tempfile.mkdtemp())
# As xtask has it: the command line to be tried, relative to the project.
PROGRAM = "CHALUMEAU_PROGRAM"
sys.path.insert(0, str(EXAMPLES))
import kit  # noqa: E402

# What the examples' README tells to type, with fewer notes.
TABLES = (
    "reed --law --csv law.csv",
    "render --written G4 --gamma 0.5 --seconds 0.4 --no-noise --out g4.wav --probe g4.csv",
    "impedance --written F4 --csv f4.csv",
    "impedance --written F4 --peaks 8 --csv f4_peaks.csv",
    "impedance --written F4 --model tmm --csv f4_tmm.csv",
    "threshold --all --zeta 0.3 --csv threshold.csv",
    "tune --gamma 0.5 --csv mf.csv",
    "tune --written C#7 --gamma 0.5 --csv high.csv",
)
PLOTS = {
    "plot_reed": "law.csv g4.csv",
    "plot_impedance": "f4.csv f4_tmm.csv --peaks f4_peaks.csv",
    "plot_notes": "threshold.csv mf.csv high.csv",
}


def program():
    """The command line: what PROGRAM names, a build of this project, or an installed one."""
    named = os.environ.get(PROGRAM)
    built = [ROOT / "target" / folder / "chalumeau" for folder in ("simulator", "debug", "release")]
    found = ROOT / named if named else next((path for path in built if path.exists()), shutil.which("chalumeau"))
    assert found, f"no chalumeau to make tables with; build it, or name it in {PROGRAM}"
    return str(found)


def plot(name, words, out):
    line = [sys.executable, EXAMPLES / f"{name}.py", *words.split(), "--out", out]
    return subprocess.run(line, cwd=SCRATCH, capture_output=True, text=True, check=False)


def tables():
    if not (SCRATCH / "law.csv").exists():
        for line in TABLES:
            subprocess.run([program(), *line.split()], cwd=SCRATCH, capture_output=True, check=True)


def kit_plots_are_drawn():
    tables()
    for name, words in PLOTS.items():
        told = plot(name, words, f"{name}.png")
        assert told.returncode == 0, told.stderr
        picture = matplotlib.image.imread(SCRATCH / f"{name}.png")[..., :3]
        assert picture.shape[0] > 500 and picture.shape[1] > 1000, picture.shape
        # Paper, and on it the blue and the red of the curves: what a figure without data does not have.
        assert 0.7 < (picture.min(axis=2) > 0.99).mean() < 0.99, name
        for colour in (kit.BLUE, kit.RED):
            wanted = np.array([int(colour[n : n + 2], 16) for n in (1, 3, 5)]) / 255
            assert (np.abs(picture - wanted).max(axis=2) < 0.02).sum() > 100, f"{name}: nothing in {colour}"


def kit_reads_what_the_command_line_measured():
    tables()
    os.chdir(SCRATCH)
    # Hk = 1 in the seed's pair: the peak stands at a third, is 1, and the reed is shut from 1 on.
    p, u = kit.table("law.csv", "p", "u")
    assert abs(p[np.argmax(u)] - 1 / 3) < 1e-3 and abs(u.max() - 1) < 1e-3, (p[np.argmax(u)], u.max())
    closing_pa = kit.remark("g4.csv", "closing pressure", "Pa")
    assert abs(closing_pa - 6000) < 0.1, closing_pa
    # Written G4 sounds F4, 349.2 Hz: upward crossings of the mouthpiece pressure in the last 0.2 s.
    t, pressure = kit.table("g4.csv", "t_s", "p_mouthpiece_pa")
    late = t > t[-1] - 0.2
    above = pressure[late] > pressure[late].mean()
    up = t[late][1:][above[1:] & ~above[:-1]]
    hz = (len(up) - 1) / (up[-1] - up[0])
    assert abs(hz / 349.23 - 1) < 0.002, hz
    # The peaks of the other table lie on the curve.
    f_hz, re, im = kit.table("f4.csv", "f_hz", "re_z_over_zc", "im_z_over_zc")
    peak_hz, height = kit.table("f4_peaks.csv", "f_hz", "mag_over_zc")
    for peak, size in list(zip(peak_hz, height))[:3]:
        near = np.hypot(re, im)[np.abs(f_hz - peak) < 2].max()
        assert 0.97 < near / size <= 1.0001, (peak, size, near)
    assert kit.name(52) == "E3" and kit.name(60) == "C4"


def kit_refuses_what_it_cannot_draw():
    tables()
    (SCRATCH / "word.csv").write_text("p,u\n0,0\n0.5,loud\n")
    (SCRATCH / "bare.csv").write_text("t_s,gamma,flow_m3s,p_mouthpiece_pa\n0,0.5,0,0\n")
    (SCRATCH / "head.csv").write_text("# an impedance head\nf_hz,mag_z,phase_deg\n100,3,20\n")
    (SCRATCH / "old.csv").write_text("written_midi,n,f_hz,mag_over_zc,q\n65,1,311,40,30\n")
    for name, words, out, says in (
        ("plot_reed", "none.csv g4.csv", "x.png", "none.csv: cannot be read"),
        ("plot_reed", "word.csv g4.csv", "x.png", "line 3: u is `loud`"),
        ("plot_reed", "law.csv bare.csv", "x.png", "no remark says `closing pressure"),
        ("plot_reed", "law.csv g4.csv --until 9", "x.png", "0 rows before 9 s"),
        ("plot_impedance", "law.csv", "x.png", "no column f_hz"),
        ("plot_impedance", "head.csv", "x.png", "re = |Z|/Zc cos(phase)"),
        ("plot_impedance", "f4.csv --peaks old.csv", "x.png", "no remark says `transposition"),
        ("plot_impedance", "f4.csv --peaks threshold.csv", "x.png", "no column f_hz"),
        ("plot_notes", "mf.csv threshold.csv", "x.png", "no column gamma_on"),
        ("plot_notes", "threshold.csv mf.csv", "x.xyz", "must end in one of"),
        ("plot_notes", "threshold.csv mf.csv", "none/x.png", "cannot be written"),
    ):
        told = plot(name, words, out)
        assert told.returncode == 2 and says in told.stderr, f"{name} {words}: {told.stderr}"
        assert "Traceback" not in told.stderr and not (SCRATCH / out).exists(), told.stderr


def kit_readme_names_the_commands():
    text = (EXAMPLES / "README.md").read_text()
    for name in PLOTS:
        help_text = subprocess.run([sys.executable, EXAMPLES / f"{name}.py", "--help"], capture_output=True, text=True)
        assert help_text.returncode == 0 and f"{name}.py" in text, name


TESTS = [
    kit_plots_are_drawn,
    kit_reads_what_the_command_line_measured,
    kit_refuses_what_it_cannot_draw,
    kit_readme_names_the_commands,
]
