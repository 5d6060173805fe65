//! The six columns of a segment's ends, shared by several tables.

/// Gives a row with the columns `start_x … end_z` its segment, and one that has little more a constructor.
macro_rules! stored_segment {
    ($name:ident { $($field:ident: $type:ty),+ } $(absent: $absent:ident)?) => {
        impl $name {
            /// A row with its segment.
            #[must_use]
            pub fn new($($field: $type,)+ segment: &crate::geometry::Segment) -> Self {
                let crate::geometry::Segment { start, end } = segment;
                Self {
                    $($field,)+
                    start_x: start.x,
                    start_y: start.y,
                    start_z: start.z,
                    end_x: end.x,
                    end_y: end.y,
                    end_z: end.z,
                    $($absent: None,)?
                }
            }
        }

        stored_segment!($name);
    };
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
