//! Well-known values: the registry of the specification in code.

/// Version of the specification that this crate writes.
pub const SPEC_VERSION: &str = "1.0.0";

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

/// Clock: the sensor's stamps.
pub const RECORDED: &str = "recorded";
/// Clock: stamps made from a frame rate.
pub const SYNTHETIC: &str = "synthetic";

/// Structural group of parallel lines.
pub const PARALLEL: &str = "parallel";

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
    /// Where the values stand, such as `camera.model`.
    pub name: &'static str,
    /// Whether other values are permitted.
    pub open: bool,
    /// Values with their meaning.
    pub values: &'static [(&'static str, &'static str)],
}

/// Every family, in the order of the specification's registry.
pub const FAMILIES: &[Family] = &[
    Family {
        name: "camera model",
        open: false,
        values: &[(
            PINHOLE,
            "`u = fx x/z + cx`, `v = fy y/z + cy`; pixel positions are free of lens distortion",
        )],
    },
    Family {
        name: "camera axes",
        open: false,
        values: &[
            (RIGHT_DOWN_FORWARD, "x right, y down, z forward; `fy` is positive"),
            (RIGHT_UP_FORWARD, "x right, y up, z forward; `fy` is negative (ICL-NUIM)"),
        ],
    },
    Family {
        name: "pixel origin",
        open: false,
        values: &[
            (PIXEL_CENTER, "(0, 0) is the middle of the top-left pixel"),
            (PIXEL_CORNER, "(0, 0) is the outer corner of the top-left pixel: its middle is (0.5, 0.5)"),
        ],
    },
    Family {
        name: "removed distortion",
        open: true,
        values: &[("brown-conrady", "coefficients k1, k2, p1, p2, k3 of the model that OpenCV uses")],
    },
    Family {
        name: "clock",
        open: false,
        values: &[
            (RECORDED, "the sensor's stamps, nanoseconds since the Unix epoch"),
            (SYNTHETIC, "stamps made from a frame rate; only their differences mean something"),
        ],
    },
    Family {
        name: "group kind",
        open: true,
        values: &[(PARALLEL, "all lines of the group have the same direction, up to sign")],
    },
    Family {
        name: "noise model",
        open: true,
        values: &[
            (NOISE_NONE, "measurements equal observations; no parameter"),
            (
                NOISE_GAUSSIAN,
                "`u = û + α_u`, `v = v̂ + α_v`, `d = d̂ + α_d` with independent `α_u, α_v ~ N(0, sigma_px²)` and `α_d ~ N(0, sigma_depth_m²)`; parameters `sigma_px`, `sigma_depth_m`",
            ),
            (
                NOISE_FIRST_RELEASE,
                "as `gaussian`, but for the ends of lines a depth noise above 0.1 m is replaced by 0.08 m; parameters `sigma_px`, `sigma_depth_m`",
            ),
            (
                NOISE_PAPER,
                "pixels as `gaussian`; `d = m / (m/(d̂ + α_d) + 0.5)`, `α_d ~ N(0, sigma_d²)` with d in centimetres; parameters `sigma_px`, `m`, `sigma_d`",
            ),
            (
                NOISE_KINECT_DISPARITY,
                "pixels as `gaussian`; `d = m / (⌊m/d̂ + α_δ + 0.5⌋)` with disparity noise `α_δ ~ N(0, sigma_disparity²)` and d in centimetres; parameters `sigma_px`, `m`, `sigma_disparity`",
            ),
        ],
    },
    Family {
        name: "estimate",
        open: true,
        values: &[
            (FRAME_TO_FRAME, "tracking from frame to frame"),
            (MAP_TO_FRAME, "tracking against a local map"),
            (POINT_BA, "bundle adjustment of points"),
            (POINT_LINE_BA, "bundle adjustment of points and lines"),
        ],
    },
    Family {
        name: "factor kind",
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
                "vertices `frame_id`, `other_frame_id`; measurement `tx, ty, tz, qx, qy, qz, qw` of `frame_from_other`; information over the tangent `[rotation; translation]`",
            ),
            (
                PARALLELISM,
                "vertices `line_id`; `group_id`; measurement empty; residual: direction of the line × direction of the group",
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
