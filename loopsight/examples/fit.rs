//! Find the parameters of a model from one log and judge them on another: values with 95 % intervals, and
//! what the data say of each.

use loopsight::{FitOptions, Log, Model, Result, Session};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/twil");

fn main() -> Result<()> {
    let model = Model::from_file(format!("{FOLDER}/first_guess.toml"))?;
    let session = Session::new(model, Log::read(format!("{FOLDER}/prbs.csv"))?)?
        .test(Log::read(format!("{FOLDER}/steps.csv"))?)?;
    let fit = session.fit(&FitOptions::default())?;
    for (name, p) in &fit.parameters {
        let within = p
            .interval95
            .map_or(f64::NAN, |[low, high]| 0.5 * (high - low));
        println!(
            "{name} = {:.5} ± {within:.5} {}: {}",
            p.value,
            p.unit,
            p.verdict.text()
        );
    }
    println!("on the other log: {}", fit.judged());
    Ok(())
}
