//! Plants and effects as expressions in a model file beside the same in Rust.

use std::hint::black_box;

use loopsight_model::model::Model;
use loopsight_model::simulate::Simulator;
use loopsight_model::{Dual, variable};

use super::robot::STEPS;
use super::{PAPER, in_turns};

const FRICTION: &str = "
[[effect]]
[effect.coulomb_friction]
at = [\"wheel.right\", \"wheel.left\"]
level = 0.9
width = 0.2
";

const OWN_FRICTION: &str = "
[[effect]]
[effect.expression]
at = [\"wheel.right\", \"wheel.left\"]
force = \"-c * tanh(flow / s)\"
parameters = { c = 0.9, s = 0.2 }
";

const AXIS: &str = "[plant.dc_axis]\nK_A = -4.0\nK_C = 3.0\n";

const OWN_AXIS: &str = "[plant.expression.states]
speed = { unit = \"rad/s\", rate = \"K_A * speed + K_C * (voltage + shaft) + load\" }
angle = { unit = \"rad\", rate = \"speed\" }
[plant.expression.inputs]
voltage = { unit = \"V\" }
[plant.expression.channels]
shaft = { unit = \"V\", flow = \"speed\" }
load = { unit = \"rad/s^2\", flow = \"speed\" }
[plant.expression.parameters]
K_A = -4.0
K_C = 3.0
";

/// Plants and effects as expressions in a model file beside the same in Rust.
pub(super) fn expressions(ratios: bool) {
    let path = loopsight_tests::repository().join("examples/expressions/robot.toml");
    let robot = std::fs::read_to_string(path).expect("the example is there");
    let measured = robot.find("\n# Velocities").unwrap_or(robot.len());
    let robot = &robot[..measured];
    let model = |text: &str| {
        Model::from_toml("model.toml", text)
            .expect("the model is right")
            .0
    };
    for (what, own, library) in [
        ("an axis, two states", OWN_AXIS.to_owned(), AXIS.to_owned()),
        ("the robot, six states", robot.to_owned(), PAPER.to_owned()),
        (
            "the robot with friction at both wheels",
            format!("{PAPER}{OWN_FRICTION}"),
            format!("{PAPER}{FRICTION}"),
        ),
    ] {
        let models = [model(&own), model(&library)];
        let nu = models[0].plant.inputs.len();
        fn drive<S: loopsight_model::registry::HostReal>(
            simulator: &mut Simulator<'_, S>,
            nu: usize,
            calls: usize,
        ) {
            simulator.reset(&[S::of(0.0); 6][..simulator.state().len()], &[0.0; 2][..nu]);
            for k in 0..calls / STEPS {
                let level = if (k / 50).is_multiple_of(2) {
                    9.0
                } else {
                    -5.0
                };
                let volts = [level, -0.6 * level];
                simulator.advance(black_box((k + 1) as f64 * 0.01), black_box(&volts[..nu]));
            }
            black_box(simulator.state());
        }
        let [mut a, mut b] = models
            .each_ref()
            .map(|m| Simulator::<f64>::new(m, &m.values()));
        drive(&mut a, nu, 1024);
        drive(&mut b, nu, 1024);
        for (a, b) in a.state().iter().zip(b.state()) {
            assert!((a - b).abs() < 1e-9, "{what}: {a} {b}");
        }
        let [mut dual, mut library_dual] = models.each_ref().map(|m| {
            let values = m.values().into_iter().enumerate();
            let values: Vec<Dual> = values.map(|(i, v)| variable(v, i)).collect();
            Simulator::<Dual>::new(m, &values)
        });
        if ratios {
            println!("one RK4 step of {what} (ratio to the last line; target: 5)");
            in_turns(
                4_096,
                &mut [
                    ("as expressions", &mut |calls| drive(&mut a, nu, calls)),
                    ("in Rust", &mut |calls| drive(&mut b, nu, calls)),
                ],
            );
            println!("the same with derivatives by all parameters");
            in_turns(
                4_096,
                &mut [
                    ("as expressions", &mut |calls| drive(&mut dual, nu, calls)),
                    ("in Rust", &mut |calls| drive(&mut library_dual, nu, calls)),
                ],
            );
        } else {
            drive(&mut dual, nu, 16);
            drive(&mut library_dual, nu, 16);
        }
    }
}
