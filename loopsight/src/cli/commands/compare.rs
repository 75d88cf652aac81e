//! `loopsight compare`.

use loopsight_diagnosis::{FitSettings, Measurements, Work, compare, fit};
use loopsight_report::{Context, comparison_page, save};

use crate::cli::arguments::CompareOptions;
use crate::cli::commands::fit::watch;
use crate::cli::failure::Failure;
use crate::cli::load::{model_and_log, refuse_fatal, writable};
use crate::cli::{output, progress};

pub(crate) fn run(options: &CompareOptions) -> Result<(), Failure> {
    options.html.as_deref().map_or(Ok(()), writable)?;
    let loaded = model_and_log(&options.files)?;
    let mut notes = Vec::new();
    let comparison = if loaded.model_path.is_none() {
        // A log that describes itself brings no parameters: compare the best the plain model can do.
        refuse_fatal(&loaded.log_path, &loaded.faults)?;
        notes.push(format!(
            "No model file was given: the parameters of the plain `{}` model were fitted to this \
             log first, so this is the least error the model can have here.",
            loaded.model.plant.id
        ));
        let bar = watch("fitting");
        let fitted = fit::fit(
            &loaded.model,
            &Measurements::new(&loaded.runs).with_faults(&loaded.faults),
            &FitSettings::default(),
            &Work::reporting(&progress::counted(&bar)),
        );
        bar.finish_and_clear();
        fitted?.comparison
    } else {
        compare(
            &loaded.model,
            &Measurements::new(&loaded.runs).with_faults(&loaded.faults),
            &Work::quiet(),
        )?
    };
    for note in &notes {
        output::note(note);
    }
    output::people(&output::comparison(&comparison), options.json);
    if options.json {
        output::json(&comparison)?;
    }
    if let Some(path) = &options.html {
        let context = Context {
            title: format!(
                "{} held against {}",
                loaded.model.name,
                loaded.log_path.display()
            ),
            model_name: loaded.model.name.clone(),
            model_file: loaded.model_path.as_ref().map(|p| p.display().to_string()),
            log_file: loaded.log_path.display().to_string(),
            notes,
            command: output::command_line(),
        };
        save(path, &comparison_page(&context, &comparison))?;
        output::note(&format!("wrote {}", path.display()));
    }
    Ok(())
}
