//! What an experiment promises.

use loopsight_diagnosis::{Plan, Promise};

use super::number::number;
use super::table::table;

/// Experiments that are shown.
const SHOWN: usize = 6;

/// What a plan comes to, sentence by sentence.
pub fn summary(plan: &Plan) -> Vec<String> {
    vec![match plan.verdict {
        Promise::CannotBeSeparated => plan.reason.clone(),
        Promise::Answers | Promise::TooShort => {
            format!("run for {} s: {}", number(plan.duration_s), plan.reason)
        }
    }]
}

/// A plan for a terminal: what to run and why, and the experiments that were compared.
pub fn text(plan: &Plan) -> String {
    let mut text = summary(plan).join("\n");
    if plan.verdict != Promise::CannotBeSeparated {
        let rows: Vec<Vec<String>> = plan
            .considered
            .iter()
            .take(SHOWN)
            .map(|c| vec![c.experiment.clone(), format!("{:.1}", c.detectability)])
            .collect();
        let what = if plan.pins.is_empty() {
            "standard deviations apart"
        } else {
            "value / std error"
        };
        let head = ["experiments compared at one length", what];
        text.push_str(&format!("\n\n{}", table(&head, &rows)));
    }
    text
}
