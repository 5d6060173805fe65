//! A whole sequence in memory, and what belongs to one of its frames.

use super::manifest::Manifest;
use super::record::Record;
use super::table::{for_each_frame_table, for_each_table};
use super::{
    Camera, CameraId, Frame, FrameStatistics, GraphFactor, GraphLine, GraphPoint, GraphPose, Iteration,
    LineCorrespondence, LineLandmark, LineMeasurement, LineObservation, MapLine, MapPoint,
    PointCorrespondence, PointLandmark, PointMeasurement, PointObservation, StructuralGroup, TrackedFrame,
    TrajectoryPose,
};

macro_rules! sequence {
    ($($name:ident: $row:ident,)+) => {
        /// A whole sequence in memory: the manifest and the rows of every table.
        ///
        /// A table that a file does not have is empty here.
        #[derive(Clone, Debug, Default, PartialEq)]
        pub struct Sequence {
            /// What is said about the sequence as a whole.
            pub manifest: Manifest,
            $(
                #[doc = concat!("Rows of the table `", stringify!($name), "`.")]
                pub $name: Vec<$row>,
            )+
        }

        impl Sequence {
            /// Sorts every table into the order in which it is stored.
            pub fn sort(&mut self) {
                $(self.$name.sort_by(Record::compare_key);)+
            }
        }
    };
}
for_each_table!(sequence);

impl Sequence {
    /// The camera of an id.
    #[must_use]
    pub fn camera(&self, camera_id: CameraId) -> Option<&Camera> {
        self.manifest.camera(camera_id)
    }
}

macro_rules! bundle {
    ($($name:ident: $row:ident,)+) => {
        /// One frame and its rows of every per-frame table.
        #[derive(Clone, Debug, Default, PartialEq)]
        pub struct FrameBundle {
            /// The frame.
            pub frame: Frame,
            $(
                #[doc = concat!("Its rows of the table `", stringify!($name), "`.")]
                pub $name: Vec<$row>,
            )+
        }
    };
}
for_each_frame_table!(bundle);

impl Sequence {
    /// Every frame with its rows, in table order; per-frame tables have to be sorted.
    ///
    /// Rows of frames that are not in the table `frames` are passed over.
    pub fn bundles(&self) -> impl Iterator<Item = FrameBundle> + '_ {
        self.frames.iter().map(|frame| {
            let mut bundle = FrameBundle { frame: frame.clone(), ..FrameBundle::default() };
            macro_rules! take {
                ($($name:ident: $row:ident,)+) => {
                    $(
                        let begin = self.$name.partition_point(|row| row.frame_id < frame.frame_id);
                        let count = self.$name[begin..].partition_point(|row| row.frame_id == frame.frame_id);
                        bundle.$name = self.$name[begin..begin + count].to_vec();
                    )+
                };
            }
            for_each_frame_table!(take);
            bundle
        })
    }
}
