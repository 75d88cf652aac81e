//! What SysId makes of a log: terms of a feedforward and gains of a feedback, in V and the log's own units.

use loopsight_core::{Place, Role};
use loopsight_diagnosis::{Estimate, Fit, InMotion, Work, in_motion};
use loopsight_model::model::Attached;
use loopsight_model::run::Run;
use loopsight_report::words::feedforward::{self, Term};
use serde::Serialize;

use super::common::ParameterEstimate;

/// Period of the loop that the feedback gains are for, s: that of a WPILib robot.
const PERIOD: f64 = 0.02;
/// What SysId allows by default: an error of the position in log units, one of the speed in log units per
/// second, and a voltage.
const POSITION_ERROR: f64 = 1.0;
const SPEED_ERROR: f64 = 1.5;
const VOLTAGE: f64 = 7.0;
/// Iterations of the Riccati equation, and the change at which it has converged.
const ITERATIONS: usize = 100_000;
const ARRIVED: f64 = 1e-12;

/// What SysId makes of a log: `u = kS sign(v) + kG + kV v + kA v'`, with the voltage at each motor and the
/// speed `v` in the log's own units.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Feedforward {
    /// The log's unit of length or angle: `Meters`, `Rotations`.
    pub units: String,
    /// Voltage that friction takes, the mean of both directions. Where it changes with the speed (Stribeck friction, drag),
    /// kS and the slope in kV are those of the line that comes nearest at the speeds of the log, as a regression finds it.
    /// Absent where no dry friction was found.
    #[serde(rename = "kS", skip_serializing_if = "Option::is_none")]
    pub k_s: Option<ParameterEstimate>,
    /// Voltage that gravity takes; absent where none was found.
    #[serde(rename = "kG", skip_serializing_if = "Option::is_none")]
    pub k_g: Option<ParameterEstimate>,
    /// Voltage per speed.
    #[serde(rename = "kV")]
    pub k_v: ParameterEstimate,
    /// Voltage per acceleration.
    #[serde(rename = "kA")]
    pub k_a: ParameterEstimate,
    /// Gains of a feedback loop.
    pub feedback: Feedback,
}

/// Gains of linear quadratic regulators every 20 ms, with SysId's default tolerances: errors of 1 unit and 1.5 units
/// per second at 7 V. Delays of the machine are neglected.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Feedback {
    /// Proportional gain of a loop on the speed, V s per unit.
    pub velocity_kp: f64,
    /// Proportional gain of a loop on the position, V per unit.
    pub position_kp: f64,
    /// Derivative gain of a loop on the position, V s per unit.
    pub position_kd: f64,
}

impl Feedforward {
    /// From a fit to a log whose unit `units` is `size` of the model's (m or rad), and what moves in its `runs`. None
    /// where the plant has no such terms, or they are no machine's.
    pub(crate) fn of(fit: &Fit, units: &str, size: f64, runs: &[Run]) -> Option<Self> {
        let per = |estimate: &Estimate, unit: &str| scaled(estimate, size, unit);
        let of_speed = format!("V s/{units}");
        let friction = dry(fit).then(|| friction(fit, runs)).flatten();
        let steady = fit.derived.get("kV")?;
        let lines = friction.as_ref();
        let k_v = lines.and_then(|line| line.with_slope.as_ref());
        let k_v = per(k_v.unwrap_or(steady), &of_speed);
        let k_a = per(fit.derived.get("kA")?, &format!("V s^2/{units}"));
        let feedback = Feedback::of(k_v.value, k_a.value)?;
        Some(Self {
            units: units.to_owned(),
            k_s: friction.map(|line| ParameterEstimate::from(&line.level)),
            k_g: gravity(fit),
            k_v,
            k_a,
            feedback,
        })
    }
}

impl Feedforward {
    /// In sentences.
    pub fn sentences(&self) -> Vec<String> {
        let all = [
            ("kS", self.k_s.as_ref()),
            ("kG", self.k_g.as_ref()),
            ("kV", Some(&self.k_v)),
            ("kA", Some(&self.k_a)),
        ];
        let terms: Vec<Term<'_>> = all
            .into_iter()
            .filter_map(|(name, term)| {
                let term = term?;
                Some(Term {
                    name,
                    value: term.value,
                    interval: term.interval95,
                    unit: &term.unit,
                })
            })
            .collect();
        let Feedback {
            velocity_kp,
            position_kp,
            position_kd,
        } = self.feedback;
        feedforward::summary(&terms, [velocity_kp, position_kp, position_kd])
    }
}

/// Whether the model has dry friction.
fn dry(fit: &Fit) -> bool {
    const DRY: [&str; 3] = [
        "coulomb_friction",
        "stribeck_friction",
        "directional_friction",
    ];
    let mut effects = fit.model.effects.iter();
    effects.any(|effect| DRY.contains(&effect.meta.id))
}

/// What everything that depends on the speed alone takes of the voltages, as a line over the speed.
fn friction(fit: &Fit, runs: &[Run]) -> Option<InMotion> {
    let model = &fit.model;
    let of_speed = |effect: &Attached| {
        effect.meta.reads == [Role::Flow]
            && effect.meta.states == 0
            && (effect.at.iter()).all(|c| matches!(c.place, Place::Effort(_)) && c.unit == "V")
    };
    let effects = (0..model.effects.len()).filter(|i| of_speed(&model.effects[*i]));
    let effects: Vec<usize> = effects.collect();
    // A wheel's flow is its own speed, and a drivetrain's kV is for the ground's.
    let radius = model.parameters.iter().map(|p| p.name.as_str());
    let radius = radius.into_iter().find(|name| *name == "wheel_radius");
    in_motion(fit, &effects, ("kV", radius), runs, &Work::quiet()).ok()?
}

/// What gravity takes of the voltages: against a constant force its opposite, and the amplitude of the sine of an arm, where
/// the zero of its angle does not matter.
fn gravity(fit: &Fit) -> Option<ParameterEstimate> {
    let of = |effect: &Attached, id: &str| {
        let own = effect.meta.parameters.iter().position(|p| p.id == id)?;
        let parameter = fit.model.parameters.get(effect.first_parameter + own)?;
        let estimate = fit.parameters.get(&parameter.name)?;
        (estimate.unit == "V").then(|| ParameterEstimate::from(estimate))
    };
    let weights = fit
        .model
        .effects
        .iter()
        .filter_map(|effect| match effect.meta.id {
            "constant_force" => of(effect, "force").map(opposite),
            "gravity_pendulum" => Some(amplitude(of(effect, "cosine")?, of(effect, "sine")?)),
            _ => None,
        });
    mean(weights.collect())
}

fn opposite(mut of: ParameterEstimate) -> ParameterEstimate {
    of.value = -of.value;
    of.interval95 = of.interval95.map(|[low, high]| [-high, -low]);
    of
}

/// `√(a² + b²)`, its error by linearisation, as if those of `a` and `b` had nothing to do with each other.
fn amplitude(a: ParameterEstimate, b: ParameterEstimate) -> ParameterEstimate {
    let mut amplitude = a.clone();
    let size = a.value.hypot(b.value);
    let along = |a_error: f64, b_error: f64| {
        (a.value * a_error).hypot(b.value * b_error) / size.max(f64::MIN_POSITIVE)
    };
    let half = |ends: [f64; 2]| 0.5 * (ends[1] - ends[0]);
    amplitude.value = size;
    amplitude.std_error = (a.std_error.zip(b.std_error)).map(|(a, b)| along(a, b));
    amplitude.interval95 = a.interval95.zip(b.interval95).map(|(a, b)| {
        let half = along(half(a), half(b));
        [size - half, size + half]
    });
    amplitude
}

/// The mean of what each channel has of its own; its error that of channels that err together. None of nothing.
fn mean(of: Vec<ParameterEstimate>) -> Option<ParameterEstimate> {
    let n = of.len() as f64;
    of.into_iter()
        .map(|mut one| {
            one.value /= n;
            one.std_error = one.std_error.map(|e| e / n);
            one.interval95 = one.interval95.map(|ends| ends.map(|end| end / n));
            one
        })
        .reduce(|mut sum, one| {
            sum.value += one.value;
            sum.std_error = sum.std_error.zip(one.std_error).map(|(a, b)| a + b);
            sum.interval95 =
                (sum.interval95.zip(one.interval95)).map(|(a, b)| [a[0] + b[0], a[1] + b[1]]);
            sum
        })
}

fn scaled(estimate: &Estimate, size: f64, unit: &str) -> ParameterEstimate {
    let mut scaled = ParameterEstimate::from(estimate);
    scaled.value *= size;
    scaled.unit = unit.to_owned();
    scaled.std_error = scaled.std_error.map(|e| e * size);
    scaled.interval95 = scaled.interval95.map(|ends| ends.map(|end| end * size));
    scaled
}

impl Feedback {
    /// For `u = kV v + kA v'`; none where that is no machine.
    fn of(k_v: f64, k_a: f64) -> Option<Self> {
        if !(k_v > 0.0 && k_a > 0.0 && k_v.is_finite() && k_a.is_finite()) {
            return None;
        }
        // x' = [0 1; 0 -kV/kA] x + [0; 1/kA] u over a period, exactly.
        let pole = -k_v / k_a;
        let decay = (pole * PERIOD).exp();
        let grown = (pole * PERIOD).exp_m1() / pole;
        let a = [[1.0, grown], [0.0, decay]];
        let b = [(grown - PERIOD) / (pole * k_a), grown / k_a];
        let weights = [POSITION_ERROR, SPEED_ERROR].map(|error: f64| error.powi(-2));
        let effort = VOLTAGE.powi(-2);
        let [_, velocity_kp] = regulator(
            [[0.0; 2], [0.0, decay]],
            [0.0, b[1]],
            [0.0, weights[1]],
            effort,
        );
        let [position_kp, position_kd] = regulator(a, b, weights, effort);
        Some(Self {
            velocity_kp,
            position_kp,
            position_kd,
        })
    }
}

/// Gain `K` of `u = -K x` that makes `Σ q0 x0² + q1 x1² + r u²` least for `x⁺ = A x + b u`: the discrete
/// Riccati equation, iterated from `P = Q` (B. D. O. Anderson, J. B. Moore, 1990, "Optimal Control", chapter 3).
fn regulator(a: [[f64; 2]; 2], b: [f64; 2], q: [f64; 2], r: f64) -> [f64; 2] {
    let mut p = [[q[0], 0.0], [0.0, q[1]]];
    let mut gain = [0.0; 2];
    for _ in 0..ITERATIONS {
        let by_b = [0, 1].map(|i| p[i][0] * b[0] + p[i][1] * b[1]);
        let square = r + b[0] * by_b[0] + b[1] * by_b[1];
        let next = [0, 1].map(|j| (by_b[0] * a[0][j] + by_b[1] * a[1][j]) / square);
        let left = |i: usize, j: usize| a[i][j] - b[i] * next[j];
        // P⁺ = Q + Aᵀ P (A - b K)
        let inner = [0, 1].map(|i| [0, 1].map(|j| p[i][0] * left(0, j) + p[i][1] * left(1, j)));
        p = [0, 1].map(|i| {
            [0, 1].map(|j| {
                let own = if i == j { q[i] } else { 0.0 };
                own + a[0][i] * inner[0][j] + a[1][i] * inner[1][j]
            })
        });
        let change = (next[0] - gain[0]).abs() + (next[1] - gain[1]).abs();
        gain = next;
        if change < ARRIVED * (gain[0].abs() + gain[1].abs()) {
            break;
        }
    }
    gain
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The scalar Riccati equation has a closed form.
    #[test]
    fn the_speed_loop_is_the_scalar_regulator() {
        let (k_v, k_a) = (2.0, 0.4);
        let found = Feedback::of(k_v, k_a).unwrap().velocity_kp;
        let a = f64::exp(-k_v / k_a * PERIOD);
        let b = (1.0 - a) / k_v;
        let (q, r) = (SPEED_ERROR.powi(-2), VOLTAGE.powi(-2));
        // b² p² + (r (1 - a²) - q b²) p - q r = 0
        let half = r * (1.0 - a * a) - q * b * b;
        let p = (-half + (half * half + 4.0 * b * b * q * r).sqrt()) / (2.0 * b * b);
        let wanted = a * b * p / (r + b * b * p);
        assert!((found - wanted).abs() < 1e-9, "{found} {wanted}");
    }

    /// A position loop with these gains is stable and well damped, and stronger errors are not answered more
    /// than the tolerances say.
    #[test]
    fn the_position_loop_brings_an_error_to_nothing() {
        let gains = Feedback::of(2.0, 0.4).unwrap();
        assert!(gains.position_kp > 0.0 && gains.position_kp < VOLTAGE / POSITION_ERROR);
        let (mut x, mut v) = (1.0, 0.0);
        for _ in 0..400 {
            let u = -gains.position_kp * x - gains.position_kd * v;
            for _ in 0..20 {
                v += 0.001 * (u - 2.0 * v) / 0.4;
                x += 0.001 * v;
            }
        }
        assert!(f64::abs(x) < 1e-3, "{x}");
    }

    #[test]
    fn no_machine_has_no_gains() {
        assert_eq!(Feedback::of(-1.0, 0.4), None);
        assert_eq!(Feedback::of(1.0, f64::NAN), None);
    }
}
