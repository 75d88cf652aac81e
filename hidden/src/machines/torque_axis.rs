//! A joint on a motor whose current is controlled.

use std::f64::consts::TAU;

use super::{Counter, Rig, Row, Scale, Sheet, dry, midpoint, quantity};
use crate::Hidden;
use crate::contact::Twisting;
use crate::delay::Delay;
use crate::friction::Friction;
use crate::truth::{Concealed, Quantity};

pub(crate) const SHEET: Sheet = Sheet {
    name: "torque_axis",
    rate: 100.0,
    inputs: 1,
    columns: &["time_s", "current_A", "speed_rad_per_s"],
    command: [0.0, 4.0],
    shows: &[
        Hidden::CoulombFriction,
        Hidden::InputDelay,
        Hidden::ElasticCoupling,
    ],
    build: |phase, _| Box::new(TorqueAxis::new(phase)),
};

/// Integration step, s, and steps from sample to sample.
const STEP: f64 = 2e-4;
const STEPS: usize = 50;
/// Counts of the motor's encoder per revolution.
const COUNTS: f64 = 400.0;
/// Turns of the motor per turn of the joint.
const GEAR: f64 = 10.0;

/// A motor behind a harmonic drive; the amplifier makes the current that it is told.
///
/// ```text
/// (rotor N² + load) ω' = N K_T i - oil ω + friction        N: turns of the motor per turn
/// ```
///
/// With a flexible spline `δ` is what it twists:
///
/// ```text
/// rotor N² ω' = N K_T i - oil ω + friction - T(δ, δ')      load ω'_l = T(δ, δ')      δ' = ω - ω_l
/// ```
#[derive(Clone, Debug)]
pub(super) struct TorqueAxis {
    /// At the joint, kg m².
    load: f64,
    /// kg m²
    rotor: f64,
    /// N m s/rad
    pub(super) oil: f64,
    /// N m/A
    torque_constant: f64,
    seal: Friction,
    spline: Option<Twisting>,
    counter: Counter,
    late: Delay<f64>,
    current: f64,
    /// Impulse, N m s, and angle, rad, of the joint on the motor's side; the same of a load behind a flexible spline.
    pub(super) state: [f64; 4],
}

impl TorqueAxis {
    pub(super) fn new(phase: [f64; 2]) -> Self {
        Self {
            load: 0.03,
            rotor: 2e-4,
            oil: 0.1,
            torque_constant: 0.05,
            seal: Friction::default(),
            spline: None,
            counter: Counter::new(Scale::new(TAU / GEAR / COUNTS, phase[0]), SHEET.rate),
            late: Delay::new(0, 0.0),
            current: 0.0,
            state: [0.0; 4],
        }
    }

    pub(super) fn inertia(&self) -> f64 {
        self.load + self.rotor * GEAR * GEAR
    }

    /// What turns with the motor, kg m².
    fn near(&self) -> f64 {
        let behind = self.spline.map_or(0.0, |spline| spline.inertia);
        self.inertia() - behind
    }

    /// Torque at the joint per ampere.
    pub(super) fn gain(&self) -> f64 {
        GEAR * self.torque_constant
    }

    fn step(&mut self) {
        let torque = self.gain() * self.late.push(self.current);
        let inertia = self.near();
        let start = self.state;
        let mut end = midpoint(start, STEP, |[impulse, angle, far, far_angle]| {
            let speed = impulse / inertia;
            let (through, far_speed) = self.spline.map_or((0.0, 0.0), |spline| {
                let far_speed = far / spline.inertia;
                let twist = angle - far_angle;
                (spline.torque(twist, speed - far_speed), far_speed)
            });
            let drive = torque - self.oil * speed;
            [drive - through, speed, through, far_speed]
        });
        let stop = dry(
            &self.seal,
            start[0] / inertia,
            end[0] / inertia,
            inertia,
            STEP,
        );
        end[0] += stop;
        end[1] += 0.5 * STEP * stop / inertia;
        self.state = end;
    }
}

impl Rig for TorqueAxis {
    fn sample(&mut self, command: f64) -> Row {
        self.current = command;
        let mut row = Row::told(command);
        [row.measured[0], row.exact[0]] = self.counter.speed(self.state[1]);
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
                let level = 0.25 * of.size;
                self.seal.coulomb = [level; 2];
                Some(
                    of.told("dry friction of the gear", &["joint"])
                        .fitted("level", level, "N m"),
                )
            }
            Hidden::InputDelay => {
                let steps = (0.02 * of.size / STEP).round() as usize;
                self.late = Delay::new(steps, 0.0);
                let delay = steps as f64 * STEP;
                Some(
                    of.told("a current that comes late", &["input"])
                        .fitted("delay", delay, "s"),
                )
            }
            Hidden::ElasticCoupling => {
                let (frequency, ratio) = (40.0 / of.size.sqrt(), 0.05);
                let spline = Twisting::swinging(self.load, frequency, ratio);
                self.spline = Some(spline);
                let doc = "a flexible spline between motor and load";
                let loads = self.load / self.near();
                let faster = f64::sqrt(1.0 + loads);
                Some(
                    of.told(doc, &["inertia"])
                        .fitted("ratio", loads, "1")
                        .fitted("resonance", faster * frequency, "rad/s")
                        .fitted("damping", faster * ratio, "1")
                        .physical("stiffness", spline.stiffness, "N m/rad"),
                )
            }
            _ => None,
        }
    }

    fn parts(&mut self) -> Vec<&mut f64> {
        vec![&mut self.load, &mut self.oil]
    }

    fn lumped(&self) -> Vec<Quantity> {
        let inertia = self.inertia();
        vec![
            quantity("drive", 1.0 / inertia, "rad/s^2/(N m)"),
            quantity("damping", self.oil / inertia, "1/s"),
        ]
    }

    fn model_toml(&self) -> String {
        format!(
            "# A joint on a motor whose current is controlled. Its recordings may hide an effect that this model lacks.\n\
             name = \"Torque axis with a secret\"\n\
             \n\
             # J ω' = u - f ω\n\
             [plant.torque_axis.physical]\n\
             inertia = {:?}          # kg m²\n\
             viscous_friction = {:?}  # N m s/rad\n\
             \n\
             # The log has the current. Torque at the joint: 0.05 N m/A behind a gear of 10.\n\
             [log.inputs.torque]\n\
             column = \"current_A\"\n\
             scale = {:?}\n\
             scale_unit = \"N m/A\"\n\
             \n\
             # The speed is the difference of counts of the motor's encoder over 10 ms.\n\
             [log.measured.speed.sensor.encoder_counts]\n\
             counts_per_revolution = {:?}\n\
             of = {{ angle = 1.0 }}\n",
            self.inertia(),
            self.oil,
            self.gain(),
            COUNTS * GEAR,
        )
    }
}
