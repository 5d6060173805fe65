"""Asks the checkers of MCAP files, pymcap-cli and Rerun, what they think of ours."""

import json
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

TOOLS = Path(sys.executable).parent


def run(*command: str | Path) -> str:
    done = subprocess.run([TOOLS / command[0], *command[1:]], capture_output=True, text=True, check=False)
    said = done.stdout + done.stderr
    assert done.returncode == 0, f"{command}: {said}"
    return said


def doctor(path: Path) -> str:
    report = [json.loads(line) for line in run("pymcap-cli", "doctor", path, "--format", "jsonl").splitlines()]
    assert report, "the doctor says something"
    severities = Counter(entry.get("severity") for entry in report if entry.get("severity"))
    bad = [entry for entry in report if entry.get("severity") in ("error", "warning")]
    assert not bad, bad
    return f"doctor {dict(severities) or 'found nothing'}"


def rerun(path: Path) -> str:
    run("rerun", "analytics", "disable")
    checked = run("rerun", "mcap", "check", path)
    with tempfile.TemporaryDirectory() as folder:
        recording = Path(folder) / "sample.rrd"
        run("rerun", "mcap", "convert", path, "-o", recording)
        run("rerun", "rrd", "verify", recording)
        shown = run("rerun", "rrd", "print", recording)
    # The viewer understands what moves and what stands, not only that there are bytes.
    for archetype in ("Transform3D", "Pinhole", "Points3D", "InstancePoses3D"):
        assert archetype in shown, f"{archetype} is not in the recording"
    return f"rerun {checked.strip().splitlines()[-1]}"


if __name__ == "__main__":
    print(doctor(Path(sys.argv[1])), "·", rerun(Path(sys.argv[1])))
