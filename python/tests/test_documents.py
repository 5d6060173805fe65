"""The notebooks and the guide run from top to bottom."""

from __future__ import annotations

import os
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from conftest import Run

PROJECT = Path(__file__).resolve().parent.parent
NOTEBOOKS = sorted((PROJECT / "notebooks").glob("*.ipynb"))
GUIDE = PROJECT.parent / "docs/src/guides/python.md"


def test_all_three_notebooks_are_there() -> None:
    assert [path.stem for path in NOTEBOOKS] == ["compare_parametrisations", "look_at_a_sequence", "own_estimator"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook(path: Path, tmp_path: Path, run: Run) -> None:
    with warnings.catch_warnings():
        # What the tools of notebooks say of each other is not ours.
        warnings.simplefilter("ignore")
        import nbformat
        from nbclient import NotebookClient

        notebook = nbformat.read(path, as_version=4)
        nbformat.validate(notebook)
        for cell in notebook.cells:
            assert not cell.get("outputs"), f"{path.name} is kept without outputs"
            assert cell.get("execution_count") is None
        # `os` is found as on a machine where it is installed.
        programs = str(Path(os.environ["OPEN_STRUCTURE_OS"]).parent)
        os.environ["PATH"] = os.pathsep.join([programs, os.environ["PATH"]])
        client = NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}})
        client.execute()
    shown = [output for cell in notebook.cells for output in cell.get("outputs", [])]
    assert any("image/png" in output.get("data", {}) for output in shown), "a notebook shows a figure"
    assert not [output for output in shown if output.output_type == "error"]


def test_the_guide_runs(tmp_path: Path, run: Run) -> None:
    """Every block of Python, one after the other, in one program; those of `console` but `pip` before them."""
    blocks: list[str] = []
    language = None
    for line in GUIDE.read_text().splitlines(keepends=True):
        if line.startswith("```"):
            if language is None:
                language = line.strip("`\n")
                blocks.append("")
            else:
                commands = [line[5:] for line in blocks[-1].splitlines() if line.startswith("$ os ")]
                for command in commands if language == "console" else ():
                    run(*command.split(), cwd=tmp_path)
                if language != "python":
                    blocks.pop()
                language = None
        elif language is not None:
            blocks[-1] += line
    assert len(blocks) >= 5
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", "\n".join(blocks)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
