//! Simulate a robot with noise, and fit a model to its log: nothing is written to a disk.

use loopsight::{Experiment, FitOptions, Model, Result, Session, SimulateOptions};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/twil");

fn main() -> Result<()> {
    let robot = Session::of_model(Model::from_file(format!("{FOLDER}/model.toml"))?);
    let experiment = Experiment::from_file(format!("{FOLDER}/prbs.toml"))?;
    let made = robot.simulate(&SimulateOptions::new(experiment))?;
    println!("{}", made.summary);
    let guess = Model::from_file(format!("{FOLDER}/first_guess.toml"))?;
    let fit = Session::new(guess, made.log().clone())?.fit(&FitOptions::default())?;
    println!("{}", fit.summary);
    Ok(())
}
