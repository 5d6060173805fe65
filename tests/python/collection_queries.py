"""Queries a whole collection with the engines that anyone would take, and sees that they open no file in vain."""

import json
import sys
from pathlib import Path

import duckdb
import polars as pl
import pyarrow.dataset as ds

import expected

TABLE = "point_measurements"


def duckdb_counts(folder: Path, where: str = "") -> dict[str, int]:
    """Rows of a table by sequence, as the specification writes the query."""
    rows = duckdb.sql(
        f"""SELECT sequence, count(*) FROM read_parquet('{folder}/*/{TABLE}.parquet', hive_partitioning = true,
            hive_types = {{'sequence': varchar}}) {where} GROUP BY ALL"""
    ).fetchall()
    return dict(rows)


def polars_table(folder: Path) -> pl.LazyFrame:
    return pl.scan_parquet(
        folder / "*" / f"{TABLE}.parquet", hive_partitioning=True, hive_schema={"sequence": pl.String}
    )


def polars_counts(rows: pl.LazyFrame) -> dict[str, int]:
    return dict(rows.group_by("sequence").len().collect().iter_rows())


def check_catalogue(folder: Path, wanted: dict[str, int]) -> None:
    """The catalogue is one small table, and joins with all the others."""
    path = folder / "catalogue.parquet"
    catalogue = pl.read_parquet(path)
    assert dict(catalogue.select("sequence", TABLE).iter_rows()) == wanted
    assert catalogue["estimates"].dtype == pl.List(pl.String)
    assert duckdb.read_parquet(str(path)).to_arrow_table().to_pylist() == catalogue.to_dicts()
    joined = duckdb.sql(
        f"""SELECT c.sequence, c.frames, count(*) FROM read_parquet('{folder}/*/frames.parquet',
            hive_partitioning = true, hive_types = {{'sequence': varchar}}) AS f
            JOIN '{path}' AS c USING (sequence) GROUP BY ALL"""
    ).fetchall()
    assert len(joined) == len(wanted) and all(frames == count for _, frames, count in joined)
    listed = f"SELECT sequence FROM '{path}' WHERE list_contains(estimates, 'only-here')"
    [(name,)] = duckdb.sql(listed).fetchall()
    assert name in wanted


def check_pruning(folder: Path, wanted: dict[str, int]) -> None:
    """Files of other sequences are not opened: they may be nonsense."""
    *others, last = sorted(wanted)
    one = others[0]
    condition = f"WHERE sequence = '{one}'"
    # What the engine says of itself.
    plan = duckdb.sql(
        f"""EXPLAIN ANALYZE SELECT sum(u) FROM read_parquet('{folder}/*/{TABLE}.parquet',
            hive_partitioning = true, hive_types = {{'sequence': varchar}}) {condition}"""
    ).fetchall()
    text = " ".join(str(part) for row in plan for part in row)
    assert f"Scanning Files: 1/{len(wanted)}" in text and "Total Files Read: 1" in text, text
    # What cannot be read if it is opened.
    [damaged] = [path for path in folder.glob(f"*/{TABLE}.parquet") if path.parent.name.endswith(last)]
    whole = damaged.read_bytes()
    damaged.write_bytes(b"PAR1 and nothing else")
    try:
        assert duckdb_counts(folder, condition) == {one: wanted[one]}
        assert polars_counts(polars_table(folder).filter(pl.col("sequence") == one)) == {one: wanted[one]}
        for fails in (lambda: duckdb_counts(folder), lambda: polars_counts(polars_table(folder))):
            try:
                fails()
            except (duckdb.Error, pl.exceptions.PolarsError):
                continue
            raise AssertionError("a damaged file was not noticed: the check above shows nothing")
    finally:
        damaged.write_bytes(whole)


def main(folder: Path, wanted: dict[str, int]) -> None:
    assert duckdb_counts(folder) == wanted
    assert polars_counts(polars_table(folder)) == wanted
    partitioning = ds.partitioning(flavor="hive")
    files = sorted(str(path) for path in folder.glob(f"*/{TABLE}.parquet"))
    dataset = ds.dataset(files, partitioning=partitioning, partition_base_dir=str(folder))
    found = dataset.to_table(["sequence"])
    counts = found.group_by("sequence").aggregate([([], "count_all")]).to_pylist()
    assert {row["sequence"]: row["count_all"] for row in counts} == wanted
    check_catalogue(folder, wanted)
    check_pruning(folder, wanted)
    print(f"{len(wanted)} sequences, {sum(wanted.values())} rows of {TABLE}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), json.loads(Path(sys.argv[2]).read_text()))
    expected.leave()
