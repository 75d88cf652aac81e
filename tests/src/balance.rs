//! Machines that run away without a loop: a pole held upright on a cart, and an axis that a motor
//! pushes to and fro. What is recorded of them is what a loop measured and applied.

use std::f64::consts::TAU;

use loopsight_model::model::{MeasuredSignal, Model};
use loopsight_model::run::Run;
use loopsight_model::simulate::Simulator;

use crate::{PERIOD, Random};

/// Angle of one count of the encoders, rad.
const COUNT: f64 = TAU / 4096.0;
/// Way of the cart for one count of its encoder, m.
const CART_COUNT: f64 = 5e-5;
/// Integration step of the truth, s; fits take longer ones.
const STEP: f64 = 5e-4;

/// A cart of 1.2 kg with a pole, its three parameters `factor` times those of the truth. Position and
/// angle are counted; with `speeds` their differences are measured as well.
pub fn cart_pole(factor: [f64; 3], effects: &str, speeds: bool) -> Model {
    let counted = |id: &str, count: f64| {
        format!(
            "{id} = {{ sensor = {{ encoder_counts = {{ counts_per_revolution = {} }} }} }}\n",
            TAU / count
        )
    };
    let mut text = format!(
        "[plant.cart_pole]\ntotal_mass = {}\npole_moment = {}\npole_inertia = {}\n{effects}\n\
         [log.measured]\nposition = {{}}\nangle = {{}}\n",
        1.2 * factor[0],
        0.06 * factor[1],
        0.024 * factor[2],
    );
    if speeds {
        text.push_str(&counted("velocity", CART_COUNT));
        text.push_str(&counted("rate", COUNT));
    }
    Model::from_toml("cart_pole.toml", &text).unwrap().0
}

/// The pole held upright by feedback of counted angles and their differences, while the reference of
/// the cart jumps and a further force shakes it.
pub fn upright(truth: &Model, seconds: f64, seed: u64) -> Run {
    let mut random = Random::new(seed);
    let mut uniform = move || random.below(1 << 20) as f64 / f64::from(1 << 20) - 0.5;
    // Where the counts begin is anyone's guess.
    let phase = [uniform(), uniform()];
    let counts = [CART_COUNT, COUNT];
    let mut before: Option<[f64; 2]> = None;
    let (mut reference, mut shake) = (0.0, 0.0);
    closed(truth, [0.0, 0.0, 0.02, 0.0], seconds, |k, x| {
        if k % 150 == 0 {
            reference = 0.5 * uniform();
        }
        if k % 12 == 0 {
            shake = 6.0 * uniform();
        }
        let read =
            [0, 1].map(|i| ((x[2 * i] / counts[i] + phase[i]).round() - phase[i]) * counts[i]);
        let speed = before.map(|b| [0, 1].map(|i| (read[i] - b[i]) / PERIOD));
        before = Some(read);
        let [v, q] = speed.unwrap_or_default();
        // Poles at -2.5 ± 1.5i, -5.6 and -7 1/s.
        let force = 14.27 * (read[0] - reference) + 12.98 * v + 63.97 * read[1] + 12.58 * q + shake;
        let [v, q] = speed.unwrap_or([f64::NAN; 2]);
        (force, [read[0], v, read[1], q])
    })
}

/// An axis with hardly any damping, its two parameters `factor` times those of the truth; its angle is
/// counted.
pub fn axis(factor: [f64; 2], effects: &str) -> Model {
    let text = format!(
        "[plant.dc_axis]\nK_A = {}\nK_C = {}\n{effects}\n[log.measured]\nangle = {{}}\n",
        -0.08 * factor[0],
        6.0 * factor[1],
    );
    Model::from_toml("axis.toml", &text).unwrap().0
}

/// The axis under a position loop that follows two sines, with up to half of `noise` rad on its sensor.
pub fn servo(truth: &Model, seconds: f64, seed: u64, noise: f64) -> Run {
    let mut random = Random::new(seed);
    let mut uniform = move || random.below(1 << 20) as f64 / f64::from(1 << 20) - 0.5;
    let phase = [TAU * uniform(), TAU * uniform()];
    let mut before = None;
    closed(truth, [0.0; 2], seconds, |k, x| {
        let time = PERIOD * k as f64;
        let reference = 1.5 * (1.1 * time + phase[0]).sin() + 0.4 * (5.3 * time + phase[1]).sin();
        let read = ((x[1] + noise * uniform()) / COUNT).round() * COUNT;
        let speed = before.map_or(0.0, |b| (read - b) / PERIOD);
        before = Some(read);
        let voltage = (8.0 * (reference - read) - 1.2 * speed).clamp(-12.0, 12.0);
        (voltage, [read])
    })
}

/// `truth` from `start` under a loop: from number and state of a sample to the input and what was
/// measured.
fn closed<const N: usize, const M: usize>(
    truth: &Model,
    start: [f64; N],
    seconds: f64,
    mut tick: impl FnMut(usize, &[f64]) -> (f64, [f64; M]),
) -> Run {
    let mut fine = truth.clone();
    fine.max_step = STEP;
    let mut simulator = Simulator::new(&fine, &fine.values());
    simulator.reset(&start, &[0.0]);
    let mut run = Run::empty(1, truth.measured.len());
    for k in 0..=(seconds / PERIOD).round() as usize {
        let time = PERIOD * k as f64;
        let (input, measured) = tick(k, simulator.state());
        // States are numbered as they are measured here.
        let index = |m: &MeasuredSignal| if M == N { m.index } else { 0 };
        let row: Vec<f64> = truth.measured.iter().map(|m| measured[index(m)]).collect();
        run.push(time, &[input], &row).unwrap();
        simulator.advance(time + PERIOD, &[input]);
    }
    run
}
