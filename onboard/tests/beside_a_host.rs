//! What is aboard beside what a host makes of the same model file by probing it.

#![allow(clippy::unwrap_used, reason = "tests")]

mod twil;

use loopsight_core::{AffineModel, Command, Observation, Observer, Plant, Sample, Tick};
use loopsight_estimators::Rls;
use loopsight_estimators::RlsSettings;
use loopsight_link::{Attachment, Unusable};
use loopsight_model::identification::{Identification, LearningSettings};
use loopsight_model::model::Model;
use loopsight_model::regression::Scheme;
use loopsight_onboard::{AffinePlant, Efforts, Learner, Twil, aboard};
use loopsight_plants::Ddmr;
use nalgebra::Const;
use twil::*;

/// What the robot has beside its plant.
const BESIDE: &str = r#"
[log.measured.linear_velocity]
[log.measured.angular_velocity]

[[effect]]
[effect.coulomb_friction]
at = ["wheel.right", "wheel.left"]
level = 0.9
width = 0.3

[[effect]]
[effect.viscous_friction]
at = ["body.yaw"]
coefficient = 0.4
"#;

/// The levels of the effects are known: aboard they are not learned.
fn model() -> Model {
    let file = format!("{}{BESIDE}", <Ddmr as Plant>::META.example);
    let (mut model, _) = Model::from_toml("model.toml", &file).unwrap();
    let n = model.plant.parameters.len();
    for parameter in &mut model.parameters[n..] {
        parameter.free = false;
    }
    model
}

fn attachments() -> [Attachment; 2] {
    let of = |id: &str, channels: &[u8], values: &[f32]| Attachment {
        id: id.try_into().unwrap(),
        channels: list(channels),
        values: list(values),
    };
    [
        of("coulomb_friction", &[0, 1], &[0.9, 0.3]),
        of("viscous_friction", &[3], &[0.4]),
    ]
}

aboard! {
    /// The Twil in the numbers of a host.
    struct Wide {
        scalar: f64,
        plant: Ddmr,
        effects: library,
        estimator: Rls<f64, Const<3>>,
    }
}

fn efforts() -> Efforts<Wide> {
    Efforts::new(&attachments(), &TRUE).unwrap()
}

/// Places and aims without symmetry, at rest and near it, too.
fn places() -> impl Iterator<Item = ([f64; 2], [f64; 2])> {
    let speeds = [-0.21, -0.013, 0.0, 0.004, 0.17];
    let turns = [-1.1, 0.0, 0.07, 0.9];
    (0..400).map(move |k| {
        let y = [speeds[k % 5], turns[(k / 5) % 4]];
        let r = [speeds[(k / 20) % 5], turns[(k / 100) % 4]];
        (y, r)
    })
}

/// Drift and input matrix are those that a host finds by probing, also where friction takes the
/// direction of a motion that is yet to begin.
#[test]
fn a_control_law_sees_the_same_model() {
    let mut host = model().affine().unwrap();
    // Friction aboard has the digits of a message.
    let bands = [0, 1].map(|i| host.bands()[i]);
    assert!(bands.iter().all(|b| *b > 0.0), "{bands:?}");
    let mut aboard = AffinePlant::<Wide>::new(TRUE, efforts(), bands);
    let mut pushed = 0;
    for (y, r) in places() {
        let (mut f, mut g) = ([[0.0; 2]; 2], [[0.0; 4]; 2]);
        host.aim(&r);
        host.evaluate(&y, &mut f[0], &mut g[0]);
        aboard.aim(&r);
        aboard.evaluate(&y, &mut f[1], &mut g[1]);
        let far = |a: &[f64], b: &[f64]| a.iter().zip(b).any(|(a, b)| (a - b).abs() > 2e-7);
        assert!(!far(&f[0], &f[1]), "{y:?} {r:?}: {f:?}");
        assert!(!far(&g[0], &g[1]), "{y:?} {r:?}: {g:?}");
        pushed += usize::from(f[1][0].abs() > 0.1 && y[0] == 0.0);
    }
    assert!(
        pushed > 10,
        "friction at rest was compensated {pushed} times"
    );
}

/// Both learn the robot from the same samples: the two rules of integration leave the same bias.
#[test]
fn the_same_is_learned() {
    let model = model();
    // Everything is learned from: what is left between the two is how rates are integrated.
    let mut settings = LearningSettings::default();
    for signal in ["linear_velocity", "angular_velocity"] {
        settings.least_excitation.insert(signal.to_owned(), 0.0);
    }
    let rls = RlsSettings::default();
    let mut host = Identification::new(&model, Scheme::Integrated, &rls, &settings, 0.01).unwrap();
    let learning = loopsight_link::Learning {
        forgetting: 1.0,
        initial_covariance: 1e6,
        covariance_limit: 1e6,
        low: list(&[-1e3; 8]),
        high: list(&[1e3; 8]),
        scale: list(&[1.0, 0.1, 0.1, 1.0, 1.0, 0.1, 0.1, 0.1]),
        dead_zone: list(&[0.0; 2]),
        least_excitation: list(&[0.0; 2]),
        window: 200.0,
        certainty_equivalence: false,
    };
    let start = BELIEVED.map(f64::from);
    host.restart(&[&start[..], &[0.9, 0.3, 0.4]].concat());
    let mut aboard = Learner::<Wide>::new(&learning, start, efforts(), false, 0.01).unwrap();
    let mut body = Body::default();
    let mut state = 1u32;
    for index in 0..4000 {
        if index % 30 == 0 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        }
        let sign = |bit: u32| if state >> bit & 1 == 1 { 9.0f32 } else { -9.0 };
        let volts = [sign(30), sign(31)];
        // The yaw of this robot is braked once more: 0.4 of its rate.
        body.yaw_drag = 0.4;
        body.drive(&volts);
        let tick = Tick {
            index,
            time: index as f64 * 0.01,
            period: 0.01,
        };
        let applied = volts.map(f64::from);
        let seen = Observation {
            tick,
            sample: Sample {
                time: tick.time,
                fresh: true,
            },
            measured: &body.x[..2],
            command: &applied,
            applied: &applied,
            outcome: Command::default(),
        };
        host.observe(&seen);
        aboard.observe(&seen);
    }
    // What a straight line between samples makes of an exponential: (K_A T)²/12.
    let bias = (TRUE[0] * 0.01).powi(2) / 12.0;
    for (j, truth) in TRUE.iter().enumerate().take(6) {
        let (there, here) = (host.values()[j], aboard.values()[j]);
        let scale = model.parameters[j].scale().max(truth.abs());
        assert!((there - here).abs() < bias * scale, "{j}: {there} {here}");
        assert!(
            (here - truth).abs() < 2.0 * bias * scale,
            "{j}: {here} {truth}"
        );
    }
}

/// Effects that a robot knows nothing of, or not enough.
#[test]
fn what_cannot_be_compensated_is_refused() {
    let refused = |id: &str, channels: &[u8], values: &[f32]| {
        let attachment = Attachment {
            id: id.try_into().unwrap(),
            channels: list(channels),
            values: list(values),
        };
        Efforts::<Twil>::new(&[attachment], &BELIEVED).err()
    };
    assert_eq!(refused("coulomb_friction", &[0], &[0.9, 0.1]), None);
    assert_eq!(refused("scrub_friction", &[3], &[0.9, 0.1]), None);
    // It needs a channel about the vertical.
    let wrong = refused("scrub_friction", &[0], &[0.9, 0.1]);
    assert_eq!(wrong, Some(Unusable::Channel(0)));
    // Inputs, rates and sensors are no efforts.
    for channel in 4..14 {
        let wrong = refused("constant_force", &[channel], &[0.9]);
        assert_eq!(wrong, Some(Unusable::Channel(0)), "{channel}");
    }
    assert_eq!(
        refused("input_delay", &[6], &[0.1]),
        Some(Unusable::Effect(0))
    );
}
