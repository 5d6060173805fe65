"""Asks the checkers of MCAP files, pymcap-cli and Rerun, what they think of ours."""

import json
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

TOOLS = Path(sys.executable).parent
# What Rerun makes of our topics; it has no image annotations and no scene lines.
UNDERSTOOD = {
    "camera_0/transform": "Transform3D:quaternion",
    "camera_0/calibration": "Pinhole:image_from_camera",
    "camera_0/true_trajectory": "InstancePoses3D:translations",
    "point_landmarks": "Points3D:positions",
}


def run(*command: str | Path) -> str:
    done = subprocess.run([TOOLS / command[0], *command[1:]], capture_output=True, text=True, check=False)
    said = done.stdout + done.stderr
    assert done.returncode == 0, f"{command}: {said}"
    return said


def doctor(path: Path) -> str:
    report = [
        json.loads(line) for line in run("pymcap-cli", "doctor", path, "--format", "jsonl").splitlines()
    ]
    assert report, "the doctor says something"
    summary = report.pop()
    assert summary["type"] == "summary" and summary["complete"] and summary["errors"] == 0, report
    codes = Counter(finding["code"] for finding in report)
    # The Arrow encoding is proposed for MCAP, not yet well-known; there is nothing else to mention.
    assert set(codes) <= {"SCHEMA_ENCODING_UNKNOWN", "NO_ATTACHMENTS"}, report
    assert all("'arrow'" in finding["message"] for finding in report if finding["severity"] == "warning")
    return f"doctor: {summary['messages']} messages, no error, {dict(codes)}"


def rerun(path: Path) -> str:
    run("rerun", "analytics", "disable")
    checked = [line.split()[0] for line in run("rerun", "mcap", "check", path).splitlines() if " /" in line]
    assert set(checked) == {"ok"}, checked
    with tempfile.TemporaryDirectory() as folder:
        recording = Path(folder) / "sample.rrd"
        run("rerun", "mcap", "convert", path, "-o", recording)
        run("rerun", "rrd", "verify", recording)
        shown = run("rerun", "rrd", "print", recording).splitlines()
    # The viewer understands what moves and what stands, not only that there are bytes.
    for topic, archetype in UNDERSTOOD.items():
        assert any(f" /foxglove/{topic} " in line and archetype in line for line in shown), topic
    return f"rerun: {len(checked)} channels ok, understands {', '.join(UNDERSTOOD.values())}"


if __name__ == "__main__":
    print(doctor(Path(sys.argv[1])), "·", rerun(Path(sys.argv[1])))
