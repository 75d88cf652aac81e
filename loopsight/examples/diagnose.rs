//! Which physical effect does a model lack? A diagnosis from two file names, and what to do next.

use loopsight::{DiagnoseOptions, Log, Model, Result, Session};

const FOLDER: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../examples/hidden-effect/oscillator_coulomb_friction"
);

fn main() -> Result<()> {
    let model = Model::from_file(format!("{FOLDER}/model.toml"))?;
    let session = Session::new(model, Log::read(format!("{FOLDER}/mixed.csv"))?)?;
    let answer = session.diagnose(&DiagnoseOptions::default())?;
    println!("{}", answer.summary);
    for advice in &answer.advice {
        println!("to know more: {}", advice.experiment);
    }
    Ok(())
}
