//! Diagnoses and improvements for the tests, and the tests of their pages.

use std::collections::BTreeMap;

use loopsight_diagnosis::{
    Advice, Comparison, Conclusion, Diagnosis, EffectAt, Estimate, Explanation, Fit, Improvement,
    ImprovementStep, Level, Method, ParameterVerdict, Statement, Untried,
};
use loopsight_model::model::Model;
use loopsight_plants as _;
use loopsight_recordings::{Fault, FaultKind};

use crate::fixtures::{comparison, context, friction_runs, opened, without_library};
use crate::{Context, diagnosis_page, improvement_page};

const MODEL: &str = "name = \"Twil\"\n[plant.ddmr]\nK_A = -15.146\nK_B = 0.0\nK_C = 0.136\n\
    K_D = -9.573\nK_E = 0.0\nK_F = 0.656\nhalf_track = 0.131\nwheel_radius = 0.05\n\
    [[effect]]\n[effect.coulomb_friction]\nat = [\"wheel.right\", \"wheel.left\"]\nlevel = 0.9\n";

const ALL: [Conclusion; 7] = [
    Conclusion::EffectMissing,
    Conclusion::NothingMissing,
    Conclusion::UnknownEffect,
    Conclusion::DataInsufficient,
    Conclusion::LogFaulty,
    Conclusion::Cancelled,
    Conclusion::NotFitted,
];

fn model(effects: usize) -> Model {
    let mut model = Model::from_toml("model.toml", MODEL).unwrap().0;
    model.effects.truncate(effects);
    model
}

fn place(effect: &str, at: &[&str]) -> EffectAt {
    EffectAt {
        effect: effect.into(),
        at: at.iter().map(|c| (*c).to_owned()).collect(),
    }
}

fn friction() -> EffectAt {
    place("coulomb_friction", &["wheel.right", "wheel.left"])
}

fn explanation(place: EffectAt, nrmse: f64, name: &str) -> Explanation {
    let estimate = Estimate {
        value: 1.2,
        unit: "V".into(),
        std_error: Some(0.01),
        interval95: Some([1.18, 1.22]),
        verdict: ParameterVerdict::Good,
    };
    Explanation {
        entries: None,
        place,
        together_with: None,
        nrmse,
        parameters: BTreeMap::from([(name.to_owned(), estimate)]),
        significance: 41.0,
        indistinguishable_from: vec![],
        note: "the residual jumps".into(),
        implausible: None,
        model: model(1),
        nrmse_fit: 0.02,
    }
}

/// As the library makes them.
pub(crate) fn diagnosis(verdict: Conclusion) -> Diagnosis {
    let refused = matches!(
        verdict,
        Conclusion::LogFaulty | Conclusion::DataInsufficient
    );
    let fault = Fault {
        kind: FaultKind::DeadSensor,
        run: String::new(),
        signal: "angular_velocity".into(),
        detail: "never moves".into(),
    };
    let mut best = explanation(friction(), 0.025, "level");
    best.indistinguishable_from = vec![place("dead_zone", &["input.right"])];
    let others = (0..7).map(|k| {
        explanation(
            place("dead_zone", &["input.right"]),
            0.026 + 0.02 * f64::from(k),
            "threshold",
        )
    });
    let missing = verdict == Conclusion::EffectMissing;
    if !missing {
        best.indistinguishable_from.clear();
    }
    let level = |nrmse| Level {
        nrmse: if refused { f64::NAN } else { nrmse },
    };
    Diagnosis {
        nominal: level(0.14),
        floor: level(0.019),
        verdict,
        missing: missing.then(friction),
        candidates: if refused {
            vec![]
        } else {
            std::iter::once(best).chain(others).collect()
        },
        not_tried: vec![Untried {
            effect: "bridge_coast".into(),
            why: "no input rests at zero between other values".into(),
        }],
        where_it_fails: vec![Statement {
            statement: "73 % of it after changes".into(),
            share_of_squared_error: 0.73,
            signal: "linear_velocity".into(),
        }],
        residual_force: None,
        faults: if verdict == Conclusion::LogFaulty {
            vec![fault]
        } else {
            vec![]
        },
        advice: vec![Advice {
            why: "these data cannot tell".into(),
            experiment: "several levels".into(),
        }],
        observer: None,
        model: (!refused).then(|| model(0)),
        nominal_fit: if refused { f64::NAN } else { 0.1 },
        set_aside: None,
    }
}

/// A fit of the model with friction.
pub(crate) fn fit() -> Fit {
    Fit {
        comparison: comparison(vec![]),
        parameters: crate::fit::tests::parameters(),
        per_run: BTreeMap::new(),
        derived: BTreeMap::new(),
        method: Method::OutputError,
        nrmse_before: None,
        nrmse_fit: 0.02,
        iterations: 3,
        cancelled: false,
        convergence: None,
        flat: vec![],
        known: None,
        model: model(1),
        history: vec![],
    }
}

/// Friction found, then `last`.
pub(crate) fn improvement(last: Conclusion) -> Improvement {
    let best = diagnosis(last).model.is_some().then(fit);
    let step = |added, nrmse_fit, nrmse_test| ImprovementStep {
        round: Some(0),
        entries: None,
        twins: Vec::new(),
        still_open: Vec::new(),
        added,
        nrmse_fit,
        nrmse_test,
    };
    Improvement {
        steps: vec![step(None, 0.1, 0.14), step(Some(friction()), 0.02, 0.025)],
        verdict: last,
        diagnoses: vec![diagnosis(Conclusion::EffectMissing), diagnosis(last)],
        best,
    }
}

/// A comparison of runs of `n` samples, and one that errs nowhere.
pub(crate) fn pair(n: usize) -> (Comparison, Comparison) {
    let before = comparison(friction_runs(2, n));
    let mut after = before.clone();
    for run in &mut after.runs {
        for signal in &mut run.signals {
            signal.free_run.clone_from(&signal.measured);
        }
    }
    after.nrmse = 0.02;
    (before, after)
}

fn page_of(diagnosis: &Diagnosis) -> String {
    let (before, after) = pair(300);
    opened(&diagnosis_page(
        &context(),
        diagnosis,
        Some(&before),
        Some(&after),
    ))
}

#[test]
fn every_conclusion_has_its_sentence() {
    for (verdict, sentence) in ALL.into_iter().zip([
        "The model lacks coulomb_friction at wheel.right and wheel.left.",
        "Nothing is missing from the model.",
        "Something is missing, and no effect of the library explains it.",
        "This log is not enough to judge the model.",
        "The log is faulty, so it says nothing about the model.",
        "The diagnosis was cancelled.",
        "The model could not be fitted.",
    ]) {
        let page = page_of(&diagnosis(verdict));
        assert!(
            page.contains(&format!("<p class=\"headline\">{sentence}</p>")),
            "{verdict:?}"
        );
        assert!(!page.contains("NaN"), "{verdict:?}");
    }
    let mut blind = diagnosis(Conclusion::NothingMissing);
    blind.verdict = Conclusion::DataInsufficient;
    let page = page_of(&blind);
    assert!(
        page.contains("This log cannot show what is missing.")
            && page.contains("is 10.0\u{a0}% on the log and 14.0\u{a0}% on the test log")
    );
}

#[test]
fn every_end_of_an_improvement_has_its_sentence() {
    for (verdict, sentence) in ALL.into_iter().zip([
        "would leave 1.90\u{a0}%: more may be missing",
        "Nothing more is missing: noise and resolution alone would leave 1.90\u{a0}%.",
        "something is still missing, and no effect of the library explains it",
        "The log does not show what is left",
        "The log does not show what is left",
        "The work was cancelled: more may be missing.",
        "The log does not show what is left",
    ]) {
        let page = improvement_page(&context(), &improvement(verdict), None, None);
        let page = opened(&page);
        assert!(page.contains("The model lacked coulomb_friction at wheel.right and wheel.left."));
        assert!(page.contains("falls from 14.0\u{a0}% to 2.50\u{a0}%"));
        assert!(page.contains(sentence), "{verdict:?}");
        assert!(!page.contains("NaN"), "{verdict:?}");
    }
    let none = Improvement {
        steps: vec![],
        verdict: Conclusion::LogFaulty,
        diagnoses: vec![],
        best: None,
    };
    assert!(improvement_page(&context(), &none, None, None).contains("There is no diagnosis."));
}

#[test]
fn a_class_is_named_beside_the_verdict() {
    let page = page_of(&diagnosis(Conclusion::EffectMissing));
    for text in [
        "The data cannot tell coulomb_friction (wheel.right, wheel.left) from dead_zone (input.right)",
        "<span class=\"badge best\">missing</span>",
        "could be this instead",
        "1.200\u{a0}V</td><td class=\"number\">1.180 … 1.220\u{a0}V",
        "w = -level tanh(flow/width)",
        "Several levels.",
        "loopsight experiment examples/twil/model.toml --separate \
         coulomb_friction@wheel.right+wheel.left dead_zone@input.right -o experiment.csv",
        "3 more candidates",
        "with coulomb_friction",
        "\"role\":\"after\"",
        "loopsight add examples/twil/model.toml coulomb_friction --at wheel.right wheel.left -o \
         model_coulomb_friction.toml",
    ] {
        assert!(page.contains(text), "{text}");
    }
}

#[test]
fn the_error_falls_step_by_step() {
    let (before, after) = pair(300);
    let context = Context {
        command: "loopsight improve m.toml l.csv --test t.csv -o best.toml --html x.html".into(),
        ..context()
    };
    let improvement = improvement(Conclusion::NothingMissing);
    let page = improvement_page(&context, &improvement, Some(&before), Some(&after));
    let page = opened(&page);
    for text in [
        "<b>The model as it is</b>",
        "The log does not pin coulomb_friction.level:",
        "<b>+ coulomb_friction</b>",
        "noise and resolution alone, on data not used in the fit: 1.90\u{a0}%",
        "Round 2",
        "Parameters of the best model",
        "loopsight compare best.toml ANOTHER_LOG",
    ] {
        assert!(page.contains(text), "{text}");
    }
    // Only where it was not asked for is there a need to say how to get the model.
    assert!(!page.contains("Write the best model to a file."));
}

#[test]
fn nothing_breaks_out_of_a_finding() {
    let nasty = "</script><img src=x onerror=alert(1)>\"'";
    let mut diagnosis = diagnosis(Conclusion::EffectMissing);
    diagnosis.faults = super::findings::diagnosis(Conclusion::LogFaulty).faults;
    diagnosis.faults[0].detail = nasty.into();
    diagnosis.where_it_fails[0].statement = nasty.into();
    diagnosis.not_tried[0].why = nasty.into();
    diagnosis.advice[0].why = nasty.into();
    diagnosis.advice[0].experiment = nasty.into();
    let estimate = diagnosis.candidates[0].parameters["level"].clone();
    let best = &mut diagnosis.candidates[0];
    best.place = place(nasty, &[nasty]);
    best.note = nasty.into();
    best.indistinguishable_from = vec![place(nasty, &[nasty])];
    best.parameters = BTreeMap::from([(
        nasty.to_owned(),
        Estimate {
            unit: nasty.into(),
            ..estimate
        },
    )]);
    diagnosis.missing = Some(place(nasty, &[nasty]));
    let context = Context {
        model_file: Some(nasty.into()),
        log_file: nasty.into(),
        command: nasty.into(),
        ..context()
    };
    let (before, after) = pair(300);
    let page = diagnosis_page(&context, &diagnosis, Some(&before), Some(&after));
    let mut improvement = improvement(Conclusion::NothingMissing);
    improvement.steps[1].added = Some(place(nasty, &[nasty]));
    improvement.diagnoses[0] = diagnosis;
    improvement.best = None;
    let other = improvement_page(&context, &improvement, Some(&before), Some(&after));
    for page in [without_library(&page), without_library(&other)] {
        assert!(!page.contains("<img"));
        assert_eq!(
            page.matches("<script").count(),
            page.matches("</script>").count()
        );
        assert!(!page.contains("https://") && !page.contains("http://"));
        assert!(!page.contains("src=\"") && !page.contains("url("));
    }
}

#[test]
fn what_is_not_a_number_is_left_out() {
    let mut diagnosis = diagnosis(Conclusion::EffectMissing);
    diagnosis.nominal.nrmse = f64::NAN;
    diagnosis.floor.nrmse = f64::INFINITY;
    diagnosis.where_it_fails[0].share_of_squared_error = f64::NAN;
    let best = &mut diagnosis.candidates[0];
    best.nrmse = f64::NAN;
    best.significance = f64::NAN;
    if let Some(level) = best.parameters.get_mut("level") {
        level.value = f64::NAN;
        level.interval95 = Some([f64::NEG_INFINITY, f64::NAN]);
    }
    let (mut before, mut after) = pair(300);
    for run in &mut before.runs {
        run.signals[0].measured[7] = f64::NAN;
    }
    after.runs.truncate(1);
    after.runs[0].signals.truncate(1);
    let page = diagnosis_page(&context(), &diagnosis, Some(&before), Some(&after));
    let page = opened(&page);
    assert!(page.contains(",null,"));
    assert_eq!(
        page.find("NaN")
            .map(|at| &page[at.saturating_sub(80)..at + 3]),
        None
    );
    // The data of the charts are JSON.
    for chart in page.split("<script type=\"application/gzip\">").skip(1) {
        let text = chart.split("</script>").next().unwrap();
        serde_json::from_str::<serde_json::Value>(text).unwrap();
    }
}

#[test]
fn findings_are_the_same_every_time() {
    let (before, after) = pair(300);
    let pages = || {
        diagnosis_page(&context(), &diagnosis(ALL[0]), Some(&before), Some(&after))
            + &improvement_page(
                &context(),
                &improvement(ALL[1]),
                Some(&before),
                Some(&after),
            )
    };
    assert_eq!(pages(), pages());
}
