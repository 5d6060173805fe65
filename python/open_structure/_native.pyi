"""Types of the native half; what each name means stands in its docstring."""

from collections.abc import Iterator, Mapping, Sequence as _List
from os import PathLike
from typing import Any, Literal, TypeAlias, final, overload

import numpy as np
import numpy.typing as npt
import pandas as pd
import polars as pl
import pyarrow as pa

from ._report import Report

__all__ = [
    "Column",
    "Frame",
    "FrameIterator",
    "Frames",
    "Sequence",
    "Table",
    "__version__",
    "adjust",
    "evaluate",
    "evaluate_frames",
    "graph",
    "measure",
    "recipes",
    "simulate",
    "track",
    "validate",
    "write_estimate",
]

__version__: str

_Path: TypeAlias = str | PathLike[str]
_Ids: TypeAlias = npt.NDArray[np.int64]
_Numbers: TypeAlias = npt.NDArray[np.float64]

@final
class Column:
    """Numbers of a table where they lie: ``numpy.asarray`` looks at them without a copy."""

    def __len__(self) -> int: ...
    @property
    def __array_interface__(self) -> dict[str, Any]: ...

@final
class Table:
    """One table of a sequence, shared with every program that takes Arrow."""

    @property
    def name(self) -> str: ...
    @property
    def column_names(self) -> list[str]: ...
    @property
    def columns(self) -> list[dict[str, Any]]: ...
    @property
    def num_rows(self) -> int: ...
    def __len__(self) -> int: ...
    def __getitem__(self, column: str, /) -> npt.NDArray[Any]: ...
    def __contains__(self, column: object, /) -> bool: ...
    def __iter__(self) -> Iterator[str]: ...
    def __arrow_c_schema__(self) -> Any: ...
    def __arrow_c_array__(self, requested_schema: Any | None = None) -> tuple[Any, Any]: ...
    def __arrow_c_stream__(self, requested_schema: Any | None = None) -> Any: ...
    def to_pyarrow(self) -> pa.Table: ...
    def to_pandas(self) -> pd.DataFrame: ...
    def to_polars(self) -> pl.DataFrame: ...
    def to_numpy(self) -> dict[str, npt.NDArray[Any]]: ...

@final
class Frame:
    """One frame: an exposure of a camera, with its rows of the tables of frames."""

    @property
    def frame_id(self) -> int: ...
    @property
    def stamp_nanos(self) -> int: ...
    @property
    def camera_id(self) -> int: ...
    @property
    def world_from_camera(self) -> _Numbers | None: ...
    @property
    def point_measurements(self) -> Table: ...
    @property
    def line_measurements(self) -> Table: ...
    @property
    def point_observations(self) -> Table: ...
    @property
    def line_observations(self) -> Table: ...

@final
class FrameIterator:
    """Gives one frame after the other."""

    def __iter__(self) -> Iterator[Frame]: ...
    def __next__(self) -> Frame: ...

@final
class Frames:
    """The frames of a sequence, in order; looks like a list."""

    def __len__(self) -> int: ...
    @overload
    def __getitem__(self, place: int, /) -> Frame: ...
    @overload
    def __getitem__(self, place: slice, /) -> list[Frame]: ...
    def __iter__(self) -> Iterator[Frame]: ...
    def __reversed__(self) -> Iterator[Frame]: ...

@final
class Sequence:
    """A sequence: measurements of a camera's way, and what estimators made of them."""

    @staticmethod
    def open(path: _Path) -> Sequence: ...
    @property
    def path(self) -> PathLike[str] | str | None: ...
    @property
    def name(self) -> str: ...
    @property
    def manifest(self) -> dict[str, Any]: ...
    @property
    def cameras(self) -> list[dict[str, Any]]: ...
    @property
    def summary(self) -> dict[str, Any] | None: ...
    @property
    def tables(self) -> list[str]: ...
    @property
    def estimates(self) -> list[str]: ...
    @property
    def graphs(self) -> list[str]: ...
    @property
    def frames(self) -> Frames: ...
    def table(self, name: str) -> Table: ...
    def frame(self, frame_id: int) -> Frame: ...
    def poses(self, name: str = "truth") -> tuple[_Ids, _Numbers]: ...
    def validate(self, *, max_findings: int = 5) -> Report: ...
    def write(self, path: _Path, *, force: bool = False, foxglove: bool = False) -> Sequence: ...
    def with_estimate(
        self,
        name: str,
        poses: Any | None = None,
        *,
        points: Any | None = None,
        lines: Any | None = None,
        replace: bool = False,
    ) -> Sequence: ...
    def _ipython_key_completions_(self) -> list[str]: ...
    def __getitem__(self, name: str, /) -> Table: ...
    def __contains__(self, table: object, /) -> bool: ...
    def __copy__(self) -> Sequence: ...
    def __deepcopy__(self, memo: Any, /) -> Sequence: ...
    def __len__(self) -> int: ...
    def __iter__(self) -> Iterator[Frame]: ...

def recipes() -> list[str]: ...
def simulate(recipe: _Path | dict[str, Any], *, seed: int | None = None) -> Sequence: ...
def measure(
    sequence: Sequence | _Path,
    noise: Literal["none", "gaussian", "first-release", "paper", "kinect-disparity"],
    *,
    seed: int = 0,
    set: Mapping[str, float] | None = None,
    outliers: float | None = None,
    missed: float | None = None,
    quantise: float | None = None,
    drop_outside: bool = False,
    keep_depth: bool = False,
    keep_estimates: bool = False,
    complete_depths: bool = False,
    name: str | None = None,
) -> Sequence: ...
def track(
    sequence: Sequence | _Path,
    *,
    method: Literal["map-to-frame", "frame-to-frame"] = "map-to-frame",
    classic: bool = False,
    sensor: Literal["monocular", "stereo", "rgbd"] | None = None,
    baseline: float | None = None,
    first_pose: _List[float] | _Numbers | None = None,
    seed: int = 0,
    name: str | None = None,
    replace: bool = False,
) -> Sequence: ...
def graph(
    sequence: Sequence | _Path,
    *,
    estimate: str | None = None,
    kind: Literal["reprojection", "pose-graph"] = "reprojection",
    name: str | None = None,
    min_views: int = 2,
    key_frames: bool = False,
    most_shared: float | None = None,
    longest_gap: int | None = None,
    loop_gap: int | None = None,
    loop_shared: int | None = None,
    no_loops: bool = False,
    seed: int = 0,
    replace: bool = False,
) -> Sequence: ...
def adjust(
    sequence: Sequence | _Path,
    *,
    method: Literal["point", "point-line", "structural", "pose-graph"] = "point-line",
    graph: str | None = None,
    name: str | None = None,
    points: Literal["xyz", "inverse-depth", "parallax"] | None = None,
    lines: Literal["orthonormal", "endpoints", "plucker-cayley"] | None = None,
    loss: str | None = None,
    optimiser: Literal["lm", "dogleg"] = "lm",
    max_iterations: int | None = None,
    tolerance: float | None = None,
    min_views: int | None = None,
    fix: _List[int] = (),
    sigma_px: float | None = None,
    soft: float | None = None,
    no_groups: bool = False,
    no_motion: bool = False,
    eliminate: Literal["landmarks", "poses", "nothing"] | None = None,
    factorise: Literal["dense", "sparse", "iterative"] | None = None,
    covariance: bool = False,
    replace: bool = False,
    threads: int | None = None,
) -> Sequence: ...
def evaluate(
    sequence: Sequence | _Path,
    *,
    estimate: str | _List[str] | None = None,
    reference: str = "truth",
    align: Literal["none", "origin", "se3", "sim3", "scale"] = "se3",
    align_first: int | None = None,
    relation: str | _List[str] | None = None,
    rpe_delta: float = 1.0,
    rpe_unit: Literal["f", "m", "d", "r"] = "f",
    all_pairs: bool = False,
    pairs_from_reference: bool = False,
) -> Table: ...
def evaluate_frames(
    sequence: Sequence | _Path,
    *,
    estimate: str | _List[str] | None = None,
    reference: str = "truth",
    align: Literal["none", "origin", "se3", "sim3", "scale"] = "se3",
    align_first: int | None = None,
    rpe_delta: float = 1.0,
    rpe_unit: Literal["f", "m", "d", "r"] = "f",
    all_pairs: bool = False,
    pairs_from_reference: bool = False,
) -> Table: ...
def validate(path: _Path, *, max_findings: int = 5) -> Report: ...
def write_estimate(
    sequence: Sequence | _Path,
    path: _Path,
    name: str,
    poses: Any | None = None,
    *,
    points: Any | None = None,
    lines: Any | None = None,
    replace: bool = False,
    force: bool = False,
) -> Sequence: ...
