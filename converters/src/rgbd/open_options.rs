//! What is read of a dataset, and what its folder does not say.

use std::ops::Range;

/// What is read of a dataset, and what its folder does not say.
#[derive(Clone, Debug, PartialEq)]
pub struct OpenOptions {
    /// Frames that are read, by their ids: see the dataset for what an id is.
    pub frames: Range<u64>,
    /// Of these the first of each so many; 0 counts as 1.
    pub stride: u64,
    /// Whether a line that cannot be used is left out and counted, rather than an error.
    pub keep_going: bool,
    /// How far stamps of a colour image and its depth map may be apart, nanoseconds (TUM RGB-D).
    ///
    /// The benchmark's own 20 ms: more than half of a frame's 33 ms would pair neighbours.
    pub max_stamp_difference_nanos: i64,
    /// How far the true poses on both sides of a stamp may be apart for one to be made between them, nanoseconds.
    ///
    /// 100 ms: ten steps of the motion capture system. A hand at 10 rad/s² departs from a constant turn by 0.7 degrees
    /// in the middle of it, and by a hundredth of that between neighbouring poses.
    pub longest_gap_nanos: i64,
    /// The camera, instead of the dataset's; its images have no distortion.
    pub camera: Option<GivenCamera>,
    /// Which Kinect took a sequence of TUM RGB-D, instead of what its name says.
    pub kinect: Option<Kinect>,
}

impl Default for OpenOptions {
    fn default() -> Self {
        Self {
            frames: 0..u64::MAX,
            stride: 1,
            keep_going: false,
            max_stamp_difference_nanos: 20_000_000,
            longest_gap_nanos: 100_000_000,
            camera: None,
            kinect: None,
        }
    }
}

impl OpenOptions {
    /// Whether a frame is one of those that are read.
    #[must_use]
    pub fn wants(&self, id: u64) -> bool {
        self.frames.contains(&id) && (id - self.frames.start).is_multiple_of(self.stride.max(1))
    }
}

/// The numbers of a camera, pixels, counted from where the dataset counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenCamera {
    /// Horizontal focal length, pixels.
    pub fx: f64,
    /// Vertical focal length, pixels; negative where the camera's y points up in the image.
    pub fy: f64,
    /// Column of the principal point, pixels.
    pub cx: f64,
    /// Row of the principal point, pixels.
    pub cy: f64,
    /// Columns and rows of the images, pixels; `None` for the dataset's.
    pub size: Option<[u32; 2]>,
}

/// One of the three cameras of TUM RGB-D.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kinect {
    /// Freiburg 1.
    Fr1,
    /// Freiburg 2.
    Fr2,
    /// Freiburg 3, whose images have no distortion.
    Fr3,
}

impl Kinect {
    /// The camera that a name speaks of: `freiburg1`, or `fr1` as a word of it.
    pub(super) fn named(name: &str) -> Option<Self> {
        let name = name.to_ascii_lowercase();
        let kinects = [("1", Self::Fr1), ("2", Self::Fr2), ("3", Self::Fr3)];
        let mut found = kinects.into_iter().filter(|(digit, _)| {
            let words: Vec<&str> = name.split(|c: char| !c.is_ascii_alphanumeric()).collect();
            words.iter().any(|word| *word == format!("freiburg{digit}") || *word == format!("fr{digit}"))
        });
        let first = found.next();
        // A name that speaks of two tells nothing.
        if found.next().is_some() { None } else { first.map(|(_, kinect)| kinect) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_camera_is_told_by_a_word_of_the_name() {
        for (name, kinect) in [
            ("rgbd_dataset_freiburg1_desk", Some(Kinect::Fr1)),
            ("rgbd_dataset_freiburg2_xyz", Some(Kinect::Fr2)),
            ("fr3_cabinet", Some(Kinect::Fr3)),
            ("FR3-office.tgz", Some(Kinect::Fr3)),
            ("fr12_desk", None),
            ("afr1", None),
            ("fr1_and_fr2", None),
            ("desk", None),
        ] {
            assert_eq!(Kinect::named(name), kinect, "{name}");
        }
    }

    #[test]
    fn a_stride_counts_from_the_first_frame_wanted() {
        let options = OpenOptions { frames: 3..12, stride: 4, ..OpenOptions::default() };
        let wanted: Vec<u64> = (0..20).filter(|id| options.wants(*id)).collect();
        assert_eq!(wanted, [3, 7, 11]);
        let all = OpenOptions { stride: 0, ..OpenOptions::default() };
        assert!((0..5).all(|id| all.wants(id)));
    }
}
