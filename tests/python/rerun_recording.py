"""Reads a recording with Rerun and draws the scene as its viewer would: everything meets in the image."""

import json
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from rerun.chunk import RrdReader

import expected

# 32-bit numbers: metres over metres times a focal length.
TOLERANCE_PX = 2e-3
NANOS = 1_000_000_000


class Recording:
    """What a recording says, by entity: what holds at all times, and what holds in a frame."""

    def __init__(self, path: Path) -> None:
        self.always: dict[str, dict[str, Any]] = defaultdict(dict)
        self.frames: dict[str, dict[int, dict[str, Any]]] = defaultdict(lambda: defaultdict(dict))
        self.seconds: dict[int, float] = {}
        for chunk in RrdReader(path).stream().to_chunks():
            batch = chunk.to_record_batch()
            entity = str(chunk.entity_path)
            names = [name for name in batch.schema.names if ":" in name]
            assert chunk.is_static or set(chunk.timeline_names) == {"frame", "time"}, entity
            for row in range(batch.num_rows):
                values = {name: batch[name][row].as_py() for name in names}
                if chunk.is_static:
                    self.always[entity].update(values)
                    continue
                frame = batch["frame"][row].as_py()
                self.frames[entity][frame].update(values)
                self.seconds[frame] = batch["time"][row].value / NANOS


def rotation(q: list[float]) -> np.ndarray:
    x, y, z, w = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def main(path: Path, rows: dict[str, list[expected.Row]], manifest: dict[str, Any]) -> None:
    found = Recording(path)
    # Pixels of a viewer count from the corner of the first one; some cameras of the sample count from its centre.
    origins = {"pixel-center": 0.5, "pixel-corner": 0.0}
    shifts = {camera["camera_id"]: origins[camera["pixel_origin"]] for camera in manifest["cameras"]}
    first = rows["frames"][0]["stamp_nanos"]
    landmarks = np.array(found.always["/world/landmarks/points"]["Points3D:positions"])
    index = {row["point_id"]: place for place, row in enumerate(rows["point_landmarks"])}
    assert len(landmarks) == len(index)
    lines = found.always["/world/landmarks/lines"]
    assert len(lines["LineStrips3D:strips"]) == len(rows["line_landmarks"]) == len(lines["LineStrips3D:colors"])
    estimates = {row["estimate"] for row in rows["trajectories"]}
    for estimate in estimates:
        assert any(entity.startswith(f"/world/estimated_trajectories/{estimate}/camera_") for entity in found.frames), estimate
    for estimate in {row["estimate"] for row in rows["map_points"]}:
        count = sum(row["estimate"] == estimate for row in rows["map_points"])
        assert len(found.always[f"/world/maps/{estimate}/points"]["Points3D:positions"]) == count
    assert found.always["/world"]["ViewCoordinates:xyz"], "the viewer knows what is up"

    drawn = 0
    for frame in rows["frames"]:
        frame_id, camera = frame["frame_id"], f"/world/camera_{frame['camera_id']}"
        assert abs(found.seconds[frame_id] - (frame["stamp_nanos"] - first) / NANOS) < 1e-9

        def of_frame(table: str, frame_id: int = frame_id) -> list[expected.Row]:
            return [row for row in rows[table] if row["frame_id"] == frame_id]

        measured = of_frame("point_measurements") or of_frame("line_measurements")
        kind = "measurements" if measured else "observations"
        points = found.frames[f"{camera}/points"][frame_id]["Points2D:positions"]
        shift = shifts[frame["camera_id"]]
        wanted = np.array([[row["u"], row["v"]] for row in of_frame(f"point_{kind}")]).reshape(-1, 2) + shift
        assert np.abs(np.array(points).reshape(-1, 2) - wanted).max(initial=0) < 1e-3, frame_id
        segments = found.frames[f"{camera}/lines"][frame_id]
        assert len(segments["LineStrips2D:strips"]) == len(of_frame(f"line_{kind}")) == len(segments["LineStrips2D:colors"])

        pose = found.frames[camera].get(frame_id)
        assert (pose is None) == ("world_from_camera_tx" not in frame)
        observed = of_frame("point_observations")
        if pose is None or not observed:
            continue
        # The matrix of a pinhole comes column by column.
        [k] = found.always[camera]["Pinhole:image_from_camera"]
        [translation], [quaternion] = pose["Transform3D:translation"], pose["Transform3D:quaternion"]
        world_from_camera = rotation(quaternion)
        places = landmarks[[index[row["point_id"]] for row in observed]]
        seen = (places - np.array(translation)) @ world_from_camera @ np.array(k).reshape(3, 3)
        assert (seen[:, 2] > 0).all()
        wanted = np.array([[row["u"], row["v"]] for row in observed]) + shift
        assert np.abs(seen[:, :2] / seen[:, 2:] - wanted).max() < TOLERANCE_PX, frame_id
        drawn += 1
    assert drawn > 0
    entities = set(found.always) | set(found.frames)
    print(f"{len(entities)} entities, {len(found.seconds)} frames on the timeline, {drawn} frames drawn")


if __name__ == "__main__":
    main(Path(sys.argv[1]), expected.load(Path(sys.argv[2])), json.loads(Path(sys.argv[3]).read_text()))
    expected.leave()
