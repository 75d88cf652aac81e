//! A heating element in a block of metal.

use super::{Rig, Row, Scale, Sheet, midpoint, quantity};
use crate::Hidden;
use crate::truth::{Concealed, Quantity};

pub(crate) const SHEET: Sheet = Sheet {
    name: "thermal",
    rate: 1.0,
    inputs: 1,
    columns: &["time_s", "power_W", "heater_K", "body_K"],
    command: [20.0, 18.0],
    shows: &[Hidden::QuadraticDrag, Hidden::InputPower, Hidden::DeadZone],
    build: |phase, _| Box::new(Thermal::new(phase)),
};

/// Integration step, s, and steps from sample to sample.
const STEP: f64 = 0.05;
const STEPS: usize = 20;
/// Thermometers of 1/16 K.
const RESOLUTION: f64 = 1.0 / 16.0;
/// Surroundings, K.
const ROOM: f64 = 295.0;
/// Power at which the heater gives what it is told whatever its curve, W.
const RATED: f64 = 40.0;

/// An element of which all heat goes into a block, and from there into a room.
///
/// ```text
/// heat_1' = power - flow        heat_2' = flow - out        temperature_i = room + heat_i/capacity_i
/// flow = contact (T_1 - T_2)    out = skin (T_2 - room) (1 + draught (T_2 - room))
/// ```
///
/// Heats are counted from the temperature of the room, where it starts.
#[derive(Clone, Debug)]
pub(super) struct Thermal {
    /// J/K
    capacity: [f64; 2],
    /// W/K
    contact: f64,
    /// W/K
    pub(super) skin: f64,
    /// How much better the air carries heat off per kelvin, 1/K.
    draught: f64,
    /// The power goes with this power of the command.
    exponent: f64,
    thermometers: [Scale; 2],
    /// Power below which the heater stays off, W.
    threshold: f64,
    command: f64,
    /// J
    pub(super) heat: [f64; 2],
}

impl Thermal {
    pub(super) fn new(phase: [f64; 2]) -> Self {
        Self {
            capacity: [20.0, 60.0],
            contact: 1.5,
            skin: 0.4,
            draught: 0.0,
            exponent: 1.0,
            thermometers: phase.map(|p| Scale::new(RESOLUTION, p)),
            threshold: 0.0,
            command: 0.0,
            heat: [0.0; 2],
        }
    }

    /// How much warmer than the room it is, K.
    pub(super) fn warmer(&self, heat: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|i| heat[i] / self.capacity[i])
    }

    /// W
    pub(super) fn out(&self, warmer: f64) -> f64 {
        self.skin * warmer * (1.0 + self.draught * warmer.abs())
    }

    fn step(&mut self) {
        let told = (self.command - self.threshold).max(0.0);
        let power = if self.exponent == 1.0 {
            told
        } else {
            RATED * (told / RATED).powf(self.exponent)
        };
        self.heat = midpoint(self.heat, STEP, |heat| {
            let [element, block] = self.warmer(heat);
            let flow = self.contact * (element - block);
            [power - flow, flow - self.out(block)]
        });
    }
}

impl Rig for Thermal {
    fn sample(&mut self, command: f64) -> Row {
        self.command = command;
        let mut row = Row::told(command);
        for (i, warmer) in self.warmer(self.heat).into_iter().enumerate() {
            row.exact[i] = ROOM + warmer;
            row.measured[i] = self.thermometers[i].read(ROOM + warmer);
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
            Hidden::QuadraticDrag => {
                self.draught = 0.004 * of.size;
                Some(
                    of.told("air that rises faster from a warmer block", &["loss"])
                        .fitted("coefficient", self.draught, "K/K^2"),
                )
            }
            Hidden::InputPower => {
                self.exponent = 1.0 + 0.5 * of.size;
                Some(
                    of.told(
                        "a heater whose power goes with a power of the command",
                        &["input"],
                    )
                    .fitted("exponent", self.exponent, "1")
                    .physical("rated_power", RATED, "W"),
                )
            }
            Hidden::DeadZone => {
                self.threshold = 3.0 * of.size;
                Some(
                    of.told(
                        "a heater that gives less than it is told by a part",
                        &["input"],
                    )
                    .fitted("threshold", self.threshold, "W"),
                )
            }
            _ => None,
        }
    }

    fn parts(&mut self) -> Vec<&mut f64> {
        let [element, block] = &mut self.capacity;
        vec![element, block, &mut self.contact, &mut self.skin]
    }

    fn lumped(&self) -> Vec<Quantity> {
        let [element, block] = self.capacity;
        vec![
            quantity("heating", 1.0 / element, "K/s/W"),
            quantity("exchange_heater", self.contact / element, "1/s"),
            quantity("exchange_body", self.contact / block, "1/s"),
            quantity("loss", self.skin / block, "1/s"),
            quantity("ambient", ROOM, "K"),
        ]
    }

    fn model_toml(&self) -> String {
        format!(
            "# A heating element in a block. Their recordings may hide an effect that this model lacks.\n\
             name = \"Heater with a secret\"\n\
             \n\
             # C_h T'_h = P - G (T_h - T_b)      C_b T'_b = G (T_h - T_b) - L (T_b - T_a)\n\
             [plant.thermal.physical]\n\
             capacity_heater = {:?}       # J/K\n\
             capacity_body = {:?}         # J/K\n\
             conductance = {:?}            # W/K\n\
             conductance_ambient = {:?}    # W/K\n\
             ambient = {ROOM:?}              # K\n\
             \n\
             # Thermometers of 1/16 K, read once a second.\n\
             [log.measured.heater]\n\
             sensor = \"instantaneous\"\n\
             \n\
             [log.measured.body]\n\
             sensor = \"instantaneous\"\n",
            self.capacity[0], self.capacity[1], self.contact, self.skin
        )
    }
}
