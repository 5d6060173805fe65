"""Sequences are opened, looked at frame by frame, held against the rules, and written."""

from __future__ import annotations

import copy
import json
import multiprocessing
import operator
import pickle
import shutil
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import open_structure
import pandas as pd
import pytest
from conftest import Run


@pytest.mark.parametrize("stored", ["folder", "mcap"])
def test_what_is_said_of_a_sequence(stored: str, request: pytest.FixtureRequest) -> None:
    path = request.getfixturevalue(stored)
    sequence = open_structure.Sequence.open(str(path))
    assert sequence.name == "sphere2"
    assert Path(sequence.path) == path
    assert sequence.manifest["generator"]["tool"] == "os simulate"
    assert sequence.cameras[0]["width"] == 640
    assert sequence.summary is None
    assert sequence.estimates == sequence.graphs == []
    assert sequence.tables[0] == "frames"
    assert "point_measurements" in sequence
    assert "graph_poses" not in sequence
    assert 3 not in sequence
    with pytest.raises(KeyError):
        sequence["points"]
    assert repr(sequence) == f"<Sequence sphere2 at {path}>"


@pytest.mark.parametrize("stored", ["folder", "mcap", "simulated"])
def test_frames_have_their_rows(stored: str, simulated: open_structure.Sequence, request: pytest.FixtureRequest) -> None:
    found = request.getfixturevalue(stored)
    sequence = found if stored == "simulated" else open_structure.Sequence.open(found)
    points = simulated["point_measurements"].to_pandas()
    assert len(sequence) == len(sequence.frames) == 100
    ids = []
    for frame in sequence:
        ids.append(frame.frame_id)
        expected = points[points.frame_id == frame.frame_id].reset_index(drop=True)
        pd.testing.assert_frame_equal(frame.point_measurements.to_pandas(), expected)
    assert ids == simulated["frames"]["frame_id"].tolist()
    frame = sequence.frame(17)
    assert frame.frame_id == sequence.frames[17].frame_id == sequence.frames[-83].frame_id == 17
    assert frame.stamp_nanos == simulated["frames"]["stamp_nanos"][17]
    assert frame.camera_id == 0
    assert len(frame.line_observations) == len(frame.line_measurements) > 0
    assert len(frame.point_observations) == len(frame.point_measurements)
    np.testing.assert_array_equal(frame.world_from_camera, sequence.poses()[1][17])
    assert "Frame 17" in repr(frame)
    with pytest.raises(KeyError):
        sequence.frame(100)
    with pytest.raises(IndexError):
        sequence.frames[100]


def test_frames_are_left_half_way(mcap: Path) -> None:
    sequence = open_structure.Sequence.open(mcap)
    for _ in range(20):
        frames = iter(sequence.frames)
        assert next(frames).frame_id == 0


def test_measurements_are_where_landmarks_project(mcap: Path) -> None:
    """Poses, landmarks, camera and observations agree, which says that none of them is turned round."""
    sequence = open_structure.Sequence.open(mcap)
    camera = sequence.cameras[0]
    landmarks = sequence["point_landmarks"]
    positions = np.stack([landmarks[name] for name in "xyz"], axis=1)
    frame = sequence.frame(42)
    seen = frame.point_observations
    at = positions[np.searchsorted(landmarks["point_id"], seen["point_id"])]
    pose = frame.world_from_camera
    in_camera = (at - pose[:3, 3]) @ pose[:3, :3]
    np.testing.assert_allclose(seen["u"], camera["fx"] * in_camera[:, 0] / in_camera[:, 2] + camera["cx"], atol=1e-9)
    np.testing.assert_allclose(seen["v"], camera["fy"] * in_camera[:, 1] / in_camera[:, 2] + camera["cy"], atol=1e-9)
    np.testing.assert_allclose(seen["depth"], in_camera[:, 2], atol=1e-12)


def test_findings_are_those_of_the_program(folder: Path, tmp_path: Path, run: Run) -> None:
    assert open_structure.Sequence.open(folder).validate().conformant
    broken = tmp_path / "broken"
    shutil.copytree(folder, broken)
    frames = pd.read_parquet(broken / "frames.parquet")
    frames.loc[3, "world_from_camera_qw"] += 0.5
    frames.to_parquet(broken / "frames.parquet", index=False)
    report = open_structure.validate(broken)
    assert not report.conformant
    assert len(report) > 0
    assert any(finding.table == "frames" and finding.row == 3 for finding in report)
    assert report[0].severity == "error"
    assert "frames" in str(report)
    program = json.loads(run("validate", "--json", broken))
    assert report.json == program
    fewer = open_structure.Sequence.open(broken).validate(max_findings=1)
    assert [(rule["rule"], rule["count"]) for rule in fewer.rules] == [(rule["rule"], rule["count"]) for rule in program["rules"]]


def test_a_sequence_in_memory_is_validated_too(tracked: open_structure.Sequence) -> None:
    report = tracked.validate()
    assert report.conformant, str(report)
    assert report.rows["trajectories"] == 100


@pytest.mark.parametrize("ending", ["", ".mcap"])
def test_a_copy_has_the_bytes_of_the_program_s_copy(ending: str, folder: Path, mcap: Path, tmp_path: Path, run: Run) -> None:
    source = mcap if ending == "" else folder
    ours = open_structure.Sequence.open(source).write(tmp_path / f"ours{ending}")
    theirs = tmp_path / f"theirs{ending}"
    run("copy", source, "-o", theirs)
    same_bytes(Path(ours.path), theirs)


def same_bytes(ours: Path, theirs: Path) -> None:
    """Whether two outputs are the same to the byte."""
    if ours.is_dir():
        names = sorted(entry.name for entry in ours.iterdir())
        assert names == sorted(entry.name for entry in theirs.iterdir())
        for name in names:
            assert (ours / name).read_bytes() == (theirs / name).read_bytes(), name
    else:
        assert ours.read_bytes() == theirs.read_bytes()


def test_nothing_is_overwritten_unless_it_is_asked_for(simulated: open_structure.Sequence, tmp_path: Path) -> None:
    path = tmp_path / "once.mcap"
    simulated.write(path, foxglove=True)
    with pytest.raises(open_structure.ExistsError, match="force=True") as caught:
        simulated.write(path)
    assert isinstance(caught.value, FileExistsError)
    assert caught.value.filename == str(path) or caught.value.filename == path
    opened = simulated.write(path, force=True)
    with pytest.raises(open_structure.OptionError, match="is the input itself"):
        opened.write(path, force=True)
    with pytest.raises(open_structure.OptionError, match="foxglove"):
        simulated.write(tmp_path / "folder", foxglove=True)
    notes = tmp_path / "notes"
    notes.mkdir()
    (notes / "dear.txt").write_text("mine")
    with pytest.raises(open_structure.ExistsError, match=r"dear\.txt"):
        simulated.write(notes, force=True)


def test_errors_are_those_that_python_users_expect(tmp_path: Path, folder: Path) -> None:
    with pytest.raises(FileNotFoundError) as missing:
        open_structure.Sequence.open(tmp_path / "nothing.mcap")
    assert isinstance(missing.value, open_structure.Error)
    assert missing.value.errno == 2
    (tmp_path / "noise.mcap").write_bytes(bytes(range(256)) * 4)
    with pytest.raises(open_structure.FormatError, match=r"noise\.mcap"):
        open_structure.Sequence.open(tmp_path / "noise.mcap")
    broken = tmp_path / "broken"
    shutil.copytree(folder, broken)
    points = pd.read_parquet(broken / "point_measurements.parquet")
    points.astype({"u": "float32"}).to_parquet(broken / "point_measurements.parquet", index=False)
    sequence = open_structure.Sequence.open(broken)
    with pytest.raises(open_structure.FormatError, match="point_measurements: column u is Float32; expected float64"):
        sequence["point_measurements"]
    points.drop(columns="v").to_parquet(broken / "point_measurements.parquet", index=False)
    with pytest.raises(open_structure.FormatError, match="column v is missing"):
        open_structure.Sequence.open(broken)["point_measurements"]
    points["v"] = points["v"].mask(points.index == 5)
    points.to_parquet(broken / "point_measurements.parquet", index=False)
    with pytest.raises(open_structure.FormatError, match="point_measurements row 5: column v is null"):
        open_structure.Sequence.open(broken)["point_measurements"]
    for wrong in (None, 3, b"bytes", ["list"]):
        with pytest.raises(TypeError):
            open_structure.track(wrong)
    with pytest.raises(TypeError):
        open_structure.Sequence()


def test_what_this_version_does_not_know_is_told(folder: Path, tmp_path: Path) -> None:
    later = tmp_path / "later"
    shutil.copytree(folder, later)
    frames = pd.read_parquet(later / "frames.parquet")
    frames["mood"] = 1
    frames.to_parquet(later / "frames.parquet", index=False)
    with pytest.warns(UserWarning, match="column mood of frames"):
        open_structure.track(later, method="frame-to-frame")


def test_sequences_and_tables_can_be_sent_to_other_processes(
    folder: Path, mcap: Path, simulated: open_structure.Sequence, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As loaders of PyTorch, joblib, Dask and Ray send them."""
    for path in (folder, mcap):
        monkeypatch.chdir(path.parent)
        sequence = open_structure.Sequence.open(path.name)
        with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as elsewhere:
            there = elsewhere.submit(operator.itemgetter("point_measurements"), sequence).result()
            assert elsewhere.submit(len, sequence.frames).result() == 100
        assert there.name == "point_measurements"
        assert there.to_pyarrow().equals(sequence["point_measurements"].to_pyarrow(), check_metadata=True)
        again = pickle.loads(pickle.dumps(sequence))
        assert again.path == path
        nothing = sequence["graph_poses"]
        assert pickle.loads(pickle.dumps(nothing)).to_pyarrow().equals(nothing.to_pyarrow(), check_metadata=True)
        frame = sequence.frames[17]
        sent = pickle.loads(pickle.dumps(frame))
        assert (sent.frame_id, sent.stamp_nanos, sent.camera_id) == (17, frame.stamp_nanos, 0)
        np.testing.assert_array_equal(sent.world_from_camera, frame.world_from_camera)
        for rows in ("point_measurements", "line_measurements", "point_observations", "line_observations"):
            assert getattr(sent, rows).to_pyarrow().equals(getattr(frame, rows).to_pyarrow())
        assert repr(sent) == repr(frame)
        assert pickle.loads(pickle.dumps(sent)).frame_id == 17
    with pytest.raises(TypeError, match="send what `write` gives"):
        pickle.dumps(simulated)
    assert copy.deepcopy(simulated) is copy.copy(simulated) is simulated


def test_a_sequence_stays_where_it_is(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder.parent)
    sequence = open_structure.Sequence.open(folder.name)
    monkeypatch.chdir(tmp_path)
    assert pickle.loads(pickle.dumps(sequence)).path == sequence.path == folder
    with pytest.raises(open_structure.OptionError, match="is the input itself"):
        sequence.write(folder, force=True)
    assert sequence.write(folder.name).path == tmp_path / folder.name


def test_frames_look_like_a_list(mcap: Path) -> None:
    frames = open_structure.Sequence.open(mcap).frames

    def ids(some: Iterable[open_structure.Frame]) -> list[int]:
        return [frame.frame_id for frame in some]

    for part in (slice(3), slice(-3, None), slice(90, 10, -20), slice(5, 5), slice(None, None, 33), slice(-200, 200, 50)):
        assert ids(frames[part]) == list(range(100))[part]
    assert ids(reversed(frames)) == list(range(99, -1, -1))
    with pytest.raises(TypeError):
        frames["first"]


def test_exceptions_can_be_sent_elsewhere() -> None:
    error = open_structure.OptionError("words")
    assert str(pickle.loads(pickle.dumps(error))) == "words"
    assert issubclass(open_structure.FormatError, ValueError)
    assert issubclass(open_structure.StepError, RuntimeError)
