//! No value that the types of the library `loopsight` allow makes it panic: arrays of odd lengths, times that
//! run backwards, numbers that are none, text that is no TOML.

use std::sync::{Arc, Mutex};

use loopsight::answers::{Answer as _, ImproveAnswer};
use loopsight::{
    AddOptions, Ask, CompareOptions, Early, Experiment, ExperimentOptions, Finding, FitOptions,
    ImproveOptions, Log, Loop, Method, Model, Session, SimulateOptions, explain,
};
use loopsight_report::words::early::line;
use proptest::collection::vec;
use proptest::num::f64::ANY;
use proptest::prelude::*;

const MODEL: &str = "[plant.oscillator]\nstiffness_per_mass = 40.0\ndamping_per_mass = 1.0\n\
    inverse_mass = 2.0\n[log.measured.position]\n";

fn model() -> Model {
    Model::from_toml("spring.toml", MODEL).unwrap_or_else(|e| unreachable!("{e}"))
}

/// Any number, or one of a size that a log has.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![ANY, -10.0..10.0f64, Just(f64::NAN), Just(0.0)]
}

/// Times that increase by fits and starts, sometimes.
fn times() -> impl Strategy<Value = Vec<f64>> {
    prop_oneof![
        vec(number(), 0..40),
        vec(0.001..0.2f64, 0..40).prop_map(|steps| {
            let sum = |t: &mut f64, step: f64| {
                *t += step;
                Some(*t)
            };
            steps.into_iter().scan(0.0, sum).collect()
        }),
    ]
}

/// Pieces of model, loop and experiment files, and of what is none.
fn text() -> impl Strategy<Value = String> {
    let pieces = prop::sample::select(vec![
        "[plant.oscillator]\n",
        "[plant.",
        "stiffness_per_mass = ",
        "duration_s = ",
        "period_s = ",
        "model = \"nowhere.toml\"\n",
        "[driver.simulated]\n",
        "[controller.pid]\n",
        "[inputs]\n",
        "force = { steps = { at = [[0.0, 1.0]] } }\n",
        "[[effect]]\n[effect.coulomb_friction]\nat = [\"mass\"]\n",
        "1e999",
        "-1.0\n",
        "0.5\n",
        "nan\n",
        "\"",
        "]]",
        "\u{0}",
        "ü",
    ]);
    vec(pieces, 0..12).prop_map(|pieces| pieces.concat())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

    #[test]
    fn logs_of_any_arrays_end_with_an_answer_or_an_error(
        time in times(),
        force in vec(number(), 0..40),
        position in vec(number(), 0..40),
        alike in any::<bool>(),
        rows in (0..50usize, 0..50usize),
    ) {
        let n = if alike { time.len().min(force.len()).min(position.len()) } else { usize::MAX };
        let cut = |values: &[f64]| values[..values.len().min(n)].to_vec();
        let log = Log::in_memory("any")
            .column("time", "s", cut(&time))
            .column("force", "N", cut(&force))
            .column("position", "mm", cut(&position))
            .build();
        let Ok(log) = log else { return Ok(()) };
        let _ = (log.runs(), log.rows(), log.columns());
        let _ = Session::new(model(), log.part(rows.0..rows.1));
        if let Ok(session) = Session::new(model(), log) {
            let series = CompareOptions::default().series(true);
            if let Ok(answer) = session.compare(&series) {
                prop_assert!(answer.to_json().is_ok());
            }
            let _ = session.fit(&FitOptions::default().method(Method::Rls));
            let _ = session.fit(&FitOptions::default().max_iterations(3));
        }
    }

    #[test]
    fn any_text_is_read_or_refused_with_its_place(text in text(), value in ANY) {
        let place = |error: loopsight::Error| {
            assert!(!error.message().is_empty());
            let _ = (error.to_string(), error.excerpt().map(|(text, span)| text.get(span)));
        };
        let _ = Log::from_bytes("any.csv", text.as_bytes()).map_err(place);
        let _ = Loop::from_toml("loop.toml", &text).map_err(place);
        let _ = explain(&text).map_err(place);
        let _ = Experiment::from_toml("experiment.toml", &text).map_err(place);
        if let Ok(model) = Model::from_toml("model.toml", &text).map_err(place) {
            let _ = model.with_value("stiffness_per_mass", value).map_err(place);
            let session = Session::of_model(model);
            let _ = session.compare(&CompareOptions::default()).map_err(place);
            let _ = session.add(&AddOptions::new(&text)).map_err(place);
        }
    }
}

#[test]
fn numbers_that_are_none_are_refused_in_options() {
    let session = Session::of_model(model());
    for wrong in [f64::NAN, f64::INFINITY, -1.0, 0.0] {
        let plan = ExperimentOptions::default().ask(Ask::Pin("nothing".to_owned()));
        assert!(session.experiment(&plan).is_err());
        for options in [
            ExperimentOptions::default().limit(wrong),
            ExperimentOptions::default().period_s(wrong),
            ExperimentOptions::default().duration_s(wrong),
        ] {
            assert!(session.experiment(&options).is_err(), "{wrong}");
        }
        let text = format!("duration_s = {wrong:?}\nperiod_s = 0.01\n").replace("NaN", "nan");
        if let Ok(experiment) = Experiment::from_toml("e.toml", &text) {
            assert!(session.simulate(&SimulateOptions::new(experiment)).is_err());
        }
    }
}

/// The error to report is that of the improved model on a log that neither the fits nor the choice saw.
#[test]
fn the_error_to_report_is_that_on_a_log_apart() {
    let folder = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../examples/hidden-effect/oscillator_coulomb_friction"
    );
    let read = |log: &str| Log::read(format!("{folder}/{log}.csv")).unwrap();
    let model = || Model::from_file(format!("{folder}/model.toml")).unwrap();
    let session = || Session::new(model(), read("mixed")).unwrap();
    let options = ImproveOptions::default();
    let apart = session().report(read("multi_level")).unwrap();
    let told = Arc::new(Mutex::new(Vec::new()));
    let heard = Arc::clone(&told);
    let telling = (options.clone()).early(move |early| heard.lock().unwrap().push(early.clone()));
    let (found, without) = (
        apart.improve(&telling).unwrap(),
        session().improve(&options).unwrap(),
    );
    in_order(&told.lock().unwrap(), &found);
    assert!(without.reported.is_none());
    assert_eq!(found.steps, without.steps);
    let reported = found.reported.as_ref().unwrap();
    assert!(found.summary.contains(&reported.sentence()));
    let better = Session::new(found.model().unwrap().clone(), read("multi_level")).unwrap();
    let there = better.compare(&CompareOptions::default()).unwrap();
    assert!((reported.errors.nrmse / there.errors.nrmse - 1.0).abs() < 1e-3);
}

/// What an improvement told before its end, and in which order.
fn in_order(told: &[Early], found: &ImproveAnswer) {
    let first: Vec<&Finding> = (told.iter().filter(|early| early.round == 0))
        .map(|early| &early.finding)
        .collect();
    let [
        Finding::Compared { nrmse, floor },
        Finding::Promised { candidates },
        finalists @ ..,
        Finding::Added(added),
    ] = first.as_slice()
    else {
        unreachable!("{first:?}")
    };
    assert_eq!(*nrmse, found.steps[0].nrmse_test);
    assert!(*floor < 0.1 * nrmse);
    assert!(candidates.len() > 1 && candidates.is_sorted_by_key(|promised| promised.nrmse));
    assert!(candidates[0].nrmse < 0.5 * nrmse);
    let finalists: Vec<_> = finalists
        .iter()
        .map(|finding| match finding {
            Finding::Finalist(fitted) => fitted,
            other => unreachable!("{other:?}"),
        })
        .collect();
    assert!(finalists.len() > 1);
    assert!(finalists.iter().any(|fitted| fitted.place == added.place));
    assert_eq!(added.place.effect, "coulomb_friction");
    let lines: Vec<String> = told.iter().map(line).collect();
    assert!(lines[0].starts_with("without more the model leaves "));
    assert!(lines[1].contains("coulomb_friction (mass) "), "{lines:#?}");
    assert!(
        lines
            .iter()
            .any(|line| line.starts_with("added coulomb_friction (mass): "))
    );
}
