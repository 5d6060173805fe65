"""Reprojects landmarks with nothing but what the files say: join, pose, intrinsics.

The way from a folder to residuals that a user would write; once with the cameras of `sequence.json`,
once with those in a Parquet file's own metadata.
"""

import json
import sys
from pathlib import Path

import numpy as np
import polars as pl
import pyarrow.parquet as pq

import expected

# Pixels reach 640, so rounding alone makes about 1e-13 of relative error.
EXACT_PX = 1e-9


def project(table: pl.DataFrame, cameras: list[dict], x: str, y: str, z: str) -> np.ndarray:
    """u, v and depth of a landmark's point in each row, by the formulas of the specification."""
    point = table.select(x, y, z).to_numpy() - table.select("^world_from_camera_t.$").to_numpy()
    q = table.select("^world_from_camera_q.$").to_numpy()
    vector, real = -q[:, :3], q[:, 3:]  # The conjugate turns the world into the camera.
    turned = np.cross(vector, point)
    seen = point + 2 * real * turned + 2 * np.cross(vector, turned)
    by_id = {camera["camera_id"]: camera for camera in cameras}
    fx, fy, cx, cy = (
        np.array([by_id[camera][name] for camera in table["camera_id"]]) for name in ("fx", "fy", "cx", "cy")
    )
    return np.c_[fx * seen[:, 0] / seen[:, 2] + cx, fy * seen[:, 1] / seen[:, 2] + cy, seen[:, 2]]


def residuals(folder: Path, cameras: list[dict], kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Residuals of points and, for both ends, of lines; n x 3: pixels, pixels, metres."""
    tables = {path.stem: pl.read_parquet(path) for path in folder.glob("*.parquet")}
    frames = tables["frames"].drop_nulls("world_from_camera_tx")
    points = (
        tables[f"point_{kind}"].join(tables["point_landmarks"], on="point_id").join(frames, on="frame_id")
    )
    point_residuals = project(points, cameras, "x", "y", "z") - points.select("u", "v", "depth").to_numpy()
    lines = tables[f"line_{kind}"].join(tables["line_landmarks"], on="line_id").join(frames, on="frame_id")
    seen = [lines.select(f"{end}_u", f"{end}_v", f"{end}_depth").to_numpy() for end in ("start", "end")]
    line = [project(lines, cameras, f"{end}_x", f"{end}_y", f"{end}_z") for end in ("start", "end")]
    # Which end is which is arbitrary.
    straight = np.c_[line[0] - seen[0], line[1] - seen[1]]
    swapped = np.c_[line[1] - seen[0], line[0] - seen[1]]
    nearer = np.abs(straight[:, [0, 1, 3, 4]]).max(axis=1) <= np.abs(swapped[:, [0, 1, 3, 4]]).max(axis=1)
    return point_residuals, np.where(nearer[:, None], straight, swapped).reshape(-1, 3)


def main(folder: Path) -> None:
    manifest = json.loads((folder / "sequence.json").read_text())
    metadata = pq.read_metadata(folder / "point_observations.parquet").metadata
    for cameras in (manifest["cameras"], json.loads(metadata[b"open-structure.cameras"])):
        for found in residuals(folder, cameras, "observations"):
            assert len(found) > 0 and np.nanmax(np.abs(found)) < EXACT_PX, np.nanmax(np.abs(found))
        # Measurements differ, by less than the noise that the sample was given; depths may be absent.
        point, line = residuals(folder, cameras, "measurements")
        assert 0.3 < np.abs(point[:, :2]).max() <= 0.71
        assert 0.3 < np.abs(line[:, :2]).max() <= 0.71
        assert np.isnan(point[:, 2]).any() and not np.isnan(point[:, 2]).all()
    exact = residuals(folder, manifest["cameras"], "observations")
    largest = max(np.abs(each).max() for each in exact)
    print(f"{len(exact[0])} points and {len(exact[1])} line ends within {largest:.1e} px")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
    expected.leave()
