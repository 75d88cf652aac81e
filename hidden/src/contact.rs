//! Contacts: the teeth of a gear with play, stops at the ends of a way, and tyres.

/// A gear with play: two shafts that touch only at the ends of a gap.
///
/// ```text
/// δ = φ_motor - φ_load     p = δ -/+ gap/2 beyond the gap, 0 within
/// T = stiffness p + damping δ'   where δ is beyond the gap and T pushes, else 0
/// ```
///
/// Reference: M. Nordin, P.-O. Gutman (2002), "Controlling mechanical systems with backlash — a
/// survey", Automatica 38, 1633–1649, section 2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Gap {
    /// Play from one end to the other, rad.
    pub(crate) gap: f64,
    /// Stiffness of the teeth at the output, N m/rad.
    pub(crate) stiffness: f64,
    /// Damping of the teeth, N m s/rad.
    pub(crate) damping: f64,
}

impl Gap {
    /// Torque from motor to load for a difference of angles and of speeds, N m.
    pub(crate) fn torque(&self, difference: f64, rate: f64) -> f64 {
        let half = 0.5 * self.gap;
        if difference.abs() <= half {
            return 0.0;
        }
        let side = difference.signum();
        let push = self.stiffness * (difference.abs() - half) + side * rate * self.damping;
        side * push.max(0.0)
    }
}

/// Two stops that give, alike, with a free way between them.
///
/// ```text
/// F = k δ + λ δ δ'     δ: how deep it is in the stop      λ = 3/2 α k
/// ```
///
/// What comes in slowly, with a speed `v`, leaves with `(1 - α v) v`. A stop does not pull.
///
/// Reference: K. H. Hunt, F. R. E. Crossley (1975), "Coefficient of restitution interpreted as damping in vibroimpact",
/// Journal of Applied Mechanics 42(2), 440–445.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stops {
    /// Where the lower and the upper one begin, rad or m.
    pub(crate) at: [f64; 2],
    /// N m/rad or N/m.
    pub(crate) stiffness: f64,
    /// Share of the speed that is lost per speed, `α`, s/rad or s/m.
    pub(crate) absorbed: f64,
}

impl Stops {
    /// Torque or force at a position and a speed.
    pub(crate) fn force(&self, position: f64, speed: f64) -> f64 {
        let [lower, upper] = self.at;
        // To the upper stop all is as to the lower one in a mirror.
        let (depth, rate, side) = if position < lower {
            (lower - position, -speed, 1.0)
        } else if position > upper {
            (position - upper, speed, -1.0)
        } else {
            return 0.0;
        };
        let damping = 1.5 * self.absorbed * self.stiffness * depth;
        side * (self.stiffness * depth + damping * rate).max(0.0)
    }

    /// The factor of the depth's rate in the force, over the stiffness.
    pub(crate) fn loss(&self) -> f64 {
        1.5 * self.absorbed
    }
}

/// A shaft that twists, with a load behind it.
///
/// ```text
/// T = stiffness δ + damping δ'     δ = φ_near - φ_far     inertia φ''_far = T
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Twisting {
    /// Of the load, kg m².
    pub(crate) inertia: f64,
    /// N m/rad
    pub(crate) stiffness: f64,
    /// N m s/rad
    pub(crate) damping: f64,
}

impl Twisting {
    /// Torque that reaches the load for a twist and its rate, N m.
    pub(crate) fn torque(&self, twist: f64, rate: f64) -> f64 {
        self.stiffness * twist + self.damping * rate
    }

    /// The shaft to a load of this inertia, which swings with `frequency` rad/s and the damping ratio `ratio` while its
    /// near end is held.
    pub(crate) fn swinging(inertia: f64, frequency: f64, ratio: f64) -> Self {
        Self {
            inertia,
            stiffness: inertia * frequency * frequency,
            damping: 2.0 * ratio * inertia * frequency,
        }
    }
}

/// A tyre on the ground: a force that grows with slip, has a peak and falls to sliding.
///
/// ```text
/// F = D sin(C atan(s/s_c))     s = r Ω - v_ground     D = friction · load
/// ```
///
/// The peak `D` is reached at `s = s_c tan(π/(2C))`. Slip is taken as a speed and not as a ratio:
/// a ratio means nothing at the crawling speeds of a reversal.
///
/// Reference: E. Bakker, L. Nyborg, H. B. Pacejka (1987), "Tyre modelling for use in vehicle
/// dynamics studies", SAE 870421.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tyre {
    /// Largest tractive force over the load on the wheel.
    pub(crate) friction: f64,
    /// Scale of the slip `s_c`, m/s.
    pub(crate) slip: f64,
}

impl Tyre {
    /// Shape factor `C`.
    const SHAPE: f64 = 1.3;

    /// Force of fast sliding over the largest force.
    pub(crate) fn sliding() -> f64 {
        (Self::SHAPE * std::f64::consts::FRAC_PI_2).sin()
    }

    /// Tractive force at a slip of `slip` m/s under a load of `load` N, N.
    pub(crate) fn force(&self, slip: f64, load: f64) -> f64 {
        self.friction * load * (Self::SHAPE * (slip / self.slip).atan()).sin()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn teeth_push_and_never_pull() {
        let gap = Gap {
            gap: 0.1,
            stiffness: 1000.0,
            damping: 2.0,
        };
        assert_eq!(gap.torque(0.049, 5.0), 0.0);
        assert!((gap.torque(0.06, 0.0) - 10.0).abs() < 1e-12);
        assert!((gap.torque(-0.06, 0.0) + 10.0).abs() < 1e-12);
        assert_eq!(
            gap.torque(0.06, -100.0),
            0.0,
            "parting faster than it springs"
        );
    }

    #[test]
    fn stops_push_back_and_never_pull() {
        let stops = Stops {
            at: [-1.0, 2.0],
            stiffness: 100.0,
            absorbed: 0.2,
        };
        assert_eq!(stops.force(1.9, 5.0), 0.0);
        assert!((stops.force(2.1, 0.0) + 10.0).abs() < 1e-9);
        assert!((stops.force(-1.1, -1.0) - 13.0).abs() < 1e-9);
        assert_eq!(
            stops.force(2.1, -9.0),
            0.0,
            "leaving faster than it follows"
        );
    }

    #[test]
    fn a_tyre_saturates() {
        let tyre = Tyre {
            friction: 0.2,
            slip: 0.003,
        };
        let forces: Vec<f64> = (0..2000)
            .map(|k| tyre.force(1e-4 * f64::from(k), 100.0))
            .collect();
        let peak = forces.iter().copied().fold(0.0, f64::max);
        assert!((peak - 20.0).abs() < 1e-3);
        assert!(forces[1999] < peak && forces[1999] > 0.85 * peak);
        assert!((tyre.force(-0.01, 100.0) + tyre.force(0.01, 100.0)).abs() < 1e-12);
    }
}
