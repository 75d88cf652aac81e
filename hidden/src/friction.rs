//! Dry friction that really sticks.

/// Resistance of a shaft to being turned, at the wheel's side of the gear.
///
/// ```text
/// |T| <= level(ω)     T opposes ω     level(ω) = coulomb + breakaway exp(-(ω/stribeck_speed)²)
/// ```
///
/// plus the smooth part `-viscous ω - quadratic ω|ω|`. Forwards and backwards may differ. The dry
/// part is no function of speed: at rest it is whatever keeps the shaft at rest, up to the level.
/// It is found as an impulse over the step, with which the shaft either stands at the end of the
/// step or the impulse is at its bound (Moreau's time stepping); there is no smoothing.
///
/// Reference: J. J. Moreau (1988), "Unilateral contact and dry friction in finite freedom
/// dynamics", in Nonsmooth Mechanics and Applications, CISM 302, 1–82; Stribeck curve as in
/// H. Olsson et al. (1998), European Journal of Control 4, 176–195, equation (3).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Friction {
    /// Dry friction while turning forwards and backwards, N m.
    pub(crate) coulomb: [f64; 2],
    /// What breaking away takes beyond `coulomb`, N m.
    pub(crate) breakaway: f64,
    /// Speed at which most of `breakaway` is gone, rad/s.
    pub(crate) stribeck_speed: f64,
    /// Viscous friction forwards and backwards, N m s/rad.
    pub(crate) viscous: [f64; 2],
    /// What viscous friction grows by per second, N m/rad.
    pub(crate) drying: f64,
    /// Drag, N m s²/rad².
    pub(crate) quadratic: f64,
}

impl Friction {
    /// Whether there is any dry friction.
    pub(crate) fn is_dry(&self) -> bool {
        self.coulomb != [0.0; 2] || self.breakaway != 0.0
    }

    /// The smooth part of the torque at speed `w`, `time` s after the start, N m.
    pub(crate) fn smooth(&self, w: f64, time: f64) -> f64 {
        let viscous = self.viscous[usize::from(w < 0.0)] + self.drying * time;
        -(viscous + self.quadratic * w.abs()) * w
    }

    /// Bounds of the dry torque at a speed of about `w`: against backward and forward motion, N m.
    pub(crate) fn bounds(&self, w: f64) -> [f64; 2] {
        let extra = if self.breakaway == 0.0 {
            0.0
        } else {
            self.breakaway * (-(w / self.stribeck_speed).powi(2)).exp()
        };
        [-(self.coulomb[0] + extra), self.coulomb[1] + extra]
    }
}

/// One place where dry friction acts: a row of the contact problem.
///
/// The velocity there is `v = v_free + Σ compliance · impulses`.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Row {
    /// Velocity without friction at the end of the step.
    pub(crate) free: f64,
    /// Least and largest impulse over the step.
    pub(crate) bounds: [f64; 2],
    /// Change of each row's velocity per impulse of this row.
    pub(crate) compliance: [f64; 3],
}

/// Sweeps over the rows; their coupling is weak, each sweep gains about a decimal.
const SWEEPS: usize = 12;

/// The impulses, by projected Gauss–Seidel sweeps from those of the last step. Rows without
/// friction have the bounds `[0, 0]`.
pub(crate) fn solve(rows: &[Row; 3], impulses: &mut [f64; 3]) {
    for _ in 0..SWEEPS {
        let mut moved = false;
        for (i, row) in rows.iter().enumerate() {
            if row.bounds == [0.0; 2] {
                impulses[i] = 0.0;
                continue;
            }
            let velocity = row.free
                + row
                    .compliance
                    .iter()
                    .zip(impulses.iter())
                    .map(|(c, p)| c * p)
                    .sum::<f64>();
            let wanted = impulses[i] - velocity / row.compliance[i];
            let new = wanted.clamp(row.bounds[0], row.bounds[1]);
            moved |= new != impulses[i];
            impulses[i] = new;
        }
        if !moved {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mass_on_a_table_sticks_or_slides() {
        // 2 kg, friction 3 N, step 1 ms: a push of 2 N does not move it, 5 N accelerate it by 1 m/s².
        for (push, expected) in [(2.0, 0.0), (5.0, 1e-3), (-5.0, -1e-3)] {
            let mut rows = [Row::default(); 3];
            rows[0] = Row {
                free: push * 1e-3 / 2.0,
                bounds: [-3e-3, 3e-3],
                compliance: [0.5, 0.0, 0.0],
            };
            let mut impulses = [0.0; 3];
            solve(&rows, &mut impulses);
            let v = rows[0].free + 0.5 * impulses[0];
            assert!((v - expected).abs() < 1e-15, "{push} N: {v}");
        }
    }

    #[test]
    fn friction_always_takes_energy() {
        let friction = Friction {
            coulomb: [1.0, 2.0],
            breakaway: 0.5,
            stribeck_speed: 0.3,
            viscous: [0.1, 0.4],
            drying: 0.01,
            quadratic: 0.2,
        };
        for k in -20..=20 {
            let w = 0.2 * f64::from(k);
            assert!(friction.smooth(w, 0.0) * w <= 0.0);
            assert!(friction.smooth(w, 9.0) * w <= friction.smooth(w, 0.0) * w);
            let [least, most] = friction.bounds(w);
            assert!(least < 0.0 && most > 0.0);
        }
        assert!((friction.bounds(0.0)[1] - 2.5).abs() < 1e-15);
        assert!((friction.bounds(9.0)[0] + 1.0).abs() < 1e-15);
    }
}
