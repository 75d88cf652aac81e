//! The answer as JSON: exactly what the command prints with `--json`, here with the series of numbers.

use loopsight::{Answer, CompareOptions, Log, Model, Result, Session};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/twil");

fn main() -> Result<()> {
    let model = Model::from_file(format!("{FOLDER}/model.toml"))?;
    let log = Log::read(format!("{FOLDER}/prbs.csv"))?.part(0..300);
    let answer = Session::new(model, log)?.compare(&CompareOptions::default().series(true))?;
    let json = answer.to_json()?;
    println!("{}", json.lines().take(12).collect::<Vec<_>>().join("\n"));
    println!("… {} lines", json.lines().count());
    Ok(())
}
