"""The stubs say what the native half has, and the package is typed throughout."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import open_structure

PROJECT = Path(__file__).resolve().parent.parent


def test_the_stubs_are_those_of_the_native_half() -> None:
    command = [sys.executable, "-m", "mypy.stubtest", "open_structure._native"]
    command += ["--mypy-config-file", str(PROJECT / "pyproject.toml")]
    done = subprocess.run(command, cwd=PROJECT / "tests", capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_package_is_typed_throughout() -> None:
    command = [sys.executable, "-m", "mypy", "--config-file", PROJECT / "pyproject.toml", "--package", "open_structure"]
    done = subprocess.run(command, cwd=PROJECT / "tests", capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_everything_public_has_its_sentence() -> None:
    for name in open_structure.__all__:
        found = getattr(open_structure, name)
        if name.startswith("__"):
            continue
        assert (found.__doc__ or "").strip(), name
        if isinstance(found, type) and found.__module__ == "open_structure" and not issubclass(found, Exception):
            for member, value in vars(found).items():
                assert member.startswith("__") or (value.__doc__ or "").strip(), f"{name}.{member}"
