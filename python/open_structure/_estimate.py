"""Estimates as users have them, arrays and tables, into bytes that the native half takes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ._errors import OptionError

Numbers = npt.NDArray[np.float64]


class Kind(NamedTuple):
    """Rows of one kind: their id and their numbers."""

    identity: str
    columns: tuple[str, ...]
    covariance: int


POSE = tuple(f"world_from_camera_{part}" for part in ("tx", "ty", "tz", "qx", "qy", "qz", "qw"))
KINDS = {
    "poses": Kind("frame_id", POSE, 21),
    "points": Kind("point_id", ("x", "y", "z"), 6),
    "lines": Kind("line_id", ("start_x", "start_y", "start_z", "end_x", "end_y", "end_z"), 21),
}
ROTATION_TOLERANCE = 1e-3


def packed(kind: str, given: Any) -> tuple[bytes, bytes, list[list[float] | None] | None]:
    """Ids as 64-bit whole numbers and numbers as 64-bit floats, both in the machine's order, and covariances.

    * ``kind``: ``poses``, ``points`` or ``lines``.
    * ``given``: ``(ids, numbers)``, or anything whose columns are found by name.
    """
    rows = KINDS[kind]
    covariances = None
    if isinstance(given, tuple):
        if len(given) != 2:
            raise OptionError(f"{kind}: expected ids and numbers, found a tuple of {len(given)}")
        ids, numbers = whole(f"{kind}: ids", given[0]), floats(kind, given[1])
        numbers = shaped(kind, rows, len(ids), numbers)
    else:
        one_estimate(kind, given)
        ids = whole(f"{kind}: {rows.identity}", column(kind, given, rows.identity))
        parts = [floats(f"{kind}: {name}", column(kind, given, name)) for name in rows.columns]
        for name, part in zip(rows.columns, parts, strict=True):
            if part.shape != ids.shape:
                raise OptionError(f"{kind}: expected {len(ids)} numbers in {name}, found shape {part.shape}")
        numbers = np.stack(parts, axis=1)
        if has(given, "covariance"):
            covariances = [covariance(kind, rows, row) for row in column(kind, given, "covariance")]
    return ids.tobytes(), np.ascontiguousarray(numbers).tobytes(), covariances


def one_estimate(kind: str, given: Any) -> None:
    """Refuses rows of several estimates, which would become one."""
    if has(given, "estimate"):
        names = sorted({str(name) for name in column(kind, given, "estimate")})
        if len(names) > 1:
            raise OptionError(f"{kind}: expected rows of one estimate, found {', '.join(names)}")


def has(given: Any, name: str) -> bool:
    """Whether a table or mapping has a column."""
    if isinstance(given, Mapping):
        return name in given
    names = getattr(given, "column_names", None)
    return name in list(getattr(given, "columns", ()) if names is None else names)


def column(kind: str, given: Any, name: str) -> Any:
    """A column of a table or mapping, by name."""
    if not has(given, name):
        raise OptionError(f"{kind}: expected a column {name}, found {type(given).__name__} without it")
    return given[name]


def array(what: str, values: Any) -> npt.NDArray[Any]:
    """Anything that numpy takes; what it does not take is an error of ours."""
    if np.ma.isMaskedArray(values):
        if np.ma.getmaskarray(values).any():
            raise OptionError(f"{what}: expected rows without masked numbers; leave them out")
        values = values.data
    try:
        return np.asarray(values)
    except (TypeError, ValueError) as cause:
        raise OptionError(f"{what}: {cause}") from cause


def whole(what: str, values: Any) -> npt.NDArray[np.int64]:
    """One-dimensional whole numbers."""
    found = array(what, values)
    if found.ndim != 1:
        raise OptionError(f"{what}: expected one dimension, found shape {found.shape}")
    if found.size == 0:
        return np.zeros(0, dtype=np.int64)
    if found.dtype.kind not in "iu":
        raise OptionError(f"{what}: expected whole numbers, found {found.dtype}")
    if found.dtype.kind == "u" and found.max() > np.iinfo(np.int64).max:
        raise OptionError(f"{what}: expected ids below 2^63, found {found.max()}")
    return np.ascontiguousarray(found, dtype=np.int64)


def floats(what: str, values: Any) -> Numbers:
    """Numbers of any shape."""
    found = array(what, values)
    if found.size and found.dtype.kind not in "iuf":
        raise OptionError(f"{what}: expected numbers, found {found.dtype}")
    return np.asarray(found, dtype=np.float64)


def shaped(kind: str, rows: Kind, count: int, numbers: Numbers) -> Numbers:
    """Numbers as one row for each id."""
    width = len(rows.columns)
    shapes: list[tuple[int, ...]] = [(count, width)]
    if kind == "poses":
        shapes += [(count, 4, 4), (count, 3, 4)]
    elif kind == "lines":
        shapes += [(count, 2, 3)]
    if numbers.shape not in shapes:
        expected = " or ".join(str(shape) for shape in shapes)
        raise OptionError(f"{kind}: expected shape {expected} for {count} ids, found {numbers.shape}")
    if kind == "poses" and numbers.ndim == 3:
        return from_matrices(numbers)
    return numbers.reshape(count, width)


def from_matrices(matrices: Numbers) -> Numbers:
    """Translation and quaternion x, y, z, w of rigid transforms."""
    rotations, translations = matrices[:, :3, :3], matrices[:, :3, 3]
    row = first(np.logical_not(np.isfinite(matrices)).any(axis=(1, 2)))
    if row is not None:
        raise OptionError(f"poses row {row}: expected finite numbers, found {matrices[row].tolist()}")
    off = np.abs(rotations @ rotations.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2), initial=0.0)
    row = first((off > ROTATION_TOLERANCE) | (np.linalg.det(rotations) < 0.0))
    if row is not None:
        raise OptionError(f"poses row {row}: expected a rotation, found {rotations[row].tolist()}")
    if matrices.shape[1] == 4:
        row = first((matrices[:, 3] != (0.0, 0.0, 0.0, 1.0)).any(axis=1))
        if row is not None:
            raise OptionError(f"poses row {row}: expected a last row of 0, 0, 0, 1, found {matrices[row, 3].tolist()}")
    return np.concatenate([translations, quaternions(rotations)], axis=1)


def pose(what: str, given: Any) -> list[float]:
    """One pose as seven numbers."""
    numbers = floats(what, given)
    if numbers.shape == (4, 4):
        numbers = from_matrices(numbers[np.newaxis])[0]
    if numbers.shape != (7,):
        raise OptionError(f"{what}: expected seven numbers or a matrix (4, 4), found shape {numbers.shape}")
    return [float(number) for number in numbers]


def quaternions(r: Numbers) -> Numbers:
    """Quaternions x, y, z, w of rotations: the eigenvectors of largest eigenvalue of Bar-Itzhack's matrices (2000)."""
    k = np.empty((len(r), 4, 4))
    k[:, 0, 0] = r[:, 0, 0] - r[:, 1, 1] - r[:, 2, 2]
    k[:, 1, 1] = r[:, 1, 1] - r[:, 0, 0] - r[:, 2, 2]
    k[:, 2, 2] = r[:, 2, 2] - r[:, 0, 0] - r[:, 1, 1]
    k[:, 3, 3] = r[:, 0, 0] + r[:, 1, 1] + r[:, 2, 2]
    for i, j in ((0, 1), (0, 2), (1, 2)):
        k[:, i, j] = k[:, j, i] = r[:, j, i] + r[:, i, j]
    for i, (j, l) in enumerate(((2, 1), (0, 2), (1, 0))):
        k[:, i, 3] = k[:, 3, i] = r[:, j, l] - r[:, l, j]
    vectors: Numbers = np.linalg.eigh(k)[1][:, :, -1]
    return vectors


def first(wrong: npt.ArrayLike) -> int | None:
    """The first row that is wrong."""
    rows = np.flatnonzero(wrong)
    return int(rows[0]) if rows.size else None


def covariance(kind: str, rows: Kind, row: Any) -> list[float] | None:
    """The upper triangle of a covariance, or nothing."""
    if row is None:
        return None
    row = row.as_py() if hasattr(row, "as_py") else row
    if row is None:
        return None
    numbers = floats(f"{kind}: covariance", row)
    if numbers.shape != (rows.covariance,) or not np.isfinite(numbers).all():
        raise OptionError(f"{kind}: expected {rows.covariance} finite numbers of a covariance, found {numbers.tolist()}")
    return [float(number) for number in numbers]
