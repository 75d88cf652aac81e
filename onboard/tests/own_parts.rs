//! A firmware with an effect and an estimator of its own.

#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

mod twil;

use loopsight_core::{
    Effect, EffectMeta, Estimator, Innovation, Parameter, PlaceKind, Reading, Real, Role,
    declare_effect,
};
use loopsight_link::*;
use loopsight_onboard::{Efforts, OnboardEstimator, Session, aboard};
use loopsight_plants::Ddmr;
use twil::*;

/// A tyre that sinks into soft ground: `w = -level ω/(|ω| + half)`, half of the level at the speed `half`.
struct SoftGround;

impl Effect for SoftGround {
    const META: EffectMeta = EffectMeta {
        id: "soft_ground",
        summary: "rolling on soft ground",
        equation: "w = -level flow/(|flow| + half)",
        places: &[PlaceKind::Effort],
        reads: &[Role::Flow],
        parameters: &[
            Parameter::new("level", "c", "channel", "effort at high speed"),
            Parameter::new("half", "h", "flow", "speed of half the level"),
        ],
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 2]) -> S {
        let [level, half] = *p;
        let speed = at.get(Role::Flow);
        -level * speed / (speed.abs() + half)
    }
}

declare_effect!(SoftGround, "soft_ground");

/// Normalised gradient: `θ <- θ + g e φ/(h + φᵀφ)`, with `g` a fiftieth and `h` a hundredth.
#[derive(Clone)]
struct Gradient<const N: usize> {
    theta: [f32; N],
}

impl<const N: usize> Estimator<f32> for Gradient<N> {
    fn update(&mut self, regressor: &[f32], measurement: f32) -> Innovation<f32> {
        let products = regressor.iter().zip(&self.theta).map(|(phi, t)| phi * t);
        let innovation = measurement - products.sum::<f32>();
        let square: f32 = regressor.iter().map(|phi| phi * phi).sum();
        for (theta, phi) in self.theta.iter_mut().zip(regressor) {
            *theta += 0.02 * innovation * phi / (0.01 + square);
        }
        Innovation {
            innovation,
            relative_variance: 1.0,
            accepted: true,
        }
    }

    fn theta(&self) -> &[f32] {
        &self.theta
    }

    fn covariance(&self, _row: usize, _column: usize) -> f32 {
        f32::NAN
    }

    fn set_theta(&mut self, theta: &[f32]) {
        if let Ok(theta) = theta.try_into() {
            self.theta = theta;
        }
    }

    fn reset(&mut self, theta: &[f32]) {
        self.set_theta(theta);
    }
}

impl<const N: usize> OnboardEstimator<f32> for Gradient<N> {
    const PARAMETERS: usize = N;

    fn new(_settings: &Learning) -> Option<Self> {
        Some(Self { theta: [0.0; N] })
    }
}

aboard! {
    /// A Twil on soft ground.
    struct Tractor {
        plant: Ddmr,
        effects: library + [SoftGround],
        estimator: Gradient<3>,
    }
}

/// Instead of the library's effects, not beside them.
mod only_its_own {
    use super::*;

    aboard! {
        /// A Twil that knows soft ground and nothing else.
        pub(crate) struct Plough {
            plant: Ddmr,
            effects: [SoftGround],
            estimator: Gradient<3>,
        }
    }
}

const SESSION: u32 = 7;

fn on_soft_ground() -> Configuration {
    Configuration {
        effects: list(&[Attachment {
            id: "soft_ground".try_into().unwrap(),
            channels: list(&[0, 1]),
            values: list(&[0.9, 0.5]),
        }]),
        ..configuration()
    }
}

/// Drives a robot for `ticks`; what it does in each.
fn driven<R>(configuration: Configuration, ticks: u32) -> Vec<Act>
where
    R: loopsight_onboard::Parts<Scalar = f32>,
{
    let mut robot = Session::<R, _>::new(PERIOD_US, ());
    let mut acts = Vec::new();
    let mut send = |request: &Request| {
        let mut said = Vec::new();
        for byte in frame(request) {
            robot.take(byte, &mut |reply| said.push(reply.clone()));
        }
        said
    };
    send(&hello(SESSION));
    let answer = send(&configure(SESSION, configuration));
    assert!(
        matches!(answer[..], [Reply::Configured { .. }]),
        "{answer:?}"
    );
    let mut body = Body::default();
    let mut measured = [0.0; 2];
    for tick in 0..ticks {
        match &send(&Request::Step(step(SESSION, tick, measured)))[..] {
            [Reply::Act(act)] => {
                measured = body.drive(&act.command);
                acts.push(act.clone());
            }
            other => panic!("tick {tick}: {other:?}"),
        }
    }
    acts
}

#[test]
fn an_effect_of_ones_own_is_evaluated_by_its_own_equation() {
    let efforts = Efforts::<Tractor>::new(&on_soft_ground().effects, &BELIEVED).unwrap();
    let [half_track, radius] = [BELIEVED[6], BELIEVED[7]];
    for [v, omega] in [[0.1, 0.0], [-0.03, 0.4], [0.0, -0.9]] {
        let w = efforts.at(&[v, omega]);
        for (i, sign) in [1.0, -1.0].into_iter().enumerate() {
            let speed = (v + sign * half_track * omega) / radius;
            let expected = -0.9 * speed / (speed.abs() + 0.5);
            assert!((w[i] - expected).abs() < 1e-6, "{i}: {} {expected}", w[i]);
        }
    }
}

/// The first command that moves the robot is larger by about what the ground takes.
#[test]
fn an_effect_of_ones_own_is_compensated() {
    let moves = (0..).find(|t| reference(*t)[0] != 0.0).unwrap();
    let [with, without] = [true, false].map(|compensated| {
        let mut configuration = on_soft_ground();
        configuration.learning = None;
        if !compensated {
            configuration.effects.clear();
        }
        driven::<Tractor>(configuration, moves + 1).pop().unwrap()
    });
    for (with, without) in with.command.iter().zip(&without.command) {
        let more = with - without;
        assert!((0.3..0.9).contains(&more), "{more}");
    }
}

/// Turning is what the reference excites most: damping and gain of the yaw rate come at least half of the way
/// from what is believed to what is true.
#[test]
fn an_estimator_of_ones_own_learns() {
    let mut configuration = configuration();
    configuration.effects = on_soft_ground().effects;
    configuration.effects[0].id = "coulomb_friction".try_into().unwrap();
    configuration.effects[0].values = list(&FRICTION.map(|v| v as f32));
    let acts = driven::<Tractor>(configuration, 10_000);
    let learned = &acts[acts.len() - 1].parameters;
    for j in [3, 5] {
        let far = |value: f32| (f64::from(value) - TRUE[j]).abs();
        let (at_first, now) = (far(BELIEVED[j]), far(learned[j]));
        assert!(now < 0.5 * at_first, "{j}: {}", learned[j]);
    }
}

#[test]
fn a_robot_refuses_what_is_not_compiled_in() {
    let mut robot = Line::default();
    robot.send(&hello(SESSION));
    let said = robot.send(&configure(SESSION, on_soft_ground()));
    let unknown = Reason::Configuration(Unusable::Effect(0));
    assert!(matches!(said[..], [Reply::Stopped { reason, .. }] if reason == unknown));

    let acts = driven::<only_its_own::Plough>(on_soft_ground(), 3);
    assert_eq!(acts.len(), 3);
    let mut robot = Session::<only_its_own::Plough, _>::new(PERIOD_US, ());
    let mut said = Vec::new();
    for request in [hello(SESSION), configure(SESSION, configuration())] {
        said.clear();
        for byte in frame(&request) {
            robot.take(byte, &mut |reply| said.push(reply.clone()));
        }
    }
    assert!(matches!(said[..], [Reply::Stopped { reason, .. }] if reason == unknown));
}
