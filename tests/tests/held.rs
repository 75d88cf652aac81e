//! What cannot be simulated from the inputs alone: a pole held upright by a loop, and a mass that a
//! force pushes to and fro.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a wrong conclusion is how this program fails"
)]

use std::f64::consts::TAU;

use loopsight_core::model::Model;
use loopsight_core::run::Run;
use loopsight_core::simulate::Simulator;
use loopsight_diagnosis::fit::fit;
use loopsight_diagnosis::{Because, Conclusion, FitSettings, compare, diagnose};
use loopsight_tests::Random;

/// Resolution of the cart's encoder, m, and of the pole's, rad.
const RESOLUTION: [f64; 2] = [5e-5, TAU / 4096.0];
const PERIOD: f64 = 0.01;

/// A cart with a pole, its masses `factor` times those of the truth.
fn cart_pole(factor: [f64; 3], effects: &str) -> Model {
    let text = format!(
        "[plant.cart_pole]\ntotal_mass = {}\npole_moment = {}\npole_inertia = {}\n{effects}\n\
         [log.measured]\nposition = {{}}\nangle = {{}}\n\
         velocity = {{ sensor = {{ encoder_counts = {{ counts_per_revolution = {} }} }} }}\n\
         rate = {{ sensor = {{ encoder_counts = {{ counts_per_revolution = {} }} }} }}\n",
        1.2 * factor[0],
        0.06 * factor[1],
        0.024 * factor[2],
        TAU / RESOLUTION[0],
        TAU / RESOLUTION[1],
    );
    Model::from_toml("cart_pole.toml", &text).unwrap().0
}

const COULOMB: &str =
    "[[effect]]\n[effect.coulomb_friction]\nat = [\"cart\"]\nlevel = 0.4\nwidth = 0.002\n";

/// The pole held upright by feedback of all states, from counted angles, while the reference of the
/// cart jumps and a further force shakes it.
fn upright(truth: &Model, seconds: f64, seed: u64) -> Run {
    let mut random = Random::new(seed);
    let mut uniform = move || random.below(1 << 20) as f64 / f64::from(1 << 20) - 0.5;
    let mut fine = truth.clone();
    fine.max_step = 5e-4;
    let values = fine.values();
    let mut simulator = Simulator::new(&fine, &values);
    let mut run = Run {
        n_inputs: 1,
        n_measured: 4,
        ..Run::default()
    };
    simulator.reset(&[0.0, 0.0, 0.02, 0.0], &[0.0]);
    let mut before: Option<[f64; 2]> = None;
    let (mut reference, mut shake) = (0.0, 0.0);
    let phase = [uniform(), uniform()];
    for k in 0..=(seconds / PERIOD).round() as usize {
        if k % 150 == 0 {
            reference = 0.5 * uniform();
        }
        if k % 12 == 0 {
            shake = 6.0 * uniform();
        }
        let counted = [0, 1].map(|i| {
            let exact = simulator.state()[2 * i];
            ((exact / RESOLUTION[i] + phase[i]).round() - phase[i]) * RESOLUTION[i]
        });
        let rate = before.map_or([0.0; 2], |b| [0, 1].map(|i| (counted[i] - b[i]) / PERIOD));
        before = Some(counted);
        // Poles at -2.5 ± 1.5i, -5.6, -7 1/s.
        let force = 14.27 * (counted[0] - reference)
            + 12.98 * rate[0]
            + 63.97 * counted[1]
            + 12.58 * rate[1]
            + shake;
        let time = PERIOD * k as f64;
        run.time.push(time);
        run.inputs.push(force);
        let missing = |v: f64| if k == 0 { f64::NAN } else { v };
        run.measured
            .extend([counted[0], missing(rate[0]), counted[1], missing(rate[1])]);
        simulator.advance(time + PERIOD, &[force]);
    }
    run
}

#[test]
fn study() {
    let truth = cart_pole([1.0; 3], "");
    let names = ["total_mass", "pole_moment", "pole_inertia"];
    let want = [1.2, 0.06, 0.024];
    let mut covered = [0; 3];
    let seeds = 12;
    for seed in 1..=seeds {
        let run = upright(&truth, 30.0, seed);
        let guess = cart_pole([1.25, 0.75, 0.8], "");
        let before = compare(&guess, std::slice::from_ref(&run), &[]);
        match &before {
            Ok(b) => println!("before {} {:?}", b.nrmse, b.held),
            Err(e) => println!("{e}"),
        }
        let t = std::time::Instant::now();
        let found = fit(
            &guess,
            &[run.clone()],
            None,
            &[],
            &FitSettings::default(),
            &|_, _| {},
        )
        .unwrap();
        print!(
            "seed {seed} nrmse {:.4} {:?} {:.0?} ",
            found.nrmse_fit,
            found.comparison.held.as_ref().map(|h| h.horizon_s),
            t.elapsed()
        );
        for (i, name) in names.iter().enumerate() {
            let p = &found.parameters[*name];
            let [low, high] = p.interval95.unwrap();
            let inside = low <= want[i] && want[i] <= high;
            covered[i] += usize::from(inside);
            print!(
                "{name} {:.5} z {:+.2} se {:.1e} ",
                p.value,
                (p.value - want[i]) / p.std_error.unwrap(),
                p.std_error.unwrap() / want[i]
            );
        }
        println!();
    }
    println!("{covered:?} of {seeds}");
    for (text, effects) in [("clean", ""), ("coulomb", COULOMB)] {
        let truth = cart_pole([1.0; 3], effects);
        let run = upright(&truth, 30.0, 5);
        let t = std::time::Instant::now();
        let d = diagnose(
            &cart_pole([1.25, 0.75, 0.8], ""),
            &[run],
            None,
            &[],
            &|_, _| {},
        )
        .unwrap();
        println!(
            "{text} {:?} {:?} nominal {} floor {} {:.0?}",
            d.verdict,
            d.missing,
            d.nominal.nrmse,
            d.floor.nrmse,
            t.elapsed()
        );
        for c in d.candidates.iter().take(5) {
            println!(
                "   {} {:?} {} sig {} {:?}",
                c.place.effect,
                c.place.at,
                c.nrmse,
                c.significance,
                c.indistinguishable_from
                    .iter()
                    .map(|p| &p.effect)
                    .collect::<Vec<_>>()
            );
        }
    }
    let _ = (Because::Unstable, Conclusion::NothingMissing);
}
