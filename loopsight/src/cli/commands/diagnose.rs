//! `loopsight diagnose`.

use crate::DiagnoseOptions;
use crate::answers::{Candidate, DiagnoseAnswer};
use crate::cli::arguments::DiagnoseArguments;
use crate::cli::progress::Bar;
use crate::cli::{files, output};
use crate::error::Result;
use crate::words::{number, percent};

pub(crate) fn run(arguments: &DiagnoseArguments) -> Result<()> {
    arguments.html.as_deref().map_or(Ok(()), files::writable)?;
    let session = files::session(&arguments.files, &arguments.also, arguments.test.as_deref())?;
    let bar = Bar::new();
    let options = DiagnoseOptions::default()
        .series(arguments.series)
        .watch(bar.watch());
    let answer = session.diagnose(&options);
    drop(bar);
    let answer = answer?;
    output::answer(&answer, &text(&answer), arguments.json)?;
    if let Some(path) = &arguments.html {
        files::save(path, &answer.page(&output::command_line()))?;
    }
    Ok(())
}

fn text(answer: &DiagnoseAnswer) -> String {
    let mut text = format!(
        "{}{}\n{}",
        output::faults(&answer.faults),
        answer.summary,
        output::correction(answer.observer.as_ref())
    );
    if !answer.candidates.is_empty() {
        let rows: Vec<Vec<String>> = answer.candidates.iter().map(row).collect();
        text.push('\n');
        text.push_str(&output::table(
            &["explanation", "error", "significance", "parameters"],
            &rows,
        ));
        text.push('\n');
    }
    if let (Some(_), Some(best)) = (&answer.missing, answer.candidates.first()) {
        for other in &best.indistinguishable_from {
            text.push_str(&format!(
                "\nnot told apart from it by these data: {} at {}",
                other.effect,
                other.at.join(", ")
            ));
        }
    }
    text.push_str(&output::where_it_fails(&answer.where_it_fails));
    for advice in &answer.advice {
        text.push_str(&format!("\nadvice: {}: {}", advice.why, advice.experiment));
    }
    if let Some(force) = &answer.residual_force {
        text.push_str(&output::residual_force(force));
    }
    text
}

fn row(candidate: &Candidate) -> Vec<String> {
    let parameters: Vec<String> = candidate
        .parameters
        .iter()
        .map(|(name, p)| format!("{name} {} {}", number(p.value), p.unit))
        .collect();
    vec![
        candidate.place.to_string(),
        percent(candidate.nrmse),
        format!("{:.1}", candidate.significance),
        parameters.join(", "),
    ]
}
