//! A slide on a ball screw under a position loop.

use std::f64::consts::TAU;

use super::{Rig, Row, Scale, Sheet, dry, midpoint, quantity};
use crate::Hidden;
use crate::friction::Friction;
use crate::truth::{Concealed, Quantity};

pub(crate) const SHEET: Sheet = Sheet {
    name: "servo_axis",
    rate: 100.0,
    inputs: 2,
    columns: &[
        "time_s",
        "position_reference_m",
        "voltage_added_V",
        "control_voltage_V",
    ],
    // Never zero: where the slide stands, a loop without integral leaves a voltage that only tells how
    // it came to stand there.
    command: [0.025, 0.15],
    shows: &[Hidden::DirectionalFriction],
    build: |phase, _| Box::new(ServoAxis::new(phase)),
};

/// Integration step, s.
const STEP: f64 = 1e-4;
/// Integration steps from one computation of the controller to the next, and its period, s.
const TICK_STEPS: usize = 10;
const TICK: f64 = STEP * TICK_STEPS as f64;
/// Computations from sample to sample.
const TICKS: usize = 10;
/// Way of the slide per turn of the screw, m.
const LEAD: f64 = 0.01;
/// Counts of the motor's encoder per turn.
const COUNTS: f64 = 8000.0;
/// Acceleration of the reference, m/s².
const RAMP: f64 = 2.5;

/// What the controller knows of the motion.
#[derive(Clone, Copy, Debug, Default)]
struct Knowledge {
    position: f64,
    /// Filtered differences.
    velocity: f64,
    voltage: f64,
}

/// A slide driven by a motor and a ball screw. A digital controller reads the motor's encoder every
/// millisecond and holds its voltage in between, which an amplifier with a current loop makes a
/// current. Set points come every 10 ms; the controller goes from one to the next on a straight line.
///
/// ```text
/// (m + J (2π/lead)²) v' = K_T (2π/lead) i - F_v v + friction        i' = (G u - i)/τ
/// u_k = k_v (k_p (ref_k - q_k) - v_k) within ±limit        v_k = v_k-1 + α ((q_k - q_k-1)/T - v_k-1)
/// ```
///
/// The command is the speed of the reference, which changes as fast as [`RAMP`] allows.
#[derive(Clone, Debug)]
pub(super) struct ServoAxis {
    /// Of the slide, kg.
    slide: f64,
    /// Of motor and screw, kg m².
    rotor: f64,
    /// N s/m
    pub(super) viscous: f64,
    guide: Friction,
    /// N m/A
    torque_constant: f64,
    /// A/V
    amplifier: f64,
    /// Time constant of the current loop, s.
    current_lag: f64,
    /// 1/s
    position_gain: f64,
    /// V s/m
    velocity_gain: f64,
    /// V
    pub(super) limit: f64,
    /// Share of a new difference in the filtered one.
    share: f64,
    encoder: Scale,
    /// Position, m, impulse, kg m/s, current, A.
    pub(super) state: [f64; 3],
    /// By counts, and without rounding.
    known: [Knowledge; 2],
    pub(super) reference: f64,
    /// Of the reference, m/s.
    speed: f64,
}

impl ServoAxis {
    pub(super) fn new(phase: [f64; 2]) -> Self {
        let encoder = Scale::new(LEAD / COUNTS, phase[0]);
        let mut known = [Knowledge::default(); 2];
        known[0].position = encoder.read(0.0);
        Self {
            slide: 45.0,
            rotor: 4e-5,
            viscous: 180.0,
            guide: Friction::default(),
            torque_constant: 0.056,
            amplifier: 1.0,
            current_lag: 1e-3,
            position_gain: 30.0,
            velocity_gain: 120.0,
            limit: 10.0,
            // A filter of 4 ms.
            share: -(-TICK / 4e-3).exp_m1(),
            encoder,
            state: [0.0; 3],
            known,
            reference: 0.0,
            speed: 0.0,
        }
    }

    /// Mass as it acts at the slide, kg.
    pub(super) fn mass(&self) -> f64 {
        self.slide + self.rotor * (TAU / LEAD).powi(2)
    }

    /// Force per volt, N/V.
    pub(super) fn force_gain(&self) -> f64 {
        self.amplifier * self.torque_constant * TAU / LEAD
    }

    /// Computes the voltages for the next millisecond.
    fn control(&mut self) {
        let position = self.state[0];
        let read = [self.encoder.read(position), position];
        for (known, q) in self.known.iter_mut().zip(read) {
            let difference = (q - known.position) / TICK;
            known.velocity += self.share * (difference - known.velocity);
            known.position = q;
            let wanted = self.position_gain * (self.reference - q);
            let voltage = self.velocity_gain * (wanted - known.velocity);
            known.voltage = voltage.clamp(-self.limit, self.limit);
        }
    }

    fn step(&mut self) {
        let mass = self.mass();
        let pull = self.torque_constant * TAU / LEAD;
        let wanted = self.amplifier * self.known[0].voltage;
        let start = self.state;
        let mut end = midpoint(start, STEP, |[_, impulse, current]| {
            let velocity = impulse / mass;
            [
                velocity,
                pull * current - self.viscous * velocity,
                (wanted - current) / self.current_lag,
            ]
        });
        let stop = dry(&self.guide, start[1] / mass, end[1] / mass, mass, STEP);
        end[1] += stop;
        end[0] += 0.5 * STEP * stop / mass;
        self.state = end;
    }
}

impl Rig for ServoAxis {
    fn sample(&mut self, command: f64) -> Row {
        let most = RAMP / SHEET.rate;
        self.speed += (command - self.speed).clamp(-most, most);
        self.control();
        let mut row = Row {
            // Nothing is added to the voltage.
            inputs: [self.reference, 0.0],
            ..Row::default()
        };
        row.measured[0] = self.known[0].voltage;
        row.exact[0] = self.known[1].voltage;
        row
    }

    fn advance(&mut self) {
        for tick in 0..TICKS {
            if tick > 0 {
                self.control();
            }
            for _ in 0..TICK_STEPS {
                self.step();
            }
            self.reference += self.speed * TICK;
        }
    }

    fn hide(&mut self, of: Concealed) -> Option<Concealed> {
        match of.effect {
            Hidden::DirectionalFriction => {
                let [forward, backward] = [12.0, 24.0].map(|level| level * of.size);
                self.guide.coulomb = [forward, backward];
                Some(
                    of.told("dry friction of the guide, higher backwards", &["slide"])
                        .fitted("level_forward", forward, "N")
                        .fitted("level_backward", backward, "N"),
                )
            }
            _ => None,
        }
    }

    fn parts(&mut self) -> Vec<&mut f64> {
        vec![&mut self.slide, &mut self.viscous]
    }

    fn lumped(&self) -> Vec<Quantity> {
        vec![
            quantity("mass", self.mass(), "kg"),
            quantity("viscous_friction", self.viscous, "N s/m"),
            quantity("position_gain", self.position_gain, "1/s"),
            quantity("velocity_gain", self.velocity_gain, "V s/m"),
            quantity("force_gain", self.force_gain(), "N/V"),
            quantity("voltage_limit", self.limit, "V"),
            // The difference is half a period old, the filter lags by (1 - α)/α periods.
            quantity(
                "velocity_lag",
                TICK * (0.5 + (1.0 - self.share) / self.share),
                "s",
            ),
            // The voltage is held for a period.
            quantity("drive_lag", 0.5 * TICK + self.current_lag, "s"),
        ]
    }

    fn model_toml(&self) -> String {
        let lumped = self.lumped();
        let rounded = |i: usize| crate::truth::significant(lumped[i].value, 4);
        format!(
            "# A slide under a position loop. Its recordings may hide an effect that this model lacks.\n\
             name = \"Slide with a secret\"\n\
             \n\
             # M v' = F - F_v v      u = k_v (k_p (q_ref - q) - v), within ±u_max\n\
             [plant.servo_axis]\n\
             mass = {:?}            # kg\n\
             viscous_friction = {:?} # N s/m\n\
             # The controller, known: it computes every millisecond, from filtered differences.\n\
             position_gain = {:?}    # 1/s\n\
             velocity_gain = {:?}   # V s/m\n\
             force_gain = {:?}      # N/V\n\
             voltage_limit = {:?}    # V\n\
             velocity_lag = {:?} # s\n\
             drive_lag = {:?}      # s\n\
             \n\
             # Between its set points the controller goes on a straight line.\n\
             [log.inputs.position_reference]\n\
             column = \"position_reference_m\"\n\
             hold = \"first_order\"\n\
             \n\
             [log.measured.control_voltage]\n\
             sensor = \"instantaneous\"\n\
             \n\
             [simulation]\n\
             max_step_s = 0.001\n",
            rounded(0),
            rounded(1),
            rounded(2),
            rounded(3),
            rounded(4),
            rounded(5),
            rounded(6),
            rounded(7),
        )
    }
}
