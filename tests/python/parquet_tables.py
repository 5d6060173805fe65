"""Reads every table of a Parquet folder with the packages that anyone would take."""

import json
import sys
from collections import Counter
from pathlib import Path

import duckdb
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq

import expected


def check_values(path: Path, rows: list[expected.Row]) -> None:
    """One line each; all four see the same rows in the same order."""
    assert expected.plain(pq.read_table(path).to_pylist()) == rows
    assert expected.plain(pl.read_parquet(path).to_dicts()) == rows
    assert expected.plain(pl.scan_parquet(path).collect().to_dicts()) == rows
    assert expected.plain(duckdb.read_parquet(str(path)).to_arrow_table().to_pylist()) == rows
    frame = pd.read_parquet(path, dtype_backend="pyarrow")
    assert expected.plain(pa.Table.from_pandas(frame, preserve_index=False).to_pylist()) == rows
    # The plain call turns whole numbers with gaps into floats, so only the shape and the keys are compared.
    frame = pd.read_parquet(path)
    assert len(frame) == len(rows)
    for column in frame.columns[frame.dtypes == "int64"]:
        assert frame[column].tolist() == [row[column] for row in rows]


def keys_of(table: str) -> list[str]:
    """Columns by which a table is sorted."""
    kind = "point_id" if "point" in table else "line_id"
    match table.split("_"):
        case ["frames"] | ["frame", "statistics"]:
            return ["frame_id"]
        case ["structural", "groups"]:
            return ["group_id"]
        case ["trajectories"] | ["tracking"]:
            return ["estimate", "frame_id"]
        case ["iterations"]:
            return ["estimate", "iteration"]
        case ["graph", "poses"]:
            return ["graph", "frame_id"]
        case ["graph", "factors"]:
            return ["graph", "factor_id"]
        case ["graph", _]:
            return ["graph", kind]
        case ["map", _]:
            return ["estimate", kind]
        case [_, "correspondences"]:
            return ["table", kind]
        case [_, "landmarks"]:
            return [kind]
        case _:
            return ["frame_id", kind]


def check_file(path: Path, manifest: dict, json_schema: dict) -> Counter[str]:
    """What stands in the file beside its values; gives the encodings that were chosen."""
    file = pq.ParquetFile(path)
    metadata, table = file.metadata, path.stem
    pairs = {key.decode(): value.decode() for key, value in metadata.metadata.items()}
    assert pairs["open-structure.spec_version"] == manifest["spec_version"]
    assert pairs["open-structure.sequence"] == manifest["name"]
    assert pairs["open-structure.table"] == table
    assert json.loads(pairs["open-structure.conventions"]) == manifest["conventions"]
    assert json.loads(pairs["open-structure.cameras"]) == manifest["cameras"]
    assert metadata.created_by.startswith("open-structure ")
    for field in file.schema_arrow:
        column = json_schema["properties"][field.name]
        for key in ("unit", "space"):
            assert field.metadata[key.encode()].decode() == column[f"x-{key}"] != ""
        assert field.metadata[b"description"].decode() == " ".join(column["description"].split()) != ""
        assert field.nullable == (field.name not in json_schema["required"])
    encodings: Counter[str] = Counter()
    for group in range(metadata.num_row_groups):
        row_group = metadata.row_group(group)
        keys = [file.schema.column(sorting.column_index).name for sorting in row_group.sorting_columns]
        assert keys == keys_of(table) and not any(s.descending for s in row_group.sorting_columns)
        for index in range(row_group.num_columns):
            column = row_group.column(index)
            assert column.compression == "ZSTD"
            assert column.has_column_index and column.has_offset_index
            assert column.is_stats_set and column.statistics.has_null_count
            # Floats are in IEEE 754's total order, which Arrow C++ does not use yet; see `check_floats`.
            # A column without any value has no smallest one.
            if column.physical_type != "DOUBLE":
                assert column.statistics.has_min_max == (column.statistics.num_values > 0), column
            encodings.update(set(column.encodings) - {"RLE"})
    return encodings


def check_floats(path: Path) -> None:
    """Floats have their smallest and largest value too, as DuckDB sees."""
    without = duckdb.execute(
        """SELECT path_in_schema FROM parquet_metadata(?)
           WHERE type = 'DOUBLE' AND stats_min_value IS NULL AND stats_null_count < num_values""",
        [str(path)],
    ).fetchall()
    assert not without, without


def main(folder: Path, rows: dict[str, list[expected.Row]], schema_folder: Path) -> None:
    manifest = json.loads((folder / "sequence.json").read_text())
    assert {path.stem for path in folder.glob("*.parquet")} == set(rows)
    assert {each["table"]: each["rows"] for each in manifest["tables"]} == {
        table: len(table_rows) for table, table_rows in rows.items()
    }
    encodings: Counter[str] = Counter()
    for table, table_rows in rows.items():
        path = folder / f"{table}.parquet"
        check_values(path, table_rows)
        schema = json.loads((schema_folder / f"{table}.schema.json").read_text())
        encodings += check_file(path, manifest, schema)
        check_floats(path)
    # All tables at once, as DuckDB users write it.
    [(count,)] = duckdb.sql(
        f"""SELECT count(*) FROM '{folder}/point_measurements.parquet'
            JOIN '{folder}/frames.parquet' USING (frame_id)"""
    ).fetchall()
    assert count == len(rows["point_measurements"])
    count = sum(map(len, rows.values()))
    print(f"{len(rows)} tables, {count} rows equal, encodings {dict(sorted(encodings.items()))}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), expected.load(Path(sys.argv[2])), Path(sys.argv[3]))
    expected.leave()
