//! Dry friction that bends before it slides.

/// A seal or a bearing on bristles: they bend with the way, against a stiffness, and slide where they bend as far as the
/// sliding friction of the moment allows (Canudas de Wit and others, 1995, equations 3 to 6).
///
/// With `T` the torque against a motion in one direction, counted against it, and `s` the way gone at a speed,
///
/// ```text
/// dT/ds = stiffness (1 - T/g(ω))     g(ω) = sliding + breakaway exp(-(ω/stribeck_speed)²)
/// ```
///
/// so that over any way at one speed the torque is an exponential, exactly.
///
/// Reference: C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky (1995), IEEE Transactions on Automatic Control
/// 40(3), 419–425, without the damping of the bristles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Bristles {
    /// N m/rad.
    pub(crate) stiffness: f64,
    /// N m.
    pub(crate) sliding: f64,
    /// What breaking away takes beyond it, N m.
    pub(crate) breakaway: f64,
    /// rad/s.
    pub(crate) stribeck_speed: f64,
    /// What they pull with against a positive way, N m.
    pub(crate) torque: f64,
}

impl Bristles {
    /// The bristles after a time at one speed.
    pub(crate) fn moved(self, speed: f64, time: f64) -> Self {
        if self.stiffness == 0.0 || speed == 0.0 {
            return self;
        }
        let ratio = speed / self.stribeck_speed;
        let slides_at = self.sliding + self.breakaway * (-ratio * ratio).exp();
        let sign = speed.signum();
        let along = sign * self.torque;
        let kept = (-self.stiffness * speed.abs() * time / slides_at).exp();
        let torque = sign * (slides_at + (along - slides_at) * kept);
        Self { torque, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEAL: Bristles = Bristles {
        stiffness: 8.0,
        sliding: 0.8,
        breakaway: 0.4,
        stribeck_speed: 1.0,
        torque: 0.0,
    };

    /// Against the differential equation in time, in small steps, to and fro.
    #[test]
    fn is_what_the_paper_writes() {
        let (mut seal, mut torque, h): (Bristles, f64, f64) = (SEAL, 0.0, 1e-5);
        for k in 0..200_000 {
            let speed: f64 = 2.0 * (h * 7.0 * f64::from(k)).sin();
            let g = 0.8 + 0.4 * (-speed * speed).exp();
            torque += h * 8.0 * (speed - speed.abs() * torque / g);
            seal = seal.moved(speed, h);
            assert!(
                (seal.torque - torque).abs() < 1e-3,
                "{k}: {seal:?} {torque}"
            );
        }
    }

    /// Slowly it takes the breakaway torque, fast the sliding one; many small steps are one large one.
    #[test]
    fn slides_at_its_level() {
        assert!((SEAL.moved(1e-3, 1e4).torque - 1.2).abs() < 1e-5);
        assert!((SEAL.moved(-9.0, 9.0).torque + 0.8).abs() < 1e-9);
        let once = SEAL.moved(0.5, 0.2).torque;
        let often = (0..20).fold(SEAL, |seal, _| seal.moved(0.5, 0.01)).torque;
        assert!((once - often).abs() < 1e-12);
    }

    /// Closed ways take energy.
    #[test]
    fn a_turn_takes_energy() {
        let (mut seal, mut work, h) = (SEAL, 0.0, 1e-4);
        for k in 0..100_000 {
            let speed = (h * f64::from(k)).cos() * 0.3;
            let next = seal.moved(speed, h);
            work += 0.5 * (seal.torque + next.torque) * speed * h;
            seal = next;
        }
        assert!(work > 0.05, "{work}");
    }
}
