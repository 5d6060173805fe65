//! The generated tables of the registry.

use std::fmt::Write as _;

use open_structure::structure::registry::{FACTOR_SHAPES, Family, family};

use crate::document::Marker;
use crate::tables::cell;

/// What stands between the markers of `spec/registry.md`.
pub(crate) fn generated(marker: &Marker<'_>) -> Option<String> {
    match marker.kind {
        "family" => family(marker.name).map(values),
        "factors" => Some(factors()),
        _ => None,
    }
}

fn values(family: &Family) -> String {
    let kind = if family.open {
        "Open: other values are permitted; these are best taken where they fit."
    } else {
        "Closed: no other value is permitted."
    };
    let mut text = format!("Stands in {}. {kind}\n\n| value | meaning |\n|---|---|\n", family.place);
    for (value, meaning) in family.values {
        let _ = writeln!(text, "| `{value}` | {} |", cell(meaning));
    }
    text
}

fn factors() -> String {
    let list = |words: &[String]| if words.is_empty() { "-".to_owned() } else { words.join(", ") };
    let mut text =
        "| kind | columns that are present | numbers of `measurement` | numbers of `information` |\n"
            .to_owned();
    text.push_str("|---|---|---|---|\n");
    for shape in FACTOR_SHAPES {
        let columns: Vec<_> = shape.columns.iter().map(|column| format!("`{column}`")).collect();
        let sizes = |dimension: fn(usize) -> usize| {
            let sizes: Vec<_> =
                shape.sizes.iter().map(|size| dimension(size.measurement).to_string()).collect();
            sizes.join(" or ")
        };
        let informations: Vec<_> = shape.sizes.iter().map(|size| size.information().to_string()).collect();
        let _ = writeln!(
            text,
            "| `{}` | {} | {} | {} |",
            shape.kind,
            list(&columns),
            sizes(|size| size),
            informations.join(" or "),
        );
    }
    text
}
