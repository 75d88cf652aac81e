//! Add what is missing, refit, repeat, and write the model that came of it, with a page to look at.

use loopsight::{ImproveOptions, Log, Model, Result, Session};

const FOLDER: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../examples/hidden-effect/oscillator_coulomb_friction"
);

fn main() -> Result<()> {
    let model = Model::from_file(format!("{FOLDER}/model.toml"))?;
    let session = Session::new(model, Log::read(format!("{FOLDER}/mixed.csv"))?)?;
    let answer = session.improve(&ImproveOptions::default())?;
    for step in &answer.steps {
        let added = step
            .added
            .as_ref()
            .map_or("as it was".to_owned(), ToString::to_string);
        println!("{added}: {:.2} % on unseen data", 100.0 * step.nrmse_test);
    }
    if let Some(better) = answer.model() {
        better.save(std::env::temp_dir().join("better.toml"))?;
        println!("{}", better.to_toml());
    }
    Ok(())
}
