"""Data sets: rows as the command line has them, nothing lost, nothing twice."""

import csv
import os
import re
import subprocess
import sys
from pathlib import Path

import chalumeau
import pytest
from chalumeau import datasets

parquet = pytest.importorskip("pyarrow.parquet")
PLAN = """
[same]
seconds = 0.5
no-noise = true
[vary]
written = ["E3", "C4", "G4"]
gamma = { from = 0.4, to = 0.5, steps = 2 }
zeta = [0.2, 0.3]
"""


def table(folder):
    with open(Path(folder, "manifest.csv"), newline="") as file:
        return list(csv.DictReader(file))


def test_the_manifest_is_that_of_the_command_line(chalumeau_says, tmp_path):
    (tmp_path / "plan.toml").write_text(PLAN)
    chalumeau_says("batch", "plan.toml", "--into", "theirs", cwd=tmp_path)
    report = chalumeau.dataset(tmp_path / "plan.toml", tmp_path / "ours", rows_per_part=5)
    assert (report.rows, report.rendered) == (12, 12) and report.rows_per_core_s > 0
    theirs, ours = table(tmp_path / "theirs"), table(tmp_path / "ours")
    for row in theirs:
        assert row.pop("warnings") == ""
    assert list(ours[0])[: len(theirs[0])] == list(theirs[0])
    for their, our in zip(theirs, ours, strict=True):
        assert {**their, "file": ""} == {**{name: our[name] for name in their}, "file": ""}
    assert len({row["sha256"] for row in ours}) == 12


def test_a_row_is_a_pure_function(tmp_path):
    row = chalumeau.rows(PLAN)[3]
    assert chalumeau.measure(row) == chalumeau.measure(dict(reversed(row.items())))
    chalumeau.dataset([row], tmp_path, sound=True)
    stored = parquet.read_table(tmp_path / "parquet").to_pylist()[0]
    samples = chalumeau.measure(row, sound=True)["samples"]
    assert stored["samples"] == samples.tolist() and stored["zeta"] == 0.3 and stored["written"] == "C4"


def test_what_was_stopped_goes_on(tmp_path):
    begun = []

    def stopping(work, parts):
        for part in parts[:2]:
            begun.append(part.file)
            yield work(part)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        chalumeau.dataset(PLAN, tmp_path, map=stopping, rows_per_part=3)
    assert not (tmp_path / "manifest.csv").exists()
    kept = {file: (tmp_path / file).stat().st_mtime_ns for file in begun}
    # A file that was damaged is made again.
    (tmp_path / begun[0]).write_bytes(b"half")
    report = chalumeau.dataset(PLAN, tmp_path, rows_per_part=3)
    assert (report.rows, report.rendered) == (12, 9)
    assert (tmp_path / begun[1]).stat().st_mtime_ns == kept[begun[1]]
    rows = parquet.read_table(tmp_path / "parquet").to_pylist()
    assert sorted(row["row"] for row in rows) == list(range(1, 13))
    # Another sound is another data set, which overwrites nothing.
    with pytest.raises(ValueError, match="another plan"):
        chalumeau.dataset(PLAN.replace("0.5\nno", "0.4\nno"), tmp_path, rows_per_part=3)
    assert chalumeau.dataset(PLAN, tmp_path, rows_per_part=3).rendered == 0
    # Files of another size would stand beside those that are there.
    for other in (1, 25):
        with pytest.raises(ValueError, match=f"begun with rows_per_part=3, got rows_per_part={other}"):
            chalumeau.dataset(PLAN, tmp_path, rows_per_part=other)
    # Nor does one whose plan nobody knows.
    (tmp_path / datasets.PLAN).unlink()
    with pytest.raises(ValueError, match="another plan"):
        chalumeau.dataset(PLAN, tmp_path, rows_per_part=3)


def test_a_file_that_has_changed_is_rendered_anew_and_levels_stand_as_they_were_asked(tmp_path, root):
    midi = tmp_path / "piece.mid"
    melody = (root / "examples/melody.mid").read_bytes()
    plan = [{"midi": str(midi), "gain_db": -6}]
    midi.write_bytes(melody)
    assert [chalumeau.dataset(plan, tmp_path / "set").rendered for _ in range(2)] == [1, 0]
    # A byte behind its last track.
    midi.write_bytes(melody + b"\0")
    assert chalumeau.dataset(plan, tmp_path / "set").rendered == 1
    assert "-6" in (tmp_path / "set/manifest.csv").read_text().splitlines()[1].split(",")


def test_names_with_a_sharp_are_quoted(chalumeau_says, tmp_path):
    plan = {"same": {"seconds": 0.05, "no-noise": True}, "vary": {"written": ["C#4", "C4"]}}
    chalumeau.dataset(plan, tmp_path / "ours")
    (tmp_path / "plan.csv").write_text('seconds,no-noise,written\n0.05,true,"C#4"\n0.05,true,C4\n')
    chalumeau_says("batch", "plan.csv", "--into", "theirs", cwd=tmp_path)
    for folder in ("ours", "theirs"):
        lines = (tmp_path / folder / "manifest.csv").read_text().splitlines()
        assert '"C#4"' in lines[1] and '"' not in lines[2], lines
        # As pandas reads it with comment="#": no field outside of quotes has one.
        assert "#" not in re.sub(r'"[^"]*"', "", lines[1])
        assert table(tmp_path / folder)[0]["written"] == "C#4"


def test_a_table_of_something_else_is_kept(tmp_path):
    (tmp_path / "manifest.csv").write_text("subject,age\n")
    with pytest.raises(ValueError, match="manifest.csv that is not of a data set"):
        chalumeau.dataset([{"written": "C4", "seconds": 0.05}], tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["manifest.csv"]
    assert (tmp_path / "manifest.csv").read_text() == "subject,age\n"


def test_a_preset_that_has_changed_is_rendered_anew(tmp_path):
    script = "import chalumeau\nprint(chalumeau.dataset([{'written': 'C4', 'seconds': 0.05, 'preset': 'Mine'}], 'set').rendered)\n"
    presets = tmp_path / "chalumeau/presets"
    presets.mkdir(parents=True)

    def rendered(lip):
        (presets / "mine.toml").write_text(f'format = 1\nname = "Mine"\n\n[parameters]\nlip = {lip}\n')
        said = subprocess.run(
            [sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True,
            env={**os.environ, "CHALUMEAU_DATA_DIR": str(tmp_path)},
        )
        assert said.returncode == 0, said.stderr
        return said.stdout.strip()

    assert [rendered(0.9), rendered(0.9), rendered(1.1)] == ["1", "0", "1"]


def test_rooms_and_players_have_the_levels_of_the_command_line(chalumeau_says, tmp_path):
    plan = '[same]\nseconds = 0.3\nwritten = "C4"\n[vary]\nroom = [0, 0.5]\nplayers = [1, 2]\n'
    (tmp_path / "plan.toml").write_text(plan)
    chalumeau_says("batch", "plan.toml", "--into", "theirs", cwd=tmp_path)
    chalumeau.dataset(plan, tmp_path / "ours")
    for name in ("peak_dbfs", "rms_dbfs"):
        theirs, ours = ([row[name] for row in table(tmp_path / folder)] for folder in ("theirs", "ours"))
        assert theirs == ours and len(set(ours)) == 4


def test_a_mistake_before_the_first_file_leaves_the_folder_free(tmp_path):
    with pytest.raises(ValueError):
        chalumeau.dataset([{"written": "C1"}], tmp_path)
    assert chalumeau.dataset([{"written": "C4", "seconds": 0.1}], tmp_path).rendered == 1


def test_a_lost_file_is_told(tmp_path):
    with pytest.raises(RuntimeError, match="4 of 4 files are missing"):
        chalumeau.dataset(PLAN, tmp_path, map=lambda work, parts: [], rows_per_part=3)


def test_processes_make_the_same_rows(tmp_path):
    alone = chalumeau.dataset(PLAN, tmp_path / "alone", rows_per_part=4)
    both = chalumeau.dataset(PLAN, tmp_path / "both", rows_per_part=4, workers=2)
    assert alone.rendered == both.rendered == 12
    assert table(tmp_path / "alone") == table(tmp_path / "both")


def test_mistakes_are_told_before_anything_is_made(tmp_path):
    for plan, says in [
        ({"vary": {"writen": ["C4"]}}, "written"),
        ({"vary": {"written": ["C4", "H9"]}}, "row 2"),
        ({"same": {"seconds": 1}}, "vary"),
        ({"vary": {}}, "nothing varies"),
        ({"vary": {"zeta": [0.3, 3.0], "written": ["C4"]}}, "0.05..0.9"),
        ({"same": {"zeta": 0.3}, "vary": {"zeta": [0.2], "written": ["C4"]}}, "zeta stands twice"),
        # What only the whole row, or a file, tells.
        ({"vary": {"written": ["C4", "C1"]}}, "row 2 .*has no fingering"),
        ({"same": {"written": "C4"}, "vary": {"breath": ["0.5", "none.csv"]}}, "row 2 .*none.csv"),
        ([{"written": "C4"}, {"midi": "none.mid"}], "row 2 .*none.mid"),
        ({"same": {"written": "C4"}, "vary": {"gamma": [0.5, 2.9], "breath-full": [6]}}, "row 2 .*kPa"),
        ({"same": {"written": "C4"}, "vary": {"contrast": [2, 3]}}, "row 1 .*feel"),
        ([{"written": "C4", "channels": "two"}], "channels must be a whole number, got 'two'"),
        ([{"written": "C4", "channels": 1.9}], "channels must be a whole number"),
        ([{"written": "C4", "channels": 3}], "channels must be 1 or 2"),
        ([{"written": "C4", "rate": 44100.5}], "rate must be a whole number"),
        ([{"written": "C4", "bits": 16}], "bits is of files of chalumeau batch"),
        ([], "no rows"),
    ]:
        with pytest.raises(ValueError, match=says):
            chalumeau.dataset(plan, tmp_path / "set")
        assert not list(tmp_path.glob("set/*"))


def test_the_command_reports_its_throughput(tmp_path):
    (tmp_path / "plan.toml").write_text(PLAN)
    words = [sys.executable, "-m", "chalumeau.datasets", "plan.toml", "--into", "set", "--workers", "2", "--growth"]
    said = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
    assert said.returncode == 0, said.stderr
    first, *grown = said.stdout.splitlines()
    assert "12 rows, 12 rendered" in first and "of one core" in first
    assert [line.split()[0] for line in grown] == ["1", "2"] and "1.00 times" in grown[0]
    assert "Warning" not in said.stderr, said.stderr
    wrong = subprocess.run([*words[:3], "none.toml", "--into", "set"], cwd=tmp_path, capture_output=True, text=True)
    assert wrong.returncode == 2 and "none.toml" in wrong.stderr


def test_a_killed_worker_of_dask_loses_nothing(root, tmp_path):
    """The example with fewer rows; `python python/examples/dask_dataset.py` has 1,000."""
    pytest.importorskip("dask.distributed")
    words = [sys.executable, root / "python/examples/dask_dataset.py", "--rows", "120", "--into", "set"]
    said = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert said.returncode == 0, said.stderr
    assert "a worker was killed" in said.stdout and "120 rows, each once" in said.stdout, said.stdout
    assert len(table(tmp_path / "set")) == 120
