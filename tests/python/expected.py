"""What the sequence holds, as JSON lines that the test wrote from its rows in memory."""

import json
from pathlib import Path
from typing import Any

Row = dict[str, Any]


def load(folder: Path) -> dict[str, list[Row]]:
    """Rows of every table, by table name; absent values are left out."""
    return {
        path.stem: [json.loads(line) for line in path.read_text().splitlines()]
        for path in sorted(folder.glob("*.jsonl"))
    }


def plain(rows: list[Row]) -> list[Row]:
    """Rows of a data frame as JSON has them: no absent values, bytes as hexadecimal digits."""
    return [{name: _plain(value) for name, value in row.items() if value is not None} for row in rows]


def _plain(value: Any) -> Any:
    return value.hex() if isinstance(value, bytes) else value
