//! Long work that is cancelled: it ends at once, and keeps what it has found.
//!
//! "At once" is counted, not timed: a plant counts how often its equation is evaluated, cancels at one
//! of these evaluations, and counts on.

#![allow(
    clippy::unwrap_used,
    reason = "helpers of tests: a failure is the test's failure"
)]

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use loopsight_core::{Derived, Parameter, Plant, PlantMeta, Real};
use loopsight_diagnosis::fit;
use loopsight_diagnosis::{
    CancelToken, Cancelled, CompareError, Conclusion, Diagnosis, ExperimentLimits, FitError,
    FitSettings, ImproveSettings, Measurements, Method, Progress, Question, QuestionError, Work,
    compare, diagnose, experiment, improve, residual_force,
};
use loopsight_drivers::{Simulated, simulate_inputs};
use loopsight_model::declare_plant;
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_plants::DcAxis;
use loopsight_tests::{Random, prbs};

/// How often the equation was evaluated, and when the work is to be cancelled.
static COUNT: AtomicU64 = AtomicU64::new(0);
static CANCEL_AT: AtomicU64 = AtomicU64::new(u64::MAX);
/// How many evaluations came since: on a busy machine the thread that cancels may have to wait before it does.
static SINCE: AtomicU64 = AtomicU64::new(0);
static CANCELLED: AtomicBool = AtomicBool::new(false);
static TOKEN: Mutex<Option<CancelToken>> = Mutex::new(None);
/// One test at a time counts.
static COUNTING: Mutex<()> = Mutex::new(());

/// An axis that counts.
#[derive(Clone, Copy, Debug)]
struct Counted;

const INNER: PlantMeta = <DcAxis as Plant>::META;
const PARAMETERS: [Parameter; 3] = [
    INNER.parameters[0],
    INNER.parameters[1],
    INNER.parameters[2],
];

impl Plant for Counted {
    const META: PlantMeta = PlantMeta {
        id: "counted_axis",
        example: "[plant.counted_axis]\nK_A = -2.0\nK_C = 8.0\n",
        parameters: &PARAMETERS,
        parameterizations: &[],
        ..INNER
    };
    const DERIVED: &'static [Derived] = &[];

    fn derivative<S: Real>(x: &[S; 2], u: &[S; 1], w: &[S; 2], p: &[S; 3]) -> [S; 2] {
        if COUNT.fetch_add(1, Ordering::Relaxed) + 1 == CANCEL_AT.load(Ordering::Relaxed) {
            let token = TOKEN.lock().unwrap_or_else(PoisonError::into_inner);
            token.as_ref().unwrap().cancel();
            CANCELLED.store(true, Ordering::Relaxed);
        } else if CANCELLED.load(Ordering::Relaxed) {
            SINCE.fetch_add(1, Ordering::Relaxed);
        }
        DcAxis::derivative(x, u, w, p)
    }

    fn output<S: Real>(index: usize, x: &[S; 2], u: &[S; 1], p: &[S; 3]) -> S {
        DcAxis::output(index, x, u, p)
    }
}

declare_plant!(Counted, "counted_axis");

const AXIS: &str = r#"
name = "axis"
[plant.counted_axis]
K_A = -2.5
K_C = 7.0
[log]
time = "t"
[log.inputs.voltage]
column = "V"
[log.measured.speed]
column = "w"
"#;

const FRICTION: &str = r#"
[[effect]]
[effect.coulomb_friction]
at = ["shaft"]
level = 1.5
"#;

fn axis(k_a: f64, k_c: f64, more: &str) -> Model {
    let text = AXIS
        .replace("K_A = -2.5", &format!("K_A = {k_a:?}"))
        .replace("K_C = 7.0", &format!("K_C = {k_c:?}"));
    Model::from_toml("axis.toml", &format!("{text}{more}"))
        .unwrap()
        .0
}

/// A model of the axis without friction, and somewhat off.
fn rough() -> Model {
    axis(-2.5, 7.0, "")
}

/// Eight seconds of an axis with dry friction.
fn log() -> Run {
    let truth = axis(-2.0, 8.0, FRICTION);
    let time: Vec<f64> = (0..=800).map(|k| 0.01 * f64::from(k)).collect();
    let settings = Simulated {
        seed: 3,
        quantize: false,
        noise: [("speed".to_owned(), 0.05)].into(),
        ..Simulated::default()
    };
    simulate_inputs(&truth, &settings, &time, &prbs(&truth, 5.0, 3, &time)).unwrap()
}

fn counting() -> MutexGuard<'static, ()> {
    COUNTING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What `work` returns when it is cancelled at the `at`-th evaluation, and how many came after that.
fn cancelled_at<T>(at: u64, work: impl Fn(&Work<'_>) -> T) -> (T, u64) {
    let token = CancelToken::new();
    *TOKEN.lock().unwrap() = Some(token.clone());
    COUNT.store(0, Ordering::Relaxed);
    SINCE.store(0, Ordering::Relaxed);
    CANCELLED.store(false, Ordering::Relaxed);
    CANCEL_AT.store(at, Ordering::Relaxed);
    let result = work(&Work::quiet().stopped_by(&token));
    CANCEL_AT.store(u64::MAX, Ordering::Relaxed);
    (result, SINCE.load(Ordering::Relaxed))
}

/// Most evaluations after a cancellation: a few samples of the simulation in each thread, of which one of this log has 800.
/// A sample takes four steps of four evaluations, 64 times as many where friction is sharpest, and twice those where steps
/// of half the length are compared.
fn few() -> u64 {
    (300 + 2 * 64 * 16) * rayon::current_num_threads() as u64
}

/// Cancels `work` at a random instant of each of so many parts of its length, and looks at what it returns.
fn at_random<T>(seed: u64, times: usize, work: impl Fn(&Work<'_>) -> T, look: impl Fn(T)) {
    let (_, all) = cancelled_at(u64::MAX, |w| drop(work(w)));
    assert_eq!(all, 0);
    let length = COUNT.load(Ordering::Relaxed);
    let mut random = Random::new(seed);
    for part in 0..times {
        let share = (part as f64 + random.share()) / times as f64;
        let at = 1 + (share * (length - 1) as f64) as u64;
        let (result, after) = cancelled_at(at, &work);
        assert!(after <= few(), "{after} evaluations after {at} of {length}");
        look(result);
    }
}

fn error_of(model: &Model, run: &Run) -> f64 {
    let runs = std::slice::from_ref(run);
    compare(model, &Measurements::new(runs), &Work::quiet())
        .unwrap()
        .nrmse
}

#[test]
fn a_comparison_ends() {
    let _one = counting();
    let (model, runs) = (rough(), [log()]);
    let work = |w: &Work<'_>| compare(&model, &Measurements::new(&runs), w);
    at_random(1, 8, work, |result| {
        assert_eq!(result.unwrap_err(), CompareError::Cancelled(Cancelled));
    });
}

#[test]
fn a_fit_keeps_the_best_so_far() {
    let _one = counting();
    let (model, run) = (rough(), log());
    let plain = error_of(&model, &run);
    let kept = AtomicU64::new(0);
    for method in [Method::OutputError, Method::Rls] {
        let settings = FitSettings {
            method,
            ..FitSettings::default()
        };
        let runs = std::slice::from_ref(&run);
        let work = |w: &Work<'_>| fit(&model, &Measurements::new(runs), &settings, w);
        at_random(2, 12, work, |result| match result {
            Err(error) => assert!(matches!(error, FitError::Cancelled(_)), "{error}"),
            Ok(fit) => {
                kept.fetch_add(1, Ordering::Relaxed);
                assert!(fit.cancelled);
                let json = serde_json::to_value(&fit).unwrap();
                assert_eq!(json["cancelled"], true);
                let error = error_of(&fit.model, &run);
                if method == Method::OutputError {
                    assert!(error < 1.001 * plain, "{error} {plain}");
                    // A comparison finds the initial state again, and a better one.
                    let share = error / fit.nrmse_fit;
                    assert!((0.9..1.0001).contains(&share), "{share}");
                }
            }
        });
    }
    assert!(kept.load(Ordering::Relaxed) > 5);
}

/// What a cancelled diagnosis has is in order.
fn sane(diagnosis: &Diagnosis, run: &Run) {
    assert_eq!(diagnosis.verdict, Conclusion::Cancelled);
    assert_eq!(diagnosis.missing, None);
    serde_json::to_value(diagnosis).unwrap();
    match &diagnosis.model {
        Some(model) => assert!(error_of(model, run) < 1.0 && diagnosis.nominal.nrmse < 1.0),
        None => assert!(diagnosis.candidates.is_empty()),
    }
    for candidate in &diagnosis.candidates {
        assert!(candidate.nrmse.is_finite() && !candidate.parameters.is_empty());
        assert!(error_of(&candidate.model, run).is_finite());
    }
}

#[test]
fn a_diagnosis_keeps_what_was_judged() {
    let _one = counting();
    let (model, run) = (rough(), log());
    let runs = std::slice::from_ref(&run);
    let work = |w: &Work<'_>| diagnose(&model, &Measurements::new(runs), w).unwrap();
    let found = work(&Work::quiet());
    assert_eq!(found.verdict, Conclusion::EffectMissing);
    let (fitted, judged) = (AtomicU64::new(0), AtomicU64::new(0));
    at_random(3, 10, work, |diagnosis| {
        sane(&diagnosis, &run);
        fitted.fetch_add(u64::from(diagnosis.model.is_some()), Ordering::Relaxed);
        judged.fetch_add(diagnosis.candidates.len() as u64, Ordering::Relaxed);
    });
    assert!(fitted.into_inner() > 5 && judged.into_inner() > 10);
}

#[test]
fn an_improvement_keeps_its_finished_steps() {
    let _one = counting();
    let (model, run) = (rough(), log());
    let runs = std::slice::from_ref(&run);
    let work = |w: &Work<'_>| {
        improve(
            &model,
            &Measurements::new(runs),
            &ImproveSettings::default(),
            w,
        )
        .unwrap()
    };
    let steps = AtomicU64::new(0);
    at_random(4, 10, work, |improvement| {
        assert_eq!(improvement.verdict, Conclusion::Cancelled);
        assert_eq!(improvement.best.is_some(), !improvement.steps.is_empty());
        if let Some(best) = &improvement.best {
            // Its fit may be done, and only what is still open not be known.
            assert!(error_of(&best.model, &run) < 1.0);
        }
        steps.fetch_max(improvement.steps.len() as u64, Ordering::Relaxed);
    });
    assert!(steps.into_inner() > 1);
}

#[test]
fn an_experiment_and_a_residual_force_end() {
    let _one = counting();
    let (model, runs) = (rough(), [log()]);
    let limits = ExperimentLimits {
        limit: 6.0,
        period: 0.01,
        duration: Some(10.0),
    };
    let plan = |w: &Work<'_>| experiment(&model, &Question::All, &limits, w);
    at_random(5, 6, plan, |result| {
        assert_eq!(result.unwrap_err(), QuestionError::Cancelled(Cancelled));
    });
    let force = |w: &Work<'_>| residual_force(&model, &runs, w);
    at_random(6, 6, force, |result| {
        assert_eq!(result.unwrap_err(), CompareError::Cancelled(Cancelled));
    });
}

#[test]
fn progress_comes_in_stages_that_end() {
    let _one = counting();
    let (model, runs) = (rough(), [log()]);
    let told: Mutex<Vec<Progress>> = Mutex::new(Vec::new());
    let report = |progress: &Progress| told.lock().unwrap().push(*progress);
    diagnose(&model, &Measurements::new(&runs), &Work::reporting(&report)).unwrap();
    let told = told.into_inner().unwrap();
    assert!(told.iter().all(|p| p.done <= p.total && p.round == 0));
    let mut stages: Vec<&str> = told.iter().map(|p| p.stage.text()).collect();
    stages.dedup();
    assert_eq!(
        stages,
        [
            "fitting the model",
            "ranking candidates",
            "trying candidates",
            "fitting the best"
        ]
    );
}

/// Ctrl-C in the middle of long work: what was found is printed, and the exit status says that it is not all.
#[test]
#[cfg(unix)]
fn ctrl_c_ends_a_diagnosis_with_what_was_found() {
    use std::process::{Command, Stdio};
    use std::time::Duration;

    let folder = loopsight_tests::repository().join("examples/hidden-effect/coulomb_friction");
    // How soon the work has begun depends on the machine; before that, the signal ends the process.
    let cut = [200, 400, 800, 1600].into_iter().find_map(|wait| {
        let child = Command::new(env!("CARGO_BIN_EXE_loopsight-under-test"))
            .current_dir(&folder)
            .args(["improve", "model.toml", "prbs.csv"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(wait));
        let id = child.id().to_string();
        let sent = Command::new("kill").args(["-INT", &id]).status().unwrap();
        let output = child.wait_with_output().unwrap();
        (sent.success() && output.status.code() == Some(1)).then_some(output)
    });
    let said = cut.unwrap();
    let errors = String::from_utf8_lossy(&said.stderr).into_owned();
    assert!(
        errors.contains("interrupted") || errors.contains("cancelled"),
        "{errors}"
    );
}
