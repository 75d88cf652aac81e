//! Effects of one's own that a diagnosis tries: `[[candidate]]`.

use loopsight::{Experiment, ImproveOptions, Model, Session, SimulateOptions};
use loopsight_tests::repository;

const CANDIDATE: &str = "[[candidate]]\n[candidate.expression]\n";

fn example(name: &str) -> String {
    let folder = repository().join("examples/own-states");
    std::fs::read_to_string(folder.join(name)).unwrap()
}

fn model(text: &str) -> Model {
    Model::from_toml("model.toml", text).unwrap()
}

/// It is named before all that the library has, and stands in the improved file with what was fitted; without it in the
/// model, the model is the plain one.
#[test]
fn a_clutch_that_the_file_proposes_is_found() {
    let experiment = Experiment::from_toml("e.toml", &example("experiment_clutch.toml")).unwrap();
    let robot = Session::of_model(model(&example("clutch.toml")));
    let made = robot.simulate(&SimulateOptions::new(experiment)).unwrap();
    let file = model(&example("clutch_candidate.toml"));
    assert!(file.effects().next().is_none());
    let session = Session::new(file, made.log().clone()).unwrap();
    let found = session.improve(&ImproveOptions::default()).unwrap();
    let added: Vec<_> = found
        .steps
        .iter()
        .filter_map(|s| s.added.as_ref())
        .collect();
    assert_eq!(added.len(), 1);
    assert_eq!(added[0].effect, "clutch");
    let text = found.model().unwrap().to_toml();
    assert!(
        text.contains("[[effect]]") && !text.contains("candidate"),
        "{text}"
    );
    let improved = model(text);
    let value = |name: &str| improved.value(name).unwrap();
    assert!((value("clutch.grip") - 0.3).abs() < 2e-3 && (value("clutch.k") - 5.0).abs() < 0.05);
}

/// What is wrong with a candidate is said where it stands.
#[test]
fn a_candidate_says_what_it_lacks() {
    let plant = "[plant.dc_axis]\n[log.measured.speed]\n";
    let at = "at = [\"shaft\"]\nforce = \"-c * tanh(flow / s)\"\n";
    let own = "[candidate.expression.parameters]\nc = { unit = \"V\" }\ns = { value = 0.1, unit = \"rad/s\" }\n";
    let named = |name: &str| format!("{CANDIDATE}name = \"{name}\"\n{at}{own}");
    assert!(Model::from_toml("m.toml", &format!("{plant}{}", named("dry"))).is_ok());
    for (text, words) in [
        (
            "[[candidate]]\n[candidate.coulomb_friction]\nat = [\"shaft\"]\n".to_owned(),
            ["m.toml:4:", "an effect of the library"],
        ),
        (format!("{CANDIDATE}{at}{own}"), ["m.toml:4:", "`name`"]),
        (
            named("coulomb_friction"),
            ["m.toml:5:", "name of an effect"],
        ),
        (
            named("dry") + &named("dry"),
            ["m.toml:13:", "another candidate"],
        ),
        (
            named("dry").replace("value = 0.1, ", ""),
            ["m.toml:10:", "`s` has no value"],
        ),
        (
            named("dry").replace("flow", "flaw"),
            ["m.toml:7:", "did you mean `flow`?"],
        ),
        (
            named("dry").replace("shaft", "shift"),
            ["m.toml:6:", "did you mean `shaft`?"],
        ),
    ] {
        let error = Model::from_toml("m.toml", &format!("{plant}{text}")).unwrap_err();
        let said = error.to_string();
        assert!(words.iter().all(|w| said.contains(w)), "{said}\n{words:?}");
    }
}
