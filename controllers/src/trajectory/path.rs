//! Paths to be followed in time.

use loopsight_core::Real;

/// Where a robot should be, and how it should move there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal<S> {
    /// `x_r`, `y_r`, m, from where the path begins, `x` along its first direction.
    pub position: [S; 2],
    /// `θ_r`, rad, from -π to π.
    pub heading: S,
    /// `v_r`, m/s.
    pub speed: S,
    /// `ω_r`, rad/s.
    pub turning: S,
}

/// The shape of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "std", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "std", serde(rename_all = "snake_case", deny_unknown_fields))]
pub enum Path {
    /// An eight: `x = L/2 sin φ`, `y = W/2 sin 2φ`, `L` long and `W` wide.
    FigureEight {
        /// `L`, m.
        length_m: f64,
        /// `W`, m.
        width_m: f64,
        /// Time of one round, s.
        lap_s: f64,
    },
    /// A circle, to the left.
    Circle {
        /// Radius, m.
        radius_m: f64,
        /// Time of one round, s.
        lap_s: f64,
    },
}

impl Path {
    /// The key of a number that is not above 0, with it.
    pub fn mistake(&self) -> Option<(&'static str, f64)> {
        let list = match *self {
            Path::FigureEight {
                length_m,
                width_m,
                lap_s,
            } => [
                ("figure_eight.length_m", length_m),
                ("figure_eight.width_m", width_m),
                ("figure_eight.lap_s", lap_s),
            ],
            Path::Circle { radius_m, lap_s } => [
                ("circle.radius_m", radius_m),
                ("circle.radius_m", radius_m),
                ("circle.lap_s", lap_s),
            ],
        };
        list.into_iter().find(|(_, v)| !(*v > 0.0 && v.is_finite()))
    }

    /// Time of one round, s.
    fn lap(&self) -> f64 {
        match *self {
            Path::FigureEight { lap_s, .. } | Path::Circle { lap_s, .. } => lap_s,
        }
    }

    /// The goal `time` s after the start; the speed grows from rest over the first `ease` s.
    ///
    /// ```text
    /// φ = 2π/lap · (t²/2ease up to ease, then t - ease/2)
    /// v = |p'| φ'      θ = angle of p'      ω = (x' y'' - y' x'')/|p'|² φ'
    /// ```
    pub fn at<S: Real>(&self, time: S, ease: f64) -> Goal<S> {
        let rate = S::of(core::f64::consts::TAU / self.lap());
        let half = S::of(0.5);
        let ease = S::of(ease);
        let (phase, pace) = if time < ease {
            (rate * time * time * half / ease, rate * time / ease)
        } else {
            (rate * (time - half * ease), rate)
        };
        // Position, first and second derivative by the phase.
        let (p, d, dd) = match *self {
            Path::FigureEight {
                length_m, width_m, ..
            } => {
                let (a, b) = (S::of(0.5 * length_m), S::of(0.5 * width_m));
                let two = S::of(2.0);
                let (sin, cos) = phase.sin_cos();
                let (sin2, cos2) = (two * phase).sin_cos();
                (
                    [a * sin, b * sin2],
                    [a * cos, two * b * cos2],
                    [-a * sin, -two * two * b * sin2],
                )
            }
            Path::Circle { radius_m, .. } => {
                let r = S::of(radius_m);
                let (sin, cos) = phase.sin_cos();
                (
                    [r * sin, r * (S::one() - cos)],
                    [r * cos, r * sin],
                    [-r * sin, r * cos],
                )
            }
        };
        let norm = d[0] * d[0] + d[1] * d[1];
        let first = match *self {
            Path::FigureEight {
                length_m, width_m, ..
            } => S::of(libm::atan2(width_m, 0.5 * length_m)),
            Path::Circle { .. } => S::zero(),
        };
        let (sin, cos) = first.sin_cos();
        let turned = |v: [S; 2]| [cos * v[0] + sin * v[1], cos * v[1] - sin * v[0]];
        let d = turned(d);
        let dd = turned(dd);
        Goal {
            position: turned(p),
            heading: d[1].atan2(d[0]),
            speed: norm.sqrt() * pace,
            turning: (d[0] * dd[1] - d[1] * dd[0]) / norm * pace,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EIGHT: Path = Path::FigureEight {
        length_m: 1.6,
        width_m: 0.8,
        lap_s: 20.0,
    };

    /// A robot that drives as the goal says comes where the goal is.
    #[test]
    fn speed_and_turning_lead_along_the_path() {
        let circle = Path::Circle {
            radius_m: 0.5,
            lap_s: 10.0,
        };
        for path in [EIGHT, circle] {
            let start = path.at(0.0, 1.0);
            assert_eq!(start.position, [0.0; 2]);
            assert!(start.heading.abs() < 1e-12 && start.speed == 0.0 && start.turning == 0.0);
            let (mut p, mut heading, h) = ([0.0f64; 2], 0.0f64, 1e-3);
            for k in 0..25_000 {
                let goal = path.at((f64::from(k) + 0.5) * h, 1.0);
                let middle = heading + 0.5 * h * goal.turning;
                p[0] += h * goal.speed * middle.cos();
                p[1] += h * goal.speed * middle.sin();
                heading += h * goal.turning;
                let now = path.at(f64::from(k + 1) * h, 1.0);
                for (found, expected) in p.iter().zip(now.position) {
                    assert!((found - expected).abs() < 1e-4, "{k}: {p:?} {now:?}");
                }
                assert!((heading - now.heading).sin().abs() < 1e-4);
            }
        }
    }

    #[test]
    fn numbers_that_cannot_be_are_named() {
        assert_eq!(EIGHT.mistake(), None);
        let flat = Path::Circle {
            radius_m: 0.0,
            lap_s: 1.0,
        };
        assert_eq!(flat.mistake(), Some(("circle.radius_m", 0.0)));
    }
}
