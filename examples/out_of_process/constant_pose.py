#!/usr/bin/env python3
"""A SLAM system in another language, at its smallest: how one enters a comparison without our library.

    os export box1 --to csv -o box1-csv
    python3 examples/out_of_process/constant_pose.py box1-csv > constant-pose.txt
    os import-trajectory box1 constant-pose.txt --name constant-pose -o box1-with-constant-pose

It reads the measurements with the standard library alone and says that the camera never moves. Put your own
estimation in the place of `estimate`.
"""

import csv
import json
import sys
from collections import defaultdict
from pathlib import Path


def number(field):
    """A number, or None for a depth that was not measured."""
    return float(field) if field else None


def read(folder):
    """Cameras by id, frames in order, and the points that each frame measures."""
    cameras = {camera["camera_id"]: camera for camera in json.loads((folder / "cameras.json").read_text())["cameras"]}
    with open(folder / "frames.csv", newline="") as file:
        frames = [{name: int(field) for name, field in row.items()} for row in csv.DictReader(file)]
    points = defaultdict(list)
    with open(folder / "point_measurements.csv", newline="") as file:
        for row in csv.DictReader(file):
            points[int(row["frame_id"])].append(
                (int(row["point_id"]), float(row["u"]), float(row["v"]), number(row["depth"]))
            )
    return cameras, frames, points


def estimate(camera, points):
    """world_from_camera as tx ty tz qx qy qz qw; here the camera stands still."""
    assert camera["fx"] > 0 and all(len(point) == 4 for point in points)
    return (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def main():
    cameras, frames, points = read(Path(sys.argv[1]))
    print("# timestamp tx ty tz qx qy qz qw")
    for frame in frames:
        pose = estimate(cameras[frame["camera_id"]], points[frame["frame_id"]])
        # Whole nanoseconds: a float of seconds since 1970 would round them.
        stamp = frame["stamp_nanos"]
        print(f"{stamp // 10**9}.{stamp % 10**9:09d}", *pose)


if __name__ == "__main__":
    main()
