//! `loopsight fit`.

use indicatif::ProgressBar;
use loopsight_core::Parameter;
use loopsight_diagnosis::{Fit, FitSettings, Measurements, Method, Scheme, Work, fit};
use loopsight_model::config::Step;
use loopsight_report::{Context, fit_page, save};

use crate::cli::arguments::{FitOptions, MethodName, SchemeName};
use crate::cli::failure::Failure;
use crate::cli::load::{Loaded, join, model_and_log, refuse_fatal, save_text, test_runs, writable};
use crate::cli::{output, progress};

pub(crate) fn run(options: &FitOptions) -> Result<(), Failure> {
    for path in options.output.iter().chain(&options.html) {
        writable(path)?;
    }
    let mut loaded = model_and_log(&options.files)?;
    join(&mut loaded, &options.also)?;
    refuse_fatal(&loaded.log_path, &loaded.faults)?;
    let test = test_runs(&mut loaded, options.test.as_deref())?;
    let settings = FitSettings {
        method: match options.method {
            MethodName::Rls => Method::Rls,
            MethodName::OutputError => Method::OutputError,
        },
        scheme: match options.regression {
            SchemeName::Euler => Scheme::Euler,
            SchemeName::Integrated => Scheme::Integrated,
        },
        ..FitSettings::default()
    };
    let bar = watch("fitting");
    let result = fit::fit(
        &loaded.model,
        &Measurements::new(&loaded.runs)
            .tested_on(test.as_deref())
            .with_faults(&loaded.faults),
        &settings,
        &Work::reporting(&progress::counted(&bar)),
    );
    bar.finish_and_clear();
    let result = result?;

    output::people(&text(options, &result), options.json);
    if options.json {
        output::json(&result)?;
    }
    if let Some(path) = &options.output {
        save_text(path, &fitted_text(&loaded, &result))?;
    }
    if let Some(path) = &options.html {
        save(path, &fit_page(&context(options, &loaded), &result))?;
        output::note(&format!("wrote {}", path.display()));
    }
    Ok(())
}

/// A spinner that shows how far a fit has come.
pub(crate) fn watch(what: &str) -> ProgressBar {
    progress::spinner(what)
}

fn text(options: &FitOptions, fit: &Fit) -> String {
    let judged = match &options.test {
        Some(path) => format!("\non {}, which it was not fitted to:\n", path.display()),
        None => "\n".to_owned(),
    };
    format!(
        "{}\n{judged}{}",
        output::fit(fit),
        output::comparison(&fit.comparison)
    )
}

/// The model file with the values of the fit in it.
fn fitted_text(loaded: &Loaded, fit: &Fit) -> String {
    let values: Vec<(Vec<Step>, f64)> = fit
        .model
        .parameters
        .iter()
        .zip(&loaded.model.parameters)
        .filter(|(new, old)| old.free && new.value != old.value)
        .filter_map(|(new, _)| {
            let error = fit.parameters.get(&new.name).and_then(|p| p.std_error);
            Some((
                new.path.clone(),
                written(new.declaration, new.value?, error),
            ))
        })
        .collect();
    loaded.source.with_values(&values)
}

/// What the file says for `value`: legible, but within the range of the `parameter`.
fn written(parameter: &Parameter, value: f64, std_error: Option<f64>) -> f64 {
    let legible = legible(value, std_error);
    if parameter.admits(legible) {
        legible
    } else {
        value
    }
}

/// `value` to about a thousandth of its standard error: the digits behind that are noise.
fn legible(value: f64, std_error: Option<f64>) -> f64 {
    match std_error {
        Some(error) if error > 0.0 && error.is_finite() => {
            let decimals = (3.0 - error.log10().floor()).clamp(0.0, 17.0) as usize;
            format!("{value:.decimals$}").parse().unwrap_or(value)
        }
        _ => value,
    }
}

fn context(options: &FitOptions, loaded: &Loaded) -> Context {
    let mut notes = Vec::new();
    if let Some(test) = &options.test {
        notes.push(format!(
            "Pictures and errors are those on {}, which the model was not fitted to.",
            test.display()
        ));
    }
    let shown = options.test.as_ref().unwrap_or(&loaded.log_path);
    Context {
        title: format!(
            "{} fitted to {}",
            loaded.model.name,
            loaded.log_path.display()
        ),
        model_name: loaded.model.name.clone(),
        model_file: loaded.model_path.as_ref().map(|p| p.display().to_string()),
        log_file: shown.display().to_string(),
        notes,
        command: output::command_line(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_below_the_noise_are_dropped() {
        assert_eq!(legible(-15.146_524_758_853, Some(5.2e-4)), -15.146_524_8);
        assert_eq!(legible(12_345.678_9, Some(2.0e5)), 12_346.0);
        assert_eq!(legible(0.136_003_798_643, None), 0.136_003_798_643);
    }

    #[test]
    fn no_number_leaves_its_range() {
        let speed = Parameter::new("speed", "v", "flow", "decay").above(0.0);
        assert_eq!(written(&speed, 1e-6, Some(23.8)), 1e-6);
        assert_eq!(written(&speed, 1.234_567_8, Some(23.8)), 1.23);
    }
}
