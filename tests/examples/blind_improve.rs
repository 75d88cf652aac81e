//! Improving blind: how close the improved model comes to the floor, two effects at once, and
//! small friction.
//!
//! `cargo run --release -p loopsight-tests --example blind_improve -- [floor] [pairs] [small] [backlash wheel_slip …]`
//!
//! * `floor`: one effect each (or those that are named); the free-run error of the improved model on an
//!   unseen multi-level recording over the error that counting alone leaves there. Learned from mixed
//!   inputs; what these leave above 1.05 is learned from full voltages both ways, too, and both are said.
//! * `pairs`: two effects hidden at once; both must be named.
//! * `small`: friction of 3 % of full drive, ten seeds.

use loopsight_diagnosis::{ImproveSettings, Improvement, Measurements, Work, improve};
use loopsight_hidden::{Experiment, Hidden, Recording, record_with};
use loopsight_model::model::Model;
use loopsight_plants as _;
use rayon::prelude::*;

/// Windings of a motor with an ironless rotor, s.
const WINDINGS: f64 = 1e-4;

const PAIRS: [(Hidden, Hidden); 12] = [
    (Hidden::CoulombFriction, Hidden::InputDelay),
    (Hidden::CoulombFriction, Hidden::BatterySag),
    (Hidden::CoulombFriction, Hidden::GainAsymmetry),
    (Hidden::CoulombFriction, Hidden::ActuatorLag),
    (Hidden::CoulombFriction, Hidden::GravitySlope),
    (Hidden::CoulombFriction, Hidden::EncoderRipple),
    (Hidden::ScrubFriction, Hidden::InputDelay),
    (Hidden::QuadraticDrag, Hidden::InputOffset),
    (Hidden::GainAsymmetry, Hidden::SensorDelay),
    (Hidden::TorqueRipple, Hidden::CoulombFriction),
    (Hidden::WheelRadiusMismatch, Hidden::CoulombFriction),
    (Hidden::SensorOffset, Hidden::InputDelay),
];

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let effects: Vec<Hidden> = Hidden::ALL
        .iter()
        .copied()
        .filter(|e| wanted.iter().any(|w| w == e.id()))
        .collect();
    let all = wanted.is_empty();
    let does = |what: &str| all || wanted.iter().any(|w| w == what);
    if does("small") {
        small();
    }
    if does("pairs") {
        pairs();
    }
    if does("floor") || !effects.is_empty() {
        floor(if effects.is_empty() {
            Hidden::ALL
        } else {
            &effects
        });
    }
}

/// A log to learn from and a multi-level one that nothing is fitted to.
fn logs(hidden: &[(Hidden, f64)], kind: Experiment, seed: u64) -> Option<(Recording, Recording)> {
    let robot = hidden.first()?.0.home();
    let log = record_with(robot, hidden, kind, seed, WINDINGS).ok()?;
    let unseen = record_with(robot, hidden, Experiment::MultiLevel, 500 + seed, WINDINGS).ok()?;
    Some((log, unseen))
}

/// Improves on `log` alone; the error of the best model on `unseen`, and its floor.
fn improved(log: &Recording, unseen: &Recording) -> Option<(Improvement, f64, f64)> {
    let (model, _) = Model::from_toml("hidden", &log.model_toml).ok()?;
    let runs = [log.run.clone()];
    let found = improve(
        &model,
        &Measurements::new(&runs),
        &ImproveSettings::default(),
        &Work::quiet(),
    )
    .ok()?;
    let best = &found.best.as_ref()?.model;
    let error = loopsight_diagnosis::compare(
        best,
        &Measurements::new(std::slice::from_ref(&unseen.run)),
        &Work::quiet(),
    )
    .ok()?
    .nrmse;
    let floor = unseen.floor();
    Some((found, error, floor))
}

/// What was added, each with what the data could not tell from it.
fn added(found: &Improvement) -> Vec<Vec<String>> {
    found
        .diagnoses
        .iter()
        .filter_map(|d| {
            d.missing.as_ref()?;
            let best = d.candidates.first()?;
            let mut class = vec![best.place.effect.clone()];
            class.extend(best.indistinguishable_from.iter().map(|p| p.effect.clone()));
            Some(class)
        })
        .collect()
}

fn names(found: &Improvement) -> String {
    found
        .steps
        .iter()
        .filter_map(|s| s.added.as_ref())
        .map(|p| format!("{}@{}", p.effect, p.at.join("+")))
        .collect::<Vec<_>>()
        .join(", ")
}

fn small() {
    println!("friction of 0.27 V (3 % of 9 V), 25 s of encoder data, ten seeds");
    let found: Vec<bool> = (1..=10u64)
        .into_par_iter()
        .map(|seed| {
            let Some((log, unseen)) =
                logs(&[(Hidden::CoulombFriction, 0.3)], Experiment::Prbs, seed)
            else {
                return false;
            };
            let Some((found, error, floor)) = improved(&log, &unseen) else {
                return false;
            };
            let right = added(&found)
                .first()
                .is_some_and(|c| c.iter().any(|e| e == "coulomb_friction"));
            println!(
                "  seed {seed}: {} {}; unseen {:.2} %, floor {:.2} %",
                if right { "found" } else { "MISSED" },
                names(&found),
                100.0 * error,
                100.0 * floor
            );
            right
        })
        .collect();
    println!(
        "found in {} of {}\n",
        found.iter().filter(|f| **f).count(),
        found.len()
    );
}

fn pairs() {
    println!("two effects at once (mixed inputs)");
    let named: Vec<bool> = PAIRS
        .par_iter()
        .map(|(a, b)| {
            let Some((log, unseen)) = logs(&[(*a, 1.0), (*b, 1.0)], Experiment::Mixed, 7) else {
                return false;
            };
            let Some((found, error, floor)) = improved(&log, &unseen) else {
                return false;
            };
            let classes = added(&found);
            let has = |id: &str| classes.iter().any(|c| c.iter().any(|e| e == id));
            let last = |id: &str| {
                let places = found.steps.iter().filter_map(|s| s.added.as_ref());
                places.into_iter().any(|p| p.effect == id)
            };
            let both = [a.id(), b.id()].iter().all(|id| has(id) || last(id));
            println!(
                "  {} {} + {}: {}; unseen {:.2} %, floor {:.2} %",
                if both { "both  " } else { "MISSED" },
                a.id(),
                b.id(),
                names(&found),
                100.0 * error,
                100.0 * floor
            );
            both
        })
        .collect();
    println!(
        "both named in {} of {}\n",
        named.iter().filter(|f| **f).count(),
        named.len()
    );
}

/// What an improved model may leave over the floor.
const WITHIN: f64 = 1.05;

fn floor(effects: &[Hidden]) {
    println!("improved model on unseen multi-level input over the floor");
    let ratio = |effect: Hidden, kind: Experiment| {
        let (log, unseen) = logs(&[(effect, 1.0)], kind, 3)?;
        let (found, error, floor) = improved(&log, &unseen)?;
        println!(
            "  {:22} {:6} {:.3}  ({:.2} % / {:.2} %)  {}",
            effect.id(),
            kind.name(),
            error / floor,
            100.0 * error,
            100.0 * floor,
            names(&found)
        );
        Some(error / floor)
    };
    let ratios: Vec<[Option<f64>; 2]> = effects
        .par_iter()
        .map(|effect| {
            let mixed = ratio(*effect, Experiment::Mixed);
            let within = mixed.is_some_and(|r| r <= WITHIN);
            let hard = (!within).then(|| ratio(*effect, Experiment::Prbs));
            [mixed, hard.flatten()]
        })
        .collect();
    let within = |r: &Option<f64>| r.is_some_and(|r| r <= WITHIN);
    println!(
        "at most {WITHIN} times the floor in {} of {} learned from mixed inputs, in {} from those or from full voltages\n",
        ratios.iter().filter(|r| within(&r[0])).count(),
        ratios.len(),
        ratios.iter().filter(|r| r.iter().any(within)).count()
    );
}
