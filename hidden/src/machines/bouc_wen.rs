//! The hysteretic oscillator of the literature.

use std::f64::consts::TAU;

use loopsight_model::run::Run;

use super::midpoint;
use crate::error::HiddenError;
use crate::hysteresis::Hysteresis;
use crate::random::Random;
use crate::recording::Recording;
use crate::truth::Truth;
use crate::{Concealed, Hidden, Robot};

/// Samples per second of the benchmark.
const RATE: f64 = 750.0;
/// Samples of a period of its multisines.
const PERIOD: usize = 8192;
/// Its excited band, Hz.
const BAND: [f64; 2] = [5.0, 150.0];
/// Root mean square of its force, N.
const FORCE: f64 = 50.0;
/// Integration steps from sample to sample: 30 kHz, where the benchmark takes 15.
const STEPS: usize = 40;

const MASS: f64 = 2.0;
const STIFFNESS: f64 = 5e4;
const DAMPING: f64 = 10.0;
const ALPHA: f64 = 5e4;
const BETA: f64 = 1e3;
const GAMMA: f64 = 0.8;
const DELTA: f64 = -1.1;

/// A recording of the Bouc–Wen oscillator of Noël and Schoukens, of `samples` samples at 750 Hz, from rest.
///
/// ```text
/// 2 kg y'' + 10 N s/m y' + 5·10⁴ N/m y + z = F
/// z' = 5·10⁴ N/m y' - 10³ (0.8 |y'| z - 1.1 y' |z|)
/// ```
///
/// `F` is a multisine: all multiples of 750/8192 Hz from 5 to 150 Hz with equal amplitudes and random phases (decided by
/// `seed`), 50 N root mean square. The displacement is read with Gaussian noise of `noise` m; in the benchmark's
/// estimation data that is 8 µm, in its test data none.
///
/// Followed by the implicit midpoint rule at 30 kHz, with the force as a sum of sines and the hysteresis exact along its
/// way, where the authors have Newmark's rule at 15 kHz.
///
/// Reference: J.-P. Noël, M. Schoukens (2016), "Hysteretic benchmark with a dynamic nonlinearity", Workshop on Nonlinear
/// System Identification Benchmarks, Brussels, table 1 and sections 3 to 5.
///
/// # Errors
///
/// [`HiddenError`] where what was recorded is no run, which does not happen.
pub fn hysteretic_benchmark(
    seed: u64,
    samples: usize,
    noise: f64,
) -> Result<Recording, HiddenError> {
    let h = 1.0 / (RATE * STEPS as f64);
    let mut random = Random::new(seed, 11);
    let mut force = Multisine::new(&mut random, 0.5 * h);
    let mut joint = Hysteresis {
        stiffness: ALPHA,
        onward: BETA * (GAMMA + DELTA),
        back: BETA * (GAMMA - DELTA),
        force: 0.0,
    };
    let mut state = [0.0; 2];
    let mut run = Run::empty(1, 1);
    let mut exact = Vec::with_capacity(samples);
    for k in 0..samples {
        let read = state[0] + noise * normal(&mut random);
        run.push(k as f64 / RATE, &[force.value()], &[read])?;
        exact.push(state[0]);
        for _ in 0..STEPS {
            force.go_on();
            let start = state;
            let push = force.value();
            state = midpoint(start, h, |[x, v]| {
                let pull = joint.moved(x - start[0]).force;
                [v, (push - STIFFNESS * x - DAMPING * v - pull) / MASS]
            });
            joint = joint.moved(state[0] - start[0]);
            force.go_on();
        }
    }
    let hidden = Concealed::new(Hidden::Hysteresis, 1.0, &[])
        .told("the hysteresis of the benchmark", &["mass"])
        .fitted("stiffness", joint.stiffness, "N/m")
        .fitted("onward", joint.onward, "1/m")
        .fitted("back", joint.back, "1/m");
    Ok(Recording {
        exact: run.clone().with_measured(exact)?,
        run,
        truth: Truth {
            robot: Robot::Oscillator,
            hidden: vec![hidden],
            lumped: vec![
                super::quantity("stiffness_per_mass", STIFFNESS / MASS, "1/s^2"),
                super::quantity("damping_per_mass", DAMPING / MASS, "1/s"),
                super::quantity("inverse_mass", 1.0 / MASS, "1/kg"),
            ],
            winding_time_constant: None,
        },
        model_toml: "# A mass on a spring, as one would begin with: its resonance is near 35 Hz.\n\
                     name = \"Oscillator of Noël and Schoukens\"\n\
                     \n\
                     # m v' = F - d v - k q\n\
                     [plant.oscillator.physical]\n\
                     mass = 1.6          # kg\n\
                     stiffness = 70000.0 # N/m\n\
                     damping = 15.0      # N s/m\n\
                     \n\
                     # The force is smooth between its samples.\n\
                     [log.inputs.force]\n\
                     column = \"force_N\"\n\
                     hold = \"first_order\"\n\
                     \n\
                     [log.measured.position]\n\
                     sensor = \"instantaneous\"\n"
            .to_owned(),
        commands: Vec::new(),
    })
}

/// A sum of sines, followed in steps of half an integration step.
struct Multisine {
    /// N
    amplitude: f64,
    /// Of each sine: cosine and sine of its phase now, and of what a step adds.
    lines: Vec<[f64; 4]>,
}

impl Multisine {
    fn new(random: &mut Random, step: f64) -> Self {
        let spacing = RATE / PERIOD as f64;
        let [first, last] = BAND.map(|edge| edge / spacing);
        let lines: Vec<[f64; 4]> = (first.ceil() as usize..=last.floor() as usize)
            .map(|line| {
                let (sin, cos) = (TAU * random.uniform()).sin_cos();
                let (turn_sin, turn_cos) = (TAU * spacing * line as f64 * step).sin_cos();
                [cos, sin, turn_cos, turn_sin]
            })
            .collect();
        let amplitude = FORCE * (2.0 / lines.len() as f64).sqrt();
        Self { amplitude, lines }
    }

    fn value(&self) -> f64 {
        self.amplitude * self.lines.iter().map(|line| line[0]).sum::<f64>()
    }

    fn go_on(&mut self) {
        for [cos, sin, turn_cos, turn_sin] in &mut self.lines {
            (*cos, *sin) = (
                *cos * *turn_cos - *sin * *turn_sin,
                *sin * *turn_cos + *cos * *turn_sin,
            );
        }
    }
}

/// A number of the normal distribution: G. E. P. Box, M. E. Muller (1958), Annals of Mathematical Statistics 29, 610.
fn normal(random: &mut Random) -> f64 {
    let radius = (-2.0 * (1.0 - random.uniform()).ln()).sqrt();
    radius * (TAU * random.uniform()).cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rms(values: impl Iterator<Item = f64>) -> f64 {
        let (mut sum, mut n) = (0.0, 0.0);
        for value in values {
            sum += value * value;
            n += 1.0;
        }
        f64::sqrt(sum / n)
    }

    /// A period of the force has the benchmark's size; the displacement that of its noise's hundredfold, 0.66 mm.
    #[test]
    fn is_as_large_as_the_benchmark() {
        let log = hysteretic_benchmark(1, PERIOD, 8e-6).unwrap();
        let run = &log.run;
        assert_eq!(run.len(), PERIOD);
        let force = rms((0..run.len()).map(|k| run.input(k)[0]));
        assert!((force - FORCE).abs() < 0.1, "{force} N");
        let way = rms(log.exact.measured().iter().copied());
        println!("displacement {:.3} mm", 1e3 * way);
        assert!((5e-4..9e-4).contains(&way), "{way} m");
        let noise = rms(run
            .measured()
            .iter()
            .zip(log.exact.measured())
            .map(|(a, b)| a - b));
        assert!((7.8e-6..8.2e-6).contains(&noise), "{noise} m");
    }
}
