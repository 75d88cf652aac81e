//! What `compare` and `diagnose` cost as a log gets longer: an axis with hidden dry friction at 1 kHz, beside free
//! runs of the plain model over the same log in the same minute. Processor time of all threads, so what else the
//! machine does matters little; on Linux only.
//!
//! `cargo run --release -p loopsight-diagnosis --example long_log`

#![allow(
    clippy::expect_used,
    reason = "what is built here is right, and a panic is how this program fails"
)]

use std::hint::black_box;

use loopsight_diagnosis::{Measurements, Work, compare, diagnose};
use loopsight_model::model::Model;
use loopsight_model::run::{Rows, Run};
use loopsight_model::simulate::{Simulator, free_run};
use loopsight_plants as _;

/// Lengths of the logs, s.
const LENGTHS: [usize; 5] = [40, 100, 300, 1000, 3600];
/// Samples in a second, and those for which a voltage is held.
const RATE: usize = 1000;
const HELD: usize = 500;
/// Width of the sensor's noise, rad/s: that of 0.05 rad/s standard deviation if it is uniform.
const NOISE: f64 = 0.173;

const PLAIN: &str = "name = \"axis\"\n[plant.dc_axis]\nK_A = -6.0\nK_C = 2.0\n[log.measured.speed]\nsensor = \"instantaneous\"\n";
const TRUTH: &str = "name = \"axis\"\n[plant.dc_axis]\nK_A = -6.4\nK_C = 2.1\n[[effect]]\n[effect.coulomb_friction]\nat = [\"shaft\"]\nlevel = 0.8\n[log.measured.speed]\nsensor = \"instantaneous\"\n";

fn model(text: &str) -> Model {
    Model::from_toml("axis", text).expect("a model").0
}

/// Seven levels of ±9 V, drawn anew every half second, and the speed with noise.
fn log(seconds: usize) -> Run {
    let mut state = 5u64;
    let mut random = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let samples = seconds * RATE + 1;
    let mut volts = 0.0;
    let inputs: Vec<f64> = (0..samples)
        .map(|k| {
            if k % HELD == 0 {
                volts = 3.0 * ((7.0 * random()).floor() - 3.0);
            }
            volts
        })
        .collect();
    let time: Vec<f64> = (0..samples).map(|k| k as f64 / RATE as f64).collect();
    let truth = model(TRUTH);
    let unknown = Rows::new(1, vec![f64::NAN; samples]);
    let driven = Run::new("", time, Rows::new(1, inputs), unknown).expect("a run");
    let mut simulator = Simulator::new(&truth, &truth.values());
    let mut speed = Vec::with_capacity(samples);
    free_run(
        &mut simulator,
        &vec![0.0; truth.n_states()],
        &driven,
        |_, y| {
            speed.push(y[0] + NOISE * (random() - 0.5));
        },
    );
    driven.with_measured(speed).expect("as many as before")
}

/// Processor time of this process so far, s.
fn processor() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let (_, fields) = stat.rsplit_once(')').unwrap_or_default();
    let ticks = fields.split_whitespace().skip(11).take(2);
    ticks.filter_map(|f| f.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// The most memory that this process had so far, MB.
fn memory() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|l| l.split_whitespace().next()?.parse::<f64>().ok());
    kilobytes.unwrap_or(f64::NAN) / 1024.0
}

/// What some work returns, and the processor time it took, s.
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let from = processor();
    let found = work();
    (found, processor() - from)
}

fn main() {
    let plain = model(PLAIN);
    let x0 = vec![0.0; plain.n_states()];
    println!(
        "| log at 1 kHz | a free run | compare | diagnose | the same in free runs of 40 s | memory | found |"
    );
    println!("|---|---|---|---|---|---|---|");
    let mut of_first = f64::NAN;
    for seconds in LENGTHS {
        let run = log(seconds);
        // As many as take a second or so.
        let runs = 7200 / seconds;
        let (_, took) = timed(|| {
            let mut simulator = Simulator::new(&plain, &plain.values());
            for _ in 0..runs {
                free_run(&mut simulator, &x0, &run, |_, y| {
                    black_box(y);
                });
            }
        });
        let free = took / runs as f64;
        if of_first.is_nan() {
            of_first = free;
        }
        let runs = [run];
        let measured = Measurements::new(&runs);
        let (compared, compare_took) = timed(|| compare(&plain, &measured, &Work::quiet()));
        drop(compared.expect("a log of this model"));
        let (found, took) = timed(|| diagnose(&plain, &measured, &Work::quiet()));
        let found = found.expect("a log of this model");
        let best = found.candidates.first().and_then(|c| {
            let (id, estimate) = c.parameters.iter().next()?;
            let error = estimate.std_error.unwrap_or(f64::NAN);
            Some(format!("{id} {:.4} ± {error:.4}", estimate.value))
        });
        println!(
            "| {seconds} s | {:.4} s | {:.0} free runs | {took:.1} s, {:.0} free runs | {:.0} | {:.0} MB | {} {} |",
            free,
            compare_took / free,
            took / free,
            took / of_first,
            memory(),
            found.missing.map_or("nothing".to_owned(), |m| m.effect),
            best.unwrap_or_default()
        );
    }
}
