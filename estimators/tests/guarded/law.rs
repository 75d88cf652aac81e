//! The guard's law: whatever comes, an estimate stays in its box and explains a sample no worse than the one before.

use loopsight_core::Real;
use loopsight_core::learning::{Guarded, Guards, Range};
use nalgebra::SVector;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

use super::bench::{Any, covariance};

fn config(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        rng_seed: RngSeed::Fixed(20_261_121),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

/// A sample: a direction, what the others are off it, a size, a measurement.
#[derive(Clone, Debug)]
struct Drawn {
    phi: [f64; 3],
    y: f64,
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => -2.0..2.0f64,
        2 => (-1.0..1.0f64, -20..20i32).prop_map(|(m, e)| m * 10f64.powi(e)),
        1 => Just(0.0),
        1 => prop_oneof![
            Just(f64::NAN),
            Just(f64::INFINITY),
            Just(f64::NEG_INFINITY),
            Just(f64::MAX),
            Just(f64::MIN_POSITIVE),
            Just(3e38),
        ],
    ]
}

/// Mostly along one line with little beside it, as of a robot that drives straight ahead; or anything.
fn samples() -> impl Strategy<Value = Vec<Drawn>> {
    let along = (
        -1.0..1.0f64,
        prop::array::uniform3(-0.02..0.02f64),
        -3.0..3.0f64,
    );
    let along = along.prop_map(|(size, beside, y)| Drawn {
        phi: [0, 1, 2].map(|i| size * [1.0, 0.7, -0.4][i] + beside[i]),
        y,
    });
    let any = (prop::array::uniform3(number()), number());
    let any = any.prop_map(|(phi, y)| Drawn { phi, y });
    prop::collection::vec(prop_oneof![3 => along, 1 => any], 1..120)
}

fn guards() -> impl Strategy<Value = Guards> {
    (
        prop_oneof![Just(0.0), 0.0..0.5f64],
        prop_oneof![Just(0.0), 0.001..0.5f64],
        1.0..50.0f64,
    )
        .prop_map(|(dead_zone, least_excitation, window)| Guards {
            dead_zone,
            least_excitation,
            window,
        })
}

/// `y - φᵀθ`, and what its rounding may come to.
fn left<S: Real + Into<f64>>(phi: &[S; 3], y: S, theta: &[S]) -> (f64, f64) {
    let wide = |v: S| -> f64 { v.into() };
    let terms = [0, 1, 2].map(|i| wide(phi[i]) * wide(theta[i]));
    let size = wide(y).abs() + terms.iter().map(|t| t.abs()).sum::<f64>();
    let unit = if S::one() + S::of(1e-10) > S::one() {
        1e-15
    } else {
        1e-6
    };
    (wide(y) - terms.iter().sum::<f64>(), 16.0 * unit * size)
}

fn holds<S: Real + Into<f64>>(
    kind: usize,
    guards: Guards,
    bound: f64,
    samples: &[Drawn],
) -> Result<(), TestCaseError> {
    let range = |start: f64| Range {
        low: S::of(start - bound),
        high: S::of(start + bound),
        scale: S::of(0.5),
    };
    let start = [0.3, -0.2, 1.0];
    let theta = SVector::from(start.map(S::of));
    let mut guard = Guarded::new(Any::<S>::new(kind), theta, &start.map(range), guards).unwrap();
    for (k, sample) in samples.iter().enumerate() {
        let phi = sample.phi.map(S::of);
        let y = S::of(sample.y);
        let before = left(&phi, y, guard.theta());
        let told = guard.update(&phi, y, None);
        let after = left(&phi, y, guard.theta());
        for (theta, start) in guard.theta().iter().zip(start) {
            let Range { low, high, .. } = range(start);
            prop_assert!(
                *theta >= low && *theta <= high,
                "{kind}, {k}: {theta:?} outside"
            );
        }
        if told.withheld.is_none() {
            let (allowed, rounding) = (before.0.abs(), before.1 + after.1);
            prop_assert!(
                after.0.abs() <= allowed + rounding,
                "kind {kind}, sample {k}: {:e} after {:e}, {told:?}",
                after.0,
                before.0
            );
        }
        if kind < 4 {
            let p = covariance(|i, j| guard.covariance(i, j));
            prop_assert!(p.iter().all(|v| v.is_finite()), "kind {kind}, sample {k}");
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(config(1500))]

    #[test]
    fn a_sample_is_explained_no_worse_in_double_precision(
        kind in 0..Any::<f64>::KINDS, guards in guards(), bound in prop_oneof![0.1..20.0f64, Just(1e30)], samples in samples()
    ) {
        holds::<f64>(kind, guards, bound, &samples)?;
    }

    #[test]
    fn a_sample_is_explained_no_worse_in_single_precision(
        kind in 0..Any::<f32>::KINDS, guards in guards(), bound in prop_oneof![0.1..20.0f64, Just(1e30)], samples in samples()
    ) {
        holds::<f32>(kind, guards, bound, &samples)?;
    }
}

/// Two regressors that go together and one of them as good as alone: what the guard masks over-corrects by its
/// correlation with what it does not, and without the law the estimate grows with every sample.
#[test]
fn what_is_masked_does_not_over_correct() {
    for kind in 0..Any::<f64>::KINDS {
        let wide = |start: f64| Range {
            low: start - 1e30,
            high: start + 1e30,
            scale: 1.0,
        };
        let start = [0.0, 0.0, 0.0];
        let guards = Guards {
            least_excitation: 0.3,
            window: 20.0,
            ..Guards::default()
        };
        let mut guard = Guarded::new(
            Any::<f64>::new(kind),
            SVector::from(start),
            &start.map(wide),
            guards,
        )
        .unwrap();
        let mut most = 0.0f64;
        for k in 0..4000 {
            let k = f64::from(k);
            let a = (0.05 * k).sin();
            let slow = 0.2 * (0.0031 * k).sin();
            let phi = [a, 0.95 * a + slow, -0.9 * a + 0.5 * slow * slow];
            guard.update(&phi, phi[0] + 0.5 * a.signum(), None);
            most = guard.theta().iter().fold(most, |m, t| m.max(t.abs()));
        }
        println!("kind {kind}: {most:.3}");
        assert!(most < 100.0, "kind {kind}: {most:e}");
    }
}

#[test]
fn boxes_without_a_finite_value_are_refused() {
    let make = |low: f64, high: f64| {
        let range = Range {
            low,
            high,
            scale: 1.0,
        };
        let start = SVector::from([0.0; 3]);
        Guarded::new(Any::<f64>::new(0), start, &[range; 3], Guards::default()).is_some()
    };
    assert!(make(-1.0, 1.0) && make(f64::NEG_INFINITY, f64::INFINITY) && make(2.0, 2.0));
    assert!(!make(f64::NEG_INFINITY, f64::NEG_INFINITY));
    assert!(!make(f64::INFINITY, f64::INFINITY));
    assert!(!make(f64::NAN, 1.0) && !make(1.0, f64::NAN));
}
