//! Well-known values: the registry of the specification in code.

/// Version of the specification that this crate writes.
pub const SPEC_VERSION: &str = "1.4.0";

/// Camera model: perspective projection without distortion.
pub const PINHOLE: &str = "pinhole";

/// Axes of a camera whose y points down in the image.
pub const RIGHT_DOWN_FORWARD: &str = "right-down-forward";
/// Axes of a camera whose y points up in the image; its `fy` is negative.
pub const RIGHT_UP_FORWARD: &str = "right-up-forward";

/// Pixel (0, 0) is the middle of the top-left pixel.
pub const PIXEL_CENTER: &str = "pixel-center";
/// Pixel (0, 0) is the outer corner of the top-left pixel.
pub const PIXEL_CORNER: &str = "pixel-corner";

/// Removed distortion: k1, k2, p1, p2, k3 of the model that OpenCV uses.
pub const BROWN_CONRADY: &str = "brown-conrady";

/// Clock: the sensor's stamps.
pub const RECORDED: &str = "recorded";
/// Clock: stamps made from a frame rate.
pub const SYNTHETIC: &str = "synthetic";

/// Structural group of parallel lines.
pub const PARALLEL: &str = "parallel";
/// Structural group of three parallel groups, each at right angles to the others.
pub const MANHATTAN: &str = "manhattan";
/// Structural group of one parallel group and several at right angles to it.
pub const ATLANTA: &str = "atlanta";

/// Noise model: none; measurements equal observations.
pub const NOISE_NONE: &str = "none";
/// Noise model: independent Gaussian noise on pixels and depth.
pub const NOISE_GAUSSIAN: &str = "gaussian";
/// Noise model of the first release's generator.
pub const NOISE_FIRST_RELEASE: &str = "first-release";
/// Noise model of the paper, section III-C.
pub const NOISE_PAPER: &str = "paper";
/// Noise model of Kinect disparities.
pub const NOISE_KINECT_DISPARITY: &str = "kinect-disparity";

/// Estimate: frame-to-frame tracking.
pub const FRAME_TO_FRAME: &str = "frame-to-frame";
/// Estimate: map-to-frame tracking.
pub const MAP_TO_FRAME: &str = "map-to-frame";
/// Estimate: bundle adjustment of points.
pub const POINT_BA: &str = "point-ba";
/// Estimate: bundle adjustment of points and lines.
pub const POINT_LINE_BA: &str = "point-line-ba";
/// Estimate: the lines of a sequence before they were made parallel.
pub const UNREFINED: &str = "unrefined";

/// Estimate: bundle adjustment with depth, parallel groups and the declared noise.
pub const STRUCTURAL_BA: &str = "structural-ba";
/// Estimate: adjustment of relative poses alone.
pub const POSE_GRAPH: &str = "pose-graph";

/// Tracking: the pose was given and not estimated.
pub const GAUGE: &str = "gauge";
/// Tracking: the pose follows from the measurements.
pub const TRACKED: &str = "tracked";
/// Tracking: too little was measured; the pose continues the motion before.
pub const PREDICTED: &str = "predicted";
/// Tracking: too little was measured, and there was no motion to continue.
pub const LOST: &str = "lost";

/// Dataset: the first text release of the paper's data.
pub const OPEN_STRUCTURE_TEXT: &str = "open-structure-text";
/// Dataset: TUM RGB-D.
pub const TUM_RGBD: &str = "tum-rgbd";
/// Dataset: ICL-NUIM.
pub const ICL_NUIM: &str = "icl-nuim";
/// Dataset: TartanAir.
pub const TARTANAIR: &str = "tartanair";
/// Dataset: none; a simulator made the scene and the path.
pub const SIMULATION: &str = "simulation";

/// Factor: a point seen in a frame.
pub const POINT_REPROJECTION: &str = "point-reprojection";
/// Factor: a segment of a line seen in a frame.
pub const LINE_REPROJECTION: &str = "line-reprojection";
/// Factor: a relative pose between two frames.
pub const RELATIVE_POSE: &str = "relative-pose";
/// Factor: a line is parallel to its group.
pub const PARALLELISM: &str = "parallelism";

/// A family of well-known values.
#[derive(Clone, Copy, Debug)]
pub struct Family {
    /// Name of the family.
    pub name: &'static str,
    /// Where the values stand, such as `cameras[].model` in the manifest.
    pub place: &'static str,
    /// Whether other values are permitted.
    pub open: bool,
    /// Values with their meaning.
    pub values: &'static [(&'static str, &'static str)],
}

/// Every family, in the order of the specification's registry.
pub const FAMILIES: &[Family] = &[
    Family {
        name: "dataset",
        place: "manifest `source.dataset`",
        open: true,
        values: &[
            (OPEN_STRUCTURE_TEXT, "the first release of the paper's data, as text files"),
            (TUM_RGBD, "TUM RGB-D: a Kinect and a motion-capture system"),
            (ICL_NUIM, "ICL-NUIM: rendered rooms; y points up in the image"),
            (TARTANAIR, "TartanAir: rendered outdoor and indoor scenes; poses are north-east-down"),
            (SIMULATION, "no dataset: a simulator made the scene and the path"),
        ],
    },
    Family {
        name: "camera model",
        place: "manifest `cameras[].model`",
        open: false,
        values: &[(
            PINHOLE,
            "`u = fx x/z + cx`, `v = fy y/z + cy`; pixel positions are free of lens distortion",
        )],
    },
    Family {
        name: "camera axes",
        place: "manifest `cameras[].axes`",
        open: false,
        values: &[
            (RIGHT_DOWN_FORWARD, "x right, y down, z forward; `fy` is positive"),
            (RIGHT_UP_FORWARD, "x right, y up, z forward; `fy` is negative (ICL-NUIM)"),
        ],
    },
    Family {
        name: "pixel origin",
        place: "manifest `cameras[].pixel_origin`",
        open: false,
        values: &[
            (PIXEL_CENTER, "(0, 0) is the middle of the top-left pixel"),
            (PIXEL_CORNER, "(0, 0) is the outer corner of the top-left pixel: its middle is (0.5, 0.5)"),
        ],
    },
    Family {
        name: "removed distortion",
        place: "manifest `cameras[].removed_distortion.model`",
        open: true,
        values: &[(BROWN_CONRADY, "coefficients k1, k2, p1, p2, k3 of the model that OpenCV uses")],
    },
    Family {
        name: "clock",
        place: "manifest `clock.kind`",
        open: false,
        values: &[
            (RECORDED, "the sensor's stamps, nanoseconds since the Unix epoch"),
            (SYNTHETIC, "stamps made from a frame rate; only their differences mean something"),
        ],
    },
    Family {
        name: "group kind",
        place: "`structural_groups.kind`",
        open: true,
        values: &[
            (PARALLEL, "all lines of the group have the same direction, up to sign"),
            (
                MANHATTAN,
                "the lines of three `parallel` groups whose directions are perpendicular to each other; its direction is that of one of them",
            ),
            (
                ATLANTA,
                "the lines of three or more `parallel` groups: one whose direction it has, and others whose directions are perpendicular to that one",
            ),
        ],
    },
    Family {
        name: "noise model",
        place: "manifest `noise.model`",
        open: true,
        values: &[
            (NOISE_NONE, "measurements equal observations; no parameter"),
            (
                NOISE_GAUSSIAN,
                "`u = û + α_u`, `v = v̂ + α_v`, `d = d̂ + α_d` with independent `α_u, α_v ~ N(0, sigma_px²)` and `α_d ~ N(0, sigma_depth_m²)`; parameters `sigma_px`, `sigma_depth_m`",
            ),
            (
                NOISE_FIRST_RELEASE,
                "as `gaussian`, but for the ends of lines a depth noise `α_d` above 0.1 m is replaced by 0.08 m (one below −0.1 m is kept); parameters `sigma_px`, `sigma_depth_m`",
            ),
            (
                NOISE_PAPER,
                "pixels as `gaussian`; `d = m / (m/(d̂ + α_d) + 0.5)`, `α_d ~ N(0, sigma_d²)` with d in centimetres; parameters `sigma_px`, `m`, `sigma_d`",
            ),
            (
                NOISE_KINECT_DISPARITY,
                "pixels as `gaussian`; `d = m / ⌊m/d̃ + α_δ + 0.5⌋` with disparity noise `α_δ ~ N(0, sigma_disparity²)` and d in centimetres; `d̃` is the depth a lateral shift away, section 4.3; parameters `sigma_px`, `m`, `sigma_disparity`, `sigma_lateral_px`",
            ),
        ],
    },
    Family {
        name: "estimate",
        place: "`estimate` of `trajectories`, `map_points` and `map_lines`",
        open: true,
        values: &[
            (FRAME_TO_FRAME, "tracking from frame to frame"),
            (MAP_TO_FRAME, "tracking against a local map"),
            (POINT_BA, "bundle adjustment of points"),
            (POINT_LINE_BA, "bundle adjustment of points and lines"),
            (
                STRUCTURAL_BA,
                "bundle adjustment with depth, the declared noise, and lines that share the directions of their groups",
            ),
            (POSE_GRAPH, "adjustment of relative poses alone"),
            (UNREFINED, "lines as observed, before they were made parallel; recovered"),
        ],
    },
    Family {
        name: "tracking state",
        place: "`tracking.state`",
        open: true,
        values: &[
            (GAUGE, "the pose was given, not estimated: it fixes the coordinate system"),
            (TRACKED, "the pose follows from the measurements"),
            (PREDICTED, "too little was measured: the pose continues the motion of the frames before"),
            (
                LOST,
                "too little was measured, and there was no motion to continue: the pose of the frame before",
            ),
        ],
    },
    Family {
        name: "factor kind",
        place: "`graph_factors.kind`",
        open: true,
        values: &[
            (
                POINT_REPROJECTION,
                "vertices `frame_id`, `point_id`; measurement `u, v` (px) or `u, v, depth` (px, px, m); residual `u − Π(P)`",
            ),
            (
                LINE_REPROJECTION,
                "vertices `frame_id`, `line_id`; measurement `start_u, start_v, end_u, end_v` (px) or `start_u, start_v, start_depth, end_u, end_v, end_depth`; residual: signed distances of both ends to the image of the line",
            ),
            (
                RELATIVE_POSE,
                "vertices `frame_id`, `other_frame_id`; measurement `tx, ty, tz, qx, qy, qz, qw` of `frame_from_other`; information over the tangent `[rotation; translation]`, applied on the left",
            ),
            (
                PARALLELISM,
                "vertex `line_id`, group `group_id`; measurement empty; residual: direction of the line × direction of the group; information over the residual, which for small angles is in radians",
            ),
        ],
    },
];

/// The family of a name.
#[must_use]
pub fn family(name: &str) -> Option<&'static Family> {
    FAMILIES.iter().find(|family| family.name == name)
}

impl Family {
    /// Whether a value is well-known.
    #[must_use]
    pub fn knows(&self, value: &str) -> bool {
        self.values.iter().any(|(known, _)| *known == value)
    }
}

/// Numbers of a factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FactorSize {
    /// Numbers of `measurement`.
    pub measurement: usize,
    /// Side of the information matrix.
    pub dimension: usize,
}

impl FactorSize {
    /// Numbers of `information`: the upper triangle of its matrix.
    #[must_use]
    pub const fn information(self) -> usize {
        self.dimension * (self.dimension + 1) / 2
    }
}

/// What a factor of a well-known kind names and holds.
#[derive(Clone, Copy, Debug)]
pub struct FactorShape {
    /// Kind of the factor.
    pub kind: &'static str,
    /// Columns of vertices and groups that are present; the others are absent.
    pub columns: &'static [&'static str],
    /// Permitted sizes.
    pub sizes: &'static [FactorSize],
}

const fn size(measurement: usize, dimension: usize) -> FactorSize {
    FactorSize { measurement, dimension }
}

/// Shapes of the factors of every well-known kind.
pub const FACTOR_SHAPES: &[FactorShape] = &[
    FactorShape {
        kind: POINT_REPROJECTION,
        columns: &["frame_id", "point_id"],
        sizes: &[size(2, 2), size(3, 3)],
    },
    FactorShape {
        kind: LINE_REPROJECTION,
        columns: &["frame_id", "line_id"],
        sizes: &[size(4, 4), size(6, 6)],
    },
    FactorShape { kind: RELATIVE_POSE, columns: &["frame_id", "other_frame_id"], sizes: &[size(7, 6)] },
    FactorShape { kind: PARALLELISM, columns: &["line_id", "group_id"], sizes: &[size(0, 3)] },
];

/// The shape of a factor of a well-known kind.
#[must_use]
pub fn factor_shape(kind: &str) -> Option<&'static FactorShape> {
    FACTOR_SHAPES.iter().find(|shape| shape.kind == kind)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::{GraphFactor, Record as _};

    #[test]
    fn every_factor_kind_has_a_shape_of_known_columns() {
        let kinds = family("factor kind").unwrap().values;
        assert_eq!(kinds.len(), FACTOR_SHAPES.len());
        for (kind, _) in kinds {
            let shape = factor_shape(kind).unwrap();
            for column in shape.columns {
                assert!(
                    GraphFactor::TABLE.fields.iter().any(|field| field.name == *column && field.nullable)
                );
            }
        }
    }

    #[test]
    fn no_family_and_no_value_is_listed_twice() {
        for (index, family) in FAMILIES.iter().enumerate() {
            assert!(FAMILIES[..index].iter().all(|other| other.name != family.name), "{}", family.name);
            for (place, (value, _)) in family.values.iter().enumerate() {
                assert!(family.values[..place].iter().all(|(other, _)| other != value), "{value}");
            }
        }
    }
}
