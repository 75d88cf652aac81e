//! A mass on a spring, moved by a voice coil.

use super::{Rig, Row, Scale, Sheet, dry, midpoint, quantity};
use crate::Hidden;
use crate::friction::Friction;
use crate::hysteresis::Hysteresis;
use crate::truth::{Concealed, Quantity};

pub(crate) const SHEET: Sheet = Sheet {
    name: "oscillator",
    rate: 100.0,
    inputs: 1,
    columns: &["time_s", "force_N", "position_m"],
    command: [0.0, 4.0],
    shows: &[
        Hidden::CubicStiffness,
        Hidden::CoulombFriction,
        Hidden::Hysteresis,
    ],
    build: |phase, _| Box::new(Oscillator::new(phase)),
};

/// Integration step, s, and steps from sample to sample.
const STEP: f64 = 1e-4;
const STEPS: usize = 100;
/// 10 bit over 0.4 m.
const RESOLUTION: f64 = 0.4 / 1024.0;

/// A carriage between springs, with a voice coil whose current, and with it the force, is
/// controlled; a distance sensor behind a converter.
///
/// ```text
/// impulse = mass · velocity        impulse' = F - tension(x) - damping · velocity + friction
/// tension(x) = stiffness x + cubic x³ + what a rubber joint pulls with
/// ```
#[derive(Clone, Debug)]
pub(super) struct Oscillator {
    /// kg
    mass: f64,
    /// N/m
    stiffness: f64,
    /// N s/m
    damping: f64,
    /// N/m³
    cubic: f64,
    guide: Friction,
    joint: Hysteresis,
    sensor: Scale,
    /// Position, m, and impulse, kg m/s.
    pub(super) state: [f64; 2],
    force: f64,
}

impl Oscillator {
    pub(super) fn new(phase: [f64; 2]) -> Self {
        Self {
            mass: 2.0,
            stiffness: 200.0,
            damping: 2.4,
            cubic: 0.0,
            guide: Friction::default(),
            joint: Hysteresis::default(),
            sensor: Scale::new(RESOLUTION, phase[0]),
            state: [0.0; 2],
            force: 0.0,
        }
    }

    fn step(&mut self) {
        let (mass, force) = (self.mass, self.force);
        let start = self.state;
        let mut end = midpoint(start, STEP, |[x, impulse]| {
            let velocity = impulse / mass;
            let joint = self.joint.moved(x - start[0]);
            let tension = (self.stiffness + self.cubic * x * x) * x + joint.force;
            [velocity, force - tension - self.damping * velocity]
        });
        let stop = dry(&self.guide, start[1] / mass, end[1] / mass, mass, STEP);
        end[1] += stop;
        end[0] += 0.5 * STEP * stop / mass;
        self.joint = self.joint.moved(end[0] - start[0]);
        self.state = end;
    }

    /// J
    #[cfg(test)]
    pub(super) fn energy(&self) -> f64 {
        let [x, impulse] = self.state;
        let spring = (0.5 * self.stiffness + 0.25 * self.cubic * x * x) * x * x;
        0.5 * impulse * impulse / self.mass + spring
    }
}

impl Rig for Oscillator {
    fn sample(&mut self, command: f64) -> Row {
        self.force = command;
        let mut row = Row::told(command);
        row.exact[0] = self.state[0];
        row.measured[0] = self.sensor.read(self.state[0]);
        row
    }

    fn advance(&mut self) {
        for _ in 0..STEPS {
            self.step();
        }
    }

    fn hide(&mut self, of: Concealed) -> Option<Concealed> {
        match of.effect {
            Hidden::CubicStiffness => {
                self.cubic = 3000.0 * of.size;
                Some(
                    of.told("springs that harden", &["mass"])
                        .fitted("stiffness", self.cubic, "N/m^3")
                        .fitted("rest", 0.0, "m"),
                )
            }
            Hidden::CoulombFriction => {
                let level = 0.25 * of.size;
                self.guide.coulomb = [level; 2];
                Some(
                    of.told("dry friction of the guide", &["mass"])
                        .fitted("level", level, "N"),
                )
            }
            Hidden::Hysteresis => {
                let (stiffness, onward, back) = (120.0 * of.size, 20.0, 8.0);
                self.joint = Hysteresis {
                    stiffness,
                    onward,
                    back,
                    force: 0.0,
                };
                Some(
                    of.told("a rubber joint to the ground", &["mass"])
                        .fitted("stiffness", stiffness, "N/m")
                        .fitted("onward", onward, "1/m")
                        .fitted("back", back, "1/m"),
                )
            }
            _ => None,
        }
    }

    fn parts(&mut self) -> Vec<&mut f64> {
        vec![&mut self.mass, &mut self.stiffness, &mut self.damping]
    }

    fn lumped(&self) -> Vec<Quantity> {
        vec![
            quantity("stiffness_per_mass", self.stiffness / self.mass, "1/s^2"),
            quantity("damping_per_mass", self.damping / self.mass, "1/s"),
            quantity("inverse_mass", 1.0 / self.mass, "1/kg"),
        ]
    }

    fn model_toml(&self) -> String {
        format!(
            "# A mass on a spring. Its recordings may hide an effect that this model lacks.\n\
             name = \"Oscillator with a secret\"\n\
             \n\
             # m v' = F - d v - k q\n\
             [plant.oscillator.physical]\n\
             mass = {:?}       # kg\n\
             stiffness = {:?} # N/m\n\
             damping = {:?}    # N s/m\n\
             \n\
             # A distance sensor, 10 bit over 0.4 m.\n\
             [log.measured.position]\n\
             sensor = \"instantaneous\"\n",
            self.mass, self.stiffness, self.damping
        )
    }
}
