//! The specification, the schemas and the code say the same: what is generated in `spec/` is compared, or written
//! anew with `UPDATE_SPEC=1 cargo test --workspace --test spec_sync`.

#![expect(clippy::unwrap_used, reason = "tests")]

mod document;
mod example;
mod ordered;
mod registry;
mod rules;
mod sample;
mod schemas;
mod tables;

use document::{Marker, fill, read_spec, sync};

/// What stands between the markers of `spec/open-structure.md`.
fn generated(text: &str, marker: &Marker<'_>) -> Option<String> {
    match marker.kind {
        "tables" => Some(tables::overview()),
        "table" => tables::columns(marker.name),
        "manifest" => tables::manifest(marker.name),
        "rules" => Some(rules::index(text)),
        "example" => example::part(marker.name),
        _ => None,
    }
}

#[test]
fn the_specification_shows_what_the_code_has() {
    let text = read_spec("open-structure.md");
    sync("open-structure.md", &fill(&text, |marker| generated(&text, marker)));
}

#[test]
fn every_table_stands_in_the_specification_once() {
    let text = read_spec("open-structure.md");
    let catalogue = [open_structure::structure::CATALOGUE];
    for table in open_structure::structure::TABLES.iter().copied().chain(catalogue) {
        let marker = format!("<!-- table:{} -->", table.name);
        assert_eq!(text.matches(&marker).count(), 1, "{marker}");
    }
}

#[test]
fn the_registry_shows_what_the_code_has() {
    let text = read_spec("registry.md");
    sync("registry.md", &fill(&text, registry::generated));
    for family in open_structure::structure::registry::FAMILIES {
        let marker = format!("<!-- family:{} -->", family.name);
        assert_eq!(text.matches(&marker).count(), 1, "{marker}");
    }
}

#[test]
fn the_change_log_begins_with_the_version_of_the_code() {
    let text = read_spec("CHANGELOG.md");
    let first = text.lines().find_map(|line| line.strip_prefix("## ")).unwrap_or_default();
    let version = open_structure::structure::registry::SPEC_VERSION;
    assert!(first.starts_with(version), "spec/CHANGELOG.md begins with {first}; the code has {version}");
    let title = read_spec("open-structure.md");
    assert!(title.contains(&format!("Version {version}")), "spec/open-structure.md does not say {version}");
}
