//! What the answers say in words: the sentences of [`loopsight_report::words`], on answers.

use loopsight_diagnosis::tracking::StepResponse;
use loopsight_diagnosis::{Comparison, Diagnosis, Fit, Improvement, Plan};
pub(crate) use loopsight_report::words as report;
#[cfg(feature = "cli")]
pub(crate) use report::hundredths as percent;
use report::run::{Learned, RegressionFigures, RunFigures, Tracked};
pub(crate) use report::{error, faults, number};

use crate::answers::{ReferenceStep, RunAnswer, Tracking};

/// How well a model agrees with a log.
pub(crate) fn comparison(comparison: &Comparison) -> String {
    report::comparison::summary(comparison).join(" ")
}

/// What a fit came to.
pub(crate) fn fit(fit: &Fit) -> String {
    report::fit::summary(fit).join(" ")
}

/// That a fit did not converge, and why; none where it did.
pub(crate) fn not_converged(fit: &Fit) -> Option<String> {
    report::fit::not_converged(fit)
}

/// The conclusion of a diagnosis.
pub(crate) fn diagnosis(diagnosis: &Diagnosis) -> String {
    report::diagnosis::summary(diagnosis).join(" ")
}

/// The conclusion of an improvement.
pub(crate) fn improvement(improvement: &Improvement) -> String {
    report::improvement::summary(improvement).join(" ")
}

/// What an experiment is and why.
pub(crate) fn plan(plan: &Plan) -> String {
    report::plan::summary(plan).join(" ")
}

/// What a run came to.
pub(crate) fn run(run: &RunAnswer) -> String {
    report::run::summary(&figures(run)).join(" ")
}

/// How a signal followed the steps of its reference, where it had any.
pub(crate) fn reached(tracking: &Tracking) -> Option<String> {
    let response = |step: &ReferenceStep| StepResponse {
        at_s: step.at_s,
        from: step.from,
        to: step.to,
        settling_time_s: step.settling_time_s,
        overshoot_percent: step.overshoot_percent,
    };
    let steps: Vec<StepResponse> = tracking.steps.iter().map(response).collect();
    report::run::followed_steps(&tracking.id, &steps)
}

/// The figures of a run that words are made of.
pub(crate) fn figures(run: &RunAnswer) -> RunFigures<'_> {
    let tracked = run.tracking.iter().map(|t| Tracked {
        id: &t.id,
        unit: &t.unit,
        rms_error: t.rms_error,
        largest_error: t.largest_error,
    });
    let learned = run.estimates.iter().map(|p| Learned {
        name: &p.name,
        unit: &p.unit,
        start: p.start,
        value: p.value,
        interval95: p.interval95,
    });
    let regressions = run.innovation.iter().enumerate().map(|(i, innovation)| {
        let learning = run.learning.get(i);
        RegressionFigures {
            id: &innovation.id,
            unit: &innovation.unit,
            innovation_rms: innovation.rms,
            excitation_rms: run.excitation.get(i).and_then(|e| e.rms),
            learned: learning.map_or(f64::NAN, |l| l.taught_share),
            withheld: learning.map_or_else(Vec::new, |l| {
                l.withheld_share
                    .iter()
                    .map(|(why, share)| (*why, *share))
                    .collect()
            }),
        }
    });
    RunFigures {
        ticks: run.ticks,
        period_s: run.duration_s / run.ticks.max(1) as f64,
        end: &run.end,
        saturated: run.saturated_share,
        stale: run.stale_share,
        fallen_back: run.fallen_back_share,
        timing: run.timing.as_ref().map(|t| loopsight_report::Timing {
            jitter_s: t.jitter_s,
            latest_s: t.latest_s,
            missed: t.missed,
            longest_s: t.longest_s,
        }),
        tracking: tracked.collect(),
        learned: learned.collect(),
        regressions: regressions.collect(),
        events: run
            .events
            .iter()
            .map(|e| (e.time_s, e.what.as_str()))
            .collect(),
        notes: &run.notes,
    }
}

/// How a robot took what it was told.
#[cfg(feature = "serial")]
pub(crate) fn sent(answer: &crate::answers::SendAnswer) -> String {
    let ends = match (answer.runs, answer.interrupted) {
        (true, _) => "drives on with it",
        (false, true) => "took it; it was driving, and came to rest",
        (false, false) => "took it, and is at rest",
    };
    format!(
        "the robot at {} ({}, every {} s) {ends}",
        answer.line,
        answer.plant,
        number(answer.period_s)
    )
}
