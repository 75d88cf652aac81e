//! `[controller.pid]`: what a file says, and the controller built from it.

use loopsight_core::Controller;
use loopsight_model::declare_part;
use loopsight_model::model::Model;
use loopsight_model::registry::{BuildError, ControllerPart, PartMeta, Setting};
use nalgebra::DVector;
use serde::{Deserialize, Serialize};

use super::{Pid, PidGains};
use crate::Mixing;
use crate::at_rest::at_rest;
use crate::per_channel::PerChannel;

/// The table of `pid` in TOML: gains, or the time constant that they are tuned for.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PidSettings {
    /// `K`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub proportional: Option<PerChannel>,
    /// `K_i`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub integral: Option<PerChannel>,
    /// `K_d`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub derivative: Option<PerChannel>,
    /// `T_f`, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub derivative_filter_s: Option<PerChannel>,
    /// `b`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference_weight: Option<PerChannel>,
    /// `c`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub derivative_weight: Option<PerChannel>,
    /// `T_t`, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tracking_time_s: Option<PerChannel>,
    /// Time constant of the closed loop that gains are tuned for, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closed_loop_time_s: Option<PerChannel>,
    /// Greatest magnitude of each input, in its unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub limit: Option<PerChannel>,
}

const META: PartMeta = PartMeta {
    id: "pid",
    role: "controller",
    summary: "one PID controller per controlled state, with reference weights, a filtered derivative \
              and anti-windup; uses no model but directions",
    equation: "s = K (b r - y) + K_i ∫(r - y) dt + K_d d(c r - y)/dt filtered;  V = M s;  \
               tuned: K = 1/(g (λ + T/2)), K_i = K/min(1/a, 4 (λ + T/2))",
    reference: "Åström, Hägglund (2006), Advanced PID Control, ISA, sections 3.4, 3.5, 13.4; \
                Skogestad (2003), Journal of Process Control 13, 291-309, equations (23)-(25)",
    example: "[controller.pid]\nclosed_loop_time_s = 0.1\nlimit = 12.0\n",
    settings: &[
        Setting::new(
            "proportional",
            "",
            "gain, in the unit of the inputs per that of the state, one for all or a list; with it \
             not `closed_loop_time_s`",
        ),
        Setting::new(
            "integral",
            "",
            "integral gain, that unit per s, one for all or a list; default 0",
        ),
        Setting::new(
            "derivative",
            "",
            "derivative gain, that unit times s, one for all or a list; default 0",
        ),
        Setting::new(
            "derivative_filter_s",
            "s",
            "time constant of the derivative's filter, one for all or a list; default a tenth of K_d/K",
        ),
        Setting::new(
            "reference_weight",
            "1",
            "weight of the reference in the proportional part, one for all or a list; default 1",
        ),
        Setting::new(
            "derivative_weight",
            "1",
            "weight of the reference in the derivative part, one for all or a list; default 0",
        ),
        Setting::new(
            "tracking_time_s",
            "s",
            "time in which the integral follows clipped inputs, one for all or a list; default K/K_i",
        ),
        Setting::new(
            "closed_loop_time_s",
            "s",
            "time constant of the closed loop, one for all or a list: gains follow from the model at \
             rest by Skogestad's rule",
        ),
        Setting::new(
            "limit",
            "",
            "greatest magnitude of the inputs, in their unit, one for all or a list; default: no \
             limit",
        ),
    ],
};

impl PidSettings {
    fn given(
        list: &Option<PerChannel>,
        key: &str,
        n: usize,
        or: f64,
    ) -> Result<DVector<f64>, BuildError> {
        match list {
            None => Ok(DVector::repeat(n, or)),
            Some(list) => list.expand(key, n),
        }
    }
}

#[typetag::serde(name = "pid")]
impl ControllerPart for PidSettings {
    fn meta(&self) -> &'static PartMeta {
        &META
    }

    fn is_limited(&self) -> bool {
        self.limit.is_some()
    }

    fn build(&self, model: &Model, period: f64) -> Result<Box<dyn Controller<f64>>, BuildError> {
        let rest = at_rest(model, META.id)?;
        let n = rest.n;
        let zero = DVector::zeros(n);
        let mixing: Mixing<f64, _> = Mixing::new(&rest.matrix, &zero)
            .map_err(|_| BuildError::at("", "the input matrix cannot be inverted"))?;
        let of = |list, key, or| Self::given(list, key, n, or);
        let (proportional, integral) = match (&self.proportional, &self.closed_loop_time_s) {
            (Some(_), None) => (
                of(&self.proportional, "proportional", 0.0)?,
                of(&self.integral, "integral", 0.0)?,
            ),
            (None, Some(_)) if self.integral.is_none() => {
                let lambda = of(&self.closed_loop_time_s, "closed_loop_time_s", 0.0)?;
                let (mut k, mut k_i) = (zero.clone(), zero.clone());
                for i in 0..n {
                    let answer = lambda[i] + 0.5 * period;
                    if !(lambda[i] > 0.0 && answer.is_finite()) {
                        let found = lambda[i];
                        let message = format!(
                            "`closed_loop_time_s` is {found} s, expected a number above 0 s"
                        );
                        return Err(BuildError::at("closed_loop_time_s", message));
                    }
                    k[i] = 1.0 / (mixing.gain(i) * answer);
                    // A plant that comes to rest by itself is quicker than the integral has to be.
                    let own = if rest.damping[i] > 0.0 {
                        1.0 / rest.damping[i]
                    } else {
                        f64::INFINITY
                    };
                    k_i[i] = k[i] / own.min(4.0 * answer);
                }
                (k, k_i)
            }
            (Some(_), Some(_)) | (None, Some(_)) => {
                let message = "`closed_loop_time_s` stands beside gains, expected one of them";
                return Err(BuildError::at("closed_loop_time_s", message));
            }
            (None, None) => {
                return Err(BuildError::at("", "no gains are given").help(
                    "give `proportional` (and `integral`, `derivative`), or `closed_loop_time_s`",
                ));
            }
        };
        let derivative = of(&self.derivative, "derivative", 0.0)?;
        let quotient = |a: f64, b: f64, or: f64| if a > 0.0 && b > 0.0 { a / b } else { or };
        let filter = match &self.derivative_filter_s {
            Some(list) => list.expand("derivative_filter_s", n)?,
            None => derivative.zip_map(&proportional, |d, k| 0.1 * quotient(d, k, 0.0)),
        };
        let tracking = match &self.tracking_time_s {
            Some(list) => list.expand("tracking_time_s", n)?,
            None => proportional.zip_map(&integral, |k, i| quotient(k, i, 1.0)),
        };
        let limit = of(&self.limit, "limit", f64::INFINITY)?;
        let gains = PidGains {
            reference_weight: of(&self.reference_weight, "reference_weight", 1.0)?,
            derivative_weight: of(&self.derivative_weight, "derivative_weight", 0.0)?,
            proportional,
            integral,
            derivative,
            filter,
            tracking,
        };
        for (key, list, least) in [
            ("proportional", &gains.proportional, 0.0),
            ("integral", &gains.integral, 0.0),
            ("derivative", &gains.derivative, 0.0),
            ("derivative_filter_s", &gains.filter, 0.0),
            ("tracking_time_s", &gains.tracking, f64::MIN_POSITIVE),
            ("reference_weight", &gains.reference_weight, f64::MIN),
            ("derivative_weight", &gains.derivative_weight, f64::MIN),
        ] {
            if let Some(wrong) = list.iter().find(|v| !(v.is_finite() && **v >= least)) {
                let wanted = match least {
                    f64::MIN => "a finite number",
                    0.0 => "a number from 0 upwards",
                    _ => "a number above 0",
                };
                let message = format!("`{key}` is {wrong}, expected {wanted}");
                return Err(BuildError::at(key, message));
            }
        }
        if let Some(wrong) = limit.iter().find(|l| l.is_nan() || **l <= 0.0) {
            let message = format!("`limit` is {wrong}, expected a number above 0");
            return Err(BuildError::at("limit", message));
        }
        Pid::new(gains, mixing, &limit, period).map_or_else(
            || {
                Err(BuildError::at(
                    "",
                    format!("the period is {period} s, expected a number above 0"),
                ))
            },
            |pid| Ok(Box::new(pid) as Box<dyn Controller<f64>>),
        )
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = vec![match &self.closed_loop_time_s {
            None => "PID control with the gains given; of the model it uses the directions of the inputs".to_owned(),
            Some(time) => format!(
                "PID control tuned for closed-loop time constants of {:?} s by Skogestad's rule, from the model at rest",
                time.listed()
            ),
        }];
        if let Some(limit) = &self.limit {
            let limits: Vec<String> = limit.listed().iter().map(|l| format!("±{l}")).collect();
            notes.push(format!("inputs are clipped at {}", limits.join(", ")));
        }
        notes
    }
}
declare_part!(&META);
