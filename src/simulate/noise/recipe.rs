//! How measurements are made of observations, as a recipe says it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::Error;
use super::NoiseModel;
use crate::structure::Noise;

/// Numbers above this are no noise of an image or of a room; below it nothing overflows.
const LARGEST: f64 = 1e6;

/// How measurements are made of observations: a model of the registry, its parameters, and options.
///
/// A parameter that is left out has the model's default, see [`NoiseModel::parameters`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoiseRecipe {
    /// Noise model.
    pub model: NoiseModel,
    /// Standard deviation of `u` and of `v`, pixels; every model but `none`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "px"))]
    pub sigma_px: Option<f64>,
    /// Standard deviation of depth, metres; `gaussian` and `first-release`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "m"))]
    pub sigma_depth_m: Option<f64>,
    /// Standard deviation of the depth noise before the formula, centimetres; `paper`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "cm"))]
    pub sigma_d: Option<f64>,
    /// Depth times disparity, centimetres times steps; `paper` and `kinect-disparity`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "cm"))]
    pub m: Option<f64>,
    /// Standard deviation of the disparity, steps; `kinect-disparity`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "1"))]
    pub sigma_disparity: Option<f64>,
    /// Standard deviation of where depth is read, in both directions, pixels; `kinect-disparity`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "px"))]
    pub sigma_lateral_px: Option<f64>,
    /// Part of the measurements that take the place of another landmark, 0 to 1; 0 by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "1"))]
    pub outlier_fraction: Option<f64>,
    /// Part of the observations that are not measured, 0 to 1; 0 by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "1"))]
    pub missed_fraction: Option<f64>,
    /// Step to which pixel positions are rounded, pixels; by default 0, which rounds nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-unit" = "px"))]
    pub quantisation_px: Option<f64>,
    /// Whether measurements that noise carries out of the image are left out; the first release has them.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub drop_outside: bool,
    /// Whether depths outside the depth range of the camera are kept, which else are absent.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub keep_depth: bool,
}

impl NoiseRecipe {
    /// A model with its default parameters and no option.
    #[must_use]
    pub fn new(model: NoiseModel) -> Self {
        Self { model, ..Self::default() }
    }

    /// Sets a parameter or an option by its name in the registry; an option that is on or off is 1 or 0.
    ///
    /// # Errors
    /// [`Error::Value`] for a name that neither the model nor the options have, or a number out of range.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), Error> {
        let slot = match name {
            "drop_outside" | "keep_depth" => {
                let on = if value == 1.0 {
                    true
                } else if value == 0.0 {
                    false
                } else {
                    return Err(Error::value(format!("noise.{name}"), "0 or 1", value));
                };
                let slot = if name == "keep_depth" { &mut self.keep_depth } else { &mut self.drop_outside };
                *slot = on;
                return Ok(());
            }
            "sigma_px" => &mut self.sigma_px,
            "sigma_depth_m" => &mut self.sigma_depth_m,
            "sigma_d" => &mut self.sigma_d,
            "m" => &mut self.m,
            "sigma_disparity" => &mut self.sigma_disparity,
            "sigma_lateral_px" => &mut self.sigma_lateral_px,
            "outlier_fraction" => &mut self.outlier_fraction,
            "missed_fraction" => &mut self.missed_fraction,
            "quantisation_px" => &mut self.quantisation_px,
            _ => return Err(self.no_such(name, value)),
        };
        *slot = Some(value);
        self.check()
    }

    /// Holds the numbers against the model.
    ///
    /// # Errors
    /// [`Error::Value`] for a parameter that the model does not have, a number that is negative or not
    /// finite, a fraction above 1, or an `m` of 0.
    pub fn check(&self) -> Result<(), Error> {
        for (name, value) in self.parameters() {
            let Some(value) = value else { continue };
            if !self.model.parameters().iter().any(|(known, _)| *known == name) {
                return Err(self.no_such(name, value));
            }
            let least = if name == "m" { 1e-6 } else { 0.0 };
            within(name, value, least, LARGEST)?;
        }
        for (name, value) in self.options() {
            within(name, value, 0.0, if name == "quantisation_px" { LARGEST } else { 1.0 })?;
        }
        Ok(())
    }

    /// Measurements made by this recipe, as a manifest declares them: the model, the seed, every parameter of
    /// the model, and the options that are not 0.
    #[must_use]
    pub fn declared(&self, seed: u64) -> Noise {
        let model = self.model.parameters().iter().map(|(name, _)| (*name, self.parameter(name)));
        let options = self.options().into_iter().filter(|(_, value)| *value != 0.0);
        Noise {
            model: self.model.name().to_owned(),
            seed: Some(seed),
            parameters: model.chain(options).map(|(name, value)| (name.to_owned(), value)).collect(),
        }
    }

    /// A parameter of the model, given or by default; 0 for one that the model does not have.
    pub(super) fn parameter(&self, name: &str) -> f64 {
        let default = self.model.parameters().iter().find(|(known, _)| *known == name);
        let given = self.parameters().into_iter().find(|(known, _)| *known == name).and_then(|found| found.1);
        default.map_or(0.0, |(_, default)| given.unwrap_or(*default))
    }

    const fn parameters(&self) -> [(&'static str, Option<f64>); 6] {
        [
            ("sigma_px", self.sigma_px),
            ("sigma_depth_m", self.sigma_depth_m),
            ("sigma_d", self.sigma_d),
            ("m", self.m),
            ("sigma_disparity", self.sigma_disparity),
            ("sigma_lateral_px", self.sigma_lateral_px),
        ]
    }

    fn options(&self) -> [(&'static str, f64); 5] {
        let number = |value: Option<f64>| value.unwrap_or(0.0);
        [
            ("outlier_fraction", number(self.outlier_fraction)),
            ("missed_fraction", number(self.missed_fraction)),
            ("quantisation_px", number(self.quantisation_px)),
            ("drop_outside", f64::from(u8::from(self.drop_outside))),
            ("keep_depth", f64::from(u8::from(self.keep_depth))),
        ]
    }

    fn no_such(&self, name: &str, value: f64) -> Error {
        let parameters = self.model.parameters().iter().map(|(name, _)| *name);
        let options = self.options().map(|(name, _)| name);
        let known: Vec<&str> = parameters.chain(options).collect();
        let expected = format!("a parameter of the model {} ({})", self.model.name(), known.join(", "));
        Error::value(format!("noise.{name}"), expected, value)
    }
}

fn within(name: &str, value: f64, least: f64, most: f64) -> Result<(), Error> {
    if (least..=most).contains(&value) {
        Ok(())
    } else {
        Err(Error::value(format!("noise.{name}"), format!("a number from {least} to {most}"), value))
    }
}
