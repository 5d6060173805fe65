//! Names of sequences as names of folders, `sequence=NAME`, and back.

/// What the name of a sequence's folder begins with: the column that query engines make of it.
const PARTITION: &str = "sequence=";

/// The folder of a sequence in a collection.
///
/// Of ASCII, all but letters, digits, `-`, `.`, `_` and `~` is written as `%` and two hexadecimal digits; other characters
/// stand as they are, for not every engine decodes them byte by byte.
#[must_use]
pub fn folder_name(sequence: &str) -> String {
    let mut name = PARTITION.to_owned();
    for character in sequence.chars() {
        let plain = character.is_ascii_alphanumeric() || "-._~".contains(character) || !character.is_ascii();
        if plain {
            name.push(character);
        } else {
            name.push_str(&format!("%{:02X}", u32::from(character)));
        }
    }
    name
}

/// The sequence that a folder of a collection is named after; `None` for what is not named as one.
///
/// What is not well encoded stands for itself: the folder of the name that is given is then another.
#[must_use]
pub fn sequence_name(folder: &str) -> Option<String> {
    let encoded = folder.strip_prefix(PARTITION)?;
    let mut bytes = Vec::with_capacity(encoded.len());
    let mut rest = encoded.as_bytes();
    while let [first, others @ ..] = rest {
        let digit = |at: usize| others.get(at).and_then(|digit| char::from(*digit).to_digit(16));
        if let (b'%', Some(high), Some(low)) = (first, digit(0), digit(1)) {
            bytes.push(u8::try_from(16 * high + low).ok()?);
            rest = &others[2..];
        } else {
            bytes.push(*first);
            rest = others;
        }
    }
    Some(String::from_utf8(bytes).unwrap_or_else(|_| encoded.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_name_comes_back_from_its_folder(name in any::<String>()) {
            let folder = folder_name(&name);
            prop_assert!(!folder.contains(['/', '\\', '\0']), "{}", folder);
            prop_assert_eq!(sequence_name(&folder), Some(name));
        }

        #[test]
        fn any_folder_has_a_name(folder in any::<String>()) {
            prop_assert_eq!(sequence_name(&folder).is_some(), folder.starts_with(PARTITION));
        }
    }

    #[test]
    fn only_what_engines_stumble_over_is_encoded() {
        assert_eq!(folder_name("box1"), "sequence=box1");
        assert_eq!(folder_name("freiburg1_desk-v2.1"), "sequence=freiburg1_desk-v2.1");
        assert_eq!(folder_name("a b=c/Größe%"), "sequence=a%20b%3Dc%2FGröße%25");
        assert_eq!(sequence_name("sequence=100%"), Some("100%".to_owned()));
        assert_eq!(sequence_name("box1"), None);
    }
}
