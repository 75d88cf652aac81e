//! How far is a model from a log? Three statements: read both, compare, print the sentence.

use loopsight::{CompareOptions, Log, Model, Result, Session};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/twil");

fn main() -> Result<()> {
    let model = Model::from_file(format!("{FOLDER}/model.toml"))?;
    let session = Session::new(model, Log::read(format!("{FOLDER}/prbs.csv"))?)?;
    println!("{}", session.compare(&CompareOptions::default())?.summary);
    Ok(())
}
