//! Estimators, controllers, drivers, and what a model file itself can define.

use std::collections::BTreeSet;

use loopsight_model::model::Model;
use loopsight_model::registry::{
    BuildError, ControllerPart, DriverContext, DriverPart, EffectPart, EstimatorPart, PartMeta,
    PlantPart, parts, plants, written,
};
use loopsight_model::run::Run;
use loopsight_tests::{recording, twil};

use super::{derivatives_agree, distinct, said, snake_case, unit};

#[derive(Debug, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Example {
    estimator: Option<Box<dyn EstimatorPart>>,
    controller: Option<Box<dyn ControllerPart>>,
    driver: Option<Box<dyn DriverPart>>,
    #[serde(rename = "plant")]
    _plant: Option<Box<dyn PlantPart>>,
    #[serde(rename = "effect")]
    _effect: Option<Box<dyn EffectPart>>,
}

/// The keys that a part's table takes, as the parser itself lists them.
fn accepted(meta: &PartMeta) -> BTreeSet<String> {
    let text = format!("[{}.{}]\nno_such_key = 1\n", meta.role, meta.id);
    let error = toml::from_str::<Example>(&text).unwrap_err();
    let words = error.message().split('`').skip(1).step_by(2);
    let names: Vec<String> = words.map(str::to_owned).collect();
    assert_eq!(
        names.first().map(String::as_str),
        Some("no_such_key"),
        "{} `{}` takes keys it does not know: {error}",
        meta.role,
        meta.id
    );
    names.into_iter().skip(1).collect()
}

#[test]
fn estimators_controllers_and_drivers_keep_their_word() {
    let model = twil();
    let run = recording(&model, 1, true);
    let load_model = |_: &str| -> Result<Model, BuildError> { Ok(twil()) };
    let load_runs = |_: &str, _: &Model| -> Result<Vec<Run>, BuildError> { Ok(vec![run.clone()]) };
    let context = DriverContext {
        model: &model,
        period: 0.01,
        load_model: &load_model,
        load_runs: &load_runs,
        read_column: &|path, _| Err(BuildError::at("path", format!("no {path}"))),
    };
    for meta in parts() {
        let of = says_what_it_takes(meta);
        let example: Example = toml::from_str(meta.example).unwrap();
        let built = match (&example.estimator, &example.controller, &example.driver) {
            (Some(part), None, None) => {
                assert_eq!((meta.role, part.meta().id), ("estimator", meta.id));
                part.build(&[0.0; 3]).map(|_| ())
            }
            (None, Some(part), None) => {
                assert_eq!((meta.role, part.meta().id), ("controller", meta.id));
                part.build(&model, 0.01).map(|_| ())
            }
            (None, None, Some(part)) => {
                assert_eq!((meta.role, part.meta().id), ("driver", meta.id));
                part.build(&context).map(|_| ())
            }
            _ => panic!("{of}: the example holds not one part"),
        };
        built.unwrap_or_else(|error| panic!("{of}: the example does not build: {error}"));
    }
}

/// What the model file itself can define says as much of itself.
#[test]
fn parts_that_a_file_defines_keep_their_word() {
    for meta in written() {
        let of = says_what_it_takes(meta);
        let text = match meta.role {
            "plant" => meta.example.to_owned(),
            _ => {
                let robot = plants().into_iter().find(|p| p.id == "ddmr").unwrap();
                format!("{}\n{}", robot.example, meta.example)
            }
        };
        let (model, _) = Model::from_toml("example", &text).unwrap();
        assert!(model.missing_values().is_empty(), "{of}: the example");
        let id = match meta.role {
            "plant" => model.plant.id,
            _ => model.effects[0].meta.id,
        };
        assert_eq!(id, meta.id);
        let n = model.parameters.len();
        derivatives_agree(&of, model, 0..n);
    }
}

/// What a part says of itself is there, and is what its table takes.
fn says_what_it_takes(meta: &PartMeta) -> String {
    let of = format!("{} `{}`", meta.role, meta.id);
    snake_case(&of, meta.id);
    for (what, text) in [
        ("summary", meta.summary),
        ("equation", meta.equation),
        ("reference", meta.reference),
        ("example", meta.example),
    ] {
        said(&of, what, text);
    }
    distinct(&of, meta.settings.iter().map(|s| s.id));
    for setting in meta.settings {
        let of = format!("{of}, setting `{}`", setting.id);
        snake_case(&of, setting.id);
        said(&of, "doc", setting.doc);
        if !setting.unit.is_empty() {
            unit(&of, setting.unit);
        }
    }
    let documented: BTreeSet<String> = meta.settings.iter().map(|s| s.id.to_owned()).collect();
    assert_eq!(
        accepted(meta),
        documented,
        "{of}: accepted and documented settings"
    );
    of
}
