//! The pages of `docs/effects`: what every effect of the library is, and how it shows.
//!
//! `cargo run --release -p loopsight-tests --example effect_gallery -- docs/effects`
//!
//! A page has the declaration of its effect, as `loopsight explain` has it, and a picture of its symptom: the machine of
//! `hidden` that hides it, and the plain model fitted to its recording.

mod page;
mod picture;

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Parser;
use loopsight_hidden::Hidden;
use loopsight_model::registry;
use loopsight_recordings::output;
use rayon::prelude::*;

/// Writes a page and a picture for every effect of the library, and the gallery of them
#[derive(Parser)]
struct Arguments {
    /// Where to
    folder: PathBuf,
    /// Only these effects; `none`: the gallery alone
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
}

type Outcome = Result<(), Box<dyn Error + Send + Sync>>;

fn main() -> Outcome {
    let arguments = Arguments::parse();
    std::fs::create_dir_all(&arguments.folder)?;
    let wanted = |id: &str| arguments.only.is_empty() || arguments.only.iter().any(|o| o == id);
    registry::effects()
        .par_iter()
        .filter(|meta| wanted(meta.id))
        .try_for_each(|meta| one(&arguments.folder, meta.id))?;
    let drawn = |id: &str| id.parse::<Hidden>().is_ok();
    if arguments.only.is_empty() || wanted("none") {
        save(&arguments.folder.join("README.md"), &page::gallery(&drawn))?;
    }
    Ok(())
}

fn one(folder: &Path, id: &str) -> Outcome {
    let part = loopsight::explain(id)?.parts.remove(0);
    let mut page = page::declared(&part);
    // What no machine hides has no picture.
    if let Ok(hidden) = id.parse::<Hidden>() {
        let picture = picture::picture(hidden);
        let picture = picture.ok_or_else(|| format!("{id}: its recording cannot be diagnosed"))?;
        eprintln!("{id}: {}", picture.caption);
        save(&folder.join(format!("{id}.svg")), &picture.svg)?;
        page += &format!("\n![How it shows]({id}.svg)\n\n{}\n", picture.caption);
    }
    save(&folder.join(format!("{id}.md")), &page)
}

fn save(file: &Path, text: &str) -> Outcome {
    output::save(file, text.as_bytes())?;
    Ok(())
}
