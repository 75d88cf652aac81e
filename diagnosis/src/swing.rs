//! A recording that tests of several parts use.

use loopsight_model::model::Model;
use loopsight_model::run::{Rows, Run};
use loopsight_model::simulate::{Simulator, free_run};

/// What a plant with one input and one measured signal does at 6 V · sin(3 t), from rest, at 100 Hz.
pub(crate) fn swing(model: &Model, samples: usize) -> Run {
    let time: Vec<f64> = (0..samples).map(|k| 0.01 * k as f64).collect();
    let volts: Vec<f64> = time.iter().map(|t| 6.0 * (3.0 * t).sin()).collect();
    let rows = |values: Vec<f64>| Rows::new(1, values);
    let nothing = rows(vec![0.0; samples]);
    let blind = Run::new("", time.clone(), rows(volts.clone()), nothing).unwrap();
    let mut simulator = Simulator::new(model, &model.values());
    let x0 = vec![0.0; model.n_states()];
    let mut measured = Vec::new();
    free_run(&mut simulator, &x0, &blind, |_, y| {
        measured.extend_from_slice(y);
    });
    Run::new("", time, rows(volts), rows(measured)).unwrap()
}
