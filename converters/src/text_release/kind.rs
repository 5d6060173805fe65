//! Which part a file plays in a sequence, told by its name.

/// The part a file plays.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum FileKind {
    /// Ground-truth poses, all digits.
    GroundTruth,
    /// Ground-truth poses again, few digits.
    RepeatedGroundTruth,
    /// Point landmarks.
    PointLandmarks,
    /// Line landmarks.
    LineLandmarks,
    /// Observations and groups.
    Association,
    /// The initial factor graph.
    Graph,
    /// The trajectory of the estimate of this name.
    Trajectory(String),
    /// The points of the estimate of this name.
    MapPoints(String),
    /// The lines of the estimate of this name.
    MapLines(String),
    /// Parameters of the run that made the sequence.
    Parameters,
}

impl FileKind {
    /// The part a file of this name plays. Case, `-`, `_` and blanks make no difference.
    ///
    /// Estimates are told by the ends of their names, so that a `Line_BA.txt` beside `Point_BA.txt` is the trajectory
    /// of `line-ba`, and `Line_Mapline.txt` its lines.
    #[must_use]
    pub fn of_name(name: &str) -> Option<Self> {
        let lower = name.to_ascii_lowercase();
        // Hidden files beside real ones bear their names: `._association.txt`.
        let stem = lower.strip_suffix(".txt").filter(|stem| !stem.starts_with('.'))?;
        let letters: String = stem.chars().filter(char::is_ascii_alphanumeric).collect();
        match letters.as_str() {
            "cameraposes" | "camerapose" => return Some(Self::GroundTruth),
            "groundtruth" | "groundpose" | "groundposes" => return Some(Self::RepeatedGroundTruth),
            "pointlandmarks" | "pointlandmark" => return Some(Self::PointLandmarks),
            "association" | "associations" => return Some(Self::Association),
            "venomsequence" => return Some(Self::Graph),
            "estimatedvo" | "frametoframe" => return Some(Self::Trajectory("frame-to-frame".into())),
            "estimatedlocalmap" | "maptoframe" => return Some(Self::Trajectory("map-to-frame".into())),
            "systemparameter" | "systemparameters" => return Some(Self::Parameters),
            _ => {}
        }
        if letters.contains("linelandmark") {
            return Some(Self::LineLandmarks);
        }
        let estimate = |ending| letters.strip_suffix(ending).map(estimate_name);
        // The release writes Mappoint and Mapline in several ways; what they share is the end.
        None.or_else(|| estimate("mappoint").or_else(|| estimate("appoint")).map(Self::MapPoints))
            .or_else(|| estimate("mapline").or_else(|| estimate("apline")).map(Self::MapLines))
            .or_else(|| estimate("ba").filter(|name| name != "ba").map(Self::Trajectory))
    }

    /// Whether a file of this kind by itself makes a sequence. Other datasets, too, have a ground truth.
    #[must_use]
    pub fn makes_a_sequence(&self) -> bool {
        !matches!(self, Self::RepeatedGroundTruth | Self::Parameters)
    }
}

/// `point` → `point-ba`, `pointline` → `pointline-ba`.
fn estimate_name(front: &str) -> String {
    let front = front.strip_suffix("ba").unwrap_or(front);
    if front.is_empty() { "ba".to_owned() } else { format!("{front}-ba") }
}

#[cfg(test)]
mod tests {
    use super::FileKind::{self, *};

    #[test]
    fn every_name_of_the_release_is_known_in_every_spelling() {
        let cases = [
            ("camera_poses.txt", GroundTruth),
            ("ground_truth.txt", RepeatedGroundTruth),
            ("ground_pose.txt", RepeatedGroundTruth),
            ("point_landmarks.txt", PointLandmarks),
            ("structline_landmarks.txt", LineLandmarks),
            ("line_landmarks_refined.txt", LineLandmarks),
            ("association.txt", Association),
            ("venom_sequence.txt", Graph),
            ("Venom-Sequence.TXT", Graph),
            ("system_parameter.txt", Parameters),
            ("estimated_vo.txt", Trajectory("frame-to-frame".into())),
            ("Frame-to-Frame.txt", Trajectory("frame-to-frame".into())),
            ("frame_to_frame.txt", Trajectory("frame-to-frame".into())),
            ("estimated_localmap.txt", Trajectory("map-to-frame".into())),
            ("Map-to-Frame.txt", Trajectory("map-to-frame".into())),
            ("Point_BA.txt", Trajectory("point-ba".into())),
            ("Point-BA.txt", Trajectory("point-ba".into())),
            ("PointLine_BA.txt", Trajectory("pointline-ba".into())),
            ("PointLine-BA.txt", Trajectory("pointline-ba".into())),
            ("Line_BA.txt", Trajectory("line-ba".into())),
            ("Point_Mappoint.txt", MapPoints("point-ba".into())),
            ("PointLine_mappoint.txt", MapPoints("pointline-ba".into())),
            ("PointLine_BA_mappoint.txt", MapPoints("pointline-ba".into())),
            ("PointLine_mapline.txt", MapLines("pointline-ba".into())),
            ("PointLine-Apline.txt", MapLines("pointline-ba".into())),
        ];
        for (name, kind) in cases {
            assert_eq!(FileKind::of_name(name), Some(kind), "{name}");
        }
    }

    #[test]
    fn names_of_other_datasets_are_not_known() {
        for name in [
            "rgb.txt",
            "depth.txt",
            "README.txt",
            "ba.txt",
            "._association.txt",
            "association.csv",
            "association",
            "pose_left.txt",
        ] {
            assert_eq!(FileKind::of_name(name), None, "{name}");
        }
        assert!(!RepeatedGroundTruth.makes_a_sequence(), "groundtruth.txt of TUM");
    }
}
