//! `loopsight diagnose`.

use loopsight_diagnosis::{
    Comparison, Conclusion, Diagnosis, Explanation, Measurements, Work, compare, diagnose,
};
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_report::{Context, diagnosis_page, save};

use crate::cli::arguments::DiagnoseOptions;
use crate::cli::failure::Failure;
use crate::cli::load::{Loaded, join, model_and_log, test_runs, writable};
use crate::cli::{output, progress};

pub(crate) fn run(options: &DiagnoseOptions) -> Result<(), Failure> {
    options.html.as_deref().map_or(Ok(()), writable)?;
    let mut loaded = model_and_log(&options.files)?;
    join(&mut loaded, &options.also)?;
    let test = test_runs(&mut loaded, options.test.as_deref())?;
    let bar = progress::bar("trying effects", 1);
    let diagnosis = diagnose(
        &loaded.model,
        &Measurements::new(&loaded.runs)
            .tested_on(test.as_deref())
            .with_faults(&loaded.faults),
        &Work::reporting(&progress::shown(&bar)),
    );
    bar.finish_and_clear();
    let diagnosis = diagnosis?;
    output::people(&text(&diagnosis), options.json);
    if options.json {
        output::json(&diagnosis)?;
    }
    if let Some(path) = &options.html {
        let shown = test.as_deref().unwrap_or(&loaded.runs);
        let before = pictures(diagnosis.model.as_ref(), shown);
        let after = pictures(diagnosis.candidates.first().map(|c| &c.model), shown);
        let context = context(&loaded, options.test.as_deref(), "what the model lacks");
        let page = diagnosis_page(&context, &diagnosis, before.as_ref(), after.as_ref());
        save(path, &page)?;
        output::note(&format!("wrote {}", path.display()));
    }
    Ok(())
}

/// `model` held against `runs` for a page; none where it cannot be simulated over them, for then
/// the page has enough to say without.
pub(crate) fn pictures(model: Option<&Model>, runs: &[Run]) -> Option<Comparison> {
    compare(model?, &Measurements::new(runs), &Work::quiet()).ok()
}

/// What a page is about.
pub(crate) fn context(loaded: &Loaded, test: Option<&std::path::Path>, what: &str) -> Context {
    Context {
        title: format!("{}: {what}", loaded.model.name),
        model_name: loaded.model.name.clone(),
        model_file: loaded.model_path.as_ref().map(|p| p.display().to_string()),
        log_file: loaded.log_path.display().to_string(),
        notes: test
            .map(|test| {
                format!(
                    "Judged on {}, which nothing was fitted to; so are the pictures.",
                    test.display()
                )
            })
            .into_iter()
            .collect(),
        command: output::command_line(),
    }
}

/// The conclusion in a sentence.
pub(crate) fn sentence(diagnosis: &Diagnosis) -> String {
    let nominal = output::percent(diagnosis.nominal.nrmse);
    match (diagnosis.verdict, diagnosis.candidates.first()) {
        (Conclusion::EffectMissing, Some(best)) => format!(
            "The model lacks {} at {}: with it the free-run error falls from {nominal} to {} (noise alone: {}).",
            best.place.effect,
            best.place.at.join(" and "),
            output::percent(best.nrmse),
            output::percent(diagnosis.floor.nrmse)
        ),
        (Conclusion::UnknownEffect, _) => format!(
            "Something is missing (error {nominal}, noise alone {}), and nothing in the library is it.",
            output::percent(diagnosis.floor.nrmse)
        ),
        (Conclusion::LogFaulty, _) => "The log is faulty: nothing was fitted.".to_owned(),
        (Conclusion::DataInsufficient, _) => {
            "The recording cannot carry the model: nothing was fitted.".to_owned()
        }
        (Conclusion::Cancelled, _) => "The diagnosis was cancelled.".to_owned(),
        _ => format!(
            "Nothing is missing: the error of {nominal} is what noise and resolution leave ({}).",
            output::percent(diagnosis.floor.nrmse)
        ),
    }
}

fn text(diagnosis: &Diagnosis) -> String {
    let mut text = format!(
        "{}{}\n{}",
        output::faults(&diagnosis.faults),
        sentence(diagnosis),
        output::held(diagnosis.observer.as_ref())
    );
    if !diagnosis.candidates.is_empty() {
        let rows: Vec<Vec<String>> = diagnosis.candidates.iter().map(row).collect();
        text.push('\n');
        text.push_str(&output::table(
            &["explanation", "error", "significance", "parameters"],
            &rows,
        ));
        text.push('\n');
    }
    if let (Some(_), Some(best)) = (&diagnosis.missing, diagnosis.candidates.first()) {
        for other in &best.indistinguishable_from {
            text.push_str(&format!(
                "\nnot told apart from it by these data: {} at {}",
                other.effect,
                other.at.join(", ")
            ));
        }
    }
    text.push_str(&output::where_it_fails(&diagnosis.where_it_fails));
    for advice in &diagnosis.advice {
        text.push_str(&format!("\nadvice: {}: {}", advice.why, advice.experiment));
    }
    if let Some(force) = &diagnosis.residual_force {
        text.push_str(&output::residual_force(force));
    }
    text
}

fn row(explanation: &Explanation) -> Vec<String> {
    let parameters: Vec<String> = explanation
        .parameters
        .iter()
        .map(|(name, p)| format!("{name} {} {}", output::number(p.value), p.unit))
        .collect();
    vec![
        output::place(&explanation.place),
        output::percent(explanation.nrmse),
        format!("{:.1}", explanation.significance),
        parameters.join(", "),
    ]
}
