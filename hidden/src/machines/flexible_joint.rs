//! A motor and a load, with a long shaft between them.

use std::f64::consts::TAU;

use super::{Counter, Rig, Row, Scale, Sheet, dry, midpoint, quantity};
use crate::Hidden;
use crate::delay::Delay;
use crate::friction::Friction;
use crate::truth::{Concealed, Quantity};

pub(crate) const SHEET: Sheet = Sheet {
    name: "flexible_joint",
    rate: 100.0,
    inputs: 1,
    columns: &[
        "time_s",
        "torque_N_m",
        "motor_speed_rad_per_s",
        "load_speed_rad_per_s",
    ],
    command: [0.0, 1.0],
    shows: &[
        Hidden::CoulombFriction,
        Hidden::DirectionalFriction,
        Hidden::CubicStiffness,
        Hidden::InputDelay,
    ],
    build: |phase, _| Box::new(FlexibleJoint::new(phase)),
};

/// Integration step, s, and steps from sample to sample.
const STEP: f64 = 2e-4;
const STEPS: usize = 50;
/// Counts of both encoders per revolution.
const COUNTS: f64 = 8192.0;

/// Two flywheels on one shaft that twists; a current loop makes the torque on the first one.
///
/// ```text
/// impulse_1' = torque - spring - bearing_1 ω_1 + friction_1        ω_i = impulse_i/inertia_i
/// impulse_2' = spring - bearing_2 ω_2 + friction_2
/// spring = stiffness δ + cubic δ³ + damping (ω_1 - ω_2)            δ = φ_1 - φ_2
/// ```
///
/// Side 1 is the motor's, side 2 the load's.
#[derive(Clone, Debug)]
pub(super) struct FlexibleJoint {
    /// Of each side, kg m².
    inertia: [f64; 2],
    /// Of each side, N m s/rad.
    bearing: [f64; 2],
    /// N m/rad
    stiffness: f64,
    /// N m/rad³
    cubic: f64,
    /// N m s/rad
    damping: f64,
    seals: [Friction; 2],
    counters: [Counter; 2],
    late: Delay<f64>,
    torque: f64,
    /// Impulses, N m s, and angles, rad.
    pub(super) state: [f64; 4],
}

impl FlexibleJoint {
    pub(super) fn new(phase: [f64; 2]) -> Self {
        Self {
            inertia: [0.01, 0.02],
            bearing: [0.02, 0.01],
            stiffness: 8.0,
            cubic: 0.0,
            damping: 0.02,
            seals: [Friction::default(); 2],
            counters: phase.map(|p| Counter::new(Scale::new(TAU / COUNTS, p), SHEET.rate)),
            late: Delay::new(0, 0.0),
            torque: 0.0,
            state: [0.0; 4],
        }
    }

    /// What the shaft carries, N m.
    fn spring(&self, twist: f64, twisting: f64) -> f64 {
        (self.stiffness + self.cubic * twist * twist) * twist + self.damping * twisting
    }

    fn step(&mut self) {
        let torque = self.late.push(self.torque);
        let speeds = |s: [f64; 4]| [0, 1].map(|i| s[i] / self.inertia[i]);
        let start = self.state;
        let mut end = midpoint(start, STEP, |state| {
            let [first, second] = speeds(state);
            let spring = self.spring(state[2] - state[3], first - second);
            [
                torque - spring - self.bearing[0] * first,
                spring - self.bearing[1] * second,
                first,
                second,
            ]
        });
        let (before, free) = (speeds(start), speeds(end));
        for i in 0..2 {
            let inertia = self.inertia[i];
            let stop = dry(&self.seals[i], before[i], free[i], inertia, STEP);
            end[i] += stop;
            end[2 + i] += 0.5 * STEP * stop / inertia;
        }
        self.state = end;
    }

    /// J
    #[cfg(test)]
    pub(super) fn energy(&self) -> f64 {
        let moving = |i: usize| 0.5 * self.state[i].powi(2) / self.inertia[i];
        let twist = self.state[2] - self.state[3];
        let square = twist * twist;
        moving(0) + moving(1) + (0.5 * self.stiffness + 0.25 * self.cubic * square) * square
    }
}

impl Rig for FlexibleJoint {
    fn sample(&mut self, command: f64) -> Row {
        self.torque = command;
        let mut row = Row::told(command);
        for i in 0..2 {
            [row.measured[i], row.exact[i]] = self.counters[i].speed(self.state[2 + i]);
        }
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
                let level = 0.12 * of.size;
                self.seals[0].coulomb = [level; 2];
                Some(
                    of.told("dry friction of the motor's seal", &["motor"])
                        .fitted("level", level, "N m"),
                )
            }
            Hidden::DirectionalFriction => {
                let torques = [0.06, 0.14].map(|level| level * of.size);
                self.seals[1].coulomb = torques;
                let [forward, backward] = torques.map(|torque| torque / self.inertia[1]);
                Some(
                    of.told("dry friction of the load, higher backwards", &["load"])
                        .fitted("level_forward", forward, "rad/s^2")
                        .fitted("level_backward", backward, "rad/s^2")
                        .physical("torque_forward", torques[0], "N m")
                        .physical("torque_backward", torques[1], "N m"),
                )
            }
            Hidden::CubicStiffness => {
                self.cubic = 120.0 * of.size;
                Some(
                    of.told("a shaft that grows stiffer as it twists", &["spring"])
                        .fitted("stiffness", self.cubic / self.stiffness, "rad/rad^3")
                        .fitted("rest", 0.0, "rad"),
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
        let ([first, second], [near, far]) = (&mut self.inertia, &mut self.bearing);
        let spring = [&mut self.stiffness, &mut self.damping];
        spring
            .into_iter()
            .chain([first, second, near, far])
            .collect()
    }

    fn lumped(&self) -> Vec<Quantity> {
        let [first, second] = self.inertia;
        vec![
            quantity("drive", 1.0 / first, "rad/s^2/(N m)"),
            quantity("motor_damping", self.bearing[0] / first, "1/s"),
            quantity("motor_stiffness", self.stiffness / first, "1/s^2"),
            quantity("load_stiffness", self.stiffness / second, "1/s^2"),
            quantity("load_damping", self.bearing[1] / second, "1/s"),
            quantity("spring_time", self.damping / self.stiffness, "s"),
        ]
    }

    fn model_toml(&self) -> String {
        let sensors: String = ["motor", "load"]
            .map(|side| {
                format!(
                    "\n[log.measured.{side}_speed.sensor.encoder_counts]\n\
                     counts_per_revolution = {COUNTS}\n\
                     of = {{ {side}_angle = 1.0 }}\n"
                )
            })
            .concat();
        format!(
            "# Motor, shaft and load. Their recordings may hide an effect that this model lacks.\n\
             name = \"Flexible joint with a secret\"\n\
             \n\
             # J_m ω'_m = u - f_m ω_m - k δ - c δ'      J_l ω'_l = k δ + c δ' - f_l ω_l\n\
             [plant.flexible_joint.physical]\n\
             motor_inertia = {:?}    # kg m²\n\
             load_inertia = {:?}     # kg m²\n\
             stiffness = {:?}         # N m/rad\n\
             spring_damping = {:?}   # N m s/rad\n\
             motor_friction = {:?}   # N m s/rad\n\
             load_friction = {:?}    # N m s/rad\n\
             \n\
             # Speeds are differences of encoder counts over 10 ms.\
             {sensors}",
            self.inertia[0],
            self.inertia[1],
            self.stiffness,
            self.damping,
            self.bearing[0],
            self.bearing[1],
        )
    }
}
