"""The programs that are compared: how each is built, configured and run."""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path

HERE = Path(__file__).resolve().parent.parent
ROOT = HERE.parent.parent
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))

# The packages of Debian that Ceres' harness is built with.
PACKAGES = ["libceres-dev", "cmake", "g++", "make"]
# Seconds past its limit after which a program is ended: those of an iteration, and of reading its input.
GRACE_SECONDS = 20.0
OWN_GRACE_SECONDS = 100.0


class Missing(Exception):
    """Why a program is not there."""


@dataclass
class Run:
    """What a program said of one run; times are seconds since it began to solve."""

    initial_cost: float
    final_cost: float
    seconds: float
    ending: str
    iterations: list = field(default_factory=list)  # [seconds, cost], costs falling
    steps: int = 0
    version: str = ""

    def seconds_to(self, target):
        """When the cost was at most the target; None where it never was."""
        return next((seconds for seconds, cost in self.iterations if cost <= target), None)


@dataclass(frozen=True)
class Peer:
    """A solver that is compared with ours."""

    name: str
    command: tuple
    # Configurations by kind of problem: name and arguments.
    configurations: dict

    def configurations_of(self, problem):
        """Those for a problem, the likeliest first; none where it cannot be posed."""
        return self.configurations.get((problem.kind, problem.method), self.configurations.get((problem.kind, None), []))

    def run(self, problem, configuration, limits, target=None):
        """Runs once; a reason instead of a `Run` where it did not get that far."""
        _, arguments = configuration
        command = [*self.command, problem.kind, problem.path, *arguments]
        command += ["--threads", limits.threads, "--iterations", limits.iterations, "--seconds", limits.seconds]
        if target is not None:
            command += ["--target", repr(target)]
        told = run_json(command, limits.seconds + GRACE_SECONDS)
        if isinstance(told, str):
            return told
        return Run(
            told["initial_cost"],
            told["final_cost"],
            told["seconds"],
            told["ending"],
            told["iterations"],
            len(told["iterations"]) - 1,
            told["version"],
        )


@dataclass(frozen=True)
class Limits:
    """How long and on how many threads."""

    threads: int
    iterations: int
    seconds: float


def run_json(command, seconds):
    """The JSON that a program prints last, or the reason why there is none."""
    try:
        done = subprocess.run(
            [str(word) for word in command], capture_output=True, text=True, timeout=seconds, check=False
        )
    except subprocess.TimeoutExpired:
        return f"no end within {seconds:.0f} s"
    if done.returncode != 0 or not done.stdout.strip():
        # A panic ends with a note on backtraces.
        words = [line for line in done.stderr.strip().splitlines() if not line.startswith("note:")]
        return words[-1] if words else f"ended with status {done.returncode}"
    return json.loads(done.stdout.strip().splitlines()[-1])


def built(command, what, **options):
    """Runs a step of building; complains with its last words."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, **options)
    if done.returncode != 0:
        words = (done.stderr.strip() or done.stdout.strip()).splitlines()
        raise Missing(f"{what}: {words[-1] if words else done.returncode}")


class Own:
    """Our own programs."""

    def __init__(self):
        command = ["cargo", "build", "--release", "--locked", "--bin", "os", "--example", "peer_adjust", "--example", "peer_export"]
        subprocess.run(command, cwd=ROOT, check=True)
        self.os = TARGET / "release" / "os"
        self.export = TARGET / "release" / "examples" / "peer_export"
        self.adjust = TARGET / "release" / "examples" / "peer_adjust"

    def convert(self):
        """The program that reads the first text release; it needs OpenCV, and is built when first asked for."""
        path = TARGET / "release" / "os-convert"
        if not path.is_file():
            command = ["cargo", "build", "--release", "--locked", "--package", "open-structure-converters"]
            subprocess.run(command, cwd=ROOT, check=True)
        return path

    def run(self, path, method, limits, target=None):
        """Adjusts once; a reason instead of a `Run` where it did not get that far."""
        goal = "-inf" if target is None else repr(target)
        # The whole adjustment is run, whose end the limit of a peer's run does not know.
        told = run_json([self.adjust, path, method, goal, limits.threads], 4.0 * limits.seconds + OWN_GRACE_SECONDS)
        if isinstance(told, str):
            return told
        reached = told["seconds_to_target"]
        iterations = [] if reached is None else [[reached, target]]
        return Run(told["initial_cost"], told["final_cost"], told["seconds"], "", iterations, told["steps"])


def ceres(work):
    """Ceres of the system, its packages installed where we may."""
    wanted = [name for name in ("cmake", "g++", "make") if shutil.which(name) is None]
    if not list(Path("/usr").glob("lib/*/cmake/Ceres/CeresConfig.cmake")) and not list(
        Path("/usr/local").glob("lib*/cmake/Ceres/CeresConfig.cmake")
    ):
        wanted.append("libceres-dev")
    if wanted:
        install = ["apt-get", "install", "--yes", "--no-install-recommends", *PACKAGES]
        if shutil.which("apt-get") is None or os.geteuid() != 0:
            raise Missing(f"{' and '.join(wanted)} not found; install them: sudo {' '.join(install)}")
        built(["apt-get", "update"], "apt-get update")
        built(install, "apt-get install")
    folder = work / "ceres"
    built(["cmake", "-S", HERE / "ceres", "-B", folder, "-DCMAKE_BUILD_TYPE=Release"], "cmake")
    built(["cmake", "--build", folder, "--parallel", "2"], "building the harness")
    built([folder / "ceres_peer_jacobians"], "its derivatives")
    schur = [
        (f"{solver}, {eliminate} eliminated", ["--solver", solver, "--eliminate", eliminate])
        for solver in ("dense-schur", "sparse-schur", "iterative-schur")
        for eliminate in ("landmarks", "poses")
    ]
    with_lines = [("sparse-schur, points eliminated", ["--solver", "sparse-schur", "--eliminate", "points"])]
    # Thousands of points seen from a few places leave a reduced system of points that is dense, and too large for memory.
    of_few_poses = [entry for entry in schur if "poses" not in entry[1] or "iterative-schur" in entry[1]]
    normal = [("normal-cholesky", ["--solver", "normal-cholesky"])]
    configurations = {
        ("graph", "point"): schur,
        ("graph", "point-line"): schur + with_lines,
        ("bal", None): of_few_poses,
        ("pose-graph", None): normal,
    }
    return Peer("Ceres", (folder / "ceres_peer",), configurations)


def gtsam(work):
    """GTSAM from PyPI, in a virtual environment of its own."""
    folder = work / "venv"
    python = folder / "bin" / "python"
    if not python.is_file():
        built([sys.executable, "-m", "venv", folder], "venv")
    if subprocess.run([python, "-c", "import gtsam"], capture_output=True, check=False).returncode != 0:
        built([python, "-m", "pip", "install", "--quiet", "gtsam>=4.2,<5"], "pip install gtsam")
    colamd, metis = ((order, ["--ordering", order]) for order in ("colamd", "metis"))
    # METIS pays on pose graphs alone.
    configurations = {("graph", "point"): [colamd], ("bal", None): [colamd], ("pose-graph", None): [colamd, metis]}
    return Peer("GTSAM", (python, HERE / "gtsam" / "adjust.py"), configurations)


def apex(work):
    """apex-solver from crates.io, a crate of its own."""
    folder = work / "rust-peer"
    command = ["cargo", "build", "--release", "--locked", "--manifest-path", HERE / "rust-peer" / "Cargo.toml"]
    built(command, "cargo build", env={**os.environ, "CARGO_TARGET_DIR": str(folder)})
    solvers = [(solver, ["--solver", solver]) for solver in ("explicit-sparse", "implicit", "cholesky")]
    # Its implicit and explicit Schur complements take several times as long as Cholesky on graphs of many frames.
    configurations = {("graph", "point"): solvers[2:], ("bal", None): solvers[:2], ("pose-graph", None): solvers[2:]}
    return Peer("apex-solver", (folder / "release" / "rust-peer",), configurations)


BUILDERS = {"Ceres": ceres, "GTSAM": gtsam, "apex-solver": apex}


def peers(work, say):
    """Those that are there, by name, and why the others are not."""
    found, missing = {}, {}
    for name, build in BUILDERS.items():
        say(f"{name}: building")
        try:
            found[name] = build(work)
        except (Missing, OSError) as cause:
            missing[name] = str(cause)
            say(f"{name}: not there, because {cause}")
    return found, missing
