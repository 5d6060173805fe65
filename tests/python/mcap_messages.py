"""Reads every message of an MCAP file with the packages that anyone would take."""

import json
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import pyarrow as pa
from jsonschema import Draft202012Validator
from mcap.reader import NonSeekingReader, make_reader
from pyarrow import ipc

import expected

PER_FRAME = {"point_observations", "line_observations", "point_measurements", "line_measurements"}


def check_for_viewers(schema: Any) -> None:
    """Foxglove and Lichtblick parse schemas without references, unions and lists of types."""
    if isinstance(schema, dict):
        assert not {"$ref", "anyOf", "oneOf", "allOf"} & set(schema), schema
        assert isinstance(schema.get("type", ""), str | dict), schema
    for part in schema.values() if isinstance(schema, dict) else schema if isinstance(schema, list) else []:
        check_for_viewers(part)


def check_container(path: Path, manifest: dict) -> None:
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == ""
        identity = {record.name: record.metadata for record in reader.iter_metadata()}
        assert identity == {
            "open-structure": {"name": manifest["name"], "spec_version": manifest["spec_version"]}
        }
        summary = reader.get_summary()
        assert summary and summary.statistics and summary.chunk_indexes
        counted = summary.statistics
        assert counted.chunk_count == len(summary.chunk_indexes)
        assert counted.message_count == sum(counted.channel_message_counts.values())
        assert all(chunk.compression == "zstd" for chunk in summary.chunk_indexes)
        assert all(chunk.message_index_offsets for chunk in summary.chunk_indexes)
        assert len(summary.metadata_indexes) == 1 and not summary.attachment_indexes
    with path.open("rb") as file:
        # From front to back, as from a pipe, with every CRC checked.
        streamed = sum(1 for _ in NonSeekingReader(file, validate_crcs=True).iter_messages())
    assert streamed == counted.message_count


def check_schema(table: str, schema: pa.Schema, json_schema: dict) -> None:
    """The Arrow schema and the JSON schema say the same of every column."""
    assert schema.metadata[b"open-structure.table"].decode() == table
    columns = json_schema["properties"]
    assert set(schema.names) == set(columns)
    for field in schema:
        assert not pa.types.is_dictionary(field.type)
        column = columns[field.name]
        assert field.metadata[b"unit"].decode() == column["x-unit"] != ""
        assert field.metadata[b"space"].decode() == column["x-space"] != ""
        assert field.metadata[b"description"].decode() == " ".join(column["description"].split()) != ""
        assert field.nullable == (field.name not in json_schema["required"])


def main(path: Path, rows: dict[str, list[expected.Row]], schema_folder: Path) -> None:
    texts = {p.name.removesuffix(".schema.json"): p.read_bytes() for p in schema_folder.iterdir()}
    schemas = {name: json.loads(text) for name, text in texts.items()}
    validators = {name: Draft202012Validator(schema) for name, schema in schemas.items()}
    for schema in schemas.values():
        Draft202012Validator.check_schema(schema)
        check_for_viewers(schema)
    # Every row, written as JSON, satisfies the schema of its table.
    for table, table_rows in rows.items():
        for row in table_rows:
            validators[table].validate(row)

    stamps = {frame["frame_id"]: frame["stamp_nanos"] for frame in rows["frames"]}
    first, last = min(stamps.values()), max(stamps.values())
    found: dict[str, list[expected.Row]] = defaultdict(list)
    records: dict[str, list[expected.Row]] = defaultdict(list)
    frames_of: dict[str, list[int]] = defaultdict(list)
    encodings: dict[str, int] = defaultdict(int)
    with path.open("rb") as file:
        before = 0
        for schema, channel, message in make_reader(file).iter_messages(log_time_order=False):
            assert before <= message.log_time == message.publish_time
            before = message.log_time
            name = channel.topic.removeprefix("/")
            encodings[schema.encoding] += 1
            if schema.encoding == "jsonschema":
                assert channel.message_encoding == "json"
                assert schema.name == f"open_structure.{name}" and schema.data == texts[name]
                record = json.loads(message.data)
                validators[name].validate(record)
                records[name].append(record)
                assert message.log_time == (first if name == "manifest" else last)
            elif schema.encoding == "arrow":
                assert channel.message_encoding == "arrow"
                arrow = ipc.read_schema(pa.py_buffer(schema.data))
                check_schema(name, arrow, schemas[name])
                batch = ipc.read_record_batch(pa.py_buffer(message.data), arrow)
                batch.validate(full=True)
                found[name] += expected.plain(batch.to_pylist())
                if name in PER_FRAME:
                    frame = set(batch["frame_id"].to_pylist())
                    assert [message.log_time] == [stamps[each] for each in frame]
                    frames_of[name] += frame
                else:
                    assert message.log_time == first
            else:
                assert schema.encoding == "protobuf" and name.startswith("foxglove/")
    assert found == rows
    for table, frames in frames_of.items():
        assert len(frames) == len(set(frames)), f"{table}: one message per frame"
    [manifest] = records["manifest"]
    assert {each["table"]: each["rows"] for each in records["table_summaries"]} == {
        table: len(table_rows) for table, table_rows in rows.items()
    }
    check_container(path, manifest)
    print(f"{sum(encodings.values())} messages {dict(encodings)}, {sum(map(len, rows.values()))} rows equal")


if __name__ == "__main__":
    main(Path(sys.argv[1]), expected.load(Path(sys.argv[2])), Path(sys.argv[3]))
    expected.leave()
