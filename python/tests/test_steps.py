"""The functions give the tables that the commands give, with the same options."""

from __future__ import annotations

import json
import math
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import open_structure
import pytest
from conftest import Run

Sequence = open_structure.Sequence


def digests(path: Path) -> dict[str, tuple[int, str]]:
    """Rows and digest of each table that has rows, as the manifest of a folder says."""
    tables = json.loads((path / "sequence.json").read_text())["tables"]
    return {table["table"]: (table["rows"], table["sha256"]) for table in tables if table["rows"] > 0}


def hold(ours: Sequence, theirs: Path, tmp_path: Path) -> None:
    """Whether a sequence has the tables and the manifest of one that a command wrote."""
    written = tmp_path / "ours"
    ours.write(written)
    assert digests(written) == digests(theirs)
    manifests = [json.loads((path / "sequence.json").read_text()) for path in (written, theirs)]
    for manifest in manifests:
        del manifest["tables"]
    assert manifests[0] == manifests[1]


def flags(options: dict[str, Any]) -> list[str]:
    """Options of a function as options of the command."""
    words: list[str] = []
    for name, value in options.items():
        flag = "--" + name.replace("_", "-")
        if value is True:
            words += [flag]
        elif isinstance(value, dict):
            words += [part for key, number in value.items() for part in (flag, f"{key}={number}")]
        elif isinstance(value, list | tuple) and name == "first_pose":
            words += [flag, ",".join(map(str, value))]
        elif isinstance(value, list | tuple):
            words += [part for item in value for part in (flag, str(item))]
        else:
            words += [flag, str(value)]
    return words


def test_simulate(tmp_path: Path, run: Run) -> None:
    assert open_structure.recipes()[-1] == "sphere2"
    run("simulate", "sphere2", "-o", tmp_path / "theirs", "--seed", "9")
    made = open_structure.simulate("sphere2", seed=9)
    hold(made, tmp_path / "theirs", tmp_path)
    assert made.summary["frames"] == 100
    recipe = json.loads(made.manifest["generator"]["parameters"]["recipe"])
    again = open_structure.simulate(recipe)
    assert again["point_measurements"].to_pyarrow().equals(made["point_measurements"].to_pyarrow())


def test_recipes_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(open_structure.OptionError, match="comes from images"):
        open_structure.simulate("office")
    with pytest.raises(open_structure.OptionError):
        open_structure.simulate("no-such-recipe")
    with pytest.raises(FileNotFoundError):
        open_structure.simulate(tmp_path / "none.toml")
    with pytest.raises(open_structure.OptionError, match="recipe: unknown field"):
        open_structure.simulate({"name": "x", "colour": "red"})
    (tmp_path / "wrong.toml").write_text("name = 3")
    with pytest.raises(open_structure.OptionError, match=r"wrong\.toml"):
        open_structure.simulate(tmp_path / "wrong.toml")


@pytest.mark.parametrize(
    "options",
    [
        {"noise": "gaussian", "seed": 7, "set": {"sigma_px": 0.5}},
        {"noise": "kinect-disparity", "quantise": 1, "outliers": 0.05, "missed": 0.1, "drop_outside": True},
        {"noise": "first-release", "keep_depth": True},
        {"noise": "paper", "complete_depths": True, "seed": 2, "name": "sphere2-paper"},
    ],
)
def test_measure(options: dict[str, Any], folder: Path, tmp_path: Path, run: Run) -> None:
    run("measure", folder, "-o", tmp_path / "theirs", *flags(options))
    hold(open_structure.measure(folder, **options), tmp_path / "theirs", tmp_path)


def test_measuring_leaves_estimates_out(tracked: Sequence, tmp_path: Path, run: Run) -> None:
    tracked.write(tmp_path / "tracked")
    for name, options in (("dropped", {}), ("kept", {"keep_estimates": True})):
        made = open_structure.measure(tracked, "gaussian", **options)
        assert bool(made.estimates) == (name == "kept")
        run("measure", tmp_path / "tracked", "-o", tmp_path / name, "--noise", "gaussian", *flags(options))
        (tmp_path / f"of-{name}").mkdir()
        hold(made, tmp_path / name, tmp_path / f"of-{name}")


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"method": "frame-to-frame", "classic": True, "name": "plain"},
        {"sensor": "stereo", "baseline": 0.12, "seed": 5},
        {"sensor": "monocular", "first_pose": [0, 0, 0, 0, 0, 0, 1]},
    ],
)
def test_track(options: dict[str, Any], folder: Path, tmp_path: Path, run: Run) -> None:
    said = json.loads(run("track", folder, "-o", tmp_path / "theirs", "--json", *flags(options)))
    made = open_structure.track(folder, **options)
    hold(made, tmp_path / "theirs", tmp_path)
    assert made.summary | {"seconds": 0} == said | {"seconds": 0}
    assert made.estimates == [made.summary["estimate"]]


@pytest.mark.parametrize(
    "options",
    [
        {"min_views": 3, "name": "mine"},
        {"key_frames": True, "most_shared": 0.9, "longest_gap": 5},
        {"kind": "pose-graph", "loop_gap": 20, "loop_shared": 5, "seed": 4},
        {"kind": "pose-graph", "no_loops": True},
    ],
)
def test_graph(options: dict[str, Any], tracked: Sequence, tmp_path: Path, run: Run) -> None:
    tracked.write(tmp_path / "tracked")
    # The estimate's own name is taken by the graph that is there already.
    options = {"replace": True} | options
    said = json.loads(run("graph", tmp_path / "tracked", "-o", tmp_path / "theirs", "--json", *flags(options)))
    made = open_structure.graph(tracked, **options)
    hold(made, tmp_path / "theirs", tmp_path)
    assert made.summary == said
    assert said["graph"] in made.graphs


@pytest.mark.parametrize(
    "options",
    [
        {"method": "point", "max_iterations": 3, "loss": "huber:2", "sigma_px": 1.5},
        {"lines": "endpoints", "points": "inverse-depth", "optimiser": "dogleg", "max_iterations": 4, "fix": [0, 5]},
        {"method": "structural", "soft": 0.5, "no_motion": True, "max_iterations": 4, "covariance": True, "threads": 1},
        {"method": "structural", "no_groups": True, "eliminate": "landmarks", "factorise": "sparse", "max_iterations": 2},
        {"name": "mine", "min_views": 4, "tolerance": 1e-3, "graph": "map-to-frame", "lines": "plucker-cayley"},
    ],
)
def test_adjust(options: dict[str, Any], tracked: Sequence, tmp_path: Path, run: Run) -> None:
    tracked.write(tmp_path / "graph")
    said = json.loads(run("adjust", tmp_path / "graph", "-o", tmp_path / "theirs", "--json", *flags(options)))
    made = open_structure.adjust(tracked, **options)
    hold(made, tmp_path / "theirs", tmp_path)
    assert made.summary | {"seconds": 0} == said | {"seconds": 0}


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"align": "sim3", "relation": ["trans", "full", "trans"], "align_first": 50},
        {"align": "none", "rpe_delta": 45.0, "rpe_unit": "d", "pairs_from_reference": True},
        {"align": "origin", "rpe_delta": 3.0, "all_pairs": True},
        {"estimate": "map-to-frame", "reference": "point-ba", "relation": "angle-deg"},
    ],
)
def test_evaluate(options: dict[str, Any], tracked: Sequence, tmp_path: Path, run: Run) -> None:
    path = tmp_path / "sphere2"
    adjusted = open_structure.adjust(tracked, method="point", max_iterations=3)
    adjusted.write(path)
    errors = tmp_path / "errors.parquet"
    printed = run("evaluate", path, "--json", "--per-frame", errors, *flags(options))
    found = open_structure.evaluate(adjusted, **options).to_pyarrow().to_pylist()
    assert found == [json.loads(line) for line in printed.splitlines()]
    frames = open_structure.evaluate_frames(path, **{name: options[name] for name in options if name != "relation"})
    plain = open_structure.Sequence.open(path)
    assert plain.estimates == adjusted.estimates
    import pyarrow.parquet as pq

    assert repr(frames.to_pyarrow().to_pylist()) == repr(pq.read_table(errors).to_pylist())


def test_what_cannot_be_compared_is_told(tracked: Sequence) -> None:
    with pytest.warns(UserWarning, match=r"map-to-frame: expected pairs of poses 0.001 m apart"):
        found = open_structure.evaluate(tracked, rpe_delta=1e-3, rpe_unit="m", all_pairs=True).to_pyarrow().to_pylist()
    assert found[0]["ape_translation_rmse_m"] > 0.0
    ids, matrices = tracked.poses("map-to-frame")
    short = tracked.with_estimate("short", (ids[:1], matrices[:1]))
    with pytest.warns(UserWarning), pytest.raises(open_structure.StepError):
        open_structure.evaluate(short, estimate="short")


def test_options_that_have_no_meaning(tracked: Sequence, simulated: Sequence) -> None:
    wrong: list[tuple[Callable[..., Any], dict[str, Any], str]] = [
        (open_structure.track, {"method": "sideways"}, "method: expected one of `frame-to-frame`, `map-to-frame`, found `sideways`"),
        (open_structure.track, {"baseline": 0.1}, "baseline goes with sensor `stereo`"),
        (open_structure.track, {"sensor": "stereo"}, "takes a baseline"),
        (open_structure.track, {"first_pose": [0, 0, 0, 0, 0, 0, 0]}, "first_pose"),
        (open_structure.track, {}, "an estimate `map-to-frame` already"),
        (open_structure.track, {"name": ""}, "is empty"),
        (open_structure.track, {"name": "truth"}, "stands for the true poses"),
        (open_structure.track, {"name": "line\nbreak"}, "has a control character"),
        (open_structure.track, {"first_pose": [1, 2, 3]}, "first_pose: expected seven numbers or a matrix (4, 4)"),
        (open_structure.evaluate, {"align_first": 0}, "align_first: expected a whole number over zero"),
        (open_structure.evaluate, {"estimate": []}, "estimate: expected a name, found none"),
        (open_structure.graph, {"most_shared": 0.5}, "go with key_frames"),
        (open_structure.graph, {"min_views": 0}, "min_views: expected a whole number over zero"),
        (open_structure.graph, {"estimate": "none"}, "expected an estimate with a trajectory, none, found map-to-frame"),
        (open_structure.adjust, {"soft": 0.5}, "soft goes with method `structural`"),
        (open_structure.adjust, {"graph": "none"}, "expected the graph none, found map-to-frame"),
        (open_structure.adjust, {"loss": "soup"}, "loss: "),
        (open_structure.adjust, {"sigma_px": -1.0}, "sigma_px: expected a number over zero, found -1"),
        (open_structure.adjust, {"tolerance": math.nan}, "tolerance"),
        (open_structure.adjust, {"threads": 0}, "threads"),
        (open_structure.evaluate, {"align": "by-hand"}, "align: expected one of `none`"),
        (open_structure.evaluate, {"rpe_delta": 0.5}, "rpe_delta: expected a whole number of frames"),
        (open_structure.evaluate, {"rpe_unit": "parsec"}, "rpe_unit: expected one of `f`"),
        (open_structure.evaluate, {"estimate": "none"}, "expected an estimate none, found map-to-frame"),
    ]
    for function, options, message in wrong:
        with pytest.raises(open_structure.OptionError) as caught:
            function(tracked, **options)
        assert message in str(caught.value), f"{function.__name__}({options}): {caught.value}"
    for noise, options, message in (
        ("salt", {}, "noise: expected one of `none`"),
        ("gaussian", {"set": {"colour": 1.0}}, "colour"),
        ("gaussian", {"outliers": 2.0}, "outlier"),
        ("gaussian", {"complete_depths": True, "missed": 0.5}, "missed does not go with complete_depths"),
    ):
        with pytest.raises(open_structure.OptionError, match=message):
            open_structure.measure(simulated, noise, **options)
    with pytest.raises(open_structure.StepError, match="no factor graph"):
        open_structure.adjust(simulated)
    with pytest.raises(open_structure.StepError, match="no estimate"):
        open_structure.graph(simulated)
    with pytest.raises(OverflowError):
        open_structure.track(tracked, seed=-1)
    with pytest.raises(TypeError):
        open_structure.track(tracked, seed="one")


def test_forked_processes_work_and_read_what_their_parent_opened(tracked: Sequence, tmp_path: Path) -> None:
    """Threads are not forked along, and a file's place is shared: as loaders of PyTorch do on Linux."""
    tracked.write(tmp_path / "folder")
    tracked.write(tmp_path / "file.mcap")
    script = """
import hashlib, multiprocessing, sys, open_structure
opened = [open_structure.Sequence.open(name) for name in ("folder", "file.mcap")]
first = open_structure.adjust(opened[0], method="point", max_iterations=2)

def read(sequence):
    taken = [frame.point_measurements["u"].tobytes() for frame in sequence.frames]
    taken += [sequence.frames[place].point_measurements["v"].tobytes() for place in range(len(sequence))]
    taken += [sequence[name].to_pyarrow().to_pandas().to_json().encode() for name in ("frames", "map_points", "trajectories")]
    return hashlib.sha256(b"".join(taken)).hexdigest()

def work(place):
    again = open_structure.adjust(opened[place % 2], method="point", max_iterations=2)
    assert again["map_points"].to_pyarrow().equals(first["map_points"].to_pyarrow())
    return [read(sequence) for sequence in opened]

expected = [read(sequence) for sequence in opened]
with multiprocessing.get_context("fork").Pool(3) as processes:
    found = processes.map_async(work, range(6), 1).get(timeout=90)
assert found == [expected] * 6, found
"""
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_other_threads_run_and_an_interrupt_ends_the_work(tmp_path: Path) -> None:
    """Ctrl-C in the middle of a long simulation raises KeyboardInterrupt soon."""
    script = """
import threading, time, open_structure
ticks = []
def tick():
    while True:
        ticks.append(time.monotonic())
        time.sleep(0.01)
threading.Thread(target=tick, daemon=True).start()
print("begun", flush=True)
try:
    while True:
        open_structure.simulate("corridor2")
except KeyboardInterrupt:
    print("interrupted", len(ticks) > 20, flush=True)
"""
    process = subprocess.Popen(
        [sys.executable, "-c", script],
        stdout=subprocess.PIPE,
        text=True,
        # Who runs these tests behind a shell's back ignores interrupts, and so would this program.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "begun\n"
        time.sleep(1.5)
        process.send_signal(signal.SIGINT)
        out, _ = process.communicate(timeout=60)
    finally:
        process.kill()
    assert out == "interrupted True\n"
    assert process.returncode == 0
