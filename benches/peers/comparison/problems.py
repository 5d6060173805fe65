"""What is adjusted: graphs of sequences, problems of Bundle Adjustment in the Large, pose graphs."""

import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Problem:
    """One problem, as every program is given it."""

    group: str  # heading of the table
    name: str
    kind: str  # of the peers: `graph`, `bal` or `pose-graph`
    path: Path  # what the peers read
    own_path: Path  # what ours reads
    method: str  # of ours


@dataclass(frozen=True)
class Sequence:
    """A sequence whose graph is adjusted, and whose time for an iteration is taken."""

    name: str
    path: Path


BAL = ["problem-49-7776-pre.txt", "problem-16-22106-pre.txt"]
POSE_GRAPHS = ["sphere2500.g2o", "parking-garage.g2o", "smallGrid3D.g2o", "intel.g2o"]
METHODS = {"point": "Point-BA", "point-line": "PointLine-BA"}


def say(words):
    """Words about the run."""
    print(words, file=sys.stderr, flush=True)


def sequences_of_release(data, programs, folder, wanted):
    """The sequences of the first text release under a folder, converted where they are not yet."""
    found = []
    for source in sorted(path for path in (data / "open-structure").iterdir() if path.is_dir()):
        if not wanted(source.name):
            continue
        # A folder of several versions becomes several sequences.
        is_ours = re.compile(re.escape(source.name) + r"(_v\d+)?(\.mcap)?$").match
        converted = [path for path in sorted(folder.iterdir()) if is_ours(path.name)]
        if not converted:
            say(f"{source.name}: converting")
            command = [programs.convert(), "open-structure", source, "-o", folder / source.name]
            # 3: done, with remarks on what could not be used.
            if subprocess.run(command, stdout=subprocess.DEVNULL, check=False).returncode not in (0, 3):
                say(f"{source.name}: cannot be converted; left out")
            converted = [path for path in sorted(folder.iterdir()) if is_ours(path.name)]
        found += [Sequence(path.name.removesuffix(".mcap"), path) for path in converted]
    return found


def simulated_sequence(recipe, programs, folder):
    """A simulated sequence with the graph of its tracked estimate; the recipe is a file or a name."""
    name = Path(recipe).stem
    graph = folder / f"{name}-simulated"
    if not graph.exists():
        say(f"{name}: simulating and tracking")
        steps = [folder / f"{name}-{step}" for step in ("scene", "measured", "tracked")]
        scene, measured, tracked = steps
        for arguments in (
            ["simulate", recipe, "-o", scene],
            ["measure", scene, "-o", measured, "--noise", "first-release", "--seed", "1"],
            ["track", measured, "-o", tracked],
            ["graph", tracked, "-o", graph, "--estimate", "map-to-frame"],
        ):
            done = subprocess.run([programs.os, *arguments, "--force"], stdout=subprocess.DEVNULL, check=False)
            # 3: done, with findings, as of frames that were predicted.
            if done.returncode not in (0, 3):
                raise RuntimeError(f"os {arguments[0]} ended with status {done.returncode}")
    return Sequence(graph.name, graph)


def of_sequences(sequences, programs, folder):
    """Point-BA and PointLine-BA of sequences, their graphs written for the peers."""
    problems = []
    for method, group in METHODS.items():
        for sequence in sequences:
            path = folder / f"{sequence.name}.{method}.txt"
            command = [programs.export, sequence.path, method, path]
            written = subprocess.run(command, capture_output=True, text=True, check=False)
            if written.returncode != 0:
                say(f"{sequence.name}, {group}: {written.stderr.strip().splitlines()[-1]}; left out")
                continue
            problems.append(Problem(group, sequence.name, "graph", path, sequence.path, method))
    return problems


def of_files(data):
    """Problems of Bundle Adjustment in the Large and pose graphs under a folder."""
    problems = []
    for name in BAL:
        path = data / "bal" / name
        if path.is_file():
            label = name.removeprefix("problem-").removesuffix("-pre.txt")
            problems.append(Problem("BAL", label, "bal", path, path, "bal"))
    for name in POSE_GRAPHS:
        path = data / "pose-graphs" / name
        if path.is_file():
            label = name.removesuffix(".g2o")
            problems.append(Problem("Pose graph", label, "pose-graph", path, path, "pose-graph"))
    return problems
