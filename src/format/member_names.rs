//! The members of a struct in the order of its fields, asked of its own deserialiser.

use serde::de::value::Error;
use serde::de::{Deserialize, Deserializer, Error as _, Visitor};
use serde::forward_to_deserialize_any;

/// Names of a struct's members, in order.
pub(super) type Members = &'static [&'static str];

/// The members of a struct, as its JSON has them; none when the type is not a struct.
pub(super) fn member_names<T: for<'de> Deserialize<'de>>() -> Members {
    let mut members: Members = &[];
    // It always ends in an error: there is nothing to read, only a question to be heard.
    let _ = T::deserialize(Listener { members: &mut members });
    members
}

/// Hears which members a struct asks for, and has none to give.
struct Listener<'a> {
    members: &'a mut Members,
}

impl<'de> Deserializer<'de> for Listener<'_> {
    type Error = Error;

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        fields: Members,
        _visitor: V,
    ) -> Result<V::Value, Error> {
        *self.members = fields;
        Err(Error::custom(format_args!("{name} was only asked for its members")))
    }

    fn deserialize_any<V: Visitor<'de>>(self, _visitor: V) -> Result<V::Value, Error> {
        Err(Error::custom("not a struct"))
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit
        unit_struct newtype_struct seq tuple tuple_struct map enum identifier ignored_any
    }
}

#[cfg(test)]
mod tests {
    use super::member_names;
    use crate::structure::{FrameId, PointMeasurement};

    #[test]
    fn members_come_in_the_order_of_the_fields() {
        assert_eq!(member_names::<PointMeasurement>(), ["frame_id", "point_id", "u", "v", "depth"]);
    }

    #[test]
    fn what_is_no_struct_has_no_members() {
        assert!(member_names::<FrameId>().is_empty());
        assert!(member_names::<Vec<i64>>().is_empty());
    }
}
