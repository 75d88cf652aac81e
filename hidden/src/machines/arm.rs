//! A joint that gravity pulls at, behind a gear motor.

use std::f64::consts::{FRAC_PI_2, TAU};

use super::{Counter, Rig, Row, Scale, Sheet, dry, midpoint, quantity};
use crate::Hidden;
use crate::contact::Stops;
use crate::driven::Motor;
use crate::friction::Friction;
use crate::motor::Winding;
use crate::physics::GRAVITY;
use crate::truth::{Concealed, Quantity};

pub(crate) const SHEET: Sheet = Sheet {
    name: "arm",
    rate: 100.0,
    inputs: 1,
    columns: &["time_s", "voltage_V", "speed_rad_per_s", "angle_rad"],
    command: [0.0, 12.0],
    shows: &[Hidden::CoulombFriction, Hidden::EndStop],
    build: |phase, time_constant| Box::new(Arm::new(phase, time_constant)),
};

/// Integration step, s, and steps from sample to sample.
const STEP: f64 = 1e-4;
const STEPS: usize = 100;
/// Counts of the joint's encoder per revolution.
const COUNTS: f64 = 8192.0;

/// A bar that hangs from a joint and is lifted by a gear motor. The encoder is at zero where it hangs.
///
/// ```text
/// (I_bar + I_rotor) ω' = τ_motor(V, ω) - weight · sin(φ) + friction + stops        weight = m g l
/// I_bar = m (l² + s²/12)
/// ```
#[derive(Clone, Debug)]
pub(super) struct Arm {
    /// Of bar and tool, kg m².
    pub(super) inertia: f64,
    /// Torque that holds it level, N m.
    pub(super) weight: f64,
    motor: Motor,
    bearing: Friction,
    stops: Option<Stops>,
    counter: Counter,
    current: f64,
    /// Speed, rad/s, and angle, rad.
    pub(super) state: [f64; 2],
    pub(super) voltage: f64,
}

impl Arm {
    pub(super) fn new(phase: [f64; 2], winding_time_constant: f64) -> Self {
        // A bar of 1.5 kg and 0.5 m.
        let (mass, length) = (1.5, 0.5);
        let resistance = 13.0;
        Self {
            inertia: mass * length * length / 3.0,
            weight: mass * GRAVITY * 0.5 * length,
            motor: Motor {
                torque_constant: 0.0265,
                back_emf_constant: 0.0265,
                resistance,
                inductance: winding_time_constant.max(1e-9) * resistance,
                gear_ratio: 0.01,
                rotor_friction: 1e-6,
                reflected_inertia: 0.0065,
            },
            bearing: Friction::default(),
            stops: None,
            counter: Counter::new(Scale::new(TAU / COUNTS, phase[0]), SHEET.rate),
            current: 0.0,
            state: [0.0; 2],
            voltage: 0.0,
        }
    }

    fn turning(&self) -> f64 {
        self.inertia + self.motor.reflected_inertia
    }

    fn step(&mut self, winding: &mut Winding) {
        let inertia = self.turning();
        let start = self.state;
        let mut current = winding.current;
        let mut end = midpoint(start, STEP, |[speed, angle]| {
            let (torque, next) = winding.torque(self.voltage, speed);
            current = next;
            let stopped = self.stops.map_or(0.0, |s| s.force(angle, speed));
            let weight = self.weight * angle.sin();
            [(torque - weight + stopped) / inertia, speed]
        });
        winding.advance(current);
        let stop = dry(&self.bearing, start[0], end[0], inertia, STEP);
        end[0] += stop / inertia;
        end[1] += 0.5 * STEP * stop / inertia;
        self.state = end;
    }

    /// Takes the motor's torque away.
    #[cfg(test)]
    pub(super) fn cut(&mut self) {
        self.motor.torque_constant = 0.0;
        self.motor.rotor_friction = 0.0;
    }

    /// Damping of motor and rotor at the joint, N m s/rad.
    fn damping(&self) -> f64 {
        let Motor {
            torque_constant,
            back_emf_constant,
            resistance,
            gear_ratio,
            rotor_friction,
            ..
        } = self.motor;
        (torque_constant * back_emf_constant / resistance + rotor_friction)
            / (gear_ratio * gear_ratio)
    }
}

impl Rig for Arm {
    fn sample(&mut self, command: f64) -> Row {
        self.voltage = command;
        let angle = self.state[1];
        let [counted, exact] = self.counter.speed(angle);
        let mut row = Row::told(command);
        row.measured[..2].copy_from_slice(&[counted, self.counter.encoder.read(angle)]);
        row.exact[..2].copy_from_slice(&[exact, angle]);
        row
    }

    fn advance(&mut self) {
        let mut winding = Winding::new(self.motor, None, STEP);
        winding.current = self.current;
        for _ in 0..STEPS {
            self.step(&mut winding);
        }
        self.current = winding.current;
    }

    fn hide(&mut self, of: Concealed) -> Option<Concealed> {
        match of.effect {
            Hidden::CoulombFriction => {
                let level = 0.8 * of.size;
                let torque = level * self.motor.torque_per_volt();
                self.bearing.coulomb = [torque; 2];
                Some(
                    of.told("dry friction of the joint", &["joint"])
                        .fitted("level", level, "V")
                        .physical("torque", torque, "N m"),
                )
            }
            Hidden::EndStop => {
                let at = [0.1 * of.size - 0.5, 0.6 - 0.1 * of.size];
                let volts_per_angle = 150.0;
                let stops = Stops {
                    at,
                    stiffness: volts_per_angle * self.motor.torque_per_volt(),
                    absorbed: 0.15,
                };
                self.stops = Some(stops);
                Some(
                    of.told("a bar that falls against rubber stops", &["joint"])
                        .fitted("lower", at[0], "rad")
                        .fitted("upper", at[1], "rad")
                        .fitted("stiffness", volts_per_angle, "V/rad")
                        .fitted("loss", stops.loss(), "s/rad")
                        .physical("torque_per_angle", stops.stiffness, "N m/rad"),
                )
            }
            _ => None,
        }
    }

    fn parts(&mut self) -> Vec<&mut f64> {
        vec![
            &mut self.inertia,
            &mut self.weight,
            &mut self.motor.rotor_friction,
        ]
    }

    fn lumped(&self) -> Vec<Quantity> {
        let inertia = self.turning();
        vec![
            quantity("K_A", -self.damping() / inertia, "1/s"),
            quantity("K_C", self.motor.torque_per_volt() / inertia, "rad/s^2/V"),
            quantity("K_G", self.weight / inertia, "rad/s^2"),
            quantity("level_angle", FRAC_PI_2, "rad"),
        ]
    }

    fn winding_time_constant(&self) -> Option<f64> {
        Some(self.motor.inductance / self.motor.resistance)
    }

    fn model_toml(&self) -> String {
        let lumped = self.lumped();
        let rounded = |i: usize| (lumped[i].value * 100.0).round() / 100.0;
        format!(
            "# An arm that hangs from a joint. Its recordings may hide an effect that this model lacks.\n\
             name = \"Arm with a secret\"\n\
             \n\
             # ω' = K_A ω + K_C V - K_G cos(φ - φ_0)\n\
             [plant.arm]\n\
             K_A = {:?}      # 1/s\n\
             K_C = {:?}       # rad/s²/V\n\
             K_G = {:?}      # rad/s²\n\
             level_angle = {FRAC_PI_2:?}   # rad; the encoder is at zero where the arm hangs\n\
             \n\
             # The speed is the difference of encoder counts over 10 ms.\n\
             [log.measured.speed.sensor.encoder_counts]\n\
             counts_per_revolution = {COUNTS}\n\
             of = {{ angle = 1.0 }}\n\
             \n\
             [log.measured.angle]\n\
             sensor = \"instantaneous\"\n",
            rounded(0),
            rounded(1),
            rounded(2),
        )
    }
}
