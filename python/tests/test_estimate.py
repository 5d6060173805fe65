"""Estimates of the user's own: any shape that says what it is goes in, anything else is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import open_structure
import polars as pl
import pytest

Sequence = open_structure.Sequence


def test_every_shape_of_a_path_gives_the_same_rows(tracked: Sequence) -> None:
    ids, matrices = tracked.poses("map-to-frame")
    table = tracked["trajectories"]
    numbers = np.stack([table[name] for name in table.column_names[2:9]], axis=1)
    forms: dict[str, Any] = {
        "matrices": (ids, matrices),
        "three rows": (ids, matrices[:, :3]),
        "seven numbers": (ids, numbers),
        "lists": (ids.tolist(), numbers.tolist()),
        "backwards": (ids[::-1], numbers[::-1]),
        "table": table,
        "pyarrow": table.to_pyarrow(),
        "pandas": table.to_pandas(),
        "polars": table.to_polars(),
        "numpy": table.to_numpy(),
    }
    for form, poses in forms.items():
        made = tracked.with_estimate("mine", poses)
        assert made.summary == {"estimate": "mine", "poses": 100, "points": 0, "lines": 0}
        assert made.estimates == ["map-to-frame", "mine"]
        found_ids, found = made.poses("mine")
        np.testing.assert_array_equal(found_ids, ids, err_msg=form)
        np.testing.assert_allclose(found, matrices, atol=1e-12, err_msg=form)
    assert tracked.estimates == ["map-to-frame"], "a sequence never changes"


def test_maps_go_in_too_and_come_out_again(tracked: Sequence, tmp_path: Path) -> None:
    points, lines = tracked["map_points"], tracked["map_lines"]
    ends = np.stack([lines[name] for name in lines.column_names[2:8]], axis=1)
    path = tmp_path / "mine.mcap"
    made = open_structure.write_estimate(
        tracked,
        path,
        "mine",
        tracked["trajectories"],
        points=points,
        lines=(lines["line_id"], ends.reshape(-1, 2, 3)),
    )
    assert Path(made.path) == path
    frame = made["map_points"].to_polars().filter(pl.col("estimate") == "mine").drop("estimate")
    assert frame.equals(points.to_polars().drop("estimate"), null_equal=True), "covariances and all"
    frame = made["map_lines"].to_polars().filter(pl.col("estimate") == "mine")
    np.testing.assert_array_equal(frame["end_z"].to_numpy(), lines["end_z"])
    report = made.validate()
    assert report.conformant, str(report)
    # Twice the same poses under two names is what the validator sees in it.
    assert "estimates-distinct" in {rule["rule"] for rule in report.rules}
    found = open_structure.evaluate(made)
    values = found.to_pandas().set_index("estimate")["ape_translation_rmse_m"]
    assert values["mine"] == values["map-to-frame"]


def test_a_name_is_replaced_only_when_it_is_asked_for(tracked: Sequence) -> None:
    ids, matrices = tracked.poses("map-to-frame")
    with pytest.raises(open_structure.OptionError, match="already"):
        tracked.with_estimate("map-to-frame", (ids, matrices))
    made = tracked.with_estimate("map-to-frame", (ids[:7], matrices[:7]), replace=True)
    assert len(made.poses("map-to-frame")[0]) == 7


def test_hostile_rows_are_refused(tracked: Sequence) -> None:
    ids, matrices = tracked.poses("map-to-frame")
    one = np.array([0.0, 0, 0, 0, 0, 0, 1])

    def changed(place: tuple[int, ...], value: float) -> np.ndarray:
        made = matrices.copy()
        made[place] = value
        return made

    wrong: list[tuple[Any, str]] = [
        ((ids, matrices[:-1]), r"expected shape \(100, 7\) or \(100, 4, 4\)"),
        ((ids, matrices.reshape(-1)), "expected shape"),
        ((ids.reshape(10, 10), matrices), "expected one dimension"),
        ((ids.astype(float), matrices), "expected whole numbers, found float64"),
        ((["a", "b"], np.stack([one, one])), "expected whole numbers"),
        (([2**63], one[None]), "expected ids below 2\\^63"),
        (([2**70], one[None]), "expected whole numbers"),
        ((ids, matrices.astype(complex)), "expected numbers, found complex128"),
        ((ids, np.full((100, 7), "x")), "expected numbers"),
        ((ids, [[1, 2], [3]]), "poses: "),
        ((ids, changed((4, 0, 0), np.nan)), "poses row 4: expected finite numbers"),
        ((ids, changed((4, 0, 0), 3.0)), "poses row 4: expected a rotation"),
        ((ids, -matrices), "expected a rotation"),
        ((ids, changed((4, 3, 0), 0.5)), "poses row 4: expected a last row of 0, 0, 0, 1"),
        (([0], 0.9 * one[None]), "trajectories row 0: expected a quaternion of length 1"),
        (([0], np.array([[0, np.inf, 0, 0, 0, 0, 1]])), "trajectories row 0: expected finite numbers"),
        (([7_000], one[None]), "expected a frame of the sequence, found frame 7000"),
        (([3, 3], np.stack([one, one])), "trajectories row 1: frame 3 stands there twice"),
        ((ids, matrices, ids), "found a tuple of 3"),
        ({"frame_id": [0]}, "expected a column world_from_camera_tx"),
        (7, "expected a column frame_id, found int"),
        (([], np.zeros((0, 7))), "without poses"),
        (None, "without poses"),
        ((ids, np.ma.array(matrices, mask=changed((4, 0, 0), 9.0) == 9.0)), "poses: expected rows without masked numbers"),
        ((np.ma.array(ids, mask=ids == 3), matrices), "poses: ids: expected rows without masked numbers"),
        ({"frame_id": [0, 1], "estimate": ["a", "b"]}, "poses: expected rows of one estimate, found a, b"),
    ]
    for poses, message in wrong:
        with pytest.raises((open_structure.OptionError, open_structure.StepError), match=message):
            tracked.with_estimate("mine", poses)
    with pytest.raises(open_structure.OptionError, match="map_lines row 0: expected two ends"):
        tracked.with_estimate("mine", lines=([1], np.zeros((1, 6))))
    with pytest.raises(open_structure.OptionError, match="map_points row 1: point 1 stands there twice"):
        tracked.with_estimate("mine", points=([1, 1], np.zeros((2, 3))))
    with pytest.raises(open_structure.OptionError, match="21 finite numbers"):
        row = {name: [0.0] for name in tracked["trajectories"].column_names[2:8]}
        tracked.with_estimate("mine", row | {"world_from_camera_qw": [1.0], "frame_id": [0], "covariance": [[1.0]]})
