"""The notebooks run, and what they claim holds: each ends in assertions."""

import os
from pathlib import Path

import pytest

NOTEBOOKS = sorted(Path(__file__).resolve().parents[1].glob("notebooks/*.ipynb"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path, root, monkeypatch):
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    monkeypatch.setenv("CHALUMEAU_ROOT", os.fspath(root))
    monkeypatch.setenv("MPLBACKEND", "agg")
    notebook = nbformat.read(path, as_version=4)
    code = [cell["source"] for cell in notebook.cells if cell["cell_type"] == "code"]
    assert any("assert " in source for source in code), "a notebook shows a claim, and fails where it does not hold"
    # Pictures and numbers are made by whoever runs it.
    assert not any(cell.get("outputs") for cell in notebook.cells)
    nbclient.NotebookClient(notebook, timeout=120, kernel_name="python3").execute()


def test_there_are_notebooks():
    assert len(NOTEBOOKS) == 5
