//! What the manifest says about a sequence made of images.

use open_structure::structure::{Exclusion, Generator, Manifest};

use super::Options;
use crate::rgbd::RawSequence;

/// The tool's name in a manifest.
pub const TOOL: &str = "os-convert";

/// What is said about a sequence made of images.
pub(super) fn manifest(
    raw: &RawSequence,
    name: &str,
    options: &Options,
    unusable: Vec<Exclusion>,
) -> Manifest {
    let mut excluded = raw.excluded.clone();
    excluded.extend(unusable);
    let descriptor = "ORB, 32 bytes: the majority of each bit over the points of the landmark";
    let texts = [
        ("options", serde_json::to_string(options).unwrap_or_default()),
        ("descriptor", descriptor.to_owned()),
    ];
    Manifest {
        name: name.to_owned(),
        description: raw.description.clone(),
        source: raw.source.clone(),
        generator: Generator {
            tool: TOOL.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            seed: Some(options.seed),
            parameters: texts.map(|(name, text)| (name.to_owned(), text)).into(),
        },
        clock: raw.clock.clone(),
        cameras: vec![raw.camera.clone()],
        noise: Some(options.noise.declared(options.seed)),
        excluded,
        ..Manifest::default()
    }
}
