"""The package itself: types, documentation, examples that run."""

import ast
import copy
import doctest
import importlib
import inspect
import pickle
import subprocess
import sys
from pathlib import Path

import chalumeau
import numpy as np
import pytest
from chalumeau import _native

HERE = Path(chalumeau.__file__).parent
MODULES = ["chalumeau", "chalumeau.arguments", "chalumeau.playing", "chalumeau.acoustics", "chalumeau.measuring", "chalumeau.datasets"]


@pytest.mark.parametrize("name", MODULES)
def test_examples_of_the_documentation_run(name):
    module = importlib.import_module(name)
    results = doctest.testmod(module, optionflags=doctest.ELLIPSIS)
    assert results.attempted > 0 and results.failed == 0


def test_everything_public_is_documented_and_has_an_example():
    for name in set(chalumeau.__all__) - {"__version__", "Instrument", "Note"}:
        thing = getattr(chalumeau, name)
        assert ">>>" in inspect.getdoc(thing), name


def test_everything_public_has_types():
    assert (HERE / "py.typed").exists()
    for name in set(chalumeau.__all__) - {"__version__", "Instrument", "Note", "Clarinet"}:
        signature = inspect.signature(getattr(chalumeau, name))
        untyped = [one for one in signature.parameters.values() if one.annotation is one.empty]
        assert not untyped and signature.return_annotation is not signature.empty, name


def test_the_types_of_the_compiled_part_name_all_that_is_there():
    stub = ast.parse((HERE / "_native.pyi").read_text())
    named = {node.name for node in stub.body if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
    there = {name for name in dir(_native) if not name.startswith("__")}
    assert named == there - {"_native"}
    for node in (node for node in stub.body if isinstance(node, ast.ClassDef)):
        members = {member.name for member in node.body if isinstance(member, ast.FunctionDef)}
        real = {name for name, value in vars(getattr(_native, node.name)).items() if not name.startswith("__")}
        assert members - {"__new__", "__eq__", "__hash__"} == real


def test_instruments_travel_between_processes():
    bass = chalumeau.instrument("bass")
    assert pickle.loads(pickle.dumps(bass)) == bass
    # A length that has more digits than a reader wants to see.
    text = bass.to_toml().replace("reed_volume_mm3 = ", "reed_volume_mm3 = 1", 1)
    first = next(line for line in text.splitlines() if line.startswith("chimney_mm = "))
    fine = chalumeau.instrument(text.replace(first, f"{first}123456789", 1))
    for again in (pickle.loads(pickle.dumps(fine)), copy.deepcopy(fine)):
        assert again == fine and hash(again) == hash(fine)
    assert [pickle.loads(pickle.dumps(chalumeau.instrument(id))) == chalumeau.instrument(id) for id in chalumeau.instruments()] == [True] * 5


def test_an_instrument_is_taken_from_tables_with_numbers_of_numpy():
    tomllib = pytest.importorskip("tomllib")
    tables = tomllib.loads(chalumeau.instrument("b-flat").to_toml())
    tables["reed_volume_mm3"] = np.float64(tables["reed_volume_mm3"])
    tables["transposition_semitones"] = np.int64(tables["transposition_semitones"])
    tables["hole"][0]["x_mm"] = np.array(tables["hole"][0]["x_mm"])
    tables["hole"][0]["description"] = None
    assert chalumeau.instrument(tables).length_m == chalumeau.instrument("b-flat").length_m


def test_names_of_hosts_flags_and_ids_set_the_same():
    by = [
        chalumeau.render(written="C4", seconds=0.05, settings={name: value})
        for name, value in [("Reed strength", "3.5"), ("stren", 3.5), ("strength", 3.5)]
    ]
    assert all((one == by[0]).all() for one in by)
    assert (by[0] != chalumeau.render(written="C4", seconds=0.05)).any()


def test_types_agree(root, tmp_path):
    pytest.importorskip("mypy")
    words = [sys.executable, "-m", "mypy", "--config-file", root / "python/pyproject.toml", "--no-incremental", "-p", "chalumeau"]
    said = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
    assert said.returncode == 0, said.stdout


def test_dir_and_help_have_every_function():
    import pydoc

    assert set(chalumeau.__all__) <= set(dir(chalumeau)) and "__getattr__" not in dir(chalumeau)
    assert "dataset(" in pydoc.render_doc(chalumeau, renderer=pydoc.plaintext)
