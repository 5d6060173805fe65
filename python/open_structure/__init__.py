"""Measurements instead of images: sequences for comparing SLAM back-ends.

A sequence is one MCAP file or one folder of Parquet files. Any reader of Parquet opens the latter, with no help from this
package; here are both as Arrow tables, and the steps of the program ``os`` as functions::

    import open_structure

    sequence = open_structure.Sequence.open("box1")
    sequence["point_measurements"].to_pandas()

    tracked = open_structure.track(sequence)
    adjusted = open_structure.adjust(open_structure.graph(tracked), method="structural")
    open_structure.evaluate(adjusted).to_pandas()

Lengths are metres, angles radians, positions in images pixels with the origin at the centre of the top-left pixel. Poses are
``world_from_camera``: they take points of the camera (x right, y down, z forward) into the world.
"""

from ._errors import (
    AccessError,
    Error,
    ExistsError,
    FormatError,
    InternalError,
    NotFoundError,
    OptionError,
    StepError,
)
from ._native import (
    Frame,
    Frames,
    Sequence,
    Table,
    __version__,
    adjust,
    evaluate,
    evaluate_frames,
    graph,
    measure,
    recipes,
    simulate,
    track,
    validate,
    write_estimate,
)
from ._report import Finding, Report

__all__ = [
    "AccessError",
    "Error",
    "ExistsError",
    "Finding",
    "FormatError",
    "Frame",
    "Frames",
    "InternalError",
    "NotFoundError",
    "OptionError",
    "Report",
    "Sequence",
    "StepError",
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
