//! The part of `os simulate` that renders raw RGB-D data.

use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::ValueEnum;

use super::progress::Progress;
use crate::format::Partial;
use crate::simulate::Simulation;
use crate::simulate::render::{Layout, RenderOptions, Rendered, render};
use crate::storage;

/// What a rendered folder may hold; a folder with anything else is not replaced.
const MEMBERS: [&str; 10] = [
    "rgb",
    "depth",
    "rgb.txt",
    "depth.txt",
    "groundtruth.txt",
    "associations.txt",
    "image_left",
    "depth_left",
    "pose_left.txt",
    "calibration.txt",
];

#[derive(clap::Args, Debug)]
pub(super) struct RawArgs {
    /// Also write a raw RGB-D dataset of the frames, in the layout and conventions of this one.
    #[arg(long, value_enum, value_name = "DATASET", requires = "render_to")]
    render: Option<Dataset>,
    /// Folder for the raw dataset.
    #[arg(long, value_name = "DIR", requires = "render")]
    render_to: Option<PathBuf>,
    /// Render frames A up to, but without, B; either may be left out.
    #[arg(long, value_name = "A..B", requires = "render", value_parser = frames)]
    render_frames: Option<Range<usize>>,
    /// Of these frames, render the first of each N.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "render", value_parser = stride)]
    render_stride: usize,
    /// Do not paint the landmarks on the surfaces.
    #[arg(long, requires = "render")]
    render_unmarked: bool,
}

/// Datasets whose layouts are written.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Dataset {
    /// TUM RGB-D: PNG files and lists with time stamps.
    Tum,
    /// ICL-NUIM, the version with PNG files; needs a camera whose fy is negative.
    Icl,
    /// ICL-NUIM as its ray tracer wrote it: depth along the ray as text.
    IclOriginal,
    /// TartanAir V1: depth as .npy, poses north-east-down.
    Tartanair,
}

impl RawArgs {
    /// The folder to render into, if there is to be one.
    ///
    /// # Errors
    /// Where one stands there that is not to be replaced, or is not a rendering.
    pub(super) fn target(&self, force: bool) -> anyhow::Result<Option<&Path>> {
        let Some(folder) = self.render_to.as_deref() else { return Ok(None) };
        if storage::is_taken(folder)? {
            if !force {
                anyhow::bail!("{} exists; --force replaces it", folder.display());
            }
            let is_rendering = is_rendering(folder).with_context(|| folder.display().to_string())?;
            if !is_rendering {
                anyhow::bail!("{} holds other things than a rendering and is not replaced", folder.display());
            }
        }
        Ok(Some(folder))
    }

    /// Renders into the folder, which gets its name when it is finished.
    pub(super) fn render(
        &self,
        simulation: &Simulation,
        folder: &Path,
        force: bool,
    ) -> anyhow::Result<(Partial, Rendered)> {
        let Some(dataset) = self.render else { anyhow::bail!("--render-to needs --render") };
        let layout = match dataset {
            Dataset::Tum => Layout::Tum,
            Dataset::Icl => Layout::Icl,
            Dataset::IclOriginal => Layout::IclOriginal,
            Dataset::Tartanair => Layout::TartanAir,
        };
        let options = RenderOptions {
            layout,
            frames: self.render_frames.clone().unwrap_or(0..usize::MAX),
            stride: self.render_stride,
            landmarks: !self.render_unmarked,
        };
        let partial = Partial::new(folder, force)?;
        partial.create_folder()?;
        let progress = Progress::new("rendering", "frames");
        let rendered =
            render(simulation, &options, partial.path(), &|done, total| progress.update(done, total))?;
        Ok((partial, rendered))
    }
}

/// Whether a folder holds nothing but what a rendering holds.
fn is_rendering(folder: &Path) -> std::io::Result<bool> {
    if !storage::is_folder(folder) {
        return Ok(false);
    }
    for entry in storage::list(folder, &[])? {
        let name = entry.name.to_string_lossy();
        let known =
            MEMBERS.contains(&&*name) || name.ends_with(".gt.freiburg") || name.starts_with("scene_00_");
        if !known {
            return Ok(false);
        }
    }
    Ok(true)
}

fn frames(text: &str) -> Result<Range<usize>, String> {
    let wrong = || format!("expected A..B with A below B, found {text}");
    let (first, last) = text.split_once("..").ok_or_else(wrong)?;
    let number =
        |text: &str, absent| if text.is_empty() { Ok(absent) } else { text.parse().map_err(|_| wrong()) };
    let range = number(first, 0)?..number(last, usize::MAX)?;
    if range.is_empty() { Err(wrong()) } else { Ok(range) }
}

fn stride(text: &str) -> Result<usize, String> {
    text.parse().ok().filter(|stride| *stride > 0).ok_or_else(|| format!("expected at least 1, found {text}"))
}
