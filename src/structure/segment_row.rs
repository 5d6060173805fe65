//! The six columns of a segment's ends, shared by several tables.

/// Gives a row with the columns `start_x … end_z` its segment.
macro_rules! stored_segment {
    ($name:ident) => {
        impl $name {
            /// The segment between the two ends, metres in `world`.
            #[must_use]
            pub fn segment(&self) -> crate::geometry::Segment {
                crate::geometry::Segment {
                    start: nalgebra::Point3::new(self.start_x, self.start_y, self.start_z),
                    end: nalgebra::Point3::new(self.end_x, self.end_y, self.end_z),
                }
            }
        }
    };
}
pub(crate) use stored_segment;
