//! The explanations that were tried, best first, with the evidence for each.

use loopsight_diagnosis::{Conclusion, Diagnosis, Estimate, Explanation};
use loopsight_model::registry;

use crate::bars::{Line, Scale};
use crate::html::{escape, identifier, table, text};
use crate::words::diagnosis::{found, significance};
use crate::words::{error, place, quantity, rounded, with_error};

/// Explanations that are there at once; the others unfold.
const SHOWN: usize = 5;

/// The lines that errors of a diagnosis are compared with.
pub(crate) fn lines(diagnosis: &Diagnosis) -> [Line; 2] {
    [
        Line {
            name: "the model as it is",
            class: "nominal",
            value: diagnosis.nominal.nrmse,
        },
        Line {
            name: "noise and resolution alone",
            class: "floor",
            value: diagnosis.floor.nrmse,
        },
    ]
}

/// Whether effects were tried. Where nothing is missing, it may be that none was worth a fit.
pub(crate) fn were_tried(diagnosis: &Diagnosis) -> bool {
    !diagnosis.candidates.is_empty() || diagnosis.verdict == Conclusion::NothingMissing
}

/// All explanations of a diagnosis.
pub(crate) fn candidates(diagnosis: &Diagnosis) -> String {
    let all = &diagnosis.candidates;
    if all.is_empty() {
        return "<p>None promised to explain more than noise does.</p>\n".into();
    }
    let scale = Scale::new(
        all.iter().map(|c| c.nrmse),
        diagnosis.nominal.nrmse,
        &lines(diagnosis),
    );
    let believed = found(diagnosis);
    let rows: Vec<String> = all
        .iter()
        .enumerate()
        .map(|(at, c)| row(at, c, believed, &scale))
        .collect();
    let (shown, more) = rows.split_at(rows.len().min(SHOWN));
    let all_bars = (
        "error",
        "error with the effect added, on data not used in the fit",
    );
    let found_bars = ("found", "the same, for what explains these data");
    let mut out = match believed {
        Some(_) => scale.legend(&[all_bars, found_bars]),
        None => scale.legend(&[all_bars]),
    };
    out.push_str(&format!("<div class=\"candidates\">{}", shown.concat()));
    if !more.is_empty() {
        out.push_str(&format!(
            "<details class=\"more\"><summary>{} more candidates</summary>{}</details>",
            more.len(),
            more.concat()
        ));
    }
    out + "</div>\n"
}

fn row(
    at: usize,
    explanation: &Explanation,
    believed: Option<&Explanation>,
    scale: &Scale,
) -> String {
    let (badge, bar) = match believed {
        Some(best) if best.place == explanation.place => {
            ("<span class=\"badge best\">missing</span>", "found")
        }
        Some(best) if best.indistinguishable_from.contains(&explanation.place) => (
            "<span class=\"badge\">could be this instead</span>",
            "found",
        ),
        _ => ("", "error"),
    };
    let short: Vec<String> = explanation
        .parameters
        .iter()
        .map(|(name, e)| format!("<span>{}</span>", in_short(name, e)))
        .collect();
    let both = || std::iter::once(&explanation.place).chain(&explanation.together_with);
    let effects: Vec<&str> = both().map(|place| place.effect.as_str()).collect();
    let places: Vec<String> = both().map(|place| place.at.join(", ")).collect();
    let open = if at == 0 && believed.is_some() {
        " open"
    } else {
        ""
    };
    format!(
        "<details class=\"candidate\"{open}><summary><span class=\"name\"><b>{}</b> {badge}<br>\
         <span class=\"soft\">{}</span></span>{}<span class=\"amount\"><b>{}</b><br>\
         <span class=\"soft\">significance {}</span></span>\
         <span class=\"short\">{}</span></summary>{}</details>\n",
        identifier(&effects.join(" + ")),
        identifier(&places.join(" + ")),
        scale.bar(&[(bar, explanation.nrmse)]),
        text(&error(explanation.nrmse)),
        text(&significance(explanation.significance)),
        short.join(" "),
        about(explanation),
    )
}

/// `level 1.20 ± 0.02 V`, as HTML.
fn in_short(name: &str, e: &Estimate) -> String {
    let (value, _) = with_error(e.value, e.std_error.unwrap_or(f64::NAN));
    let value = match e.interval95 {
        Some([low, high]) if low.is_finite() && high.is_finite() => {
            format!("{value}\u{a0}±\u{a0}{}", rounded((high - low) / 2.0, 2))
        }
        _ => value,
    };
    format!("{} {}", identifier(name), text(&quantity(&value, &e.unit)))
}

/// The parameters and what the library knows of the effect.
fn about(explanation: &Explanation) -> String {
    let mut out = String::from("<div class=\"about-effect\">");
    if !explanation.parameters.is_empty() {
        out.push_str(&parameters(explanation));
    }
    let meta = registry::effects()
        .into_iter()
        .find(|meta| meta.id == explanation.place.effect);
    let mut items = Vec::new();
    if let Some(meta) = meta {
        items.push(("What it is", escape(meta.summary)));
    }
    items.push(("How it shows", text(&explanation.note)));
    if let Some(meta) = meta {
        items.push(("What helps", escape(meta.remedy)));
        items.push((
            "Equation",
            format!("<code>{}</code>", escape(meta.equation)),
        ));
        items.push(("From", escape(meta.reference)));
    }
    if !explanation.indistinguishable_from.is_empty() {
        let others: Vec<String> = explanation
            .indistinguishable_from
            .iter()
            .map(place)
            .collect();
        items.push(("Could also be", escape(&others.join("; "))));
    }
    out.push_str("<dl>");
    for (term, what) in items.iter().filter(|(_, what)| !what.is_empty()) {
        out.push_str(&format!("<dt>{term}</dt><dd>{what}</dd>"));
    }
    out + "</dl></div>"
}

fn parameters(explanation: &Explanation) -> String {
    let rows: Vec<Vec<String>> = explanation
        .parameters
        .iter()
        .map(|(name, e)| {
            let error = e.std_error.unwrap_or(f64::NAN);
            let interval = match e.interval95 {
                Some([low, high]) => quantity(
                    &format!(
                        "{} … {}",
                        with_error(low, error).0,
                        with_error(high, error).0
                    ),
                    &e.unit,
                ),
                None => "-".into(),
            };
            vec![
                identifier(name),
                text(&quantity(&with_error(e.value, error).0, &e.unit)),
                text(&interval),
                escape(e.verdict.text()),
            ]
        })
        .collect();
    table(
        &["parameter", "value", "95 % interval", "what the data say"],
        &[false, true, true, false],
        &rows,
    )
}
