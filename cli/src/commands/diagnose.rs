//! `loopsight diagnose`.

use loopsight_core::run::Run;
use loopsight_diagnosis::{Conclusion, Diagnosis, Explanation, diagnose};

use crate::arguments::DiagnoseOptions;
use crate::failure::Failure;
use crate::load::{Loaded, model_and_log, recording};
use crate::{output, progress};

pub(crate) fn run(options: &DiagnoseOptions) -> Result<(), Failure> {
    let mut loaded = model_and_log(&options.files)?;
    let test = test_runs(&mut loaded, options.test.as_deref())?;
    let bar = progress::bar("trying effects", 1);
    let diagnosis = diagnose(
        &loaded.model,
        &loaded.runs,
        test.as_deref(),
        &loaded.faults,
        &|done, total| {
            bar.set_length(total);
            bar.set_position(done);
        },
    );
    bar.finish_and_clear();
    let diagnosis = diagnosis?;
    output::people(&text(&diagnosis), options.json);
    if options.json {
        output::json(&diagnosis)?;
    }
    Ok(())
}

/// The runs of a test recording, which must measure what the log measures; its faults join those
/// of the log.
pub(crate) fn test_runs(
    loaded: &mut Loaded,
    path: Option<&std::path::Path>,
) -> Result<Option<Vec<Run>>, Failure> {
    let Some(path) = path else { return Ok(None) };
    let mut model = loaded.model.clone();
    let (runs, faults) = recording(&mut model, path)?;
    if model.measured != loaded.model.measured {
        return Err(Failure::request(format!(
            "{} does not measure the same signals as {}",
            path.display(),
            loaded.log_path.display()
        )));
    }
    loaded.faults.extend(faults);
    Ok(Some(runs))
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
        _ => format!(
            "Nothing is missing: the error of {nominal} is what noise and resolution leave ({}).",
            output::percent(diagnosis.floor.nrmse)
        ),
    }
}

fn text(diagnosis: &Diagnosis) -> String {
    let mut text = format!(
        "{}{}\n",
        output::faults(&diagnosis.faults),
        sentence(diagnosis)
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
    if let Some(best) = diagnosis.candidates.first() {
        for other in &best.indistinguishable_from {
            text.push_str(&format!(
                "\nnot told apart from it by these data: {} at {}",
                other.effect,
                other.at.join(", ")
            ));
        }
    }
    for statement in &diagnosis.where_it_fails {
        text.push_str(&format!("\nwhere it fails: {}", statement.statement));
    }
    for advice in &diagnosis.advice {
        text.push_str(&format!("\nadvice: {}: {}", advice.why, advice.experiment));
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
        format!(
            "{} @ {}",
            explanation.place.effect,
            explanation.place.at.join("+")
        ),
        output::percent(explanation.nrmse),
        format!("{:.1}", explanation.significance),
        parameters.join(", "),
    ]
}
