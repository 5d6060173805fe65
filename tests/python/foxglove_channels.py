"""Decodes the viewers' channels and draws the scene as a viewer would: everything meets in the image."""

import json
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

import expected

# 32-bit point clouds, metres over metres times a focal length.
CLOUD_TOLERANCE_PX = 1e-3
TOLERANCE_PX = 1e-9
POINTS, LINE_LIST = 1, 4
SCENE_LINE_LIST = 2


def matrix(translation: Any, q: Any) -> np.ndarray:
    """The 4x4 matrix of a translation and a unit quaternion."""
    x, y, z, w = q.x, q.y, q.z, q.w
    assert abs(x * x + y * y + z * z + w * w - 1) < 1e-12
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    moved = np.eye(4)
    moved[:3, :3], moved[:3, 3] = rotation, [translation.x, translation.y, translation.z]
    return moved


def project(calibration: Any, camera_from_world: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Pixels of points of the world, an n x 3 array."""
    seen = np.c_[points, np.ones(len(points))] @ camera_from_world.T
    assert (seen[:, 2] > 0).all()
    image = seen @ np.array(calibration.P).reshape(3, 4).T
    return image[:, :2] / image[:, 2:]


def xy(points: Any) -> np.ndarray:
    return np.array([[point.x, point.y] for point in points])


def rgb(color: Any) -> tuple[float, float, float]:
    assert color.a == 1
    return (color.r, color.g, color.b)


def decode(path: Path) -> tuple[dict, dict[str, dict[int, Any]]]:
    """The manifest and the viewers' messages by topic and stamp."""
    messages: dict[str, dict[int, Any]] = defaultdict(dict)
    manifest = {}
    with path.open("rb") as file:
        for schema, channel, message in make_reader(file).iter_messages():
            if channel.topic == "/manifest":
                manifest = json.loads(message.data)
            if channel.topic.startswith("/foxglove/"):
                assert schema.name.startswith("foxglove.") and schema.encoding == "protobuf"
                decoder = DecoderFactory().decoder_for(channel.message_encoding, schema)
                assert decoder and message.log_time not in messages[channel.topic]
                decoded = decoder(message.data)
                messages[channel.topic.removeprefix("/foxglove/")][message.log_time] = decoded
    return manifest, {topic: by_stamp for topic, by_stamp in messages.items() if by_stamp}


def main(path: Path, rows: dict[str, list[expected.Row]]) -> None:
    manifest, messages = decode(path)
    mirrored = all(camera["fy"] < 0 for camera in manifest["cameras"])
    world = "world_with_x_negated" if mirrored else "world"
    estimates = sorted({row["estimate"] for row in rows["trajectories"]})
    cameras = {f"camera_{camera['camera_id']}": camera for camera in manifest["cameras"]}
    assert set(messages) == (
        {f"{camera}/{what}" for camera in cameras
         for what in ("transform", "calibration", "annotations", "true_trajectory",
                      *(f"estimated_trajectory/{name}" for name in estimates))}
        | {"point_landmarks", "line_landmarks"}
        | {f"map_points/{name}" for name in {row["estimate"] for row in rows["map_points"]}}
        | {f"map_lines/{name}" for name in {row["estimate"] for row in rows["map_lines"]}}
    )  # fmt: skip

    [cloud] = messages["point_landmarks"].values()
    assert cloud.frame_id == world and cloud.point_stride == 12
    points = np.frombuffer(cloud.data, "<f4").reshape(-1, 3).astype(float)
    assert len(points) == len(rows["point_landmarks"])
    point_index = {row["point_id"]: index for index, row in enumerate(rows["point_landmarks"])}

    # Lines of the scene by colour, which tells their group.
    [scene] = messages["line_landmarks"].values()
    [entity] = scene.entities
    assert entity.frame_id == world
    drawn = {}
    for primitive in entity.lines:
        assert primitive.type == SCENE_LINE_LIST
        ends = np.array([[end.x, end.y, end.z] for end in primitive.points]).reshape(-1, 2, 3)
        drawn[rgb(primitive.color)] = ends
    group_of = {line: group["group_id"] for group in rows["structural_groups"] for line in group["line_ids"]}
    lines_of: dict[int | None, list[int]] = defaultdict(list)
    for row in rows["line_landmarks"]:
        lines_of[group_of.get(row["line_id"])].append(row["line_id"])
    assert sorted(map(len, drawn.values())) == sorted(map(len, lines_of.values()))
    [grey] = [color for color in drawn if color[0] == color[1] == color[2]]
    assert len(drawn[grey]) == len(lines_of[None]), "lines of no group are grey"

    frames_drawn = 0
    for frame in rows["frames"]:
        camera = f"camera_{frame['camera_id']}"
        stamp, origin = frame["stamp_nanos"], cameras[camera]["pixel_origin"]
        calibration = messages[f"{camera}/calibration"][stamp]
        annotations = messages[f"{camera}/annotations"][stamp]
        assert calibration.frame_id == camera and calibration.K[4] > 0
        assert (calibration.width, calibration.height) == (640, 480)
        assert annotations.timestamp.ToNanoseconds() == stamp
        # Viewers count from the corner of the image.
        shift = 0.5 if origin == "pixel-center" else 0.0

        def of_frame(table: str, frame: expected.Row = frame) -> list[expected.Row]:
            return [row for row in rows[table] if row["frame_id"] == frame["frame_id"]]

        measured = of_frame("point_measurements") or of_frame("line_measurements")
        kind = "measurements" if measured else "observations"
        shown = {annotation.type: [] for annotation in annotations.points}
        for annotation in annotations.points:
            shown[annotation.type].append(annotation)
        point_rows = of_frame(f"point_{kind}")
        assert len(shown.get(POINTS, [])) == (1 if point_rows else 0)
        for annotation in shown.get(POINTS, []):
            red, green, blue = rgb(annotation.outline_color)
            assert green > red and green > blue, "points are green"
            wanted = np.array([[row["u"], row["v"]] for row in point_rows]) + shift
            assert np.array_equal(xy(annotation.points), wanted)
        segments = sum(len(annotation.points) // 2 for annotation in shown.get(LINE_LIST, []))
        assert segments == len(of_frame(f"line_{kind}"))
        for annotation in shown.get(LINE_LIST, []):
            assert rgb(annotation.outline_color) in drawn, "a group has one colour everywhere"

        if "world_from_camera_tx" not in frame:
            assert stamp not in messages[f"{camera}/transform"]
            continue
        transform = messages[f"{camera}/transform"][stamp]
        assert (transform.parent_frame_id, transform.child_frame_id) == (world, camera)
        camera_from_world = np.linalg.inv(matrix(transform.translation, transform.rotation))
        observed = of_frame("point_observations")
        if observed:
            seen = project(
                calibration, camera_from_world, points[[point_index[o["point_id"]] for o in observed]]
            )
            wanted = np.array([[row["u"], row["v"]] for row in observed]) + shift
            assert np.abs(seen - wanted).max() < CLOUD_TOLERANCE_PX
            frames_drawn += 1
        if kind == "observations":
            # Each drawn segment lies on a scene line of its colour.
            for annotation in shown.get(LINE_LIST, []):
                ends = drawn[rgb(annotation.outline_color)].reshape(-1, 3)
                images = project(calibration, camera_from_world, ends).reshape(-1, 4)
                for segment in xy(annotation.points).reshape(-1, 4):
                    assert np.abs(images - segment).max(axis=1).min() < TOLERANCE_PX

    for camera in cameras:
        [trajectory] = messages[f"{camera}/true_trajectory"].values()
        transforms = messages[f"{camera}/transform"].values()
        assert trajectory.frame_id == world and len(trajectory.poses) == len(transforms)
        for pose, transform in zip(trajectory.poses, transforms, strict=True):
            # Each decoder makes classes of its own, so the bytes are compared.
            assert pose.position.SerializeToString() == transform.translation.SerializeToString()
            assert pose.orientation.SerializeToString() == transform.rotation.SerializeToString()
    count = sum(map(len, messages.values()))
    print(f"{count} messages on {len(messages)} topics, {frames_drawn} frames drawn")


if __name__ == "__main__":
    main(Path(sys.argv[1]), expected.load(Path(sys.argv[2])))
