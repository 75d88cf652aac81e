//! Encoders, and the velocities that are made of their counts.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use crate::delay::Delay;
use crate::driven::{Body, Driven};

/// Counts per revolution after quadrature.
pub(crate) const COUNTS: f64 = 8192.0;
/// Angle of one count, rad.
const RESOLUTION: f64 = TAU / COUNTS;

/// A disc that does not turn about its centre: `φ_read = φ + amplitude (sin(φ + phase) - sin phase)`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Eccentricity {
    /// rad.
    pub(crate) amplitude: f64,
    /// rad.
    pub(crate) phase: f64,
}

/// How velocities are made of encoder counts.
///
/// ```text
/// N = floor(φ_read/Δ + p)     Δ = 2π/8192     p random in [0, 1)
/// y_j(t_k) = scale_j Σ_i gain_ji Δ (N_i(t_k - d) - N_i(t_k-1 - d))/T + offset_j
/// ```
///
/// With a window of `n` differences more it is `(N_i(t_k) - N_i(t_k-1-n))/((1 + n) T)`: the mean of so many. With a lag the counts pass a first-order filter, whose output is in whole counts, too. With one track `N` is the
/// number of marks that have passed, whichever way, and the angle is the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct OdometryParts {
    /// Number of signals.
    pub(crate) signals: usize,
    /// From the shafts' rates to the signals, with the nominal geometry.
    pub(crate) gain: [[f64; 2]; 2],
    /// Age of the counts when they are read, s.
    pub(crate) delay: f64,
    /// Time constant of the filter, s.
    pub(crate) lag: f64,
    /// Differences before the last one of which the mean is given out.
    pub(crate) window: usize,
    /// Offset of each signal.
    pub(crate) offset: [f64; 2],
    /// Scale of each signal.
    pub(crate) scale: [f64; 2],
    /// Radius of each measuring wheel over the nominal one.
    pub(crate) wheel_size: [f64; 2],
    /// The discs have one track of marks, which does not show the direction.
    pub(crate) one_track: bool,
    /// Of each disc.
    pub(crate) eccentricity: [Eccentricity; 2],
}

impl OdometryParts {
    /// Odometry without fault.
    pub(crate) fn new(robot: Driven, body: &Body) -> Self {
        let r = body.wheel_radius;
        let (signals, gain) = match robot {
            Driven::Twil => {
                let yaw = r / (2.0 * body.half_track);
                (2, [[r / 2.0, r / 2.0], [yaw, -yaw]])
            }
            Driven::Axis => (1, [[1.0, 0.0], [0.0, 0.0]]),
        };
        Self {
            signals,
            gain,
            delay: 0.0,
            lag: 0.0,
            window: 0,
            offset: [0.0; 2],
            scale: [1.0; 2],
            wheel_size: [1.0; 2],
            one_track: false,
            eccentricity: [Eccentricity::default(); 2],
        }
    }
}

/// An angle as it is and as it is counted, rad.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Reading {
    exact: [f64; 2],
    counted: [f64; 2],
    /// What is given out, in whole counts.
    output: [f64; 2],
}

/// Encoders at work.
#[derive(Clone, Debug)]
pub(crate) struct Odometry {
    parts: OdometryParts,
    phase: [f64; 2],
    line: Delay<[f64; 2]>,
    /// What remains of a difference after one step of the filter; 0 without filter.
    decay: f64,
    now: Reading,
    /// At the samples before this one, the oldest first.
    last: VecDeque<Reading>,
    /// What the discs were at after the last step.
    seen: Reading,
    /// Every step counts, not only those at which a sample is taken.
    every_step: bool,
}

impl Odometry {
    /// Encoders on shafts at angle 0, with marks at `phase` in `[0, 1)`.
    pub(crate) fn new(parts: OdometryParts, phase: [f64; 2], step: f64) -> Self {
        let decay = if parts.lag > 0.0 {
            (-step / parts.lag).exp()
        } else {
            0.0
        };
        let mut odometry = Self {
            parts,
            phase,
            line: Delay::new((parts.delay / step).round() as usize, [0.0; 2]),
            decay,
            now: Reading::default(),
            last: VecDeque::new(),
            seen: Reading::default(),
            every_step: parts.delay > 0.0 || parts.lag > 0.0 || parts.one_track,
        };
        odometry.now = odometry.read([0.0; 2]);
        odometry.last = vec![odometry.now; 1 + parts.window].into();
        odometry.seen = odometry.now;
        odometry
    }

    fn read(&self, angles: [f64; 2]) -> Reading {
        let exact = [0, 1].map(|i| {
            let Eccentricity { amplitude, phase } = self.parts.eccentricity[i];
            let angle: f64 = angles[i] / self.parts.wheel_size[i];
            if amplitude == 0.0 {
                angle
            } else {
                angle + amplitude * ((angle + phase).sin() - phase.sin())
            }
        });
        let counted = [0, 1].map(|i| (exact[i] / RESOLUTION + self.phase[i]).floor() * RESOLUTION);
        Reading {
            exact,
            counted,
            output: counted,
        }
    }

    /// Takes note of the shafts' angles after an integration step; `due` when a sample is read now.
    pub(crate) fn step(&mut self, angles: [f64; 2], due: bool) {
        if !self.every_step && !due {
            return;
        }
        let late = self.line.push(angles);
        let mut read = self.read(late);
        if self.parts.one_track {
            let way = |now: f64, before: f64, passed: f64| passed + (now - before).abs();
            let seen = std::mem::replace(&mut self.seen, read);
            for i in 0..2 {
                read.exact[i] = way(read.exact[i], seen.exact[i], self.now.exact[i]);
                read.counted[i] = way(read.counted[i], seen.counted[i], self.now.counted[i]);
            }
        }
        for i in 0..2 {
            let pass = |old: &mut f64, new: f64| *old = new + (*old - new) * self.decay;
            pass(&mut self.now.exact[i], read.exact[i]);
            pass(&mut self.now.counted[i], read.counted[i]);
        }
    }

    /// The signals over the last `period` s: as counted, and as they would be without counting.
    pub(crate) fn sample(&mut self, period: f64) -> ([f64; 2], [f64; 2]) {
        let last = self.last.pop_front().unwrap_or(self.now);
        let span = (1 + self.parts.window) as f64;
        let rate = |now: [f64; 2], last: [f64; 2]| {
            let [right, left] = [0, 1].map(|i| (now[i] - last[i]) / (span * period));
            [0, 1].map(|j| {
                let gain = self.parts.gain[j];
                self.parts.scale[j] * (gain[0] * right + gain[1] * left) + self.parts.offset[j]
            })
        };
        if self.decay > 0.0 {
            let whole = |angle: f64| (angle / RESOLUTION).floor() * RESOLUTION;
            self.now.output = self.now.counted.map(whole);
        } else {
            self.now.output = self.now.counted;
        }
        let counted = rate(self.now.output, last.output);
        let exact = rate(self.now.exact, last.exact);
        self.last.push_back(self.now);
        (counted, exact)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parts() -> OdometryParts {
        OdometryParts::new(Driven::Twil, &Driven::Twil.parts().1)
    }

    #[test]
    fn counting_loses_less_than_a_count() {
        let mut odometry = Odometry::new(parts(), [0.3, 0.9], 1e-4);
        let mut sum = [0.0; 2];
        for k in 1..=1000 {
            let t = 0.01 * f64::from(k);
            odometry.step([2.0 * t, -0.5 * t], true);
            let (counted, exact) = odometry.sample(0.01);
            assert!((exact[0] - 0.025 * 1.5).abs() < 1e-9);
            let error = counted[0] - exact[0];
            assert!(error.abs() < 2.0 * 0.025 * TAU / COUNTS / 0.01);
            sum[0] += error;
            sum[1] += counted[1] - exact[1];
        }
        assert!(sum.iter().all(|s| (s / 1000.0).abs() < 1e-3), "{sum:?}");
    }

    /// There and back: no angle, but twice the way.
    #[test]
    fn one_track_counts_both_ways() {
        let mut one = parts();
        one.one_track = true;
        let mut odometry = Odometry::new(one, [0.2; 2], 1e-4);
        for k in 1..=1000 {
            let angle = (TAU * f64::from(k) / 2000.0).sin();
            odometry.step([angle, -angle], k == 1000);
        }
        let ([counted, _], [exact, _]) = odometry.sample(0.1);
        let expected = 0.025 * (2.0 + 2.0) / 0.1;
        assert!((exact - expected).abs() < 1e-4, "{exact}");
        assert!((counted - expected).abs() < 0.025 * 4.0 * RESOLUTION / 0.1);
    }

    #[test]
    fn delay_lag_and_window_are_late_by_their_time() {
        let mut late = parts();
        late.delay = 0.03;
        let mut slow = parts();
        slow.lag = 0.03;
        // A mean of seven differences is late by three periods more than one.
        let mut mean = parts();
        mean.window = 6;
        for parts in [late, slow, mean] {
            let mut odometry = Odometry::new(parts, [0.0; 2], 1e-4);
            // A ramp of speed: the mean over a period is late by half of it, too.
            let mut v = [0.0; 2];
            for k in 1..=10_000 {
                let t = 1e-4 * f64::from(k);
                odometry.step([t * t, t * t], k % 100 == 0);
                if k % 100 == 0 {
                    v = odometry.sample(0.01).1;
                }
            }
            let expected = 0.05 * 2.0 * (1.0 - 0.03 - 0.005);
            assert!((v[0] - expected).abs() < 2e-5, "{} {expected}", v[0]);
        }
    }

    #[test]
    fn an_eccentric_disc_returns_after_a_revolution() {
        let mut parts = parts();
        parts.eccentricity[0] = Eccentricity {
            amplitude: 0.05,
            phase: 0.7,
        };
        let odometry = Odometry::new(parts, [0.0; 2], 1e-4);
        assert!((odometry.read([TAU, 0.0]).exact[0] - TAU).abs() < 1e-12);
        assert!((odometry.read([3.0, 0.0]).exact[0] - 3.0).abs() > 0.03);
    }
}
