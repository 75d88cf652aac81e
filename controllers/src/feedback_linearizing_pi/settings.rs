//! `[controller.feedback_linearizing_pi]`: what a file says, and the controller built from it.

use loopsight_core::Controller;
use loopsight_model::declare_part;
use loopsight_model::model::Model;
use loopsight_model::registry::{BuildError, ControllerPart, PartMeta, Setting};
use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::{DesignError, FeedbackLinearizingPi};
use crate::at_rest::at_rest;
use crate::per_channel::PerChannel;
use crate::{PiResponse, Rule, SampledPi, gains};

/// The table of `feedback_linearizing_pi` in TOML: gains, or what they follow from, or an
/// acceleration without feedback.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FeedbackLinearizingPiSettings {
    /// `K_p`, 1/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub proportional: Option<PerChannel>,
    /// `K_i`, 1/s².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub integral: Option<PerChannel>,
    /// Settling time (2 %), s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settling_time_s: Option<PerChannel>,
    /// Damping `ξ`; 1 where only the settling time is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damping: Option<PerChannel>,
    /// How gains follow from the settling time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rule: Option<Rule>,
    /// Feed the rate of the reference forward.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub feedforward: bool,
    /// Greatest magnitude of each input, in its unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<PerChannel>,
    /// Constant acceleration instead of a PI law, in the unit of each controlled state per second.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub open_loop_acceleration: Option<Vec<f64>>,
}

const META: PartMeta = PartMeta {
    id: "feedback_linearizing_pi",
    role: "controller",
    summary: "inverts the model so that each controlled state is one integrator, with a PI law \
              around each",
    equation: "V = G⁻¹ (ν - f);  ν = K_p (r - y) + K_i ∫(r - y) dt;  \
               H(s) = (K_p s + K_i)/(s² + K_p s + K_i);  K_p = 2 ξ ω_n, K_i = ω_n²",
    reference: "Alves, Lages, Henriques (2018), IFAC PapersOnLine 51-15, 437-442, equations \
                (48)-(52); Hanus, Kinnaert, Henrotte (1987), Automatica 23(6), 729-739",
    example: "[controller.feedback_linearizing_pi]\nsettling_time_s = 0.45\ndamping = 1.0\n\
              limit = 12.0\n",
    settings: &[
        Setting::new(
            "proportional",
            "1/s",
            "proportional gain, one for all controlled states or a list; with `integral`, instead \
             of `settling_time_s`",
        ),
        Setting::new(
            "integral",
            "1/s^2",
            "integral gain, one for all controlled states or a list",
        ),
        Setting::new(
            "settling_time_s",
            "s",
            "time from which on the error of a step stays within 2 %, one for all controlled \
             states or a list",
        ),
        Setting::new(
            "damping",
            "1",
            "damping of the poles, one for all controlled states or a list; default 1",
        ),
        Setting::new(
            "rule",
            "",
            "how gains follow from the settling time: `paper` (the default) by ω_n = 4/(ξ T_s), \
             which leaves the zero of H(s) out and settles later, or `exact`",
        ),
        Setting::new(
            "feedforward",
            "",
            "adds the rate of the reference, for references without steps; default false",
        ),
        Setting::new(
            "limit",
            "",
            "greatest magnitude of the inputs, in their unit, one for all or a list; default: no \
             limit",
        ),
        Setting::new(
            "open_loop_acceleration",
            "",
            "constant accelerations, one per controlled state, in its unit per second, instead of \
             the PI law: shows the linearisation alone",
        ),
    ],
};

/// Gains `(K_p, K_i)`, or the constant accelerations.
enum Demand {
    Gains(Vec<(f64, f64)>),
    Acceleration(Vec<f64>),
}

impl FeedbackLinearizingPiSettings {
    /// Gains `(K_p, K_i)` of `n` controlled states, for a law that runs elsewhere.
    ///
    /// # Errors
    ///
    /// The table asks for a constant acceleration or a feedforward, or its gains cannot be used.
    pub fn gains(&self, n: usize) -> Result<Vec<(f64, f64)>, BuildError> {
        let only = "this runs the law from gains alone";
        if self.feedforward {
            return Err(
                BuildError::at("feedforward", "`feedforward` is true, expected false").help(only),
            );
        }
        match self.demand(Some(n))? {
            Demand::Gains(gains) => Ok(gains),
            Demand::Acceleration(_) => {
                let key = "open_loop_acceleration";
                Err(BuildError::at(key, format!("`{key}` is given, expected gains")).help(only))
            }
        }
    }

    /// Largest commands of `n` inputs, in their unit; infinite where none is given.
    ///
    /// # Errors
    ///
    /// Another number of limits than inputs.
    pub fn limits(&self, n: usize) -> Result<Vec<f64>, BuildError> {
        match &self.limit {
            None => Ok(vec![f64::INFINITY; n]),
            Some(limit) => Ok(limit.expand("limit", n)?.as_slice().to_vec()),
        }
    }

    /// What is asked for, of `n` channels; with `n` unknown, as many as the longest list has.
    fn demand(&self, n: Option<usize>) -> Result<Demand, BuildError> {
        let of_gains = [
            ("proportional", self.proportional.is_some()),
            ("integral", self.integral.is_some()),
        ];
        let of_design = [
            ("settling_time_s", self.settling_time_s.is_some()),
            ("damping", self.damping.is_some()),
            ("rule", self.rule.is_some()),
        ];
        let first = |list: &[(&'static str, bool)]| list.iter().find(|(_, is)| *is).map(|k| k.0);
        let ways = "give `proportional` and `integral`, or `settling_time_s` (and `damping`, \
                    `rule`), or `open_loop_acceleration`";
        let (gain, design) = (first(&of_gains), first(&of_design));
        let n = n.unwrap_or_else(|| {
            [
                &self.proportional,
                &self.integral,
                &self.settling_time_s,
                &self.damping,
            ]
            .into_iter()
            .flatten()
            .map(|list| list.listed().len())
            .max()
            .unwrap_or(1)
        });
        if let Some(acceleration) = &self.open_loop_acceleration {
            return match gain.or(design) {
                None => Ok(Demand::Acceleration(acceleration.clone())),
                Some(key) => Err(BuildError::at(
                    key,
                    format!("`{key}` stands beside `open_loop_acceleration`, expected one of them"),
                )
                .help(ways)),
            };
        }
        if let (Some(gain), Some(design)) = (gain, design) {
            return Err(BuildError::at(
                design,
                format!("`{design}` stands beside `{gain}`, expected one way to give the gains"),
            )
            .help(ways));
        }
        if let (Some(proportional), Some(integral)) = (&self.proportional, &self.integral) {
            let proportional = proportional.expand("proportional", n)?;
            let integral = integral.expand("integral", n)?;
            return Ok(Demand::Gains(
                proportional
                    .iter()
                    .copied()
                    .zip(integral.iter().copied())
                    .collect(),
            ));
        }
        let Some(settling) = &self.settling_time_s else {
            let (key, message) = match (gain, design) {
                (Some("proportional"), _) => ("proportional", "`integral` is missing"),
                (Some(_), _) => ("integral", "`proportional` is missing"),
                (None, Some(key)) => (key, "`settling_time_s` is missing"),
                (None, None) => ("", "no gains are given"),
            };
            return Err(BuildError::at(key, message).help(ways));
        };
        let settling = settling.expand("settling_time_s", n)?;
        let damping = self
            .damping
            .as_ref()
            .unwrap_or(&PerChannel::All(1.0))
            .expand("damping", n)?;
        let rule = self.rule.unwrap_or_default();
        settling
            .iter()
            .zip(damping.iter())
            .map(|(settling, damping)| {
                gains(rule, *settling, *damping).ok_or_else(|| {
                    let (key, found, unit) = if *settling > 0.0 && settling.is_finite() {
                        ("damping", damping, "")
                    } else {
                        ("settling_time_s", settling, " s")
                    };
                    BuildError::at(
                        key,
                        format!("`{key}` is {found}{unit}, expected a number above 0{unit}"),
                    )
                })
            })
            .collect::<Result<Vec<_>, _>>()
            .map(Demand::Gains)
    }
}

#[typetag::serde(name = "feedback_linearizing_pi")]
impl ControllerPart for FeedbackLinearizingPiSettings {
    fn meta(&self) -> &'static PartMeta {
        &META
    }

    fn is_limited(&self) -> bool {
        self.limit.is_some()
    }

    fn build(&self, model: &Model, period: f64) -> Result<Box<dyn Controller<f64>>, BuildError> {
        let n = at_rest(model, META.id)?.n;
        let limit = match &self.limit {
            None => DVector::repeat(n, f64::INFINITY),
            Some(limit) => limit.expand("limit", n)?,
        };
        let built = match self.demand(Some(n))? {
            Demand::Gains(gains) => FeedbackLinearizingPi::new(
                &DVector::from_iterator(n, gains.iter().map(|g| g.0)),
                &DVector::from_iterator(n, gains.iter().map(|g| g.1)),
                &limit,
                period,
            )
            .map(|law| {
                if self.feedforward {
                    law.feeding_forward()
                } else {
                    law
                }
            }),
            Demand::Acceleration(acceleration) => {
                let listed = PerChannel::Each(acceleration);
                let acceleration = listed.expand("open_loop_acceleration", n)?;
                FeedbackLinearizingPi::open_loop(&acceleration, &limit, period)
            }
        };
        let controller = built.map_err(|error| {
            let key = match error {
                DesignError::Proportional(..) => "proportional",
                DesignError::Integral(..) => "integral",
                DesignError::Limit(..) => "limit",
                DesignError::Acceleration(..) => "open_loop_acceleration",
                DesignError::Period(_) | DesignError::Lengths => "",
            };
            BuildError::at(key, error.to_string())
        })?;
        Ok(Box::new(controller))
    }

    fn inverts_model(&self) -> bool {
        true
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        match self.demand(None) {
            Err(_) => {}
            Ok(Demand::Acceleration(acceleration)) => notes.push(format!(
                "open loop: constant accelerations {acceleration:?} until an input is clipped; the \
                 reference is not followed"
            )),
            Ok(Demand::Gains(gains)) => {
                let asked = self
                    .settling_time_s
                    .as_ref()
                    .map_or(&[][..], |s| s.listed());
                for (i, (kp, ki)) in gains.iter().enumerate() {
                    let channel = if gains.len() > 1 {
                        format!("channel {}: ", i + 1)
                    } else {
                        String::new()
                    };
                    let Some(response) = PiResponse::new(*kp, *ki) else {
                        continue;
                    };
                    let design = format!(
                        "{channel}K_p = {kp:.4} 1/s, K_i = {ki:.4} 1/s^2 settle within 2 % from \
                         {:.3} s on and overshoot by {:.1} %",
                        response.settling_time(),
                        100.0 * response.overshoot()
                    );
                    notes.push(match asked.get(i).or(asked.first()) {
                        None => design,
                        Some(asked) if self.rule == Some(Rule::Exact) => {
                            format!("{design}; asked for: {asked} s")
                        }
                        Some(asked) => format!(
                            "{design}; asked for: {asked} s, which the rule 4/(ξ T_s) misses \
                             because it leaves the zero of H(s) out; `rule = \"exact\"` keeps it"
                        ),
                    });
                }
            }
        }
        if let Some(limit) = &self.limit {
            let limits: Vec<String> = limit.listed().iter().map(|l| format!("±{l}")).collect();
            notes.push(format!("inputs are clipped at {}", limits.join(", ")));
        }
        notes
    }

    /// The response of `H(s)`, or of `u' = ν` under the constant acceleration. The sampled law is
    /// `H(s)` at every sample, so running it on the bare integrator gives it without an error.
    fn ideal(&self, references: &[Vec<f64>], period: f64) -> Option<Vec<Vec<f64>>> {
        match self.demand(Some(references.len())).ok()? {
            Demand::Gains(gains) => references
                .iter()
                .zip(gains)
                .map(|(reference, (kp, ki))| {
                    let law = SampledPi::new(kp, ki, period)?;
                    let (mut u, mut z, mut before) = (0.0, 0.0, None);
                    let follow = |r: &f64| {
                        let (now, error) = (u, r - u);
                        u += period * (law.proportional * (law.reference_weight * r - u) + z);
                        if self.feedforward {
                            u += before.replace(*r).map_or(0.0, |before| r - before);
                        }
                        z += law.integral * period * error;
                        now
                    };
                    Some(reference.iter().map(follow).collect())
                })
                .collect(),
            Demand::Acceleration(acceleration) => Some(
                acceleration
                    .iter()
                    .zip(references)
                    .map(|(a, reference)| {
                        (0..reference.len())
                            .map(|k| a * period * k as f64)
                            .collect()
                    })
                    .collect(),
            ),
        }
    }
}
declare_part!(&META);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ideal_response_is_that_of_h() {
        let settings = FeedbackLinearizingPiSettings {
            settling_time_s: Some(PerChannel::All(0.45)),
            ..Default::default()
        };
        let (kp, ki) = gains(Rule::Paper, 0.45, 1.0).unwrap();
        let response = PiResponse::new(kp, ki).unwrap();
        let (up, down) = (vec![0.2; 100], vec![-1.3; 100]);
        let ideal = settings.ideal(&[up, down], 0.01).unwrap();
        for (k, (forward, turning)) in ideal[0].iter().zip(&ideal[1]).enumerate() {
            let share = 1.0 - response.error(0.01 * k as f64);
            assert!((forward - 0.2 * share).abs() < 1e-12);
            assert!((turning + 1.3 * share).abs() < 1e-12);
        }
        let settings = FeedbackLinearizingPiSettings {
            open_loop_acceleration: Some(vec![0.6, 0.0]),
            ..Default::default()
        };
        let ideal = settings.ideal(&[vec![0.0; 3], vec![0.0; 3]], 0.01).unwrap();
        assert_eq!(ideal[1], [0.0; 3]);
        assert!((ideal[0][2] - 0.012).abs() < 1e-15);
        assert_eq!(
            FeedbackLinearizingPiSettings::default().ideal(&[], 0.01),
            None
        );
    }
}
