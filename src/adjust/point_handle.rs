//! The variables of a point, in the form in which it is kept.

use super::error::Error;
use super::estimation::Estimation;
use super::inverse_depth::{HostFactor, InverseDepthFactor, numbers_in_host, point_in_host};
use super::observations::Observations;
use super::options::{Options, PointForm};
use super::parallax_point::{ParallaxFactor, ParallaxPoint, ParallaxSpace, centre};
use super::parametrisation::{VectorSpace, rotation, translation};
use super::point_factor::PointFactor;
use super::point_sight::PointSight;
use super::problem::{Values, Variable};
use super::whitening::{depth_sight, pixel_sight};
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;

/// The variables of a point; anchors by their pose.
#[derive(Clone, Copy, Debug)]
pub(super) enum PointHandle {
    /// x, y, z.
    Place(Variable),
    /// Slopes and inverse depth in a host.
    Hosted { point: Variable, host: Variable },
    /// Direction from a main anchor, and parallax to an associate one.
    Parallax { point: Variable, main: Variable, associate: Variable },
}

impl PointHandle {
    /// Where the point is, metres in the world.
    pub(super) fn place(&self, values: &Values<'_>) -> Vector3<f64> {
        match self {
            Self::Place(point) => Vector3::from_column_slice(values.of(*point)),
            Self::Hosted { point, host } => {
                let host = values.of(*host);
                rotation(host).transpose() * (point_in_host(values.of(*point)).0 - translation(host))
            }
            Self::Parallax { point, main, associate } => {
                ParallaxPoint::new(
                    &centre(values.of(*main)),
                    &centre(values.of(*associate)),
                    values.of(*point),
                )
                .place
            }
        }
    }

    /// How the place moves by the steps of variables: rotation and shift of poses first, with the first column of each.
    pub(super) fn by_steps(&self, values: &Values<'_>) -> Vec<(Variable, usize, Matrix3<f64>)> {
        match self {
            Self::Place(point) => vec![(*point, 0, Matrix3::identity())],
            Self::Hosted { point, host } => {
                let back = rotation(values.of(*host)).transpose();
                let (p, by_numbers) = point_in_host(values.of(*point));
                vec![(*host, 0, back * p.cross_matrix()), (*host, 3, -back), (*point, 0, back * by_numbers)]
            }
            Self::Parallax { point, main, associate } => {
                let (a, b) = (values.of(*main), values.of(*associate));
                let found = ParallaxPoint::new(&centre(a), &centre(b), values.of(*point));
                vec![
                    (*main, 3, found.by_main * -rotation(a).transpose()),
                    (*associate, 3, found.by_associate * -rotation(b).transpose()),
                    (*point, 0, found.by_form),
                ]
            }
        }
    }
}

/// Factors of points with one kind of sight, by what they tie.
struct Factors<S, const R: usize> {
    place: Vec<PointFactor<S, R>>,
    hosted: Vec<InverseDepthFactor<S, R>>,
    host: Vec<HostFactor<S, R>>,
    parallax: Vec<ParallaxFactor<S, R, 4>>,
    anchor: Vec<ParallaxFactor<S, R, 3>>,
}

impl<S: PointSight<R> + 'static, const R: usize> Factors<S, R> {
    fn new() -> Self {
        Self {
            place: Vec::new(),
            hosted: Vec::new(),
            host: Vec::new(),
            parallax: Vec::new(),
            anchor: Vec::new(),
        }
    }

    fn push(&mut self, handle: PointHandle, frame: Variable, sight: S) {
        match handle {
            PointHandle::Place(point) => self.place.push(PointFactor { variables: [frame, point], sight }),
            PointHandle::Hosted { point, host } if host == frame => {
                self.host.push(HostFactor { variables: [point], sight });
            }
            PointHandle::Hosted { point, host } => {
                self.hosted.push(InverseDepthFactor { variables: [frame, host, point], sight });
            }
            PointHandle::Parallax { point, main, associate } if main == frame || associate == frame => {
                let variables = [main, associate, point];
                self.anchor.push(ParallaxFactor { variables, frame: usize::from(associate == frame), sight });
            }
            PointHandle::Parallax { point, main, associate } => {
                let variables = [frame, main, associate, point];
                self.parallax.push(ParallaxFactor { variables, frame: 0, sight });
            }
        }
    }

    fn add(self, estimation: &mut Estimation, options: &Options) -> Result<(), Error> {
        estimation.problem.add_factors(self.place, options.loss)?;
        estimation.problem.add_factors(self.hosted, options.loss)?;
        estimation.problem.add_factors(self.host, options.loss)?;
        estimation.problem.add_factors(self.parallax, options.loss)?;
        estimation.problem.add_factors(self.anchor, options.loss)
    }
}

impl Estimation {
    /// Adds the points and what was measured of them.
    pub(super) fn add_points(&mut self, observations: &Observations, options: &Options) -> Result<(), Error> {
        let mut frames_of = vec![Vec::new(); observations.points.len()];
        observations.point_views.iter().for_each(|view| frames_of[view.point].push(view.frame));
        let (places, slopes) = (Arc::new(VectorSpace(3)), Arc::new(VectorSpace(3)));
        let angles = Arc::new(ParallaxSpace);
        for (point, frames) in observations.points.iter().zip(&frames_of) {
            let place = point.position.coords;
            let first = frames.iter().min().copied();
            let handle = match (options.points, first) {
                (PointForm::InverseDepth, Some(first)) => {
                    let in_host = observations.frames[first].camera_from_world * point.position;
                    let variable = self.problem.add(&slopes, &numbers_in_host(&in_host.coords));
                    PointHandle::Hosted { point: variable, host: self.poses[first] }
                }
                (PointForm::Parallax, Some(first)) => {
                    let centre =
                        |frame: usize| observations.frames[frame].camera_from_world.inverse().translation();
                    let main = centre(first);
                    let forms = frames.iter().filter_map(|frame| {
                        Some((*frame, ParallaxPoint::numbers_of(&main, &centre(*frame), &place)?))
                    });
                    // The widest parallax names the point best; that nearest to a right angle.
                    let width = |numbers: &[f64; 10]| libm::sin(numbers[9]);
                    let widest = forms.max_by(|a, b| width(&a.1).total_cmp(&width(&b.1)).then(b.0.cmp(&a.0)));
                    match widest {
                        Some((frame, numbers)) => {
                            let variable = self.problem.add(&angles, &numbers);
                            let (main, associate) = (self.poses[first], self.poses[frame]);
                            PointHandle::Parallax { point: variable, main, associate }
                        }
                        None => PointHandle::Place(self.problem.add(&places, place.as_slice())),
                    }
                }
                _ => PointHandle::Place(self.problem.add(&places, place.as_slice())),
            };
            self.points.push(handle);
        }
        let (mut pixels, mut depths) = (Factors::<_, 2>::new(), Factors::<_, 3>::new());
        for view in &observations.point_views {
            let (handle, frame) = (self.points[view.point], self.poses[view.frame]);
            match view.depth {
                Some(depth) => depths.push(handle, frame, depth_sight(view, depth, &observations.noise)),
                None => pixels.push(handle, frame, pixel_sight(view, &observations.noise)),
            }
        }
        pixels.add(self, options)?;
        depths.add(self, options)
    }
}
