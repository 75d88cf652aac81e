//! Parts of loops as they may stand in a file.

use loopsight_controllers::{FeedbackLinearizingPiSettings, PerChannel, Rule};
use loopsight_drivers::{Limit, Replay, SensorFault, Simulated};
use loopsight_estimators::{Forgetting, RlsSettings};
use loopsight_model::limits::SignalLimits;
use loopsight_model::registry::DriverPart;
use loopsight_model::supervisor::{Supervision, SupervisorSettings};
use proptest::collection::{btree_map, vec};
use proptest::option;
use proptest::prelude::*;
use proptest::sample::select;

use super::{finite, name, seed};

pub(super) fn per_channel() -> impl Strategy<Value = PerChannel> {
    prop_oneof![
        finite().prop_map(PerChannel::All),
        vec(finite(), 0..4).prop_map(PerChannel::Each),
    ]
}

pub(super) fn controller() -> impl Strategy<Value = FeedbackLinearizingPiSettings> {
    let rule = option::of(select(vec![Rule::Paper, Rule::Exact]));
    let channel = || option::of(per_channel());
    (
        channel(),
        channel(),
        channel(),
        channel(),
        rule,
        channel(),
        (option::of(vec(finite(), 0..3)), any::<bool>()),
    )
        .prop_map(
            |(proportional, integral, settling_time_s, damping, rule, limit, more)| {
                let (open_loop_acceleration, feedforward) = more;
                FeedbackLinearizingPiSettings {
                    proportional,
                    integral,
                    settling_time_s,
                    damping,
                    rule,
                    feedforward,
                    limit,
                    open_loop_acceleration,
                }
            },
        )
}

pub(super) fn estimator() -> impl Strategy<Value = RlsSettings> {
    let rule = prop_oneof![
        Just(Forgetting::Constant),
        Just(Forgetting::Variable),
        Just(Forgetting::Directional),
    ];
    let limits = (option::of(finite()), option::of(finite()));
    (finite(), rule, finite(), limits).prop_map(
        |(forgetting, rule, initial_covariance, (least_forgetting, covariance_limit))| {
            RlsSettings {
                forgetting,
                rule,
                least_forgetting,
                initial_covariance,
                covariance_limit,
            }
        },
    )
}

pub(super) fn simulated() -> impl Strategy<Value = Simulated> {
    let limit = option::of(prop_oneof![
        finite().prop_map(Limit::All),
        btree_map(name(), finite(), 0..3).prop_map(Limit::Each),
    ]);
    (
        option::of(name()),
        option::of(finite()),
        btree_map(name(), finite(), 0..3),
        seed(),
        limit,
        any::<bool>(),
        vec(fault(), 0..3),
    )
        .prop_map(
            |(model, step_s, noise, seed, limit, quantize, fault)| Simulated {
                model,
                step_s,
                noise,
                seed,
                limit,
                quantize,
                fault,
            },
        )
}

pub(super) fn fault() -> impl Strategy<Value = SensorFault> {
    let span = (finite(), option::of(finite()));
    prop_oneof![
        (option::of(name()), span.clone()).prop_map(|(of, (start_s, duration_s))| {
            SensorFault::DeadEncoder {
                of,
                start_s,
                duration_s,
            }
        }),
        (name(), span.clone()).prop_map(|(signal, (start_s, duration_s))| SensorFault::Frozen {
            signal,
            start_s,
            duration_s,
        }),
        (finite(), span).prop_map(|(share, (start_s, duration_s))| SensorFault::Stale {
            share,
            start_s,
            duration_s,
        }),
    ]
}

pub(super) fn limits() -> impl Strategy<Value = SignalLimits> {
    (option::of(finite()), option::of(finite()))
        .prop_map(|(magnitude, rate)| SignalLimits { magnitude, rate })
}

pub(super) fn supervisor() -> impl Strategy<Value = Supervision> {
    prop_oneof![
        Just(Supervision::Nobody),
        settings().prop_map(Supervision::By)
    ]
}

fn settings() -> impl Strategy<Value = SupervisorSettings> {
    (
        vec(finite(), 9),
        btree_map(name(), finite(), 0..3),
        btree_map(name(), proptest::array::uniform2(finite()), 0..3),
        any::<u32>(),
    )
        .prop_map(|(numbers, tracking, range, falls)| SupervisorSettings {
            window_s: numbers[0],
            worse: numbers[1],
            innovation: numbers[2],
            innovation_s: numbers[3],
            tracking,
            tracking_share: numbers[4],
            tracking_s: numbers[5],
            range,
            frozen_s: numbers[6],
            stale_s: numbers[7],
            calm_s: numbers[8],
            falls,
        })
}

pub(super) fn driver() -> impl Strategy<Value = Box<dyn DriverPart>> {
    prop_oneof![
        simulated().prop_map(|part| Box::new(part) as Box<dyn DriverPart>),
        (name(), option::of(name())).prop_map(|(recording, run)| {
            Box::new(Replay { recording, run }) as Box<dyn DriverPart>
        }),
    ]
}
