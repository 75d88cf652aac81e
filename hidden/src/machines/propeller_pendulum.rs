//! A pendulum that a fan lifts.

use std::f64::consts::TAU;

use super::{Rig, Row, Scale, Sheet, dry, midpoint, quantity};
use crate::Hidden;
use crate::friction::Friction;
use crate::physics::GRAVITY;
use crate::truth::{Concealed, Quantity};

pub(crate) const SHEET: Sheet = Sheet {
    name: "propeller_pendulum",
    rate: 100.0,
    inputs: 1,
    columns: &["time_s", "voltage_V", "angle_rad"],
    command: [0.0, 3.5],
    shows: &[
        Hidden::InputPower,
        Hidden::ActuatorLag,
        Hidden::CoulombFriction,
    ],
    build: |phase, _| Box::new(PropellerPendulum::new(phase)),
};

/// Integration step, s, and steps from sample to sample.
const STEP: f64 = 2e-4;
const STEPS: usize = 50;
/// Counts of the encoder per revolution.
const COUNTS: f64 = 4096.0;
/// Voltage at which the fan gives the thrust of its data sheet, V.
const RATED: f64 = 4.0;

/// A rod with a fan at its end. The fan turns as fast as its voltage asks for after a while, and its thrust
/// goes with a power of that.
///
/// ```text
/// impulse' = arm · thrust - weight sin φ - air ω + friction      ω = impulse/inertia
/// lag turning' = V - turning                                     thrust = blade · turning^n
/// ```
///
/// The inertia is that of a rod and of a fan at its end.
#[derive(Clone, Debug)]
pub(super) struct PropellerPendulum {
    /// kg
    rod: f64,
    /// kg
    fan: f64,
    /// Length of the rod, m.
    arm: f64,
    /// N/V
    blade: f64,
    /// N m s/rad
    air: f64,
    /// The thrust goes with this power of the fan's speed.
    exponent: f64,
    /// s
    lag: f64,
    pivot: Friction,
    encoder: Scale,
    voltage: f64,
    /// Speed of the fan, as the voltage that keeps it, V.
    turning: f64,
    /// Impulse, N m s, and angle, rad.
    pub(super) state: [f64; 2],
}

impl PropellerPendulum {
    pub(super) fn new(phase: [f64; 2]) -> Self {
        Self {
            rod: 0.1,
            fan: 0.05,
            arm: 0.4,
            blade: 0.08,
            air: 0.03,
            exponent: 1.0,
            lag: 0.0,
            pivot: Friction::default(),
            encoder: Scale::new(TAU / COUNTS, phase[0]),
            voltage: 0.0,
            turning: 0.0,
            state: [0.0; 2],
        }
    }

    fn inertia(&self) -> f64 {
        (self.rod / 3.0 + self.fan) * self.arm * self.arm
    }

    /// Torque that holds it level, N m.
    pub(super) fn weight(&self) -> f64 {
        (0.5 * self.rod + self.fan) * self.arm * GRAVITY
    }

    /// Torque of the fan, N m.
    pub(super) fn lift(&self) -> f64 {
        let share = self.turning.abs() / RATED;
        let curved = RATED * share.powf(self.exponent) * self.turning.signum();
        self.arm * self.blade * curved
    }

    fn step(&mut self) {
        if self.lag > 0.0 {
            // A constant voltage over the step: the exact answer of the lag, half before and half after.
            self.turning += (self.voltage - self.turning) * -(-0.5 * STEP / self.lag).exp_m1();
        } else {
            self.turning = self.voltage;
        }
        let (inertia, lift) = (self.inertia(), self.lift());
        let start = self.state;
        let mut end = midpoint(start, STEP, |[impulse, angle]| {
            let speed = impulse / inertia;
            [lift - self.weight() * angle.sin() - self.air * speed, speed]
        });
        if self.lag > 0.0 {
            self.turning += (self.voltage - self.turning) * -(-0.5 * STEP / self.lag).exp_m1();
        }
        let (before, free) = (start[0] / inertia, end[0] / inertia);
        let stop = dry(&self.pivot, before, free, inertia, STEP);
        end[0] += stop;
        end[1] += 0.5 * STEP * stop / inertia;
        self.state = end;
    }

    /// J
    #[cfg(test)]
    pub(super) fn energy(&self) -> f64 {
        0.5 * self.state[0] * self.state[0] / self.inertia() - self.weight() * self.state[1].cos()
    }
}

impl Rig for PropellerPendulum {
    fn sample(&mut self, command: f64) -> Row {
        self.voltage = command;
        let mut row = Row::told(command);
        row.exact[0] = self.state[1];
        row.measured[0] = self.encoder.read(self.state[1]);
        row
    }

    fn advance(&mut self) {
        for _ in 0..STEPS {
            self.step();
        }
    }

    fn hide(&mut self, of: Concealed) -> Option<Concealed> {
        match of.effect {
            Hidden::InputPower => {
                self.exponent = 1.0 + 0.5 * of.size;
                Some(
                    of.told(
                        "a fan whose thrust goes with a power of its voltage",
                        &["fan"],
                    )
                    .fitted("exponent", self.exponent, "1")
                    .physical("rated_voltage", RATED, "V"),
                )
            }
            Hidden::ActuatorLag => {
                self.lag = 0.1 * of.size;
                Some(
                    of.told("a fan that takes its time", &["fan"])
                        .fitted("lag", self.lag, "s"),
                )
            }
            Hidden::CoulombFriction => {
                let torque = 0.01 * of.size;
                self.pivot.coulomb = [torque; 2];
                let level = torque / (self.arm * self.blade);
                Some(
                    of.told("dry friction of the pivot", &["joint"])
                        .fitted("level", level, "V")
                        .physical("torque", torque, "N m"),
                )
            }
            _ => None,
        }
    }

    fn parts(&mut self) -> Vec<&mut f64> {
        // Only ratios show: of inertia, weight, thrust and air the last three over the first.
        vec![&mut self.rod, &mut self.blade, &mut self.air]
    }

    fn lumped(&self) -> Vec<Quantity> {
        let inertia = self.inertia();
        vec![
            quantity("drive", self.arm * self.blade / inertia, "rad/s^2/V"),
            quantity("damping", self.air / inertia, "1/s"),
            quantity("gravity_stiffness", self.weight() / inertia, "rad/s^2"),
        ]
    }

    fn model_toml(&self) -> String {
        let lumped = self.lumped();
        let rounded = |i: usize| crate::truth::significant(lumped[i].value, 3);
        format!(
            "# A pendulum that a fan lifts. Its recordings may hide an effect that this model lacks.\n\
             name = \"Propeller pendulum with a secret\"\n\
             \n\
             # ω' = K V - D ω - A sin φ\n\
             [plant.propeller_pendulum]\n\
             drive = {:?}               # rad/s²/V\n\
             damping = {:?}            # 1/s\n\
             gravity_stiffness = {:?}   # rad/s²\n\
             \n\
             [log.measured.angle]\n\
             sensor = \"instantaneous\"\n",
            rounded(0),
            rounded(1),
            rounded(2),
        )
    }
}
