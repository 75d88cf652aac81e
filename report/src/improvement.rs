//! The page of an improvement: the error falling, effect by effect.

use loopsight_diagnosis::{Comparison, Diagnosis, Improvement, ImprovementStep};

use crate::bars::{Line, Scale};
use crate::beside::Names;
use crate::candidates;
use crate::comparison::faults;
use crate::conclusion::conclusion;
use crate::diagnosis::{TERMS, about_candidates, advice, against_measurements, failures, shares};
use crate::fit::estimates;
use crate::html::{escape, identifier, list, text};
use crate::next;
use crate::page::{Context, page, section};
use crate::residual_force::residual_force;
use crate::words::fit::not_determined;
use crate::words::improvement::{added, said};
use crate::words::{error, place};

/// The page of an improvement: the verdict, the error step by step, the model `before` and `after`
/// compared with the same measurements, where it failed, every explanation that was tried, the
/// parameters of the best model, and what to do next.
///
/// `before` is the comparison of the first diagnosis' model, `after` that of
/// [`Improvement::best`]; either may be absent.
pub fn improvement_page(
    context: &Context,
    improvement: &Improvement,
    before: Option<&Comparison>,
    after: Option<&Comparison>,
) -> String {
    let first = improvement.diagnoses.first();
    let last = improvement.diagnoses.last();
    let mut body = conclusion(&said(improvement), improvement.verdict);
    if let Some(first) = first {
        body.push_str(&faults(&first.faults));
    }
    if !improvement.steps.is_empty() {
        body.push_str(&section(
            "The error, step by step",
            "Each step adds the effect that explains most, and fits all parameters again.",
            &steps(&improvement.steps, last),
        ));
    }
    let changed = !added(improvement).is_empty();
    let after = after.filter(|_| changed);
    let names = Names {
        before: "before",
        after: "after",
    };
    if let Some(before) = before {
        body.push_str(&against_measurements(before, after, names));
    }
    let title = if changed {
        "Where it failed"
    } else {
        "Where it fails"
    };
    let statements = first.map_or(&[][..], |d| &d.where_it_fails);
    body.push_str(&failures(title, statements, before, after, names));
    if let (Some(last), true) = (last, changed) {
        let left = shares(&last.where_it_fails);
        if !left.is_empty() {
            body.push_str(&format!(
                "<details><summary>Where the rest of the error lies</summary>{left}</details>\n"
            ));
        }
    }
    body.push_str(&residual_force(
        last.and_then(|d| d.residual_force.as_ref()),
    ));
    body.push_str(&rounds(&improvement.diagnoses));
    if let Some(best) = &improvement.best {
        let all: Vec<_> = best
            .parameters
            .iter()
            .filter(|(_, e)| e.verdict != loopsight_diagnosis::ParameterVerdict::Frozen)
            .collect();
        let flat: Vec<String> = best.flat.iter().map(|f| not_determined(f)).collect();
        body.push_str(&section(
            "Parameters of the best model",
            "They were fitted to the whole log.",
            &(estimates(&all) + &list(&flat)),
        ));
    }
    body.push_str(&advice(&improvement.advice()));
    body.push_str(&section(
        "What to do next",
        "",
        &next::list(&next::after_improvement(context, improvement)),
    ));
    body.push_str(TERMS);
    page(context, &body)
}

/// Bars of the fitted and the unseen error, step by step.
fn steps(steps: &[ImprovementStep], last: Option<&Diagnosis>) -> String {
    let floor = Line {
        name: "noise and resolution alone, on data not used in the fit",
        class: "floor",
        value: last.map_or(f64::NAN, |d| d.floor.nrmse),
    };
    let values = steps.iter().flat_map(|s| [s.nrmse_fit, s.nrmse_test]);
    let usual = steps.first().map_or(f64::NAN, |s| s.nrmse_test);
    let scale = Scale::new(values, usual, &[floor]);
    let mut out = scale.legend(&[
        ("error", "on data not used in the fit"),
        ("seen", "on data used in the fit"),
    ]);
    out.push_str("<div class=\"candidates steps\">");
    for step in steps {
        let (name, at) = match &step.added {
            Some(place) => (format!("+ {}", place.effect), place.at.join(", ")),
            None => ("The model as it is".into(), "fitted again".into()),
        };
        out.push_str(&format!(
            "<div class=\"candidate\"><span class=\"name\"><b>{}</b><br><span class=\"soft\">{}\
             </span></span>{}<span class=\"amount\"><b>{}</b><br><span class=\"soft\">{} in the fit\
             </span></span></div>\n",
            escape(&name),
            identifier(&at),
            scale.bar(&[("error", step.nrmse_test), ("seen", step.nrmse_fit)]),
            text(&error(step.nrmse_test)),
            text(&error(step.nrmse_fit)),
        ));
    }
    out + "</div>\n"
}

/// The explanations that were tried in each round; the first round is open.
fn rounds(diagnoses: &[Diagnosis]) -> String {
    let tried: Vec<&Diagnosis> = diagnoses
        .iter()
        .filter(|d| candidates::were_tried(d))
        .collect();
    let mut body = String::new();
    for (at, diagnosis) in tried.iter().enumerate() {
        let found = match &diagnosis.missing {
            Some(missing) => format!("found {}", place(missing)),
            None => "found no significant effect".into(),
        };
        let open = if at == 0 { " open" } else { "" };
        body.push_str(&format!(
            "<details class=\"round\"{open}><summary><h3>Round {}</h3> <span class=\"soft\">{}</span>\
             </summary>{}</details>\n",
            at + 1,
            escape(&found),
            candidates::candidates(diagnosis)
        ));
    }
    if body.is_empty() {
        return body;
    }
    section("What could be missing", &about_candidates(), &body)
}
