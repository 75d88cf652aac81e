//! Results as text and as JSON.

use std::io::Write as _;

use loopsight_diagnosis::{
    Comparison, Estimate, Fit, Held, Place, ResidualForce, Statement, Verdict,
};
use loopsight_recordings::{Fault, Severity};
use loopsight_report::ASTRAY;
use serde::Serialize;

use crate::cli::failure::Failure;

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

/// The result as JSON, and nothing else, on standard output.
pub(crate) fn json(value: &impl Serialize) -> Result<(), Failure> {
    let text = serde_json::to_string_pretty(value).map_err(|e| Failure::work(e.to_string()))?;
    result(&text);
    Ok(())
}

/// Text for people: to standard output, or to standard error when that is taken by JSON.
pub(crate) fn people(text: &str, json: bool) {
    if json { note(text) } else { result(text) }
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

/// An effect and where it is.
pub(crate) fn place(place: &Place) -> String {
    format!("{} @ {}", place.effect, place.at.join("+"))
}

/// Six significant digits, without needless zeros.
pub(crate) fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let magnitude = value.abs().log10().floor();
    if !(-4.0..7.0).contains(&magnitude) {
        return format!("{value:.4e}");
    }
    let decimals = (5.0 - magnitude).max(0.0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// Per cent with a sensible number of digits.
pub(crate) fn percent(value: f64) -> String {
    if value.is_nan() {
        "-".to_owned()
    } else if value > ASTRAY {
        format!("> {:.0} %", 100.0 * ASTRAY)
    } else {
        format!("{:.2} %", 100.0 * value)
    }
}

pub(crate) fn faults(faults: &[Fault]) -> String {
    let mut text = String::new();
    for fault in faults {
        let word = match fault.severity() {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Fatal => "fault",
        };
        text.push_str(&format!("{word}: {fault}\n"));
    }
    text
}

/// What is known of a force that the library does not have.
pub(crate) fn residual_force(force: &ResidualForce) -> String {
    let mut text = format!("\nresidual force: {}", force.statement);
    if let Some(expression) = &force.expression {
        text.push_str(&format!(
            "\n\nto begin with, at the end of the model file (then fit, look, and edit):\n\n{}",
            expression.toml.trim_end()
        ));
    }
    text
}

pub(crate) fn comparison(comparison: &Comparison) -> String {
    let rows: Vec<Vec<String>> = comparison
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
    let failures = where_it_fails(&comparison.where_it_fails);
    format!(
        "{}free run: error {} of the standard deviation, fit {:.2} %\n{}{}{failures}",
        faults(&comparison.faults),
        percent(comparison.nrmse),
        comparison.fit_percent,
        held(comparison.observer.as_ref()),
        table(&["signal", "rmse", "nrmse", "fit", "one-step nrmse"], &rows)
    )
}

/// Where a model fails: a line for each statement.
pub(crate) fn where_it_fails(statements: &[Statement]) -> String {
    statements
        .iter()
        .map(|s| format!("\nwhere it fails: {}", s.statement))
        .collect()
}

/// That a free run was held to the measurements, where it was; with a line's end.
pub(crate) fn held(observer: Option<&Held>) -> String {
    observer.map_or_else(String::new, |held| format!("note: {}\n", held.statement))
}

fn estimate((name, p): (&String, &Estimate)) -> Vec<String> {
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

pub(crate) fn fit(fit: &Fit) -> String {
    let rows: Vec<Vec<String>> = fit.parameters.iter().map(estimate).collect();
    let mut text = table(
        &["parameter", "value", "unit", "std error", "95 % interval"],
        &rows,
    );
    // Below the table: beside it, they would make it wider than a terminal.
    let mut verdicts: Vec<(Verdict, Vec<&str>)> = Vec::new();
    for (name, p) in &fit.parameters {
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
    for flat in &fit.flat {
        text.push_str(&format!("\nnot determined: {flat}"));
    }
    if !fit.derived.is_empty() {
        let rows: Vec<Vec<String>> = fit.derived.iter().map(estimate).collect();
        let head = ["from these", "value", "unit", "std error", "95 % interval"];
        text.push_str(&format!("\n\n{}", table(&head, &rows)));
    }
    text.push_str(&format!(
        "\n\nerror on the fitted log: {}{}",
        fit.nrmse_before
            .map_or_else(String::new, |b| format!("{} before, ", percent(b))),
        percent(fit.nrmse_fit)
    ));
    text
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
