//! Sessions of a model and a log that are given as texts.

use loopsight::{Answer, ImproveOptions, Log, Model, Session};
use serde_json::Value;

/// What `improve` answers, as JSON.
pub(crate) fn improved(model: &str, log: &str) -> Value {
    let model = Model::from_toml("model.toml", model).unwrap();
    let log = Log::from_bytes("log.csv", log.as_bytes()).unwrap();
    let session = Session::new(model, log).unwrap();
    let found = session.improve(&ImproveOptions::default()).unwrap();
    serde_json::from_str(&found.to_json().unwrap()).unwrap()
}
