//! Files that were damaged: whatever stands in them, reading them ends with a result or an error,
//! never with a panic. A few hundred cases, the same ones on every machine.

#![allow(
    clippy::unwrap_used,
    reason = "what is damaged here was right, and a panic is how this program fails"
)]

use loopsight::{CompareOptions, FitOptions, Log, Method, Session};
use loopsight_diagnosis::{Measurements, Work, compare};
use loopsight_model::config::TomlSource;
use loopsight_model::loop_file::LoopFile;
use loopsight_model::model::Model;
use loopsight_model::registry::{BuildError, DriverContext, parts, plants};
use loopsight_model::run::{Rows, Run};
use loopsight_tests::damage::damaged;
use loopsight_tests::{Random, repository, twil, twil_path};

/// Calls `read` with `count` damaged copies of `text`; returns how many still read.
fn survivors(text: &str, seed: u64, count: usize, read: impl Fn(&str) -> bool) -> usize {
    let mut random = Random::new(seed);
    (0..count)
        .filter(|_| {
            let bytes = damaged(text.as_bytes(), &mut random);
            read(&String::from_utf8_lossy(&bytes))
        })
        .count()
}

/// What would follow reading a model: a short comparison with a log.
fn use_model(text: &str) -> bool {
    match Model::from_toml("damaged.toml", text) {
        Err(error) => {
            assert!(!error.to_string().is_empty());
            false
        }
        Ok((model, source)) => {
            let _ = source.with_values(&[(vec!["plant".into(), "ddmr".into()], 1.0)]);
            let _ = model.affine();
            // A damaged step could ask for any amount of work.
            if model.max_step > 1e-4 {
                let _ = compare(
                    &model,
                    &Measurements::new(&[short_run(&model)]),
                    &Work::quiet(),
                );
            }
            true
        }
    }
}

/// Twenty samples of something.
fn short_run(model: &Model) -> Run {
    let (n, n_inputs, n_measured) = (20, model.plant.inputs.len(), model.measured.len());
    let row = |k: usize, width: usize| (0..width).map(move |i| ((k * 3 + i) % 5) as f64 * 0.1);
    let rows = |width| Rows::new(width, (0..n).flat_map(|k| row(k, width)).collect());
    let time = (0..n).map(|k| k as f64 * 0.01).collect();
    Run::new("", time, rows(n_inputs), rows(n_measured)).unwrap()
}

#[test]
fn damaged_models_never_panic() {
    let mut texts = vec![std::fs::read_to_string(twil_path()).unwrap()];
    texts.extend(plants().iter().map(|p| p.example.to_owned()));
    let effects = "\n[[effect]]\n[effect.coulomb_friction]\nat = [\"wheel.right\"]\nlevel = 0.9\n\
                   [[effect]]\n[effect.input_delay]\nat = [\"input.left\"]\ndelay = 0.02\n\
                   [fit]\nfree = [\"wheel_radius\"]\n[simulation]\nmax_step_s = 0.001\n";
    texts.push(format!("{}{effects}", texts[0]));
    for name in [
        "expressions/pendulum.toml",
        "expressions/twil.toml",
        "own-states/clutch.toml",
        "own-states/clutch_candidate.toml",
        "own-states/lag.toml",
    ] {
        let path = repository().join("examples").join(name);
        texts.push(std::fs::read_to_string(path).unwrap());
    }
    let mut all = 0;
    for (seed, text) in texts.iter().enumerate() {
        let read = survivors(text, seed as u64, 300, use_model);
        println!("text {seed}: {read} of 300 still read");
        assert!((1..300).contains(&read), "{read} of 300");
        all += read;
    }
    // Of a short text hardly a line can be damaged so that it is read all the same.
    assert!(
        all > 5 * texts.len(),
        "{all} of 300 for each of {}",
        texts.len()
    );
}

#[test]
fn damaged_loops_never_panic() {
    let model = twil();
    let mut texts = vec![
        "model = \"model.toml\"\nperiod_s = 0.01\nduration_s = 1.0\nlog = \"run.csv\"\n\
         [driver.simulated]\nlimit = 12.0\nnoise = { linear_velocity = 0.01 }\n\
         [controller.feedback_linearizing_pi]\nsettling_time_s = [0.45, 0.5]\n\
         [estimator.rls]\nforgetting = 0.99\n\
         [reference]\nlinear_velocity = { sum = [{ constant = 0.1 }, { sine = { amplitude = 0.1, \
         frequency_hz = 1.0 } }] }\nangular_velocity = { prbs = { amplitude = 1.0, hold_s = 0.5 } }\n"
            .to_owned(),
    ];
    // Every part that is linked takes its turn.
    for part in parts() {
        let table = part.example.lines().next().unwrap();
        if !texts[0].contains(table) {
            let old = format!("[{}.", part.role);
            let (before, rest) = texts[0].split_once(&old).unwrap();
            let after = rest.split_once("\n[").map_or("", |(_, after)| after);
            texts.push(format!("{before}{}\n[{after}", part.example));
        }
    }
    let load_model = |_: &str| -> Result<Model, BuildError> { Ok(twil()) };
    let load_runs =
        |_: &str, model: &Model| -> Result<Vec<Run>, BuildError> { Ok(vec![short_run(model)]) };
    for (seed, text) in texts.iter().enumerate() {
        let read = survivors(text, 100 + seed as u64, 300, |text| {
            let Ok(source) = TomlSource::parse("damaged.toml", text) else {
                return false;
            };
            let Ok(file) = LoopFile::parse(&source) else {
                return false;
            };
            let context = DriverContext {
                model: &model,
                period: file.period_s,
                load_model: &load_model,
                load_runs: &load_runs,
                read_column: &|path, _| Err(BuildError::at("path", format!("no {path}"))),
            };
            let Ok(mut composed) = file.compose(&source, &model, &context) else {
                return true;
            };
            if (1e-3..1.0).contains(&file.period_s) && !file.real_time {
                for k in 0..20 {
                    let time = f64::from(k) * file.period_s;
                    let reference: Vec<f64> =
                        composed.references.iter().map(|r| r.sample(time)).collect();
                    if composed.host.tick(&reference).is_err() {
                        break;
                    }
                }
            }
            true
        });
        println!("text {seed}: {read} of 300 still read");
        assert!(read < 295, "{read} of 300");
    }
}

#[test]
fn damaged_logs_never_panic() {
    let model = loopsight::Model::from_file(twil_path()).unwrap();
    let log = std::fs::read_to_string(repository().join("examples/twil/prbs.csv")).unwrap();
    let short: String = log.lines().take(60).map(|l| format!("{l}\n")).collect();
    let read = survivors(&short, 7, 400, |text| {
        let Ok(log) = Log::from_bytes("damaged.csv", text.as_bytes()) else {
            return false;
        };
        let Ok(session) = Session::new(model.clone(), log) else {
            return false;
        };
        let _ = session.compare(&CompareOptions::default());
        let _ = session.fit(&FitOptions::default().method(Method::Rls));
        true
    });
    println!("{read} of 400 still read");
    assert!((5..395).contains(&read), "{read} of 400");
}

/// A log of the kind that describes itself, as WPILib's tool writes it.
fn sysid() -> String {
    let run = |sign: f64| -> String {
        let rows = (0..40).map(|k| {
            let t = f64::from(k) * 0.005;
            let (u, v) = (sign * 10.0 * t, sign * 3.0 * t);
            format!("[{t},{u},{u},{x},{x},{v},{v},0.0,0.0]", x = 0.5 * v * t)
        });
        format!("[{}]", rows.collect::<Vec<_>>().join(","))
    };
    format!(
        "{{\"sysid\":true,\"test\":\"Drivetrain\",\"units\":\"Meters\",\"unitsPerRotation\":0.48,\
         \"slow-forward\":{0},\"slow-backward\":{1},\"fast-forward\":{0},\"fast-backward\":{1}}}",
        run(1.0),
        run(-1.0)
    )
}

#[test]
fn damaged_sysid_logs_never_panic() {
    let text = sysid();
    Log::from_bytes("right.json", text.as_bytes()).unwrap();
    let read = survivors(&text, 11, 400, |text| {
        let Ok(log) = Log::from_bytes("damaged.json", text.as_bytes()) else {
            return false;
        };
        let Some(model) = log.model() else {
            return true;
        };
        // The model a log describes is one that can be read.
        let _ = Session::new(model.unwrap(), log);
        true
    });
    println!("{read} of 400 still read");
    assert!((5..395).contains(&read), "{read} of 400");
}
