//! `[controller.mrac]`: what a file says, and the controller built from it.

use loopsight_core::Controller;
use loopsight_model::declare_part;
use loopsight_model::model::Model;
use loopsight_model::registry::{BuildError, ControllerPart, PartMeta, Setting};
use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::{Mrac, MracDesign};
use crate::Mixing;
use crate::at_rest::at_rest;
use crate::per_channel::PerChannel;

/// The table of `mrac` in TOML.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MracSettings {
    /// Settling time (2 %) of the reference model, s.
    pub settling_time_s: PerChannel,
    /// `γ`, 1/s.
    #[serde(default = "adaptation")]
    pub adaptation: f64,
    /// `σ`, 1/s.
    #[serde(default = "leakage")]
    pub leakage: f64,
    /// `Y`, in the unit of each controlled state.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<PerChannel>,
    /// Greatest magnitude of each input, in its unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit: Option<PerChannel>,
}

fn adaptation() -> f64 {
    5.0
}

fn leakage() -> f64 {
    0.02
}

const META: PartMeta = PartMeta {
    id: "mrac",
    role: "controller",
    summary: "model reference adaptive control: gains move until each controlled state does what a \
              first-order model does with its reference",
    equation: "y_m' = a_m (r - y_m);  s = θᵀ(y/Y, r/Y, 1);  \
               θ' = -γ (a_m/g) (y - y_m) φ/(1 + φᵀφ) - σ (θ - θ_0);  V = M s",
    reference: "Ioannou, Sun (1996), Robust Adaptive Control, Prentice Hall, sections 6.2 and 8.4.1; \
                Ioannou, Kokotović (1984), Automatica 20(5), 583-594",
    example: "[controller.mrac]\nsettling_time_s = 0.45\nlimit = 12.0\n",
    settings: &[
        Setting::new(
            "settling_time_s",
            "s",
            "time after which the reference model is within 2 % of a step, 4/a_m, one for all \
             controlled states or a list; no default",
        ),
        Setting::new(
            "adaptation",
            "1/s",
            "rate at which the gains move; 0 keeps them; default 5",
        ),
        Setting::new(
            "leakage",
            "1/s",
            "rate at which the gains return to those of the model; default 0.02",
        ),
        Setting::new(
            "size",
            "",
            "size of the controlled states, in their units, one for all or a list: how much the gains of \
             states and references move against the constant one; default: that of the plant",
        ),
        Setting::new(
            "limit",
            "",
            "greatest magnitude of the inputs, in their unit, one for all or a list; default: no \
             limit",
        ),
    ],
};

#[typetag::serde(name = "mrac")]
impl ControllerPart for MracSettings {
    fn meta(&self) -> &'static PartMeta {
        &META
    }

    fn is_limited(&self) -> bool {
        self.limit.is_some()
    }

    fn build(&self, model: &Model, period: f64) -> Result<Box<dyn Controller<f64>>, BuildError> {
        let rest = at_rest(model, META.id)?;
        let n = rest.n;
        let settling = self.settling_time_s.expand("settling_time_s", n)?;
        let size = match &self.size {
            None => DVector::from_column_slice(&rest.sizes),
            Some(size) => size.expand("size", n)?,
        };
        let limit = match &self.limit {
            None => DVector::repeat(n, f64::INFINITY),
            Some(limit) => limit.expand("limit", n)?,
        };
        for (key, list) in [("settling_time_s", &settling), ("size", &size)] {
            if let Some(wrong) = list.iter().find(|v| !(**v > 0.0 && v.is_finite())) {
                let message = format!("`{key}` is {wrong}, expected a number above 0");
                return Err(BuildError::at(key, message));
            }
        }
        if let Some(wrong) = limit.iter().find(|l| l.is_nan() || **l <= 0.0) {
            let message = format!("`limit` is {wrong}, expected a number above 0");
            return Err(BuildError::at("limit", message));
        }
        for (key, rate) in [("adaptation", self.adaptation), ("leakage", self.leakage)] {
            if !(rate >= 0.0 && rate.is_finite()) {
                let message =
                    format!("`{key}` is {rate} 1/s, expected a number from 0 1/s upwards");
                return Err(BuildError::at(key, message));
            }
        }
        let mixing: Mixing<f64, _> = Mixing::new(&rest.matrix, &DVector::zeros(n))
            .map_err(|_| BuildError::at("", "the input matrix cannot be inverted"))?;
        let design = MracDesign {
            rate: settling.map(|t| 4.0 / t),
            damping: DVector::from_column_slice(&rest.damping),
            size,
            adaptation: self.adaptation,
            leakage: self.leakage,
        };
        Mrac::new(&design, mixing, &limit, period).map_or_else(
            || {
                Err(BuildError::at(
                    "",
                    format!("the period is {period} s, expected a number above 0"),
                ))
            },
            |mrac| Ok(Box::new(mrac) as Box<dyn Controller<f64>>),
        )
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = vec![format!(
            "the reference model settles within 2 % after {:?} s; gains start from the model at rest, move \
             with {} 1/s and return with {} 1/s",
            self.settling_time_s.listed(),
            self.adaptation,
            self.leakage
        )];
        if let Some(limit) = &self.limit {
            let limits: Vec<String> = limit.listed().iter().map(|l| format!("±{l}")).collect();
            notes.push(format!("inputs are clipped at {}", limits.join(", ")));
        }
        notes
    }

    /// What the reference model does.
    fn ideal(&self, references: &[Vec<f64>], period: f64) -> Option<Vec<Vec<f64>>> {
        let settling = self
            .settling_time_s
            .expand("settling_time_s", references.len())
            .ok()?;
        let follow = |(reference, settling): (&Vec<f64>, &f64)| {
            let decay = (-4.0 * period / settling).exp();
            let mut y = 0.0;
            let next = |r: &f64| {
                let now = y;
                y = r + decay * (y - r);
                now
            };
            reference.iter().map(next).collect()
        };
        Some(references.iter().zip(settling.iter()).map(follow).collect())
    }
}
declare_part!(&META);
