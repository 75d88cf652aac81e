//! A spring whose force depends on the way it came.

/// A joint with hysteresis after Bouc and Wen, followed along its way instead of in time: it does not matter how fast
/// the way is gone.
///
/// With `f` the force that it holds against, counted in the direction of the motion, and `s` the way gone,
///
/// ```text
/// df/ds = stiffness - onward f     f > 0: it is wound further
/// df/ds = stiffness - back f       f < 0: it is let go
/// ```
///
/// so that over any way in one direction the force is an exponential, exactly.
///
/// Noël and Schoukens (2016), equation (3) with `ν = 1`: `stiffness = α`, `onward = β (γ + δ)`, `back = β (γ - δ)`.
///
/// Reference: J.-P. Noël, M. Schoukens (2016), "Hysteretic benchmark with a dynamic nonlinearity", Workshop on Nonlinear
/// System Identification Benchmarks, Brussels, section 2.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Hysteresis {
    /// N/m, or N m/rad.
    pub(crate) stiffness: f64,
    /// 1/m, or 1/rad.
    pub(crate) onward: f64,
    /// 1/m, or 1/rad.
    pub(crate) back: f64,
    /// What it pulls with against a positive way, N or N m.
    pub(crate) force: f64,
}

impl Hysteresis {
    /// The joint after a way in one direction, m or rad.
    pub(crate) fn moved(self, way: f64) -> Self {
        if self.stiffness == 0.0 || way == 0.0 {
            return self;
        }
        let sign = way.signum();
        let (mut along, mut left) = (sign * self.force, way.abs());
        if along < 0.0 {
            let free = self.until_free(along);
            if free >= left {
                along = self.after(along, left, self.back);
                left = 0.0;
            } else {
                along = 0.0;
                left -= free;
            }
        }
        let force = sign * self.after(along, left, self.onward);
        Self { force, ..self }
    }

    /// The force after a way without a turn in its law.
    fn after(&self, along: f64, way: f64, rate: f64) -> f64 {
        let decay = rate * way;
        let gained = if decay.abs() < 1e-12 {
            way
        } else {
            -(-decay).exp_m1() / rate
        };
        along * (-decay).exp() + self.stiffness * gained
    }

    /// The way on which a force against the motion is let go altogether.
    fn until_free(&self, along: f64) -> f64 {
        let share = -along / self.stiffness;
        if self.back.abs() * share < 1e-12 {
            share
        } else {
            (self.back * share).ln_1p() / self.back
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAPER: Hysteresis = Hysteresis {
        stiffness: 5e4,
        onward: -300.0,
        back: 1900.0,
        force: 0.0,
    };

    /// Against the differential equation of the paper, in small steps of time.
    #[test]
    fn is_what_the_paper_writes() {
        let (alpha, beta, gamma, delta) = (5e4, 1e3, 0.8, -1.1);
        let (mut joint, mut force, mut x): (Hysteresis, f64, f64) = (PAPER, 0.0, 0.0);
        let h = 1e-7;
        for k in 0..2_000_000 {
            let t = f64::from(k) * h;
            let v = 0.2 * (90.0 * t).cos() + 0.15 * (233.0 * t).cos();
            let rate = |f: f64| alpha * v - beta * (gamma * v.abs() * f + delta * v * f.abs());
            let middle = force + 0.5 * h * rate(force);
            force += h * rate(middle);
            joint = joint.moved(v * h);
            x += v * h;
            assert!(
                (joint.force - force).abs() < 0.02,
                "{t} s, {x} m: {joint:?} {force}"
            );
        }
        assert!(x.abs() > 1e-4 && force.abs() > 1.0);
    }

    /// A way is a way, in one piece or in many.
    #[test]
    fn a_way_in_pieces_is_the_same() {
        for joint in [
            PAPER,
            Hysteresis {
                onward: 0.0,
                back: 0.0,
                ..PAPER
            },
        ] {
            for way in [1e-3, -2e-3, 5e-5] {
                let start = joint.moved(7e-4);
                let pieces = (0..1000).fold(start, |j, _| j.moved(way / 1000.0));
                let whole = start.moved(way);
                assert!((pieces.force - whole.force).abs() < 1e-9 * whole.force.abs());
            }
        }
    }

    /// What goes round gives back less than it took.
    #[test]
    fn a_turn_takes_energy() {
        let (mut joint, mut work) = (PAPER, 0.0);
        let positions =
            (0..=400).map(|k| 1e-3 * (std::f64::consts::TAU * f64::from(k) / 200.0).sin());
        let mut at = 0.0;
        for x in positions {
            let next = joint.moved(x - at);
            work += 0.5 * (joint.force + next.force) * (x - at);
            (joint, at) = (next, x);
        }
        assert!(work > 0.01, "{work} J");
    }
}
