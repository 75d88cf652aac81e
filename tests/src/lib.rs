//! What the cross-crate tests share: the robot of the paper, recordings of it, and the command as a
//! user has it.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "what is built here is right, and a panic is how a test fails"
)]

pub mod balance;
pub mod damage;
pub mod json_schema;
pub mod loops;

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use flate2::read::GzDecoder;
use loopsight_controllers as _;
use loopsight_drivers::{Simulated, simulate_inputs};
use loopsight_estimators as _;
use loopsight_model::excitation::{Excitation, build, sample_rows};
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_model::sensor::Sensor;
use loopsight_plants as _;
use serde_json::Value;

/// Windings of a motor with an ironless rotor, s. No model knows of them, and they are too quick to be seen.
pub const WINDINGS: f64 = 1e-4;

/// The top folder of the repository.
pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap()
        .to_owned()
}

/// The folder of measurements that are not part of the project, named by `LOOPSIGHT_DATA`; where it is
/// unset, says that nothing is tested against `what`.
pub fn real_data(what: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("LOOPSIGHT_DATA").map(PathBuf::from);
    if folder.is_none() {
        println!("LOOPSIGHT_DATA is not set: nothing was tested against {what}");
    }
    folder
}

/// The model file of the Twil, with its encoders.
pub fn twil_path() -> PathBuf {
    repository().join("examples/twil/model.toml")
}

/// The Twil with the paper's parameters; its velocities come from encoder counts.
pub fn twil() -> Model {
    Model::load(&twil_path()).unwrap().0
}

/// `model` with the same measured signals, all made by `sensor`.
pub fn measured_by(mut model: Model, sensor: &Sensor) -> Model {
    let list: Vec<(String, Sensor)> = model
        .measured
        .iter()
        .map(|m| (m.signal.id.to_owned(), sensor.clone()))
        .collect();
    model.measure(&list).unwrap();
    model
}

/// `model` without the values that a fit is to find.
pub fn unknown(mut model: Model) -> Model {
    for parameter in model.parameters.iter_mut().filter(|p| p.free) {
        parameter.value = None;
    }
    model
}

/// Sampling period of the paper, s.
pub const PERIOD: f64 = 0.01;

/// `0, T, 2 T, …, seconds`.
pub fn instants(seconds: f64) -> Vec<f64> {
    let last = (seconds / PERIOD).round() as usize;
    (0..=last).map(|k| k as f64 * PERIOD).collect()
}

/// Pseudo-random binary inputs of ±`amplitude`, drawn anew every 0.5 s, one row per instant.
pub fn prbs(model: &Model, amplitude: f64, seed: u64, time: &[f64]) -> Vec<f64> {
    let given: BTreeMap<String, Excitation> = model
        .plant
        .inputs
        .iter()
        .map(|input| {
            let prbs = Excitation::Prbs {
                amplitude,
                hold_s: 0.5,
                seed,
                common: false,
            };
            (input.id.to_owned(), prbs)
        })
        .collect();
    sample_rows(&build(&given, model.plant.inputs).unwrap(), time)
}

/// 25 s of the paper's experiment on `model`: ±9 V, 100 Hz. With `quantize`, encoders count.
pub fn recording(model: &Model, seed: u64, quantize: bool) -> Run {
    let settings = Simulated {
        seed,
        quantize,
        ..Simulated::default()
    };
    let time = instants(25.0);
    simulate_inputs(model, &settings, &time, &prbs(model, 9.0, seed, &time)).unwrap()
}

/// A random stream that needs no crate: xorshift64*, seeded.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// The stream of `seed`.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    /// 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    /// From 0 to 1.
    pub fn share(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Noise of standard deviation 1, equally distributed.
    pub fn noise(&mut self) -> f64 {
        12f64.sqrt() * (self.share() - 0.5)
    }

    /// A whole number below `end`, which is above 0.
    pub fn below(&mut self, end: usize) -> usize {
        ((self.bits() >> 33) as usize) % end
    }
}

/// Checks the effects that `improve` added, in any order, and that values of parameters are what they were made, to a share
/// of `within`. What it answered is `found`.
///
/// # Panics
///
/// Where they are not, or the answer lacks its keys.
pub fn check_improved(found: &Value, effects: &[&str], values: &[(&str, f64)], within: f64) {
    let steps = found["steps"].as_array().unwrap().iter();
    let mut added: Vec<&str> = steps
        .filter_map(|s| s["added"]["effect"].as_str())
        .collect();
    added.sort_unstable();
    assert_eq!(added, effects);
    for (name, made) in values {
        let value = found["parameters"][name]["value"].as_f64().unwrap();
        assert!((value / made - 1.0).abs() < within, "{name} {value}");
    }
}

/// Checks that the last step of `improve` left less than `most` on data it did not see.
///
/// # Panics
///
/// Where it did not, or the answer lacks its keys.
pub fn check_left(found: &Value, most: f64) {
    let last = found["steps"].as_array().unwrap().last().unwrap();
    let left = last["nrmse_test"].as_f64().unwrap();
    assert!(left < most, "{left}");
}

/// A page with the charts' data as they were before they were packed; the charts' library is left as it is.
///
/// # Panics
///
/// Where a chart's data are not gzip in base64.
pub fn opened(page: &str) -> String {
    const OPENING: &str = "<script type=\"application/gzip\">";
    let mut parts = page.split(OPENING);
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (packed, rest) = part.split_once("</script>").unwrap();
        let bytes = STANDARD.decode(packed).unwrap();
        GzDecoder::new(&bytes[..]).read_to_string(&mut out).unwrap();
        out += rest;
    }
    out
}
