"""Writes the tables of a sequence anew, as someone would who never heard of our library.

Every column may be null as far as the file says, columns come in another order, some that may be absent
are, and one is there that nobody knows.
"""

import shutil
import sys
from pathlib import Path

import duckdb
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq

import expected

LEFT_OUT = {
    "point_landmarks": ["descriptor"],
    "point_observations": ["depth"],
    "graph_factors": ["information"],
}


def main(tool: str, folder: Path, output: Path) -> None:
    output.mkdir()
    shutil.copy(folder / "sequence.json", output)
    for path in sorted(folder.glob("*.parquet")):
        arrow = pq.read_table(path)
        # Without our metadata, nullability and element names.
        bare = pa.schema([pa.field(field.name, bare_type(field.type)) for field in arrow.schema])
        arrow = pa.table(arrow.columns, schema=bare).drop_columns(LEFT_OUT.get(path.stem, []))
        remark = pa.array(["a note"] * arrow.num_rows)
        arrow = arrow.select(arrow.column_names[::-1]).append_column("remark", remark)
        target = output / path.name
        match tool:
            case "pandas":
                arrow.to_pandas(types_mapper=pd.ArrowDtype).to_parquet(target)
            case "polars":
                pl.from_arrow(arrow).write_parquet(target)
            case "duckdb":
                duckdb.from_arrow(arrow).write_parquet(str(target))
            case "pyarrow":
                pq.write_table(arrow, target, compression="none", data_page_version="2.0", version="1.0")
            case _:
                raise SystemExit(f"no such tool: {tool}")
        columns = pq.ParquetFile(target).schema
        levels = [columns.column(index).max_definition_level for index in range(len(columns))]
        assert min(levels) > 0, "every column is optional"
    print(f"{tool} wrote {len(list(output.iterdir())) - 1} tables")


def bare_type(data_type: pa.DataType) -> pa.DataType:
    return pa.list_(data_type.value_type) if pa.types.is_list(data_type) else data_type


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3]))
    expected.leave()
