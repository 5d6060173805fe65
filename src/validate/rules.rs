//! The rules of the specification, in its order.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a broken rule means.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(inline)]
pub enum Severity {
    /// Worth knowing; the sequence conforms all the same.
    Advice,
    /// The specification says SHOULD; the sequence conforms.
    Warning,
    /// The specification says MUST; the sequence does not conform.
    Error,
}

impl Severity {
    /// `error`, `warning` or `advice`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Advice => "advice",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// One rule of the specification.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Rule {
    /// Its stable name.
    pub id: &'static str,
    /// What breaking it means.
    pub severity: Severity,
    /// Section of the specification.
    pub section: &'static str,
    /// What must or should hold, in one sentence.
    pub statement: &'static str,
    /// The reason, where it is not plain.
    pub why: Option<&'static str>,
    /// First version of the specification with the rule.
    pub since: &'static str,
}

macro_rules! rules {
    ($($variant:ident: $id:literal, $severity:ident, $section:literal, $statement:literal, $why:expr, $since:literal;)+) => {
        /// A rule, as the checks name it.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub(crate) enum RuleId {
            $($variant),+
        }

        /// Every rule, in the order of the specification.
        pub const RULES: &[Rule] = &[
            $(Rule {
                id: $id,
                severity: Severity::$severity,
                section: $section,
                statement: $statement,
                why: $why,
                since: $since,
            }),+
        ];
    };
}

rules! {
    ContainerReadable: "container-readable", Error, "3",
        "A sequence MUST be an MCAP file or a Parquet folder that can be decoded throughout.",
        None, "1.0.0";
    ContainerChecksums: "container-checksums", Error, "9.1",
        "Every CRC of an MCAP file MUST be right.",
        None, "1.0.0";
    McapProfileEmpty: "mcap-profile-empty", Error, "9.1",
        "The profile of an MCAP file MUST be the empty string.",
        None, "1.0.0";
    McapIdentity: "mcap-identity", Error, "9.2",
        "An MCAP file MUST hold one Metadata record `open-structure` whose `spec_version` and `name` equal those of the manifest.",
        None, "1.0.0";
    McapIndexed: "mcap-indexed", Error, "9.1",
        "An MCAP file MUST be chunked and have a summary section with statistics, chunk index, message indexes, and repeated channels and schemas.",
        Some("A reader finds one frame of a large file without reading the rest."), "1.0.0";
    McapSchemasEmbedded: "mcap-schemas-embedded", Error, "9.4",
        "A table's channel MUST carry its Arrow schema, and a JSON channel a JSON Schema that its messages satisfy.",
        None, "1.0.0";
    McapMessageTimes: "mcap-message-times", Error, "9.3",
        "The manifest and the tables that are stored whole MUST be stamped with the first frame's stamp, rows of a frame with its stamp, and table summaries with the last frame's; log times MUST NOT fall in file order.",
        None, "1.0.0";
    McapOneMessagePerFrame: "mcap-one-message-per-frame", Error, "9.3",
        "A table that is stored per frame MUST have at most one message for each frame, with the rows of that frame alone.",
        None, "1.0.0";
    ManifestSchema: "manifest-schema", Error, "5",
        "The manifest MUST satisfy its JSON Schema.",
        None, "1.0.0";
    ManifestVersion: "manifest-version", Error, "5",
        "`spec_version` MUST be `major.minor.patch` with a known major version; this text describes major version 1.",
        None, "1.0.0";
    ManifestName: "manifest-name", Error, "5",
        "`name` MUST NOT be empty, nor contain `/`, `\\` or control characters.",
        Some("Tools make file names of it."), "1.0.0";
    ManifestConventions: "manifest-conventions", Error, "5.4",
        "`conventions` MUST hold the values of version 1: `world_from_camera`, `hamilton-xyzw`, `z`, `m`, `rad`, `px`, `ns`.",
        None, "1.0.0";
    CamerasValid: "cameras-valid", Error, "5.5",
        "Camera ids MUST be unique and at least 0; `width` and `height` at least 1; `fx`, `fy`, `cx` and `cy` finite; `fx` greater than 0; `fy` not 0; `depth_min` and `depth_max`, where given, greater than 0 and in this order.",
        None, "1.0.0";
    CameraAxes: "camera-axes", Error, "5.5",
        "`axes` MUST be `right-up-forward` exactly when `fy` is negative.",
        None, "1.0.0";
    RegistryClosed: "registry-closed", Error, "5.1",
        "Values of closed families (camera model, camera axes, pixel origin, clock) MUST be registered.",
        Some("A reader that does not know them cannot use the numbers."), "1.0.0";
    RegistryOpen: "registry-open", Advice, "5.1",
        "Values of open families (removed distortion, group kind, noise model, estimate, factor kind) are best taken from the registry.",
        None, "1.0.0";
    UnknownContent: "unknown-content", Advice, "12",
        "Readers pass over columns, tables, topics, files and manifest members that they do not know, and a validator mentions them.",
        None, "1.0.0";
    SourceDocumented: "source-documented", Advice, "5.2",
        "`licence` and `citation` of the source are best given.",
        None, "1.0.0";
    FramesPresent: "frames-present", Error, "3",
        "The table `frames` MUST be there.",
        None, "1.0.0";
    TablesListed: "tables-listed", Error, "5.9",
        "The table summaries MUST list exactly the known tables that are there, each once.",
        None, "1.0.0";
    TableRows: "table-rows", Error, "5.9",
        "The number of rows of a table MUST equal that of its summary.",
        None, "1.0.0";
    TableDigest: "table-digest", Error, "5.9",
        "The digest of a table MUST equal that of its summary.",
        Some("It is the same in both encodings, so a copy can be held against its original."), "1.0.0";
    ColumnsPresent: "columns-present", Error, "6.1",
        "Columns that are not nullable MUST be there.",
        None, "1.0.0";
    ColumnsTyped: "columns-typed", Error, "6.1",
        "Columns MUST have the types of this specification.",
        None, "1.0.0";
    ColumnsNotNull: "columns-not-null", Error, "6.1",
        "Values of columns that are not nullable, and elements of lists, MUST NOT be null.",
        None, "1.0.0";
    RowsOrdered: "rows-ordered", Error, "6.1",
        "Rows MUST be sorted by key, ascending; text is compared byte by byte.",
        Some("One frame is found without reading the others."), "1.0.0";
    KeysUnique: "keys-unique", Error, "6.1",
        "A key MUST NOT occur twice in a table.",
        None, "1.0.0";
    IdsNotNegative: "ids-not-negative", Error, "4.7",
        "Ids and row numbers MUST NOT be negative.",
        None, "1.0.0";
    ValuesFinite: "values-finite", Error, "4.8",
        "Floats MUST be finite.",
        Some("What is not known is null, not NaN."), "1.0.0";
    StampsOrdered: "stamps-ordered", Error, "6.2",
        "Stamps MUST NOT be negative and MUST NOT fall from frame to frame.",
        None, "1.0.0";
    CameraKnown: "camera-known", Error, "6.2",
        "The camera of a frame MUST be in the manifest.",
        None, "1.0.0";
    PoseWhole: "pose-whole", Error, "6.2",
        "The seven pose columns of a frame MUST be present together or absent together.",
        None, "1.0.0";
    QuaternionUnit: "quaternion-unit", Error, "4.3",
        "Quaternions MUST have unit length within 1e-3.",
        Some("Sources print as few as four decimals and their digits are kept; readers normalise."), "1.0.0";
    FrameKnown: "frame-known", Error, "6.1",
        "A frame id in any table MUST be in `frames`.",
        None, "1.0.0";
    LandmarkKnown: "landmark-known", Warning, "6.1",
        "A landmark that is measured or observed SHOULD be in its landmark table, where that table is there.",
        None, "1.0.0";
    LandmarkSeen: "landmark-seen", Advice, "6.1",
        "A landmark is best shown by at least one row.",
        None, "1.0.0";
    CorrespondencesAgree: "correspondences-agree", Error, "6.10",
        "Each entry of a correspondence MUST name a row of its table that shows this landmark in this frame; `frame_ids` and `rows` have equal lengths; `table` is one of the two tables of the kind; every row of the table is named once.",
        None, "1.0.0";
    EstimatesDistinct: "estimates-distinct", Advice, "6.3",
        "Two estimates with identical poses are probably one.",
        None, "1.0.0";
    PixelInImage: "pixel-in-image", Warning, "6.19",
        "Pixel positions SHOULD lie within the image, widened by 1 px for observations and by 6 sigma and half a rounding step for measurements; sigma is that of the declared noise, else 1 px.",
        Some("Noise carries measurements over the edge; sigma is the declared one, else 1 px."), "1.0.0";
    DepthPositive: "depth-positive", Error, "4.4",
        "Depths MUST be greater than 0.",
        None, "1.0.0";
    SegmentPixelsDistinct: "segment-pixels-distinct", Warning, "6.19",
        "The two ends of a segment SHOULD differ.",
        None, "1.0.0";
    LineFormsAgree: "line-forms-agree", Error, "6.5",
        "The three forms of a line landmark MUST say the same line: angle at most 1e-9 rad, distance at most 1e-9 m times max(1, distance from the origin in metres).",
        None, "1.0.0";
    PluckerConstraint: "plucker-constraint", Error, "6.5",
        "Moment and direction MUST be perpendicular, `|n · d| ≤ 1e-9 max(1, |n|)`, and the direction of unit length within 1e-9.",
        None, "1.0.0";
    SegmentLength: "segment-length", Error, "6.5",
        "The ends of a line landmark MUST NOT coincide.",
        None, "1.0.0";
    GroupLinesKnown: "group-lines-known", Warning, "6.6",
        "Lines of a group SHOULD be in `line_landmarks`, where that table is there.",
        None, "1.0.0";
    GroupLinesUnique: "group-lines-unique", Error, "6.6",
        "A group MUST list at least one line, ascending without repetition, and a line MUST be in at most one group of a kind.",
        None, "1.0.0";
    GroupLinesParallel: "group-lines-parallel", Error, "6.6",
        "Lines of a `parallel` group MUST be parallel to the group's direction within 1e-3 rad, whatever their sign.",
        Some("A solver may share one direction among them."), "1.0.0";
    GroupDirection: "group-direction", Error, "6.6",
        "The direction of a group MUST be whole, and of unit length within 1e-6; it is absent only if no line of the group has a landmark.",
        None, "1.0.0";
    GroupOfGroups: "group-of-groups", Error, "6.6",
        "The lines of a `manhattan` or `atlanta` group MUST be all lines of certain `parallel` groups: three of them in a `manhattan` group, three or more in an `atlanta` group.",
        Some("A reader finds its parallel groups by their lines."), "1.2.0";
    GroupDirectionsOrthogonal: "group-directions-orthogonal", Error, "6.6",
        "The direction of a `manhattan` or `atlanta` group MUST be that of one of its parallel groups, and those of the others perpendicular to it, within 1e-3 rad; in a `manhattan` group, all three are perpendicular to each other.",
        Some("A solver may then turn all of them together."), "1.2.0";
    GraphVerticesKnown: "graph-vertices-known", Error, "6.14",
        "The vertices of a factor MUST be in the vertex tables of its graph.",
        None, "1.0.0";
    GraphFactorShape: "graph-factor-shape", Error, "6.14",
        "A factor of a registered kind MUST name the vertices, and have the numbers of `measurement` and `information`, that the registry gives.",
        None, "1.0.0";
    GraphInformationPositive: "graph-information-positive", Error, "6.14",
        "Information matrices MUST be positive semi-definite.",
        None, "1.0.0";
    CovariancePositive: "covariance-positive", Error, "6.21",
        "A covariance MUST have as many numbers as its column says, and be positive semi-definite.",
        None, "1.3.0";
    TrackingCounts: "tracking-counts", Error, "6.20",
        "Counts of `tracking` MUST NOT be negative, and there are at most as many inliers as matches.",
        None, "1.3.0";
    FrameStatisticsAgree: "frame-statistics-agree", Error, "6.15",
        "`frame_statistics` MUST have one row for each frame, with the numbers that its definition gives: counts exactly, angles and lengths within 1e-6 rad and m.",
        None, "1.0.0";
    PointObservationsReproject: "point-observations-reproject", Error, "7",
        "A noise-free point observation MUST lie within 0.5 px of its landmark's image through the true pose, and its depth within 1 cm or 1 %.",
        None, "1.0.0";
    LineObservationsReproject: "line-observations-reproject", Warning, "7",
        "Both ends of a noise-free line observation SHOULD lie within 0.5 px of the image of their landmark's line through the true pose.",
        None, "1.0.0";
    NoiseDeclared: "noise-declared", Warning, "5.7",
        "A sequence with measurements SHOULD declare their noise.",
        None, "1.0.0";
    NoiseAgrees: "noise-agrees", Error, "7",
        "Residuals of measurements against the truth MUST agree with the declared noise: their robust sigma within 10 % and four standard errors, in pixels, and in depth where that is declared.",
        Some("Judged from landmarks that are where their rows see them, so that a wrong landmark is not taken for noise."), "1.0.0";
    MeasurementsNoisy: "measurements-noisy", Advice, "7",
        "Measurements are best noisy, by at least 0.05 px.",
        Some("On measurements that equal observations an optimiser ends at zero, which compares nothing."), "1.0.0";
    PointLandmarksTriangulate: "point-landmarks-triangulate", Error, "7",
        "A point landmark that at least three rows show MUST be where they triangulate to through the true poses: excess chi-square at most 60.",
        Some("Sigma is the declared one or the found one, at least 0.5 px. A right landmark exceeds 60 once in 1e12 times."), "1.0.0";
    LineLandmarksTriangulate: "line-landmarks-triangulate", Warning, "7",
        "A line landmark that at least three rows show SHOULD be where they triangulate to, as for points, with the distances of both ends to the image of the line.",
        Some("Lines that were turned to be parallel after they were observed are found by this."), "1.0.0";
    CollectionFoldersNamed: "collection-folders-named", Error, "15.1",
        "The folder of a sequence MUST be called `sequence=NAME`, after the name in its manifest.",
        Some("Query engines take the name of the sequence from the folder."), "1.4.0";
    CataloguePresent: "catalogue-present", Error, "15.2",
        "A collection MUST have a catalogue.",
        None, "1.4.0";
    CatalogueComplete: "catalogue-complete", Error, "15.2",
        "Every sequence of a collection MUST have a row in the catalogue.",
        Some("Who looks into the catalogue alone would miss it."), "1.4.0";
    CatalogueSequencesThere: "catalogue-sequences-there", Error, "15.2",
        "The folder of every row of the catalogue MUST be there.",
        None, "1.4.0";
    CatalogueAgrees: "catalogue-agrees", Error, "15.2",
        "A row of the catalogue MUST say what its sequence says: `path_length` within 1e-6 m times max(1, length in metres), all else exactly.",
        Some("A query that is answered by the catalogue would give another answer than the sequences."), "1.4.0";
}

impl RuleId {
    /// What the specification says.
    pub(crate) fn rule(self) -> &'static Rule {
        &RULES[self as usize]
    }
}

/// The rule of a name.
#[must_use]
pub fn rule(id: &str) -> Option<&'static Rule> {
    RULES.iter().find(|rule| rule.id == id)
}

/// A version as three numbers; `None` when it is not `major.minor.patch`.
pub(crate) fn version_numbers(version: &str) -> Option<(u64, u64, u64)> {
    let mut parts = version.split('.').map(|part| {
        let plain = !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
        if plain && (part == "0" || !part.starts_with('0')) { part.parse::<u64>().ok() } else { None }
    });
    let numbers = (parts.next()??, parts.next()??, parts.next()??);
    parts.next().is_none().then_some(numbers)
}

/// The rules that hold for a file of a declared version: those of its major version that are not younger.
///
/// A version that cannot be read is taken for the oldest, so that no rule is held against a file that did not
/// promise it. A newer minor version than the newest known brings all rules of its major version.
#[must_use]
pub fn rules_for(version: &str) -> Vec<&'static Rule> {
    let declared = version_numbers(version).unwrap_or((1, 0, 0));
    RULES
        .iter()
        .filter(|rule| {
            version_numbers(rule.since).is_some_and(|since| since.0 == declared.0 && since <= declared)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_unique_and_lead_back_to_their_rule() {
        for (index, one) in RULES.iter().enumerate() {
            assert_eq!(rule(one.id), Some(one));
            assert!(RULES[..index].iter().all(|other| other.id != one.id), "{}", one.id);
            assert!(one.id.bytes().all(|byte| byte.is_ascii_lowercase() || byte == b'-'));
        }
        assert_eq!(RuleId::CatalogueAgrees.rule().id, "catalogue-agrees");
        assert_eq!(RuleId::CatalogueAgrees as usize, RULES.len() - 1);
    }

    #[test]
    fn the_word_of_the_statement_fits_the_severity() {
        for rule in RULES {
            let must = rule.statement.contains("MUST");
            assert_eq!(must, rule.severity == Severity::Error, "{}", rule.id);
            if rule.severity == Severity::Warning {
                assert!(rule.statement.contains("SHOULD"), "{}", rule.id);
            }
            assert!(rule.statement.ends_with('.'), "{}", rule.id);
        }
    }

    #[test]
    fn a_file_is_held_against_the_rules_of_its_version() {
        assert_eq!(rules_for("1.0.0").len(), 59);
        let later = |version: &str| rules_for(version).iter().any(|rule| rule.id == "group-of-groups");
        assert!(!later("1.1.0") && later("1.2.0"));
        assert_eq!(rules_for("1.7.3").len(), RULES.len());
        assert!(rules_for("2.0.0").is_empty());
        assert_eq!(rules_for("nonsense").len(), 59);
    }

    #[test]
    fn versions_are_three_plain_numbers() {
        assert_eq!(version_numbers("1.20.3"), Some((1, 20, 3)));
        for wrong in [
            "1",
            "1.0",
            "1.0.0.0",
            "1.0.x",
            "v1.0.0",
            "1.0.-1",
            "01.0.0",
            "1..0",
            "",
            "1.0.99999999999999999999",
        ] {
            assert_eq!(version_numbers(wrong), None, "{wrong}");
        }
    }
}
