//! Writes the recording of `examples/cart-pole`: a pole held upright on a cart whose wheels rub.
//!
//! ```text
//! cargo run --release -p loopsight-tests --example cart_pole
//! ```

use std::error::Error;

use loopsight_model::model::signals;
use loopsight_recordings::{header, write_csv};
use loopsight_tests::balance::{cart_pole, upright};
use loopsight_tests::repository;

/// Friction of the wheels.
const FRICTION: &str =
    "[[effect]]\n[effect.coulomb_friction]\nat = [\"cart\"]\nlevel = 0.4\nwidth = 0.005\n";

fn main() -> Result<(), Box<dyn Error>> {
    let truth = cart_pole([1.0; 3], FRICTION, true);
    // At the first sample there is no difference to read a speed from.
    let run = upright(&truth, 20.0, 5);
    let run = run.part(1..run.len());
    let states = truth.measured.iter().map(|m| header(m.signal));
    let input = signals(truth.plant).nth(truth.n_states()).map(header);
    let headers: Vec<String> = std::iter::once("time_s".to_owned())
        .chain(input)
        .chain(states)
        .collect();
    let round = |v: &f64| (v * 1e7).round() / 1e7;
    let rows: Vec<f64> = (0..run.len())
        .flat_map(|k| {
            let time = run.time()[k] - run.time()[0];
            let row = std::iter::once(&time)
                .chain(run.input(k))
                .chain(run.sample(k));
            row.map(round).collect::<Vec<f64>>()
        })
        .collect();
    let path = repository().join("examples/cart-pole/upright.csv");
    write_csv(&path, &headers, &rows)?;
    println!("wrote {}", path.display());
    Ok(())
}
