//! What a PI loop around one integrator does, in closed form.

/// Band around the final value that counts as settled, 2 % of the step.
pub const SETTLED: f64 = 0.02;

/// The closed loop of `u' = ν`, `ν = K_p (r - u) + K_i ∫(r - u) dt`.
///
/// ```text
/// H(s) = (K_p s + K_i)/(s² + K_p s + K_i)                                            (49)
/// e(t) = 1 - y(t) = exp(-σ t) (cosh(η t) - σ sinh(η t)/η),   σ = K_p/2,  η² = σ² - K_i
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `K_p`, `K_i` | gains | 1/s, 1/s² |
/// | `e(t)` | error after a unit step of the reference | 1 |
/// | `σ`, `η` | decay rate; half the distance between the poles, imaginary where they oscillate | 1/s |
///
/// The zero of `H` is what the rule `T_s = 4/(ξ ω_n)` of (50) leaves out. It makes every such loop
/// overshoot: `e' = 0` at `t* = 2 artanh(η/σ)/η` (`2 atan(ω_d/σ)/ω_d` where `η = i ω_d`), and there
/// `e = -exp(-σ t*)`; the later extremes of an oscillating loop lie on the same exponential, `π/ω_d`
/// apart.
///
/// Assumptions: `K_p > 0`, `K_i >= 0`; no actuator limit.
///
/// Reference: Alves, Lages, Henriques (2018), (48)–(52); the step response of a second order system
/// with a zero: Franklin, Powell, Emami-Naeini, "Feedback Control of Dynamic Systems", ch. 3.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PiResponse {
    kp: f64,
    ki: f64,
    pub(crate) sigma: f64,
    /// `η²`.
    pub(crate) split: f64,
}

impl PiResponse {
    /// The loop with these gains; `None` where it would not settle (`K_p <= 0`, `K_i < 0`, NaN).
    pub fn new(kp: f64, ki: f64) -> Option<Self> {
        let sigma = 0.5 * kp;
        (kp > 0.0 && ki >= 0.0 && kp.is_finite() && ki.is_finite()).then_some(Self {
            kp,
            ki,
            sigma,
            split: sigma * sigma - ki,
        })
    }

    /// `1 - y(t)` after a unit step of the reference at `t = 0`.
    pub fn error(&self, t: f64) -> f64 {
        let (sigma, x) = (self.sigma, self.split * t * t);
        if x.abs() < 1e-6 {
            // The same, expanded by (η t)².
            let cosh = 1.0 + x / 2.0 * (1.0 + x / 12.0);
            let sinh_by_eta = t * (1.0 + x / 6.0 * (1.0 + x / 20.0));
            return libm::exp(-sigma * t) * (cosh - sigma * sinh_by_eta);
        }
        if self.split < 0.0 {
            let eta = libm::sqrt(-self.split);
            let (sin, cos) = libm::sincos(eta * t);
            return libm::exp(-sigma * t) * (cos - sigma * sin / eta);
        }
        // The slow pole is K_i over the fast one: no cancellation where they lie far apart.
        let eta = libm::sqrt(self.split);
        let (fast, slow) = (sigma + eta, self.ki / (sigma + eta));
        (fast * libm::exp(-fast * t) - slow * libm::exp(-slow * t)) / (2.0 * eta)
    }

    /// When the response to a step is farthest above it, s; infinity without integral action.
    pub fn peak_time(&self) -> f64 {
        let x = self.split / (self.sigma * self.sigma);
        if self.ki == 0.0 {
            f64::INFINITY
        } else if x.abs() < 1e-6 {
            2.0 / self.sigma * (1.0 + x / 3.0)
        } else if x < 0.0 {
            let eta = libm::sqrt(-self.split);
            2.0 * libm::atan(eta / self.sigma) / eta
        } else {
            let eta = libm::sqrt(self.split);
            let fast = self.sigma + eta;
            (2.0 * libm::log(fast) - libm::log(self.ki)) / eta
        }
    }

    /// How far the response to a step overshoots, as a fraction of the step.
    pub fn overshoot(&self) -> f64 {
        libm::exp(-self.sigma * self.peak_time())
    }

    /// From when on the response to a step stays within 2 % of it, s.
    pub fn settling_time(&self) -> f64 {
        if self.ki == 0.0 {
            return libm::log(1.0 / SETTLED) / self.kp;
        }
        // Extremes lie at t*, t* + π/ω_d, …; between two of them the error is monotone.
        let peak = self.peak_time();
        let envelope = libm::log(1.0 / SETTLED) / self.sigma;
        if peak >= envelope {
            // Even the first one is within the band.
            return self.crossing(0.0, peak);
        }
        if self.split < 0.0 {
            let half = core::f64::consts::PI / libm::sqrt(-self.split);
            let last = peak + libm::floor((envelope - peak) / half) * half;
            return self.crossing(last, last + half);
        }
        let mut end = 2.0 * peak;
        while self.error(end).abs() > SETTLED && end.is_finite() {
            end *= 2.0;
        }
        self.crossing(peak, end)
    }

    /// Where `|e|` falls below the band within `(outside, inside)`, by bisection.
    fn crossing(&self, mut outside: f64, mut inside: f64) -> f64 {
        // The far end may lie on the other side of zero, and outside again by rounding only.
        let sign = if self.error(outside) < 0.0 { -1.0 } else { 1.0 };
        for _ in 0..200 {
            let middle = 0.5 * (outside + inside);
            if middle <= outside || middle >= inside {
                break;
            }
            if sign * self.error(middle) > SETTLED {
                outside = middle;
            } else {
                inside = middle;
            }
        }
        inside
    }
}

/// From when on the response of `H(s) = (K_p s + K_i)/(s² + K_p s + K_i)` to a step stays within
/// 2 % of it, s, the zero included; infinity where it never does.
///
/// ```
/// let settled = loopsight_controllers::settling_time(17.78, 79.01);
/// assert!((settled - 0.607).abs() < 1e-3); // (50) promises 0.45 s
/// ```
pub fn settling_time(kp: f64, ki: f64) -> f64 {
    PiResponse::new(kp, ki).map_or(f64::INFINITY, |response| response.settling_time())
}

/// How far the response of `H(s)` to a step overshoots, as a fraction of the step; NaN where the
/// loop does not settle.
///
/// ```
/// assert!((loopsight_controllers::overshoot(17.78, 79.01) - 0.135).abs() < 1e-3);
/// ```
pub fn overshoot(kp: f64, ki: f64) -> f64 {
    PiResponse::new(kp, ki).map_or(f64::NAN, |response| response.overshoot())
}

/// How gains follow from a settling time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "std",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "snake_case")
)]
pub enum Rule {
    /// `ω_n = 4/(ξ T_s)`, (50): leaves the zero of `H(s)` out, so the loop settles later.
    #[default]
    Paper,
    /// `ω_n` such that the response of `H(s)`, with its zero, settles at `T_s`.
    Exact,
}

/// Gains `(K_p, K_i) = (2 ξ ω_n, ω_n²)`, (51)(52), for a 2 % settling time (s) and a damping.
///
/// `None` unless both are numbers above 0.
///
/// ```
/// use loopsight_controllers::{Rule, gains, settling_time};
/// let (kp, ki) = gains(Rule::Paper, 0.45, 1.0).unwrap();
/// assert!((kp - 17.78).abs() < 0.01 && (ki - 79.01).abs() < 0.01);
/// let (kp, ki) = gains(Rule::Exact, 0.45, 1.0).unwrap();
/// assert!((settling_time(kp, ki) - 0.45).abs() < 1e-9);
/// ```
pub fn gains(rule: Rule, settling_time_s: f64, damping: f64) -> Option<(f64, f64)> {
    if !(settling_time_s > 0.0 && damping > 0.0 && settling_time_s.is_finite()) {
        return None;
    }
    let natural = match rule {
        Rule::Paper => 4.0 / (damping * settling_time_s),
        // H depends on ω_n t alone: the settling time at ω_n = 1 s⁻¹ tells it for all.
        Rule::Exact => PiResponse::new(2.0 * damping, 1.0)?.settling_time() / settling_time_s,
    };
    let gains = (2.0 * damping * natural, natural * natural);
    (gains.0.is_finite() && gains.1.is_finite() && gains.0 > 0.0).then_some(gains)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The step response of `H(s)` integrated in fine steps: error at every step.
    fn brute_force(kp: f64, ki: f64, dt: f64, steps: usize) -> Vec<f64> {
        let (mut u, mut integral) = (0.0, 0.0);
        let rate = |u: f64, z: f64| (kp * (1.0 - u) + z, ki * (1.0 - u));
        (0..steps)
            .map(|_| {
                let error: f64 = 1.0 - u;
                let (a, b) = rate(u, integral);
                let (c, d) = rate(u + 0.5 * dt * a, integral + 0.5 * dt * b);
                let (e, f) = rate(u + 0.5 * dt * c, integral + 0.5 * dt * d);
                let (g, h) = rate(u + dt * e, integral + dt * f);
                u += dt / 6.0 * (a + 2.0 * c + 2.0 * e + g);
                integral += dt / 6.0 * (b + 2.0 * d + 2.0 * f + h);
                error
            })
            .collect()
    }

    #[test]
    fn settling_and_overshoot_agree_with_brute_force() {
        let dampings = [
            0.1,
            0.3,
            0.5,
            0.6,
            0.7,
            0.779_7,
            0.9,
            0.999_999_9,
            1.0,
            1.000_000_1,
            1.1,
            1.5,
            1.8,
            2.0,
            3.0,
            5.0,
        ];
        for damping in dampings {
            for natural in [0.5, 8.889, 100.0] {
                let (kp, ki) = (2.0 * damping * natural, natural * natural);
                let dt = 2e-4 / natural;
                let errors = brute_force(kp, ki, dt, 300_000);
                let last = errors.iter().rposition(|e| e.abs() > SETTLED).unwrap();
                let settled = settling_time(kp, ki);
                assert!(
                    (settled - last as f64 * dt).abs() < 2.0 * dt,
                    "ξ {damping}, ω {natural}: {settled} instead of {}",
                    last as f64 * dt
                );
                let lowest = errors.iter().copied().fold(0.0, f64::min);
                assert!((overshoot(kp, ki) + lowest).abs() < 1e-6);
                let response = PiResponse::new(kp, ki).unwrap();
                for (k, error) in errors.iter().enumerate().step_by(997) {
                    assert!((response.error(k as f64 * dt) - error).abs() < 1e-9);
                }
            }
        }
    }

    /// Remark on (50): the paper's loop overshoots by exp(-2) at 2/ω_n and is late.
    #[test]
    fn the_papers_gains_settle_later_than_asked() {
        let response = PiResponse::new(17.78, 79.01).unwrap();
        assert!((response.overshoot() - (-2.0f64).exp()).abs() < 1e-4);
        assert!((response.peak_time() - 0.225).abs() < 5e-4);
        assert!((response.settling_time() - 0.607).abs() < 5e-4);
    }

    #[test]
    fn the_exact_rule_gives_what_is_asked() {
        for damping in [0.2, 0.5, 0.7, 1.0, 1.4, 4.0, 30.0] {
            let (kp, ki) = gains(Rule::Exact, 0.45, damping).unwrap();
            assert!((settling_time(kp, ki) - 0.45).abs() < 1e-9);
            assert!((kp / (2.0 * ki.sqrt()) - damping).abs() < 1e-12);
        }
        assert_eq!(gains(Rule::Exact, 0.0, 1.0), None);
        assert_eq!(gains(Rule::Paper, 0.45, -1.0), None);
        assert_eq!(gains(Rule::Paper, f64::NAN, 1.0), None);
        assert_eq!(settling_time(0.0, 1.0), f64::INFINITY);
        assert!((settling_time(2.0, 0.0) - 50f64.ln() / 2.0).abs() < 1e-12);
    }
}
