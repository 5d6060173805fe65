"""Sequences in an object store: moto plays S3, and polars and pyarrow read with clients of their own."""

from __future__ import annotations

import os
import pickle
from collections.abc import Iterator
from pathlib import Path

import boto3
import open_structure
import polars as pl
import pyarrow.parquet as pq
import pytest
from conftest import Run
from moto.server import ThreadedMotoServer
from pyarrow.fs import S3FileSystem


@pytest.fixture
def endpoint(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """A server with an empty bucket `lab`; the environment says how to speak to it."""
    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    endpoint = f"http://{host}:{port}"
    for name in [name for name in os.environ if name.startswith("AWS_")]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("AWS_ENDPOINT_URL", endpoint)
    monkeypatch.setenv("AWS_ACCESS_KEY_ID", "someone")
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "something")
    monkeypatch.setenv("AWS_REGION", "us-east-1")
    boto3.client("s3", region_name="us-east-1").create_bucket(Bucket="lab")
    yield endpoint
    server.stop()


def keys() -> list[str]:
    """What lies in the bucket."""
    listed = boto3.client("s3", region_name="us-east-1").list_objects_v2(Bucket="lab")
    return [found["Key"] for found in listed.get("Contents", [])]


def test_a_sequence_goes_through_a_store(endpoint: str, folder: Path, tmp_path: Path, run: Run) -> None:
    url = "s3://lab/runs/sphere2"
    run("copy", folder, "-o", url)
    assert keys() == sorted(f"runs/sphere2/{path.name}" for path in folder.iterdir())
    run("track", url, "-o", "s3://lab/runs/tracked.mcap")
    assert "runs/tracked.mcap" in keys()
    run("track", folder, "-o", tmp_path / "tracked.mcap")
    stored = boto3.client("s3", region_name="us-east-1").get_object(Bucket="lab", Key="runs/tracked.mcap")
    assert stored["Body"].read() == (tmp_path / "tracked.mcap").read_bytes()

    sequence = open_structure.Sequence.open(url)
    assert sequence.path == url
    assert pickle.loads(pickle.dumps(sequence)).path == url
    plain = pq.read_table(folder / "point_measurements.parquet")
    assert sequence["point_measurements"].to_pyarrow().equals(plain)
    assert len(sequence.frame(17).point_measurements) > 0
    open_structure.Sequence.open("s3://lab/runs/tracked.mcap").write("s3://lab/runs/again")
    assert open_structure.evaluate("s3://lab/runs/again")["estimate"].tolist() == ["map-to-frame"]
    with pytest.raises(FileExistsError):
        sequence.write("s3://lab/runs/again")
    with pytest.raises(FileNotFoundError, match=r"\[Errno 2\] .* 's3://lab/runs/nothing'"):
        open_structure.Sequence.open("s3://lab/runs/nothing")


def test_others_read_what_lies_there(endpoint: str, folder: Path, run: Run) -> None:
    run("copy", folder, "-o", "s3://lab/all/sequence=sphere2")
    run("simulate", "corridor1", "-o", "s3://lab/all/sequence=corridor1")
    run("index", "s3://lab/all")
    assert "all/catalogue.parquet" in keys()
    assert run("validate", "s3://lab/all").count("conformant") == 3
    plain = pq.read_table(folder / "point_measurements.parquet")
    store = S3FileSystem(
        endpoint_override=endpoint.removeprefix("http://"),
        scheme="http",
        access_key="someone",
        secret_key="something",
        region="us-east-1",
    )
    with store.open_input_file("lab/all/sequence=sphere2/point_measurements.parquet") as file:
        assert pq.read_table(file).equals(plain)
    options = {
        "aws_endpoint_url": endpoint,
        "aws_allow_http": "true",
        "aws_access_key_id": "someone",
        "aws_secret_access_key": "something",
        "aws_region": "us-east-1",
    }
    points = pl.scan_parquet("s3://lab/all/*/point_measurements.parquet", hive_partitioning=True, storage_options=options)
    counts = points.group_by("sequence").len().sort("sequence").collect()
    assert [name for name, _ in counts.rows()] == ["corridor1", "sphere2"]
    assert counts["len"][1] == plain.num_rows
