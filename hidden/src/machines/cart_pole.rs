//! A pole balanced on a cart.

use std::f64::consts::TAU;

use super::{Rig, Row, Scale, Sheet, dry, midpoint, quantity};
use crate::Hidden;
use crate::friction::Friction;
use crate::physics::GRAVITY;
use crate::truth::{Concealed, Quantity};

pub(crate) const SHEET: Sheet = Sheet {
    name: "cart_pole",
    rate: 100.0,
    inputs: 1,
    columns: &[
        "time_s",
        "force_N",
        "position_m",
        "velocity_m_per_s",
        "angle_rad",
        "rate_rad_per_s",
    ],
    command: [0.0, 3.0],
    shows: &[Hidden::CoulombFriction],
    build: |phase, _| Box::new(CartPole::new(phase)),
};

/// Integration step, s, and steps from sample to sample.
const STEP: f64 = 1e-4;
const STEPS: usize = 100;
/// Counts of the pole's encoder per revolution.
const POLE_COUNTS: f64 = 8192.0;
/// Way of the cart for one count of its encoder, m.
const CART_COUNT: f64 = 5e-5;
/// Feedback of position, velocity, angle and rate, N/m, N s/m, N, N s.
const FEEDBACK: [f64; 4] = [14.27, 12.98, 63.97, 12.58];

/// A rod on a cart, balanced by state feedback of counted angles and their differences. The
/// command is a force that shakes the cart; what the motor of the rail is told is the sum of both.
///
/// Positions and momenta, after Hamilton: with `D = [M, b cos θ; b cos θ, J]`
///
/// ```text
/// [P; L] = D [v; q]        P' = F + friction        L' = b sin θ (g - v q)
/// ```
///
/// Reference: H. Goldstein, C. Poole, J. Safko (2002), "Classical Mechanics", 3rd edition, section 8.1.
#[derive(Clone, Debug)]
pub(super) struct CartPole {
    /// kg
    cart: f64,
    /// kg
    rod: f64,
    /// m
    length: f64,
    rail: Friction,
    encoders: [Scale; 2],
    /// Position, m, angle, rad, and their momenta `P`, kg m/s, `L`, kg m²/s.
    pub(super) state: [f64; 4],
    before: Option<[[f64; 2]; 2]>,
    pub(super) force: f64,
}

/// `M`, `b` and `J`.
#[derive(Clone, Copy, Debug)]
struct Masses {
    total: f64,
    moment: f64,
    inertia: f64,
}

impl Masses {
    /// Velocity of the cart and rate of the pole.
    fn velocities(&self, [_, angle, cart, pole]: [f64; 4]) -> [f64; 2] {
        let coupling = self.moment * angle.cos();
        let determinant = self.total * self.inertia - coupling * coupling;
        [
            (self.inertia * cart - coupling * pole) / determinant,
            (self.total * pole - coupling * cart) / determinant,
        ]
    }
}

impl CartPole {
    pub(super) fn new(phase: [f64; 2]) -> Self {
        let resolutions = [CART_COUNT, TAU / POLE_COUNTS];
        Self {
            cart: 1.0,
            rod: 0.2,
            length: 0.6,
            rail: Friction::default(),
            encoders: [0, 1].map(|i| Scale::new(resolutions[i], phase[i])),
            state: [0.0, 0.02, 0.0, 0.0],
            before: None,
            force: 0.0,
        }
    }

    fn masses(&self) -> Masses {
        Masses {
            total: self.cart + self.rod,
            moment: 0.5 * self.rod * self.length,
            inertia: self.rod * self.length * self.length / 3.0,
        }
    }

    pub(super) fn step(&mut self) {
        let masses = self.masses();
        let start = self.state;
        let mut end = midpoint(start, STEP, |state| {
            let [v, q] = masses.velocities(state);
            let lever = masses.moment * state[1].sin();
            [v, q, self.force, lever * (GRAVITY - v * q)]
        });
        if self.rail.is_dry() {
            let [before, _] = masses.velocities(start);
            let free = masses.velocities(end);
            // What an impulse on the cart moves, while the pole's momentum stays.
            let coupling = masses.moment * end[1].cos();
            let mass = masses.total - coupling * coupling / masses.inertia;
            end[2] += dry(&self.rail, before, free[0], mass, STEP);
            let held = masses.velocities(end);
            end[0] += 0.5 * STEP * (held[0] - free[0]);
            end[1] += 0.5 * STEP * (held[1] - free[1]);
        }
        self.state = end;
    }

    /// J
    #[cfg(test)]
    pub(super) fn energy(&self) -> f64 {
        let masses = self.masses();
        let [v, q] = masses.velocities(self.state);
        let [_, angle, cart, pole] = self.state;
        0.5 * (cart * v + pole * q) + masses.moment * GRAVITY * angle.cos()
    }
}

impl Rig for CartPole {
    fn sample(&mut self, command: f64) -> Row {
        let exact = [self.state[0], self.state[1]];
        let counted = [0, 1].map(|i| self.encoders[i].read(exact[i]));
        let now = [counted, exact];
        let before = self.before.unwrap_or(now);
        self.before = Some(now);
        let [measured, exact] = [0, 1].map(|i| {
            let [v, q] = [0, 1].map(|j| (now[i][j] - before[i][j]) * SHEET.rate);
            [now[i][0], v, now[i][1], q]
        });
        let pairs = FEEDBACK.iter().zip(measured);
        self.force = command + pairs.map(|(gain, y)| gain * y).sum::<f64>();
        Row {
            inputs: [self.force, 0.0],
            measured,
            exact,
        }
    }

    fn advance(&mut self) {
        for _ in 0..STEPS {
            self.step();
        }
    }

    fn hide(&mut self, of: Concealed) -> Option<Concealed> {
        match of.effect {
            Hidden::CoulombFriction => {
                let level = 0.4 * of.size;
                self.rail.coulomb = [level; 2];
                Some(
                    of.told("dry friction of the cart on its rail", &["cart"])
                        .fitted("level", level, "N"),
                )
            }
            _ => None,
        }
    }

    fn parts(&mut self) -> Vec<&mut f64> {
        vec![&mut self.cart, &mut self.rod, &mut self.length]
    }

    fn lumped(&self) -> Vec<Quantity> {
        let masses = self.masses();
        vec![
            quantity("total_mass", masses.total, "kg"),
            quantity("pole_moment", masses.moment, "kg m"),
            quantity("pole_inertia", masses.inertia, "kg m^2"),
            quantity("gravity", GRAVITY, "m/s^2"),
        ]
    }

    fn model_toml(&self) -> String {
        let [mass, moment, inertia] = {
            let lumped = self.lumped();
            [0, 1, 2].map(|i| crate::truth::significant(lumped[i].value, 3))
        };
        format!(
            "# A pole on a cart. Its recordings may hide an effect that this model lacks.\n\
             name = \"Cart and pole with a secret\"\n\
             \n\
             [plant.cart_pole]\n\
             total_mass = {mass:?}     # kg, cart and pole\n\
             pole_moment = {moment:?}   # kg m, mass of the pole times the way to its centre\n\
             pole_inertia = {inertia:?} # kg m², about the pivot\n\
             \n\
             # Way and angle are counted; the speeds are their differences over 10 ms.\n\
             [log.measured.position]\n\
             sensor = \"instantaneous\"\n\
             \n\
             [log.measured.velocity.sensor.encoder_counts]\n\
             counts_per_revolution = {:?} # 0.05 mm a count\n\
             \n\
             [log.measured.angle]\n\
             sensor = \"instantaneous\"\n\
             \n\
             [log.measured.rate.sensor.encoder_counts]\n\
             counts_per_revolution = {POLE_COUNTS:?}\n",
            (TAU / CART_COUNT).round(),
        )
    }
}
