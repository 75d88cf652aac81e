//! Improving blind: how close the improved model comes to the floor, two effects at once, and
//! small friction.
//!
//! `cargo run --release -p loopsight-tests --example blind_improve -- [floor] [pairs] [small] [backlash wheel_slip …]`
//! `cargo run --release -p loopsight-tests --example blind_improve -- several 3 300 330 [axis]`
//!
//! * `floor`: one effect each (or those that are named); the free-run error of the improved model on an
//!   unseen multi-level recording over the error that counting alone leaves there. Learned from mixed
//!   inputs; what these leave above 1.05 is learned from full voltages both ways, too, and both are said.
//! * `pairs`: two effects hidden at once; both must be named.
//! * `small`: friction of 3 % of full drive, ten seeds.
//! * `several`: so many effects at once, drawn at random with their sizes, for each seed of a range, on a robot that is drawn as
//!   well or named; how many of the improved models leave at most 1.5 times the floor of an unseen recording.

use loopsight_diagnosis::{ImproveSettings, Improvement, Measurements, Work, improve};
use loopsight_hidden::{Experiment, Hidden, Recording, Robot, catalogue, record_with};
use loopsight_model::model::Model;
use loopsight_plants as _;
use loopsight_tests::{Random, WINDINGS};
use rayon::prelude::*;

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
    if let [what, numbers @ ..] = &wanted[..]
        && what == "several"
    {
        let number = |i: usize, or| numbers.get(i).and_then(|w| w.parse().ok()).unwrap_or(or);
        let robot = numbers.get(3).map(String::as_str);
        return several(number(0, 2), number(1, 1)..number(2, 41), robot);
    }
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
fn logs(
    robot: Robot,
    hidden: &[(Hidden, f64)],
    kind: Experiment,
    seed: u64,
) -> Option<(Recording, Recording)> {
    let recorded = |kind, seed| record_with(robot, hidden, kind, seed, WINDINGS).ok();
    Some((
        recorded(kind, seed)?,
        recorded(Experiment::MultiLevel, 500 + seed)?,
    ))
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
            let Some((log, unseen)) = logs(
                Robot::Twil,
                &[(Hidden::CoulombFriction, 0.3)],
                Experiment::Prbs,
                seed,
            ) else {
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
            let Some((log, unseen)) = logs(a.home(), &[(*a, 1.0), (*b, 1.0)], Experiment::Mixed, 7)
            else {
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

/// What an improved model may leave over the floor where several effects are hidden.
const CLOSE: f64 = 1.5;

/// So many effects at once, drawn at random among those of a robot, with half, all and twice of their sizes.
fn several(count: u64, seeds: std::ops::Range<u64>, robot: Option<&str>) {
    println!("{count} effects at once, drawn at random (mixed inputs)");
    let named = Robot::ALL.iter().find(|r| Some(r.name()) == robot);
    let close: Vec<bool> = seeds
        .into_par_iter()
        .filter_map(|seed| {
            let mut random = Random::new(seed);
            let drawn = Robot::ALL[random.below(Robot::ALL.len())];
            let robot = named.copied().unwrap_or(drawn);
            let chosen = drawn_for(robot, count, &mut random);
            let (log, unseen) = logs(robot, &chosen, Experiment::Mixed, seed)?;
            let truth: Vec<String> = (chosen.iter())
                .map(|(effect, size)| format!("{}={size}", effect.id()))
                .collect();
            let name = format!("{seed} {}:{}", robot.name(), truth.join("+"));
            let Some((found, error, floor)) = improved(&log, &unseen) else {
                println!("  FAILED {name}");
                return Some(false);
            };
            let close = error <= CLOSE * floor;
            println!(
                "  {} {name}: {}; {:?}, unseen {:.2} %, floor {:.2} %",
                if close { "close " } else { "FAR   " },
                names(&found),
                found.verdict,
                100.0 * error,
                100.0 * floor
            );
            Some(close)
        })
        .collect();
    println!(
        "at most {CLOSE} times the floor in {} of {}\n",
        close.iter().filter(|close| **close).count(),
        close.len()
    );
}

/// Different effects of a robot, as many as wanted where it has so many, each with a size.
fn drawn_for(robot: Robot, count: u64, random: &mut Random) -> Vec<(Hidden, f64)> {
    let of_robot = catalogue().into_iter().filter(|(of, _)| *of == robot);
    let mut rest: Vec<Hidden> = of_robot.map(|(_, effect)| effect).collect();
    let most = count.min(rest.len() as u64);
    let draw = |_| {
        let effect = rest.swap_remove(random.below(rest.len()));
        (effect, [0.5, 1.0, 2.0][random.below(3)])
    };
    (0..most).map(draw).collect()
}

/// What an improved model may leave over the floor.
const WITHIN: f64 = 1.05;

fn floor(effects: &[Hidden]) {
    println!("improved model on unseen multi-level input over the floor");
    let ratio = |effect: Hidden, kind: Experiment| {
        let (log, unseen) = logs(effect.home(), &[(effect, 1.0)], kind, 3)?;
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
