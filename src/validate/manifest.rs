//! The manifest: its schema, its version, its cameras and its words.

use std::collections::BTreeSet;

use serde::de::DeserializeOwned;
use serde_json::Value;

use super::finding::{Detail, Findings};
use super::frames::View;
use super::rules::{RuleId, version_numbers};
use crate::format::json_schema;
use crate::structure::registry::SPEC_VERSION;
use crate::structure::{Camera, Clock, Conventions, Noise, Source, TableSummary, registry};

/// Major version whose files can be judged.
const MAJOR: u64 = 1;

/// What could be understood of a manifest.
#[derive(Clone, Debug, Default)]
pub(crate) struct Known {
    /// Whether it is a JSON object.
    pub(crate) readable: bool,
    pub(crate) spec_version: Option<String>,
    pub(crate) name: Option<String>,
    pub(crate) cameras: Option<Vec<Camera>>,
    /// Cameras ready for projection, in the same order; `None` for one whose numbers cannot be used.
    pub(crate) views: Vec<Option<View>>,
    pub(crate) noise: Option<Noise>,
    /// Whether it certainly says nothing about noise.
    pub(crate) silent_on_noise: bool,
    pub(crate) summaries: Option<Vec<TableSummary>>,
}

impl Known {
    /// Whether the declared version is one that cannot be judged.
    pub(crate) fn is_of_another_age(&self) -> bool {
        self.spec_version.as_deref().and_then(version_numbers).is_some_and(|version| version.0 != MAJOR)
    }

    /// Whether the declared version is a later one than that of this code.
    pub(crate) fn is_younger(&self) -> bool {
        self.spec_version.as_deref().and_then(version_numbers) > version_numbers(SPEC_VERSION)
    }
}

/// Checks the text of a manifest, and understands of it what can be understood.
pub(crate) fn manifest(text: &[u8], findings: &mut Findings) -> Known {
    match serde_json::from_slice(text) {
        Ok(value) => manifest_value(&value, findings),
        Err(error) => {
            findings.add(RuleId::ManifestSchema, None, || Detail::new("JSON", error.to_string()));
            Known::default()
        }
    }
}

/// Checks a manifest, and understands of it what can be understood.
pub(crate) fn manifest_value(value: &Value, findings: &mut Findings) -> Known {
    let known = Known {
        readable: value.is_object(),
        spec_version: part(value, "spec_version"),
        name: part(value, "name"),
        cameras: part(value, "cameras"),
        views: Vec::new(),
        noise: part(value, "noise"),
        silent_on_noise: value.is_object() && value.get("noise").is_none(),
        // Left out when empty.
        summaries: if value.get("tables").is_none() { Some(Vec::new()) } else { part(value, "tables") },
    };
    if let Some(version) = &known.spec_version {
        declared_version(version, findings);
    }
    if known.is_of_another_age() {
        return known;
    }
    schema(value, findings);
    if let Some(name) = &known.name {
        sequence_name(name, findings);
    }
    conventions(value, findings);
    if let Some(clock) = part::<Clock>(value, "clock") {
        closed("clock", &clock.kind, "clock", findings);
    }
    if let Some(source) = part::<Source>(value, "source") {
        documented(&source, findings);
        open("dataset", Some(&source.dataset).filter(|dataset| !dataset.is_empty()), findings);
    }
    if let Some(noise) = &known.noise {
        open("noise model", [&noise.model], findings);
    }
    let views = known.cameras.as_deref().map(|listed| cameras(listed, findings)).unwrap_or_default();
    Known { views, ..known }
}

fn part<T: DeserializeOwned>(value: &Value, name: &str) -> Option<T> {
    serde_json::from_value(value.get(name)?.clone()).ok()
}

fn declared_version(version: &str, findings: &mut Findings) {
    let found = match version_numbers(version) {
        None => format!("`{version}`"),
        Some((major, ..)) if major != MAJOR => format!("`{version}`, of which nothing else can be judged"),
        Some(_) => return,
    };
    findings.add(RuleId::ManifestVersion, None, || Detail::new("a version 1.minor.patch", found));
}

/// Holds the manifest against its JSON Schema, and names fields that the schema does not have.
fn schema(value: &Value, findings: &mut Findings) {
    let Some(schema) = json_schema("manifest").and_then(|text| serde_json::from_str::<Value>(&text).ok())
    else {
        return;
    };
    if let Ok(validator) = jsonschema::validator_for(&schema) {
        for error in validator.iter_errors(value) {
            findings.add(RuleId::ManifestSchema, None, || {
                let place = error.instance_path().to_string();
                let detail = Detail::new("a manifest that satisfies its JSON Schema", error.to_string());
                if place.is_empty() { detail } else { detail.id(place) }
            });
        }
    }
    unknown_fields(&schema, value, "", findings);
}

fn unknown_fields(schema: &Value, value: &Value, place: &str, findings: &mut Findings) {
    match value {
        Value::Object(fields) => {
            let Some(properties) = schema.get("properties").and_then(Value::as_object) else { return };
            for (name, field) in fields {
                let inner = format!("{place}/{name}");
                if let Some(schema) = properties.get(name) {
                    unknown_fields(schema, field, &inner, findings);
                } else {
                    findings.add(RuleId::UnknownContent, None, || {
                        Detail::new(
                            format!("fields of version {SPEC_VERSION}"),
                            "another one in the manifest",
                        )
                        .id(inner)
                    });
                }
            }
        }
        Value::Array(items) => {
            let Some(schema) = schema.get("items") else { return };
            for (index, item) in items.iter().enumerate() {
                unknown_fields(schema, item, &format!("{place}/{index}"), findings);
            }
        }
        _ => {}
    }
}

fn sequence_name(name: &str, findings: &mut Findings) {
    let wrong = name.chars().find(|c| *c == '/' || *c == '\\' || c.is_control());
    let found = match wrong {
        _ if name.is_empty() => "an empty one".to_owned(),
        Some(wrong) => format!("{name:?} with {wrong:?} in it"),
        None => return,
    };
    findings.add(RuleId::ManifestName, None, || {
        Detail::new("a name without `/`, `\\` and control characters", found)
    });
}

fn conventions(value: &Value, findings: &mut Findings) {
    let Ok(Value::Object(expected)) = serde_json::to_value(Conventions::default()) else { return };
    for (name, expected) in expected {
        let found = value.get("conventions").and_then(|conventions| conventions.get(&name));
        // One that is missing, or no text, breaks the schema.
        if let Some(found) = found.filter(|found| found.is_string() && **found != expected) {
            findings.add(RuleId::ManifestConventions, None, || {
                Detail::new(expected.to_string(), found.to_string()).id(format!("conventions.{name}"))
            });
        }
    }
}

fn documented(source: &Source, findings: &mut Findings) {
    for (name, text) in [("licence", &source.licence), ("citation", &source.citation)] {
        if text.as_ref().is_none_or(|text| text.trim().is_empty()) {
            findings.add(RuleId::SourceDocumented, None, || {
                Detail::new(format!("the {name} of the source"), "none").id(format!("source.{name}"))
            });
        }
    }
}

fn cameras(cameras: &[Camera], findings: &mut Findings) -> Vec<Option<View>> {
    let mut seen = BTreeSet::new();
    cameras
        .iter()
        .map(|camera| {
            let id = camera.camera_id;
            let mut usable = true;
            let mut broken = |expected: &str, found: String| {
                usable = false;
                findings.add(RuleId::CamerasValid, None, || Detail::new(expected, found).id(id));
            };
            if !seen.insert(id) {
                broken("an id of its own", format!("{id} for the second time"));
            }
            if id.0 < 0 {
                broken("an id of 0 or more", id.0.to_string());
            }
            if camera.width == 0 || camera.height == 0 {
                broken("an image of at least one pixel", format!("{} x {}", camera.width, camera.height));
            }
            let intrinsics = [camera.fx, camera.fy, camera.cx, camera.cy];
            if !intrinsics.iter().all(|number| number.is_finite()) {
                broken("finite fx, fy, cx, cy", format!("{intrinsics:?}"));
            }
            if camera.fx <= 0.0 {
                broken("fx over 0 px", format!("{} px", camera.fx));
            }
            if camera.fy == 0.0 {
                broken("fy that is not 0 px", "0 px".to_owned());
            }
            for (name, depth) in [("depth_min", camera.depth_min), ("depth_max", camera.depth_max)] {
                if let Some(depth) = depth.filter(|depth| *depth <= 0.0) {
                    broken(&format!("{name} over 0 m"), format!("{depth} m"));
                }
            }
            if let (Some(min), Some(max)) = (camera.depth_min, camera.depth_max)
                && min > max
            {
                broken("depth_min of at most depth_max", format!("{min} m and {max} m"));
            }
            closed("camera model", &camera.model, &id.to_string(), findings);
            closed("pixel origin", &camera.pixel_origin, &id.to_string(), findings);
            closed("camera axes", &camera.axes, &id.to_string(), findings);
            open("removed distortion", camera.removed_distortion.as_ref().map(|lens| &lens.model), findings);
            axes(camera, findings);
            (usable && camera.model == registry::PINHOLE).then(|| View::new(camera))
        })
        .collect()
}

fn axes(camera: &Camera, findings: &mut Findings) {
    let expected = if camera.fy < 0.0 { registry::RIGHT_UP_FORWARD } else { registry::RIGHT_DOWN_FORWARD };
    let known = [registry::RIGHT_UP_FORWARD, registry::RIGHT_DOWN_FORWARD].contains(&camera.axes.as_str());
    if known && camera.axes != expected {
        findings.add(RuleId::CameraAxes, None, || {
            let expected = format!("`{expected}` with fy {} px", camera.fy);
            Detail::new(expected, format!("`{}`", camera.axes)).id(camera.camera_id)
        });
    }
}

/// Checks a value of a closed family.
fn closed(family: &str, value: &str, place: &str, findings: &mut Findings) {
    let Some(known) = registry::family(family).filter(|known| !known.knows(value)) else { return };
    findings.add(RuleId::RegistryClosed, None, || {
        let values: Vec<String> = known.values.iter().map(|(value, _)| format!("`{value}`")).collect();
        Detail::new(format!("{family} {}", values.join(" or ")), format!("`{value}`")).id(place)
    });
}

/// Mentions values of an open family that are not registered.
pub(crate) fn open<'a>(
    family: &'static str,
    values: impl IntoIterator<Item = &'a String>,
    findings: &mut Findings,
) {
    let Some(known) = registry::family(family) else { return };
    for value in values.into_iter().filter(|value| !known.knows(value)) {
        findings.add(RuleId::RegistryOpen, None, || {
            Detail::new(format!("a registered {family}"), format!("`{value}`")).id(family)
        });
    }
}
