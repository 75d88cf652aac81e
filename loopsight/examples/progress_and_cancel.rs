//! Long work tells how far it is, and a token ends it within 0.2 s: what was found until then is the
//! answer.

use loopsight::answers::Verdict;
use loopsight::{CancelToken, DiagnoseOptions, Log, Model, Result, Session, Stage};

const FOLDER: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../examples/hidden-effect/coulomb_friction"
);

fn main() -> Result<()> {
    let model = Model::from_file(format!("{FOLDER}/model.toml"))?;
    let session = Session::new(model, Log::read(format!("{FOLDER}/multi_level.csv"))?)?;
    let token = CancelToken::new();
    let enough = token.clone();
    let options = DiagnoseOptions::default()
        .cancel(&token)
        .progress(move |progress| {
            println!(
                "{}: {} of {}",
                progress.stage.text(),
                progress.done,
                progress.total
            );
            // A button in a window would do this.
            if progress.stage == Stage::FirstLooks && progress.done >= 3 {
                enough.cancel();
            }
        });
    let answer = session.diagnose(&options)?;
    assert_eq!(answer.verdict, Verdict::Cancelled);
    println!(
        "{} The error so far: {:.3}",
        answer.summary, answer.nominal.nrmse
    );
    Ok(())
}
