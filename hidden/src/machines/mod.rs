//! Machines that are none of motors and wheels: one command, a few sensors, a file each.

mod arm;
mod bouc_wen;
mod cart_pole;
mod flexible_joint;
mod oscillator;
mod propeller_pendulum;
mod record;
mod refit;
mod rotary_pendulum;
mod servo_axis;
mod tank_pair;
mod thermal;
mod torque_axis;

#[cfg(test)]
mod tests;

use crate::Hidden;
use crate::friction::Friction;
use crate::truth::{Concealed, Quantity};

pub(crate) use arm::SHEET as ARM;
pub use bouc_wen::hysteretic_benchmark;
pub(crate) use cart_pole::SHEET as CART_POLE;
pub(crate) use flexible_joint::SHEET as FLEXIBLE_JOINT;
pub(crate) use oscillator::SHEET as OSCILLATOR;
pub(crate) use propeller_pendulum::SHEET as PROPELLER_PENDULUM;
pub(crate) use record::along_rig;
pub use refit::Parts;
pub(crate) use refit::{left, refit};
pub(crate) use rotary_pendulum::SHEET as ROTARY_PENDULUM;
pub(crate) use servo_axis::SHEET as SERVO_AXIS;
pub(crate) use tank_pair::SHEET as TANK_PAIR;
pub(crate) use thermal::SHEET as THERMAL;
pub(crate) use torque_axis::SHEET as TORQUE_AXIS;

/// Most signals that a machine here logs.
const SIGNALS: usize = 4;

/// What is said of a machine before it is built.
#[derive(Debug)]
pub(crate) struct Sheet {
    /// Name in messages and file names.
    pub(crate) name: &'static str,
    /// Samples per second.
    pub(crate) rate: f64,
    /// Number of the plant's inputs.
    pub(crate) inputs: usize,
    /// Header of the log: time, inputs, signals.
    pub(crate) columns: &'static [&'static str],
    /// Centre and amplitude of the commands.
    pub(crate) command: [f64; 2],
    /// What it can hide.
    pub(crate) shows: &'static [Hidden],
    /// The clean machine at rest. Its sensors' marks are where `phase`, two numbers in `[0, 1)`, has
    /// them; a winding has the time constant given, s.
    pub(crate) build: fn(phase: [f64; 2], winding_time_constant: f64) -> Box<dyn Rig>,
}

impl Sheet {
    fn signals(&self) -> usize {
        self.columns.len() - 1 - self.inputs
    }
}

/// What a log has of one instant.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Row {
    /// What acts on the plant from now on.
    pub(crate) inputs: [f64; 2],
    /// What the sensors say.
    pub(crate) measured: [f64; SIGNALS],
    /// What they would say without rounding.
    pub(crate) exact: [f64; SIGNALS],
}

impl Row {
    /// That of a machine with one command, before its sensors are read.
    fn told(command: f64) -> Self {
        Self {
            inputs: [command, 0.0],
            ..Self::default()
        }
    }
}

/// A machine at work.
pub(crate) trait Rig {
    /// Reads the sensors and takes the command for the time up to the next sample.
    fn sample(&mut self, command: f64) -> Row;

    /// Moves on to the next sample.
    fn advance(&mut self);

    /// Builds an effect in; none where there is no place for it.
    fn hide(&mut self, concealed: Concealed) -> Option<Concealed>;

    /// Parts that a fit of the machine finds.
    fn parts(&mut self) -> Vec<&mut f64>;

    /// The parameters that its plant has, those of a log without effect.
    fn lumped(&self) -> Vec<Quantity>;

    /// Time constant of its winding, s.
    fn winding_time_constant(&self) -> Option<f64> {
        None
    }

    /// A model file.
    fn model_toml(&self) -> String;
}

/// A reading in whole steps: of an encoder, of a converter.
#[derive(Clone, Copy, Debug)]
struct Scale {
    resolution: f64,
    /// Where the marks are, in steps.
    phase: f64,
}

impl Scale {
    /// Marks at a phase in `[0, 1)`.
    fn new(resolution: f64, phase: f64) -> Self {
        let phase = phase - 0.5;
        Self { resolution, phase }
    }

    /// The value at the middle of the step that `x` is in.
    fn read(&self, x: f64) -> f64 {
        ((x / self.resolution + self.phase).round() - self.phase) * self.resolution
    }
}

/// A speed as the difference of an encoder's readings, over the time since the sample before.
#[derive(Clone, Copy, Debug)]
struct Counter {
    encoder: Scale,
    rate: f64,
    /// The last angle as read and as it was.
    before: Option<[f64; 2]>,
}

impl Counter {
    /// An encoder that is read `rate` times per second.
    fn new(encoder: Scale, rate: f64) -> Self {
        let before = None;
        Self {
            encoder,
            rate,
            before,
        }
    }

    /// The speeds by counts and without rounding; none at the first sample.
    fn speed(&mut self, angle: f64) -> [f64; 2] {
        let now = [self.encoder.read(angle), angle];
        let before = self.before.replace(now).unwrap_or(now);
        [0, 1].map(|i| (now[i] - before[i]) * self.rate)
    }
}

/// One step of `h` by the implicit midpoint rule, `x₁ = x₀ + h f((x₀ + x₁)/2)`, iterated from `x₀`.
///
/// Reference: E. Hairer, C. Lubich, G. Wanner (2006), "Geometric Numerical Integration", 2nd
/// edition, section II.1.
fn midpoint<const N: usize>(
    start: [f64; N],
    h: f64,
    mut rate: impl FnMut([f64; N]) -> [f64; N],
) -> [f64; N] {
    let mut end = start;
    for _ in 0..4 {
        let rates = rate(mean(start, end));
        for ((e, s), r) in end.iter_mut().zip(start).zip(rates) {
            *e = s + h * r;
        }
    }
    end
}

fn mean<const N: usize>(a: [f64; N], b: [f64; N]) -> [f64; N] {
    let mut mean = a;
    for (m, b) in mean.iter_mut().zip(b) {
        *m = 0.5 * (*m + b);
    }
    mean
}

/// Impulse of dry friction over a step of `h` s: what stops the motion, within the bounds of the
/// friction. `free` is the speed without it at the end of the step, `mass` what it moves.
fn dry(friction: &Friction, before: f64, free: f64, mass: f64, h: f64) -> f64 {
    let [least, most] = friction.bounds(before).map(|force| h * force);
    (-mass * free).clamp(least, most)
}

fn quantity(name: &'static str, value: f64, unit: &'static str) -> Quantity {
    Quantity { name, value, unit }
}
