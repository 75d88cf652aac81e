//! Two tanks, one above the other, and a pump.

use super::{Rig, Row, Scale, Sheet, midpoint, quantity};
use crate::Hidden;
use crate::physics::GRAVITY;
use crate::truth::{Concealed, Quantity};

pub(crate) const SHEET: Sheet = Sheet {
    name: "tank_pair",
    rate: 1.0,
    inputs: 1,
    columns: &["time_s", "pump_V", "level_upper_m", "level_lower_m"],
    command: [4.4, 4.0],
    shows: &[
        Hidden::DeadZone,
        Hidden::InputPower,
        Hidden::ConstantForce,
        Hidden::Overflow,
    ],
    build: |phase, _| Box::new(TankPair::new(phase)),
};

/// Integration step, s, and steps from sample to sample.
const STEP: f64 = 0.01;
const STEPS: usize = 100;
/// Pressure transmitters, 12 bit over 1 m of water.
const RESOLUTION: f64 = 1.0 / 4096.0;
/// Both tanks at the start, m.
const START: f64 = 0.15;

/// Voltage at which the pump moves what its data sheet says, V.
const RATED: f64 = 6.0;

/// Discharge coefficient of a sharp edge.
const WEIR: f64 = 0.62;
/// Length of the edge that the upper tank runs over, m.
const RIM: f64 = 0.4;

/// Two tanks with holes in their bottoms; what leaves the upper one falls into the lower one.
///
/// ```text
/// volume₁' = pump - out₁ - over        volume₂' = out₁ - out₂ - drawn
/// pressure = ρ g volume/area    out = hole √(2 pressure/ρ)
/// ```
///
/// Over an edge of the length `L` runs `over = ⅔ 0.62 L √(2 g) (level - edge)^1.5`, out of the apparatus.
///
/// References: D. Bernoulli (1738), "Hydrodynamica", section III: the speed of efflux; G. Poleni (1717), "De motu aquae
/// mixto": the weir.
#[derive(Clone, Debug)]
pub(super) struct TankPair {
    /// m²
    area: [f64; 2],
    /// Effective area of the holes, m².
    hole: [f64; 2],
    /// m³/s/V
    pump: f64,
    /// Voltage below which the pump does not turn, V.
    threshold: f64,
    /// Its flow goes with this power of the voltage.
    exponent: f64,
    /// Height at which the upper tank runs over, m.
    edge: f64,
    /// What a dosing pump draws from the lower tank, m³/s.
    drawn: f64,
    sensors: [Scale; 2],
    /// m³
    pub(super) volume: [f64; 2],
    voltage: f64,
}

impl TankPair {
    pub(super) fn new(phase: [f64; 2]) -> Self {
        let area = [0.02, 0.016];
        Self {
            area,
            hole: [3.0e-5, 2.8e-5],
            pump: 1.2e-5,
            threshold: 0.0,
            exponent: 1.0,
            edge: f64::INFINITY,
            drawn: 0.0,
            sensors: phase.map(|p| Scale::new(RESOLUTION, p)),
            volume: area.map(|a| a * START),
            voltage: 0.0,
        }
    }

    /// What the pump moves, m³/s.
    fn inflow(&self) -> f64 {
        let live = (self.voltage - self.threshold).max(0.0);
        let curved = if self.exponent == 1.0 {
            live
        } else {
            RATED * (live / RATED).powf(self.exponent)
        };
        self.pump * curved
    }

    /// What runs out of a tank that holds `volume`, m³/s.
    pub(super) fn outflow(&self, tank: usize, volume: f64) -> f64 {
        let pressure = 1000.0 * GRAVITY * volume.max(0.0) / self.area[tank];
        self.hole[tank] * (2.0 * pressure / 1000.0).sqrt()
    }

    /// What runs over the edge of the upper tank, m³/s.
    pub(super) fn over(&self, volume: f64) -> f64 {
        let head = (volume / self.area[0] - self.edge).max(0.0);
        2.0 / 3.0 * WEIR * RIM * (2.0 * GRAVITY * head).sqrt() * head
    }

    fn step(&mut self) {
        let inflow = self.inflow();
        let end = midpoint(self.volume, STEP, |volume| {
            let [first, second] = [0, 1].map(|i| self.outflow(i, volume[i]));
            let over = self.over(volume[0]);
            [inflow - first - over, first - second - self.drawn]
        });
        // No tank holds less than nothing.
        self.volume = end.map(|v| v.max(0.0));
    }

    fn level(&self, tank: usize) -> f64 {
        self.volume[tank] / self.area[tank]
    }
}

impl Rig for TankPair {
    fn sample(&mut self, command: f64) -> Row {
        self.voltage = command;
        let mut row = Row::told(command);
        for i in 0..2 {
            row.exact[i] = self.level(i);
            row.measured[i] = self.sensors[i].read(self.level(i));
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
            Hidden::DeadZone => {
                self.threshold = 0.8 * of.size;
                Some(
                    of.told("a pump that does not turn below a threshold", &["pump"])
                        .fitted("threshold", self.threshold, "V"),
                )
            }
            Hidden::InputPower => {
                self.exponent = 1.0 + 0.5 * of.size;
                Some(
                    of.told(
                        "a pump whose flow goes with a power of its voltage",
                        &["pump"],
                    )
                    .fitted("exponent", self.exponent, "1")
                    .physical("rated_voltage", RATED, "V"),
                )
            }
            Hidden::ConstantForce => {
                self.drawn = 6e-6 * of.size;
                Some(
                    of.told(
                        "a dosing pump that draws from the lower tank",
                        &["tank.lower"],
                    )
                    .fitted("force", -self.drawn / self.area[1], "m/s")
                    .physical("drawn", self.drawn, "m^3/s"),
                )
            }
            Hidden::Overflow => {
                self.edge = 0.36 - 0.08 * of.size;
                Some(
                    of.told("an upper tank that runs over its edge", &["tank.upper"])
                        .fitted("limit", self.edge, "m")
                        .fitted("edge", WEIR * RIM / self.area[0], "1/m")
                        .physical("rim", RIM, "m"),
                )
            }
            _ => None,
        }
    }

    fn parts(&mut self) -> Vec<&mut f64> {
        // With both holes and the pump the level and its rate are free; the area of the upper tank
        // only scales volumes.
        let [upper, lower] = &mut self.hole;
        vec![upper, lower, &mut self.pump, &mut self.area[1]]
    }

    fn lumped(&self) -> Vec<Quantity> {
        let [upper, lower] = self.area;
        vec![
            quantity("pump", self.pump / upper, "m/s/V"),
            quantity("outlet_upper", self.hole[0] / upper, "1"),
            quantity("inlet_lower", self.hole[0] / lower, "1"),
            quantity("outlet_lower", self.hole[1] / lower, "1"),
        ]
    }

    fn model_toml(&self) -> String {
        format!(
            "# Two tanks and a pump. Their recordings may hide an effect that this model lacks.\n\
             name = \"Tanks with a secret\"\n\
             \n\
             # A_1 h'_1 = K u - a_1 √(2 g h_1)      A_2 h'_2 = a_1 √(2 g h_1) - a_2 √(2 g h_2)\n\
             [plant.tank_pair.physical]\n\
             area_upper = {:?}      # m²\n\
             area_lower = {:?}     # m²\n\
             hole_upper = {:?}      # m²\n\
             hole_lower = {:?}    # m²\n\
             pump_flow = {:?}     # m³/s/V\n\
             \n\
             # Pressure transmitters, 12 bit over 1 m of water.\n\
             [log.measured.level_upper]\n\
             sensor = \"instantaneous\"\n\
             \n\
             [log.measured.level_lower]\n\
             sensor = \"instantaneous\"\n",
            self.area[0], self.area[1], self.hole[0], self.hole[1], self.pump
        )
    }
}
