"""What the tests share: a small sequence, and the program `os` to compare with."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import open_structure
import pytest

Run = Callable[..., str]

@pytest.fixture(scope="session")
def run() -> Run:
    """Runs `os` with arguments; gives what it prints."""
    program = os.environ.get("OPEN_STRUCTURE_OS")
    if program is None:
        pytest.fail("OPEN_STRUCTURE_OS does not name the program `os`; the tests are run by `cargo test -p open-structure-python`")

    def call(*arguments: object, cwd: Path | None = None) -> str:
        command = [program, *map(str, arguments)]
        done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
        assert done.returncode in (0, 3), f"{command}: {done.stderr}"
        return done.stdout

    return call


@pytest.fixture(scope="session")
def simulated() -> open_structure.Sequence:
    """The smallest sequence of the paper: 100 frames with noisy measurements."""
    return open_structure.simulate("sphere2")


@pytest.fixture(scope="session")
def folder(simulated: open_structure.Sequence, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same as a Parquet folder."""
    path = tmp_path_factory.mktemp("stored") / "sphere2"
    simulated.write(path)
    return path


@pytest.fixture(scope="session")
def mcap(simulated: open_structure.Sequence, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same as an MCAP file."""
    path = tmp_path_factory.mktemp("stored") / "sphere2.mcap"
    simulated.write(path)
    return path


@pytest.fixture(scope="session")
def tracked(simulated: open_structure.Sequence) -> open_structure.Sequence:
    """With the path of its camera and a graph about it."""
    return open_structure.graph(open_structure.track(simulated))
