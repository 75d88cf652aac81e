//! Results as text and as JSON.

use std::io::Write as _;

use crate::answers::{Answer, Correction, Estimates, Failing, LogFault, MissingForce, ModelErrors};
use crate::answers::{FitAnswer, ParameterEstimate, ParameterVerdict, Severity};
use crate::error::Result;
use crate::words::{number, percent};

/// Something for the person at the terminal that is not the result: standard error.
pub(crate) fn note(text: &str) {
    eprintln!("{text}");
}

/// The result: standard output. A closed pipe is not an error.
pub(crate) fn result(text: &str) {
    let mut out = std::io::stdout().lock();
    let _ = out.write_all(text.as_bytes());
    let _ = out.write_all(b"\n");
}

/// An answer: as text on standard output, or as JSON there and the text on standard error.
pub(crate) fn answer(answer: &impl Answer, text: &str, json: bool) -> Result<()> {
    if json {
        note(text);
        result(&answer.to_json()?);
    } else {
        result(text);
    }
    Ok(())
}

/// A table with columns aligned: the first to the left, the others to the right.
pub(crate) fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    aligned(head, rows, 1)
}

/// A table with all columns aligned to the left.
pub(crate) fn columns(head: &[&str], rows: &[Vec<String>]) -> String {
    aligned(head, rows, head.len())
}

/// A table whose first `left` columns are aligned to the left, the others to the right.
fn aligned(head: &[&str], rows: &[Vec<String>], left: usize) -> String {
    let mut widths: Vec<usize> = head.iter().map(|h| h.chars().count()).collect();
    for row in rows {
        for (width, cell) in widths.iter_mut().zip(row) {
            *width = (*width).max(cell.chars().count());
        }
    }
    let line = |cells: Vec<&str>| {
        let mut text = String::new();
        for (i, (cell, width)) in cells.iter().zip(&widths).enumerate() {
            let gap = " ".repeat(width - cell.chars().count());
            if i < left {
                text.push_str(&format!("  {cell}{gap}"));
            } else {
                text.push_str(&format!("  {gap}{cell}"));
            }
        }
        text.trim_end().to_owned()
    };
    let mut lines = vec![line(head.to_vec())];
    for row in rows {
        lines.push(line(row.iter().map(String::as_str).collect()));
    }
    lines.join("\n")
}

/// A line for each fault.
pub(crate) fn faults(faults: &[LogFault]) -> String {
    let mut text = String::new();
    for fault in faults {
        let word = match fault.severity {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Fatal => "fault",
        };
        text.push_str(&format!("{word}: {fault}\n"));
    }
    text
}

/// What is known of a force that the library does not have.
pub(crate) fn residual_force(force: &MissingForce) -> String {
    let mut text = format!("\nresidual force: {}", force.statement);
    if let Some(expression) = &force.expression {
        text.push_str(&format!(
            "\n\nto begin with, at the end of the model file (then fit, look, and edit):\n\n{}",
            expression.toml.trim_end()
        ));
    }
    text
}

/// The errors of a model; `summary` says them in words.
pub(crate) fn errors(errors: &ModelErrors, summary: &str) -> String {
    let rows: Vec<Vec<String>> = errors
        .signals
        .iter()
        .map(|s| {
            vec![
                s.id.clone(),
                format!("{} {}", number(s.rmse), s.unit),
                percent(s.nrmse),
                format!("{:.2} %", s.fit_percent),
                percent(s.one_step_nrmse),
            ]
        })
        .collect();
    format!(
        "{}{summary}\n{}{}{}",
        faults(&errors.faults),
        correction(errors.observer.as_ref()),
        table(&["signal", "rmse", "nrmse", "fit", "one-step nrmse"], &rows),
        where_it_fails(&errors.where_it_fails)
    )
}

/// Where a model fails: a line for each statement.
pub(crate) fn where_it_fails(statements: &[Failing]) -> String {
    statements
        .iter()
        .map(|s| format!("\nwhere it fails: {}", s.statement))
        .collect()
}

/// That a free run was corrected by the measurements, where it was; with a line's end.
pub(crate) fn correction(correction: Option<&Correction>) -> String {
    correction.map_or_else(String::new, |c| format!("note: {}\n", c.statement))
}

fn estimate((name, p): (&String, &ParameterEstimate)) -> Vec<String> {
    vec![
        name.clone(),
        number(p.value),
        p.unit.clone(),
        p.std_error
            .map_or_else(|| "-".to_owned(), |e| format!("{e:.2e}")),
        p.interval95.map_or_else(
            || "-".to_owned(),
            |[low, high]| format!("{} … {}", number(low), number(high)),
        ),
    ]
}

/// Parameters with intervals, and what the data say of them.
pub(crate) fn parameters(parameters: &Estimates, flat: &[String], derived: &Estimates) -> String {
    let rows: Vec<Vec<String>> = parameters.iter().map(estimate).collect();
    let mut text = table(
        &["parameter", "value", "unit", "std error", "95 % interval"],
        &rows,
    );
    // Below the table: beside it, they would make it wider than a terminal.
    let mut verdicts: Vec<(ParameterVerdict, Vec<&str>)> = Vec::new();
    for (name, p) in parameters {
        match verdicts
            .iter_mut()
            .find(|(verdict, _)| *verdict == p.verdict)
        {
            Some((_, names)) => names.push(name),
            None => verdicts.push((p.verdict, vec![name])),
        }
    }
    for (verdict, names) in &verdicts {
        text.push_str(&format!("\n{}: {}", verdict.text(), names.join(", ")));
    }
    for flat in flat {
        text.push_str(&format!("\nnot determined: {flat}"));
    }
    if !derived.is_empty() {
        let rows: Vec<Vec<String>> = derived.iter().map(estimate).collect();
        let head = ["from these", "value", "unit", "std error", "95 % interval"];
        text.push_str(&format!("\n\n{}", table(&head, &rows)));
    }
    text
}

/// A fit: its parameters, and what it came to.
pub(crate) fn fit(fit: &FitAnswer) -> String {
    let parameters = parameters(&fit.parameters, &fit.flat, &fit.derived);
    format!("{parameters}\n\n{}", fit.summary)
}

/// The command as it was typed, for the foot of a page.
pub(crate) fn command_line() -> String {
    let words: Vec<String> = std::env::args_os()
        .skip(1)
        .map(|w| w.to_string_lossy().into_owned())
        .map(|w| if w.contains(' ') { format!("'{w}'") } else { w })
        .collect();
    format!("loopsight {}", words.join(" "))
}
