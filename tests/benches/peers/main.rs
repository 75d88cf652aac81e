//! What a free run, a fit, a search for what is missing and an update of recursive least squares cost here, and what the
//! packages take that people use for the same from Python. One recording, one run, one thread.
//!
//! `cargo bench -p loopsight-tests --bench peers` prints the first column. With the packages of
//! `tests/benches/peers/requirements.txt` installed in the Python that `PYTHON` names, it prints the others, too.

#![allow(
    clippy::expect_used,
    reason = "what is shipped is right, and a panic is how this program fails"
)]

use std::collections::BTreeMap;
use std::hint::black_box;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use loopsight_core::Estimator;
use loopsight_diagnosis::{FitSettings, Measurements, Work, diagnose, fit};
use loopsight_estimators::{Rls, RlsSettings};
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_model::simulate::{Simulator, free_run};
use loopsight_plants as _;
use nalgebra::SVector;
use serde::Deserialize;

/// A carriage of 2 kg on springs, with dry friction that the model lacks: 25 s at 100 Hz.
const RECORDING: &str = "../examples/hidden-effect/oscillator_coulomb_friction";
const FREE_RUN: &str = "1. a free run of the plain model, 25 s";
const FIT: &str = "2. a fit of mass, stiffness, damping and friction";
const SEARCH: &str = "3. the search for what is missing";
const UPDATES: &str = "4. recursive least squares, 2499 updates";
/// Times whose median is the measure.
const ROUNDS: usize = 5;
/// Speed within which friction turns round, m/s.
const WIDTH: f64 = 2e-3;
/// Free runs, or passes over the samples, in one time.
const MANY: usize = 100;

/// What one package takes for one task.
#[derive(Deserialize)]
struct Figure {
    seconds: f64,
    /// The error of a free run over the recording, relative to its standard deviation, or what was found.
    result: String,
}

/// The median of the seconds that something takes, over some rounds.
fn median(mut once: impl FnMut()) -> f64 {
    let mut times: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let from = Instant::now();
            once();
            from.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[ROUNDS / 2]
}

fn percent(error: f64) -> String {
    format!("error {:.2} %", 100.0 * error)
}

/// The model and the run of the recording.
fn recording(folder: &Path) -> (Model, Run) {
    let path = folder.join("model.toml");
    let text = std::fs::read_to_string(&path).expect("a shipped model");
    let (mut model, _) = Model::from_toml("model.toml", &text).expect("a model");
    let bytes = std::fs::File::open(folder.join("mixed.csv")).expect("a shipped log");
    let table = loopsight_recordings::read_csv_from(bytes, "mixed.csv").expect("a log");
    let source = loopsight_recordings::Source::Table(table);
    let plant = model.plant;
    let signals: Vec<_> = plant.states.iter().chain(plant.outputs).copied().collect();
    let log = loopsight_recordings::map(&source, plant.inputs, &signals, &model.log);
    let mut log = log.expect("a log of the model");
    let measured: Vec<_> = (log.measured.iter())
        .map(|m| (m.id.clone(), m.sensor.clone()))
        .collect();
    model.measure(&measured).expect("signals of the model");
    (model, log.runs.remove(0))
}

/// What each task takes here.
fn figures(folder: &Path) -> BTreeMap<&'static str, Figure> {
    let (model, run) = recording(folder);
    let measurements = Measurements::new(std::slice::from_ref(&run));
    let x0 = vec![0.0; model.n_states()];
    let mut simulator = Simulator::new(&model, &model.values());
    let free = median(|| {
        for _ in 0..MANY {
            free_run(&mut simulator, &x0, &run, |_, predicted| {
                black_box(predicted);
            });
        }
    });

    let mut with = model
        .with_effect("coulomb_friction", &["mass"])
        .expect("an effect that fits");
    // As in the script: friction turns round within 2 mm/s.
    let width = with
        .parameters
        .iter_mut()
        .find(|p| p.declaration.is_width());
    width.expect("friction has a width").value = Some(WIDTH);
    let settings = FitSettings::default();
    let fitted = || fit(&with, &measurements, &settings, &Work::quiet()).expect("a fit");
    let fitting = median(|| {
        black_box(fitted());
    });

    let found = || diagnose(&model, &measurements, &Work::quiet()).expect("a diagnosis");
    let finding = median(|| {
        black_box(found());
    });
    let found = found();
    let named = (found.missing.as_ref()).map_or("nothing", |place| place.effect.as_str());
    let left = found.candidates.first().map_or(f64::NAN, |c| c.nrmse);

    // Acceleration by differences, speed and position of the same samples.
    let position: Vec<f64> = (0..run.len()).map(|k| run.sample(k)[0]).collect();
    let period = run.median_period();
    let samples: Vec<([f64; 3], f64)> = (1..position.len() - 1)
        .map(|k| {
            let [before, now, after] = [position[k - 1], position[k], position[k + 1]];
            let speed = (after - before) / (2.0 * period);
            let acceleration = (after - 2.0 * now + before) / (period * period);
            ([run.input(k)[0], speed, now], acceleration)
        })
        .collect();
    let rls = RlsSettings {
        forgetting: 0.999,
        ..RlsSettings::default()
    };
    let mut theta = [0.0; 3];
    let updating = median(|| {
        for _ in 0..MANY {
            let mut estimator =
                Rls::new(SVector::<f64, 3>::zeros(), &rls).expect("settings are right");
            for (regressor, y) in &samples {
                estimator.update(regressor, *y);
            }
            theta.copy_from_slice(estimator.theta());
        }
    });
    let figure = |seconds: f64, result: String| Figure { seconds, result };
    BTreeMap::from([
        (
            FREE_RUN,
            figure(free / MANY as f64, "four steps a sample".to_owned()),
        ),
        (FIT, figure(fitting, percent(fitted().nrmse_fit))),
        (
            SEARCH,
            figure(finding, format!("{named}, {}", percent(left))),
        ),
        (
            UPDATES,
            figure(
                updating / MANY as f64,
                format!("inverse mass {:.3} 1/kg", theta[0]),
            ),
        ),
    ])
}

/// What they take in Python, by task and package; empty where the packages are not there.
fn peers(folder: &Path) -> BTreeMap<String, BTreeMap<String, Figure>> {
    let Ok(python) = std::env::var("PYTHON") else {
        println!(
            "no other packages: PYTHON names no Python that has those of tests/benches/peers/requirements.txt\n"
        );
        return BTreeMap::new();
    };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("benches/peers/peers.py");
    let output = Command::new(&python)
        .arg(script)
        .arg(folder.join("mixed.csv"))
        .env("OMP_NUM_THREADS", "1")
        .env("NUMBA_NUM_THREADS", "1")
        .output()
        .expect("the Python that PYTHON names");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{python}: {said}");
    serde_json::from_slice(&output.stdout).expect("what the script prints")
}

fn main() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(RECORDING);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let one = one.expect("a thread");
    let here = one.install(|| figures(&folder));
    let peers = peers(&folder);
    for (task, figure) in &here {
        println!("{task}");
        let mut lines = vec![("loopsight".to_owned(), figure)];
        let others = peers.get(*task).into_iter().flatten();
        lines.extend(others.map(|(name, figure)| (name.clone(), figure)));
        for (name, figure) in lines {
            let ratio = figure.seconds / here[task].seconds;
            println!(
                "  {name:<44}{:>9.3} ms  {:>7.2} times  {}",
                1e3 * figure.seconds,
                ratio,
                figure.result
            );
        }
    }
}
