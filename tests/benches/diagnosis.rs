//! What a diagnosis with the whole library costs: 40 s of a Twil at 100 Hz, with nothing hidden and with dry
//! friction, beside free runs of the plain model over the same log in the same minute.
//!
//! `cargo bench -p loopsight-tests --bench diagnosis`

#![allow(
    clippy::expect_used,
    reason = "what is built here is right, and a panic is how this program fails"
)]

use std::hint::black_box;
use std::time::Instant;

use loopsight_diagnosis::{Measurements, Work, diagnose};
use loopsight_hidden::{Hidden, Recording, Robot, record_along};
use loopsight_model::model::Model;
use loopsight_model::simulate::{Simulator, free_run};
use loopsight_plants as _;
use loopsight_tests::WINDINGS;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Samples of the log at 100 Hz.
const SAMPLES: usize = 4001;
/// Samples for which a voltage is held.
const HELD: usize = 50;
/// The voltage, V.
const VOLTS: f64 = 9.0;
/// Free runs whose middle is the measure.
const RUNS: usize = 201;

fn log(hidden: &[(Hidden, f64)]) -> Recording {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut volts = [0.0; 2];
    let commands: Vec<[f64; 2]> = (0..SAMPLES)
        .map(|k| {
            if k % HELD == 0 {
                volts = [0, 1].map(|_| if random.random() { VOLTS } else { -VOLTS });
            }
            volts
        })
        .collect();
    record_along(Robot::Twil, hidden, &commands, 1, WINDINGS).expect("a Twil can have it")
}

/// Seconds that a free run of the plain model takes.
fn free_run_takes(model: &Model, log: &Recording) -> f64 {
    let mut simulator = Simulator::new(model, &model.values());
    let x0 = vec![0.0; model.n_states()];
    let mut times: Vec<f64> = (0..RUNS)
        .map(|_| {
            let from = Instant::now();
            free_run(&mut simulator, &x0, &log.run, |_, predicted| {
                black_box(predicted);
            });
            from.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[RUNS / 2]
}

/// Seconds that a diagnosis takes, and what it concludes.
fn diagnosis_takes(model: &Model, log: &Recording) -> (f64, String) {
    let from = Instant::now();
    let found = diagnose(
        model,
        &Measurements::new(std::slice::from_ref(&log.run)),
        &Work::quiet(),
    );
    let found = found.expect("a log that can be diagnosed");
    let named = found.missing.map_or("nothing".to_owned(), |p| p.effect);
    (from.elapsed().as_secs_f64(), named)
}

fn main() {
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let one = one.expect("a thread");
    for (name, hidden) in [
        ("nothing is hidden", &[][..]),
        ("dry friction is", &[(Hidden::CoulombFriction, 1.0)]),
    ] {
        let log = log(hidden);
        let (model, _) = Model::from_toml("hidden", &log.model_toml).expect("a model");
        let run = free_run_takes(&model, &log);
        let (on_one, _) = one.install(|| diagnosis_takes(&model, &log));
        let (on_all, named) = diagnosis_takes(&model, &log);
        println!(
            "{name}: {named} found in {on_all:.2} s on {} threads, {on_one:.2} s on one, which is {:.0} free runs of {:.2} ms",
            rayon::current_num_threads(),
            on_one / run,
            1e3 * run
        );
    }
}
