//! Families of source sequences: cameras, origins, licences, and which of them some rows were taken with.

use nalgebra::{Point2, Point3};
use open_structure::geometry::{PinholeCamera, Pose};
use open_structure::structure::registry;

/// A dataset whose images the sequences were made from, with the camera that took them.
#[derive(Clone, Copy, Debug)]
pub struct Family {
    /// Name, as it stands in the manifest and the summary.
    pub name: &'static str,
    /// `fx`, `fy`, `cx`, `cy`, pixels.
    pub intrinsics: [f64; 4],
    /// Distortion of its images, `k1, k2, p1, p2, k3` of the registry's `brown-conrady`; the rows of the release are free
    /// of it.
    pub distortion: Option<[f64; 5]>,
    /// Image sizes that occur, the usual one first, pixels.
    pub sizes: &'static [[u32; 2]],
    /// Where pixel (0, 0) lies, as the registry names it.
    pub pixel_origin: &'static str,
    /// Whether poses are printed with at most four decimals, which tells families with one camera apart.
    pub coarse_poses: bool,
    /// Dataset of the images; `None` where there are no images.
    pub origin: Option<Origin>,
    /// Beginnings of names of its sequences; a `#` stands for a digit. They matter only where the data cannot decide.
    pub names: &'static [&'static str],
}

/// The dataset that the images of a family come from.
#[derive(Clone, Copy, Debug)]
pub struct Origin {
    /// Name of the dataset.
    pub dataset: &'static str,
    /// Where it is published.
    pub url: &'static str,
    /// Licence, as an SPDX expression.
    pub licence: &'static str,
    /// How to cite it.
    pub citation: &'static str,
}

const ICL_NUIM: Origin = Origin {
    dataset: "icl-nuim",
    url: "https://www.doc.ic.ac.uk/~ahanda/VaFRIC/iclnuim.html",
    licence: "CC-BY-3.0",
    citation: "A. Handa, T. Whelan, J. McDonald, A. J. Davison: A Benchmark for RGB-D Visual Odometry, 3D Reconstruction and SLAM. ICRA 2014.",
};

const TUM_RGBD: Origin = Origin {
    dataset: "tum-rgbd",
    url: "https://cvg.cit.tum.de/data/datasets/rgbd-dataset",
    licence: "CC-BY-4.0",
    citation: "J. Sturm, N. Engelhard, F. Endres, W. Burgard, D. Cremers: A Benchmark for the Evaluation of RGB-D SLAM Systems. IROS 2012.",
};

const TARTANAIR: Origin = Origin {
    dataset: "tartanair",
    url: "https://theairlab.org/tartanair-dataset/",
    licence: "CC-BY-4.0",
    citation: "W. Wang, D. Zhu, X. Wang, Y. Hu, Y. Qiu, C. Wang, Y. Hu, A. Kapoor, S. Scherer: TartanAir: A Dataset to Push the Limits of Visual SLAM. IROS 2020.",
};

const VGA: &[[u32; 2]] = &[[640, 480]];

/// ICL-NUIM.
pub(crate) const ICL: Family = Family {
    name: "icl",
    intrinsics: [481.20, -480.0, 319.5, 239.5],
    distortion: None,
    // A re-release of one sequence is 752 columns wide.
    sizes: &[[640, 480], [752, 480]],
    pixel_origin: registry::PIXEL_CENTER,
    coarse_poses: false,
    origin: Some(ICL_NUIM),
    names: &["livingroom", "living_room", "office#", "office_#", "lr_kt", "of_kt"],
};

/// The simulated sequences of the first release.
pub(crate) const SIMULATED: Family = Family {
    name: "simulated",
    intrinsics: [535.4, 539.2, 320.1, 247.6],
    distortion: None,
    sizes: VGA,
    pixel_origin: registry::PIXEL_CENTER,
    coarse_poses: false,
    origin: None,
    names: &["box", "corridor", "sphere"],
};

/// TUM RGB-D, the third Kinect.
pub(crate) const TUM_FR3: Family = Family {
    name: "tum-fr3",
    intrinsics: [535.4, 539.2, 320.1, 247.6],
    distortion: None,
    sizes: VGA,
    pixel_origin: registry::PIXEL_CENTER,
    coarse_poses: true,
    origin: Some(TUM_RGBD),
    names: &["structure", "nostructure", "stru_", "nostru_", "fr3", "rgbd_dataset_freiburg3", "cabinet"],
};

/// TartanAir, first version.
pub(crate) const TARTANAIR_V1: Family = Family {
    name: "tartanair",
    intrinsics: [320.0, 320.0, 320.0, 240.0],
    distortion: None,
    sizes: VGA,
    pixel_origin: registry::PIXEL_CORNER,
    coarse_poses: false,
    origin: Some(TARTANAIR),
    names: &["carwelding", "hospital", "japanesealley", "office"],
};

/// TUM RGB-D, the first Kinect.
pub(crate) const TUM_FR1: Family = Family {
    name: "tum-fr1",
    intrinsics: [517.3, 516.5, 318.6, 255.3],
    distortion: Some([0.2624, -0.9531, -0.0054, 0.0026, 1.1633]),
    sizes: VGA,
    pixel_origin: registry::PIXEL_CENTER,
    coarse_poses: true,
    origin: Some(TUM_RGBD),
    names: &["fr1", "rgbd_dataset_freiburg1"],
};

/// TUM RGB-D, the second Kinect.
pub(crate) const TUM_FR2: Family = Family {
    name: "tum-fr2",
    intrinsics: [520.9, 521.0, 325.1, 249.7],
    distortion: Some([0.2312, -0.7849, -0.0033, -0.0001, 0.9172]),
    sizes: VGA,
    pixel_origin: registry::PIXEL_CENTER,
    coarse_poses: true,
    origin: Some(TUM_RGBD),
    names: &["fr2", "rgbd_dataset_freiburg2"],
};

/// Every family, those of the release first.
///
/// # Sources
/// The intrinsics are those under which the published rows reproject; they agree with what the datasets publish.
pub const FAMILIES: &[Family] = &[ICL, SIMULATED, TUM_FR3, TARTANAIR_V1, TUM_FR1, TUM_FR2];

/// Above this median residual no family is believed to fit, pixels: noise has 1 px, the wrong camera tens.
pub const BAD_RESIDUAL_PX: f64 = 5.0;

/// This share of the rows may lie beyond an image that is still believed to be the right one.
const STRAY_SHARE: f64 = 5e-4;

/// How far rows may lie beyond the image, pixels: six times the usual noise.
const STRAY_PX: f64 = 6.0;

/// A row as it stands, and the landmark it shows, in the camera.
pub(crate) type Sight = (Point3<f64>, Point2<f64>);

/// What a family is chosen by.
pub(crate) struct Clues<'a> {
    /// Name of the sequence.
    pub(crate) name: &'a str,
    /// Landmarks in their cameras and where they were seen; may be a sample.
    pub(crate) sights: &'a [Sight],
    /// Every pixel position of the sequence.
    pub(crate) pixels: &'a [Point2<f64>],
    /// Whether no pose has more than four decimals.
    pub(crate) coarse_poses: bool,
    /// The camera the user gave.
    pub(crate) given: Option<PinholeCamera>,
}

/// A family chosen for a sequence, and why.
#[derive(Clone, Debug)]
pub struct Choice {
    /// The family; `None` where neither data nor name tell.
    pub family: Option<&'static Family>,
    /// The camera.
    pub camera: PinholeCamera,
    /// Median residual of the chosen camera, pixels; `None` where nothing could be projected.
    pub residual_px: Option<f64>,
    /// Median residual of every family, in the order of [`FAMILIES`], pixels.
    pub residuals_px: Vec<(&'static str, f64)>,
    /// What decided: `data`, `name`, `given`, `default`.
    pub by: &'static str,
    /// Rows farther than 6 px beyond the image.
    pub beyond_image: usize,
}

impl Choice {
    /// Whether the residual says that this is not the camera the rows were taken with.
    #[must_use]
    pub fn is_doubtful(&self) -> bool {
        self.residual_px.is_some_and(|residual| residual > BAD_RESIDUAL_PX)
    }

    /// Name of the family, or what stands for it.
    #[must_use]
    pub fn family_name(&self) -> &'static str {
        self.family.map_or("unknown", |family| family.name)
    }
}

impl Family {
    /// The camera with the usual image size.
    pub(crate) fn camera(&self) -> PinholeCamera {
        let [fx, fy, cx, cy] = self.intrinsics;
        let [width, height] = self.sizes[0];
        PinholeCamera { fx, fy, cx, cy, width, height }
    }

    /// Length of the longest beginning that the name has; `None` when it has none.
    fn name_match(&self, name: &str) -> Option<usize> {
        let name = name.to_ascii_lowercase();
        let matches = |pattern: &str| {
            let mut letters = name.chars();
            pattern.chars().all(|wanted| {
                letters
                    .next()
                    .is_some_and(|found| if wanted == '#' { found.is_ascii_digit() } else { found == wanted })
            })
        };
        self.names.iter().filter(|pattern| matches(pattern)).map(|pattern| pattern.len()).max()
    }
}

/// The family whose camera the rows were taken with.
///
/// The one with the smallest median reprojection residual; among families with one camera, which the residual cannot
/// tell apart, the number of decimals of the poses decides, then the name. Where nothing can be projected, the name.
pub(crate) fn choose(clues: &Clues<'_>) -> Choice {
    let by_name = |families: &[&'static Family]| {
        let best = families.iter().filter_map(|family| Some((family.name_match(clues.name)?, *family)));
        best.max_by_key(|(length, _)| *length).map(|(_, family)| family)
    };
    let all: Vec<&'static Family> = FAMILIES.iter().collect();
    let residuals_px: Vec<(&'static str, f64)> = if clues.sights.is_empty() {
        Vec::new()
    } else {
        all.iter().map(|family| (family.name, median_residual(&family.camera(), clues.sights))).collect()
    };
    let best = residuals_px.iter().map(|(_, residual)| *residual).min_by(f64::total_cmp);
    let (mut family, mut by) = match best {
        // Equal cameras have equal residuals, bit by bit.
        Some(best) => {
            let fitting: Vec<&'static Family> = all
                .iter()
                .zip(&residuals_px)
                .filter(|(_, (_, residual))| residual.total_cmp(&best).is_eq())
                .map(|(family, _)| *family)
                .collect();
            let same_digits: Vec<&'static Family> =
                fitting.iter().copied().filter(|family| family.coarse_poses == clues.coarse_poses).collect();
            match (fitting.as_slice(), same_digits.as_slice()) {
                ([only], _) | (_, [only]) => (Some(*only), "data"),
                _ => (by_name(&fitting).or(fitting.first().copied()), "name"),
            }
        }
        None => (by_name(&all), "name"),
    };
    let mut camera = family.map_or_else(|| FAMILIES[1].camera(), Family::camera);
    if let Some(given) = clues.given {
        camera = given;
        by = "given";
        // Someone who gives a camera does so because no family fits; the name may still tell the origin.
        if best.is_none_or(|best| best > BAD_RESIDUAL_PX) {
            family = by_name(&all);
        }
    } else if family.is_none() {
        by = "default";
    }
    if let (None, Some(family)) = (clues.given, family) {
        let stray =
            |size: &&[u32; 2]| beyond(clues.pixels, **size) as f64 <= STRAY_SHARE * clues.pixels.len() as f64;
        let size = family.sizes.iter().find(stray).or(family.sizes.last());
        if let Some([width, height]) = size {
            (camera.width, camera.height) = (*width, *height);
        }
    }
    let residual_px = (!clues.sights.is_empty()).then(|| median_residual(&camera, clues.sights));
    let beyond_image = beyond(clues.pixels, [camera.width, camera.height]);
    Choice { family, camera, residual_px, residuals_px, by, beyond_image }
}

/// Rows that lie more than [`STRAY_PX`] beyond an image.
fn beyond(pixels: &[Point2<f64>], [width, height]: [u32; 2]) -> usize {
    let outside = |value: f64, size: u32| value < -STRAY_PX || value > f64::from(size) + STRAY_PX;
    pixels.iter().filter(|pixel| outside(pixel.x, width) || outside(pixel.y, height)).count()
}

/// Median distance between where landmarks appear and where they were seen, pixels; those behind the camera are infinitely far.
fn median_residual(camera: &PinholeCamera, sights: &[Sight]) -> f64 {
    let mut residuals: Vec<f64> = sights
        .iter()
        .map(|(point, pixel)| camera.project(*point).map_or(f64::INFINITY, |found| (found - pixel).norm()))
        .collect();
    residuals.sort_by(f64::total_cmp);
    residuals.get(residuals.len() / 2).copied().unwrap_or(f64::INFINITY)
}

/// A landmark as a camera sees it.
pub(crate) fn sight(camera_from_world: &Pose, landmark: Point3<f64>, u: f64, v: f64) -> Sight {
    (camera_from_world * landmark, Point2::new(u, v))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sheet of points before a camera, and their images.
    fn sights(camera: &PinholeCamera) -> Vec<Sight> {
        (0..50)
            .map(|index| {
                let point =
                    Point3::new(f64::from(index % 7) * 0.2 - 0.6, f64::from(index % 5) * 0.2 - 0.4, 2.0);
                (point, camera.project(point).unwrap())
            })
            .collect()
    }

    fn pixels(sights: &[Sight]) -> Vec<Point2<f64>> {
        sights.iter().map(|(_, pixel)| *pixel).collect()
    }

    #[test]
    fn the_data_decide_whatever_the_name_says() {
        for family in FAMILIES {
            let sights = sights(&family.camera());
            let clues = Clues {
                name: "hospital",
                sights: &sights,
                pixels: &pixels(&sights),
                coarse_poses: family.coarse_poses,
                given: None,
            };
            let choice = choose(&clues);
            assert_eq!(choice.family_name(), family.name);
            assert_eq!(choice.by, "data");
            assert!(choice.residual_px.unwrap() < 1e-9);
            assert!(!choice.is_doubtful());
        }
    }

    #[test]
    fn names_decide_where_nothing_can_be_projected() {
        for (name, family) in [
            ("office", "tartanair"),
            ("office0", "icl"),
            ("office2_v2", "icl"),
            ("livingroom3", "icl"),
            ("japanesealley", "tartanair"),
            ("box2", "simulated"),
            ("sphere2", "simulated"),
            ("corridor2", "simulated"),
            ("structure_texture_far", "tum-fr3"),
            ("nostructure_texture_near_withloop", "tum-fr3"),
            ("something", "unknown"),
        ] {
            let clues = Clues { name, sights: &[], pixels: &[], coarse_poses: false, given: None };
            let choice = choose(&clues);
            assert_eq!((choice.family_name(), choice.residual_px), (family, None), "{name}");
        }
    }

    #[test]
    fn a_camera_of_no_family_is_doubtful_until_it_is_given() {
        let strange = PinholeCamera { fx: 900.0, fy: 900.0, cx: 400.0, cy: 300.0, width: 800, height: 600 };
        let sights = sights(&strange);
        let pixels = pixels(&sights);
        let mut clues =
            Clues { name: "x", sights: &sights, pixels: &pixels, coarse_poses: false, given: None };
        assert!(choose(&clues).is_doubtful());
        clues.given = Some(strange);
        let choice = choose(&clues);
        assert_eq!((choice.camera, choice.by, choice.family_name()), (strange, "given", "unknown"));
        assert!(!choice.is_doubtful());
    }

    #[test]
    fn a_wider_image_is_told_by_its_rows() {
        let narrow = sights(&FAMILIES[0].camera());
        let chosen = |pixels: &[Point2<f64>]| {
            choose(&Clues { name: "", sights: &narrow, pixels, coarse_poses: false, given: None })
        };
        let mut pixels = pixels(&narrow);
        assert_eq!(chosen(&pixels).camera.width, 640);
        pixels.push(Point2::new(700.0, 100.0));
        assert_eq!((chosen(&pixels).camera.width, chosen(&pixels).beyond_image), (752, 0));
        pixels.push(Point2::new(7000.0, 100.0));
        assert_eq!(chosen(&pixels).beyond_image, 1);
    }
}
