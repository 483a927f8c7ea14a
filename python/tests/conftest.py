"""Tests of the installed package."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def root() -> Path:
    """The repository."""
    return ROOT


@pytest.fixture(scope="session")
def program() -> str:
    """The command line of the same source: of the environment, or what was built last."""
    built = [ROOT / "target" / kind / "chalumeau" for kind in ("release", "debug")]
    named = os.environ.get("CHALUMEAU_PROGRAM") or next((str(path) for path in built if path.exists()), None)
    assert named and shutil.which(named), (
        "build the command line first: cargo build --release --no-default-features --features cli, "
        "or name it in CHALUMEAU_PROGRAM"
    )
    return named


@pytest.fixture(scope="session")
def chalumeau_says(program):
    """Runs a command; its standard output."""

    def run(*words: str, cwd: Path | None = None) -> str:
        done = subprocess.run([program, *words], cwd=cwd, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


@pytest.fixture(scope="session")
def table(chalumeau_says):
    """Runs a command that prints a table; its columns by name, as floats, or as texts where these are no numbers."""
    import csv

    def run(*words: str) -> dict[str, list[float]]:
        lines = [line for line in chalumeau_says(*words).splitlines() if not line.startswith("#")]
        rows = list(csv.DictReader(lines))

        def column(name: str) -> list:
            try:
                return [float(row[name]) for row in rows]
            except ValueError:
                return [row[name] for row in rows]

        return {name: column(name) for name in rows[0]}

    return run
