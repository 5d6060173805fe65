"""Loads the folder through its Croissant description, offline, as a data catalogue would."""

import hashlib
import json
import logging
import sys
from pathlib import Path

import mlcroissant as mlc

import expected


def main(folder: Path, rows: dict[str, list[expected.Row]]) -> None:
    path = folder / "croissant.json"
    description, manifest = json.loads(path.read_text()), json.loads((folder / "sequence.json").read_text())
    assert description["license"] == manifest["source"]["licence"]
    assert description["citeAs"] == manifest["source"]["citation"]
    files = {entry["@id"]: entry for entry in description["distribution"]}
    assert set(files) == {p.name for p in folder.iterdir()} - {"croissant.json"}
    for name, entry in files.items():
        data = (folder / name).read_bytes()
        assert entry["sha256"] == hashlib.sha256(data).hexdigest()
        assert entry["contentSize"] == f"{len(data)} B"

    dataset = mlc.Dataset(jsonld=path)
    issues = dataset.metadata.ctx.issues
    assert not issues.errors, issues.report()
    # A sequence does not know when it is published.
    unexpected = [warning for warning in issues.warnings if "datePublished" not in warning]
    assert not unexpected, unexpected
    count = 0
    for record_set in dataset.metadata.record_sets:
        wanted = rows[record_set.name]
        found = list(dataset.records(record_set.name))
        assert len(found) == len(wanted), record_set.name
        for record, row in zip(found, wanted, strict=True):
            named = {key.removeprefix(f"{record_set.name}/"): value for key, value in record.items()}
            for name, value in row.items():
                if isinstance(value, int | float):
                    # It reads with pandas, to whom whole numbers with gaps are floats.
                    whole = all(name in each for each in wanted)
                    assert named[name] == (value if whole else float(value)), (record_set.name, name, value)
            count += 1
    assert {record_set.name for record_set in dataset.metadata.record_sets} == set(rows)
    print(f"{len(files)} files, {len(rows)} record sets, {count} records, no errors")


if __name__ == "__main__":
    logging.getLogger("absl").setLevel(logging.ERROR)
    main(Path(sys.argv[1]), expected.load(Path(sys.argv[2])))
    expected.leave()
