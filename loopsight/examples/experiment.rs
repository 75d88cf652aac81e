//! Plan the experiment that tells two effects apart, and try it on a simulated robot before the real one.

use loopsight::{Experiment, ExperimentOptions, Model, Result, Session, SimulateOptions};

const MODEL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/twil/model.toml");

fn main() -> Result<()> {
    let session = Session::of_model(Model::from_file(MODEL)?);
    let options = ExperimentOptions::default()
        .separate("coulomb_friction", "dead_zone")
        .limit(9.0);
    let plan = session.experiment(&options)?;
    println!("{}", plan.summary);
    let tried = session.simulate(&SimulateOptions::new(Experiment::of_plan(&plan)?))?;
    println!(
        "{} with columns {}",
        tried.summary,
        tried.columns.join(", ")
    );
    Ok(())
}
