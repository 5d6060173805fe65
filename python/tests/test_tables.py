"""Tables cross to other libraries without a copy, with what each column means."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import open_structure
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest


def address(array: np.ndarray) -> int:
    """Where the numbers of an array lie."""
    return array.__array_interface__["data"][0]


@pytest.mark.parametrize("stored", ["folder", "mcap"])
def test_a_table_holds_what_the_parquet_file_holds(stored: str, folder: Path, request: pytest.FixtureRequest) -> None:
    sequence = open_structure.Sequence.open(request.getfixturevalue(stored))
    assert "point_measurements" in sequence.tables
    for name in sequence.tables:
        plain = pq.read_table(folder / f"{name}.parquet")
        ours = sequence[name].to_pyarrow()
        assert ours.column_names == plain.column_names
        assert ours.to_pylist() == plain.to_pylist(), name


def test_arrow_and_numpy_look_at_the_memory_of_the_table(mcap: Path) -> None:
    table = open_structure.Sequence.open(mcap)["point_measurements"]
    there = address(table["u"])
    assert there == address(table["u"]) == address(table.to_numpy()["u"])
    assert pa.table(table)["u"].chunk(0).buffers()[1].address == there
    assert pa.record_batch(table)["u"].buffers()[1].address == there
    assert address(pl.DataFrame(table)["u"].to_numpy(allow_copy=False)) == there
    assert address(table.to_polars()["u"].to_numpy(allow_copy=False)) == there
    assert address(table.to_pandas()["u"].to_numpy()) == there
    assert not table["u"].flags.writeable


def test_memory_lives_as_long_as_somebody_looks_at_it(mcap: Path) -> None:
    column = open_structure.Sequence.open(mcap)["point_measurements"]["v"]
    stream = pa.table(open_structure.Sequence.open(mcap)["point_measurements"])["v"]
    # Whatever was freed too early is written over by now.
    again = [open_structure.Sequence.open(mcap)["point_measurements"] for _ in range(5)]
    np.testing.assert_array_equal(column, again[0]["v"])
    np.testing.assert_array_equal(stream.to_numpy(), again[0]["v"])


def test_a_stream_that_nobody_takes_is_freed(mcap: Path) -> None:
    table = open_structure.Sequence.open(mcap)["frames"]
    for _ in range(100):
        table.__arrow_c_stream__()
        table.__arrow_c_array__()
        table.__arrow_c_schema__()
    assert len(table) == 100


def test_every_library_sees_the_same(mcap: Path) -> None:
    table = open_structure.Sequence.open(mcap)["line_measurements"]
    frame = table.to_pandas()
    assert isinstance(frame, pd.DataFrame)
    assert len(frame) == len(table) == table.num_rows == len(table.to_polars())
    for name, values in table.to_numpy().items():
        np.testing.assert_array_equal(values, frame[name].to_numpy())
        np.testing.assert_array_equal(values, table.to_polars()[name].to_numpy())


def test_a_column_says_its_unit_its_space_and_its_meaning(mcap: Path) -> None:
    table = open_structure.Sequence.open(mcap)["point_measurements"]
    assert table.column_names == ["frame_id", "point_id", "u", "v", "depth"]
    by_name = {column["name"]: column for column in table.columns}
    assert by_name["depth"]["unit"] == "m"
    assert by_name["depth"]["space"] == "camera"
    assert by_name["depth"]["nullable"]
    assert "optical axis" in by_name["depth"]["description"]
    assert pa.table(table).schema.field("depth").metadata[b"unit"] == b"m"
    assert "point_measurements" in repr(table)
    assert "u" in table
    assert "w" not in table
    with pytest.raises(KeyError):
        table["w"]


def test_absent_values_words_and_lists_are_told_apart(tracked: open_structure.Sequence) -> None:
    factors = tracked["graph_factors"].to_numpy()
    assert factors["kind"].dtype == object
    assert isinstance(factors["kind"][0], str)
    lists = tracked["point_correspondences"]["frame_ids"]
    assert lists[0].dtype == np.int64
    assert lists[0].tolist() == tracked["point_correspondences"].to_pyarrow()["frame_ids"][0].as_py()
    statistics = tracked["frame_statistics"].to_pyarrow()
    for name in ("median_parallax_to_previous", "points_shared_with_previous"):
        plain, ours = statistics[name].to_pylist(), tracked["frame_statistics"][name]
        assert plain[0] is None
        if np.ma.isMaskedArray(ours):
            assert ours.tolist() == plain
        else:
            assert np.isnan(ours[0])
            assert [None if np.isnan(value) else value for value in ours] == plain
    descriptors = tracked["point_landmarks"]["descriptor"]
    assert set(descriptors.tolist()) == {None}


def test_a_table_that_is_not_there_has_columns_and_no_rows(mcap: Path) -> None:
    sequence = open_structure.Sequence.open(mcap)
    assert "map_points" not in sequence.tables
    table = sequence["map_points"]
    assert len(table) == 0
    assert table.column_names[:2] == ["estimate", "point_id"]
    assert len(table.to_pandas()) == len(table["x"]) == 0
    with pytest.raises(open_structure.OptionError, match="expected one of frames, .* found \"points\""):
        sequence.table("points")
