//! A rod that swings at the end of an arm.

use std::f64::consts::TAU;

use super::{Counter, Rig, Row, Scale, Sheet, dry, midpoint, quantity};
use crate::Hidden;
use crate::delay::Delay;
use crate::friction::Friction;
use crate::physics::GRAVITY;
use crate::truth::{Concealed, Quantity};

pub(crate) const SHEET: Sheet = Sheet {
    name: "rotary_pendulum",
    rate: 100.0,
    inputs: 1,
    columns: &[
        "time_s",
        "torque_N_m",
        "arm_speed_rad_per_s",
        "pendulum_angle_rad",
    ],
    command: [0.0, 0.04],
    shows: &[Hidden::CoulombFriction, Hidden::InputDelay],
    build: |phase, _| Box::new(RotaryPendulum::new(phase)),
};

/// Integration step, s, and steps from sample to sample.
const STEP: f64 = 2e-4;
const STEPS: usize = 50;
/// Counts of both encoders per revolution.
const COUNTS: f64 = 8192.0;

/// A bar on a motor's shaft, with a rod on a pivot at its end.
///
/// With the angular momenta `p` that belong to the angles, Hamilton's equations:
///
/// ```text
/// p = M(θ) [α' θ']ᵀ      p_α' = torque - oil α' + friction      p_θ' = ∂T/∂θ - m g l sin θ - air θ'
/// M = [J_bar + m L² + J_rod sin²θ, m L l cos θ; m L l cos θ, J_rod]      J_rod = m (2 l)²/3
/// ```
///
/// Reference: L. D. Landau, E. M. Lifshitz (1976), "Mechanics", 3rd edition, section 40.
#[derive(Clone, Debug)]
pub(super) struct RotaryPendulum {
    /// Of bar and rotor about the axis, kg m².
    bar: f64,
    /// From the axis to the pivot, m.
    length: f64,
    /// Of the rod, kg.
    mass: f64,
    /// Half of the rod, m.
    half: f64,
    /// N m s/rad
    pub(super) oil: f64,
    /// N m s/rad
    pub(super) air: f64,
    brushes: Friction,
    counters: [Counter; 2],
    late: Delay<f64>,
    pub(super) torque: f64,
    /// Momenta about axis and pivot, N m s, angles of arm and rod, rad.
    pub(super) state: [f64; 4],
}

impl RotaryPendulum {
    pub(super) fn new(phase: [f64; 2]) -> Self {
        Self {
            bar: 2e-3,
            length: 0.2,
            mass: 0.06,
            half: 0.15,
            oil: 4e-3,
            air: 1e-4,
            brushes: Friction::default(),
            counters: phase.map(|p| Counter::new(Scale::new(TAU / COUNTS, p), SHEET.rate)),
            late: Delay::new(0, 0.0),
            torque: 0.0,
            state: [0.0; 4],
        }
    }

    /// Of the rod about its pivot, kg m².
    fn rod(&self) -> f64 {
        self.mass * (2.0 * self.half).powi(2) / 3.0
    }

    /// `[m_αα, m_αθ, m_θθ]` of the mass matrix.
    fn masses(&self, angle: f64) -> [f64; 3] {
        let (sin, cos) = angle.sin_cos();
        let arm = self.bar + self.mass * self.length * self.length + self.rod() * sin * sin;
        [arm, self.mass * self.length * self.half * cos, self.rod()]
    }

    fn speeds(&self, [axis, pivot, _, angle]: [f64; 4]) -> [f64; 2] {
        let [arm, across, rod] = self.masses(angle);
        let determinant = arm * rod - across * across;
        [
            (rod * axis - across * pivot) / determinant,
            (arm * pivot - across * axis) / determinant,
        ]
    }

    pub(super) fn step(&mut self) {
        let torque = self.late.push(self.torque);
        let start = self.state;
        let mut end = midpoint(start, STEP, |state| {
            let [turning, swinging] = self.speeds(state);
            let (sin, cos) = state[3].sin_cos();
            let across = self.mass * self.length * self.half;
            // How the kinetic energy changes with the angle, at these speeds.
            let bends = (self.rod() * cos * turning - across * swinging) * sin * turning;
            let falls = self.mass * GRAVITY * self.half * sin;
            [
                torque - self.oil * turning,
                bends - falls - self.air * swinging,
                turning,
                swinging,
            ]
        });
        // What an impulse at the axis moves: one over the corner of the inverse mass matrix.
        let [arm, across, rod] = self.masses(end[3]);
        let moved = arm - across * across / rod;
        let (before, free) = (self.speeds(start)[0], self.speeds(end)[0]);
        let stop = dry(&self.brushes, before, free, moved, STEP);
        end[0] += stop;
        end[2] += 0.5 * STEP * stop / moved;
        self.state = end;
    }

    /// J
    #[cfg(test)]
    pub(super) fn energy(&self) -> f64 {
        let [turning, swinging] = self.speeds(self.state);
        let moving = self.state[0] * turning + self.state[1] * swinging;
        0.5 * moving - self.mass * GRAVITY * self.half * self.state[3].cos()
    }
}

impl Rig for RotaryPendulum {
    fn sample(&mut self, command: f64) -> Row {
        self.torque = command;
        let mut row = Row::told(command);
        [row.measured[0], row.exact[0]] = self.counters[0].speed(self.state[2]);
        row.exact[1] = self.state[3];
        row.measured[1] = self.counters[1].encoder.read(self.state[3]);
        row
    }

    fn advance(&mut self) {
        for _ in 0..STEPS {
            self.step();
        }
    }

    fn hide(&mut self, of: Concealed) -> Option<Concealed> {
        match of.effect {
            Hidden::CoulombFriction => {
                let level = 5e-3 * of.size;
                self.brushes.coulomb = [level; 2];
                Some(
                    of.told("dry friction of the motor's brushes", &["arm"])
                        .fitted("level", level, "N m"),
                )
            }
            Hidden::InputDelay => {
                let steps = (0.02 * of.size / STEP).round() as usize;
                self.late = Delay::new(steps, 0.0);
                let delay = steps as f64 * STEP;
                Some(
                    of.told("a torque that comes late", &["input"])
                        .fitted("delay", delay, "s"),
                )
            }
            _ => None,
        }
    }

    fn parts(&mut self) -> Vec<&mut f64> {
        // The length of the arm is measured, and with the mass the half of the rod is all about it.
        vec![
            &mut self.bar,
            &mut self.mass,
            &mut self.half,
            &mut self.oil,
            &mut self.air,
        ]
    }

    fn lumped(&self) -> Vec<Quantity> {
        let moment = self.mass * self.half;
        let arm = self.bar + self.mass * self.length * self.length;
        vec![
            quantity("arm_inertia", arm, "kg m^2"),
            quantity("pendulum_inertia", self.rod(), "kg m^2"),
            quantity("coupling", moment * self.length, "kg m^2"),
            quantity("pendulum_moment", moment, "kg m"),
            quantity("arm_friction", self.oil, "N m s/rad"),
            quantity("pivot_friction", self.air, "N m s/rad"),
        ]
    }

    fn model_toml(&self) -> String {
        let lumped = self.lumped();
        let rounded = |i: usize| crate::truth::significant(lumped[i].value, 3);
        format!(
            "# A rod at the end of an arm. Their recordings may hide an effect that this model lacks.\n\
             name = \"Rotary pendulum with a secret\"\n\
             \n\
             # Furuta's pendulum; the rod's angle is counted from where it hangs.\n\
             [plant.rotary_pendulum]\n\
             arm_inertia = {:?}       # kg m²\n\
             pendulum_inertia = {:?}  # kg m²\n\
             coupling = {:?}          # kg m²\n\
             pendulum_moment = {:?}    # kg m\n\
             arm_friction = {:?}       # N m s/rad\n\
             pivot_friction = {:?}    # N m s/rad\n\
             gravity = {GRAVITY:?}           # m/s²\n\
             \n\
             # The arm's speed is the difference of encoder counts over 10 ms.\n\
             [log.measured.arm_speed.sensor.encoder_counts]\n\
             counts_per_revolution = {COUNTS}\n\
             of = {{ arm_angle = 1.0 }}\n\
             \n\
             [log.measured.pendulum_angle]\n\
             sensor = \"instantaneous\"\n",
            rounded(0),
            rounded(1),
            rounded(2),
            rounded(3),
            rounded(4),
            rounded(5),
        )
    }
}
