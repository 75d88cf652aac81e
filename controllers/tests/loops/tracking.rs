//! What a better model is worth: tracking errors of the same robot under one controller or another.

use super::*;

/// The robot: dry friction sharper than any model of it, a delay, encoders.
fn robot() -> Model {
    model(&format!(
        "{TWIL}[[effect]]\n[effect.coulomb_friction]\nat = [\"wheel.right\", \"wheel.left\"]\nlevel = 1.5\nwidth = 0.03\n\
         [[effect]]\n[effect.input_delay]\nat = [\"input.right\", \"input.left\"]\ndelay = 0.04\n{ENCODERS}"
    ))
}

/// What a diagnosis finds of it: friction and delay a few per cent off.
fn improved() -> Model {
    model(&format!(
        "{TWIL}[[effect]]\n[effect.coulomb_friction]\nat = [\"wheel.right\", \"wheel.left\"]\nlevel = 1.42\n\
         [[effect]]\n[effect.input_delay]\nat = [\"input.right\", \"input.left\"]\ndelay = 0.0385\n{ENCODERS}"
    ))
}

fn nominal() -> Model {
    model(&format!("{TWIL}{ENCODERS}"))
}

fn drive(controller: &str, believed: &Model) -> Trace {
    let text = format!(
        "period_s = 0.01
model = \"model.toml\"
[driver.simulated]
model = \"robot.toml\"
step_s = 0.001
limit = 12.0
{controller}
[reference]
linear_velocity = {{ sum = [{{ sine = {{ amplitude = 0.08, frequency_hz = 0.13 }} }}, {{ sine = {{ amplitude = 0.04, frequency_hz = 0.31 }} }}] }}
angular_velocity = {{ sum = [{{ sine = {{ amplitude = 0.4, frequency_hz = 0.17 }} }}, {{ sine = {{ amplitude = 0.2, frequency_hz = 0.41 }} }}] }}
"
    );
    run(&text, believed, &robot(), 3000)
}

/// The least errors (m/s, rad/s) over a grid of designs, each signal on its own: as good as a
/// controller of this kind can be tuned here.
fn best(designs: impl Iterator<Item = String>) -> [f64; 2] {
    designs.fold([f64::INFINITY; 2], |best, design| {
        let trace = drive(&design, &nominal());
        [0, 1].map(|i| best[i].min(trace.rms(i, 500)))
    })
}

/// The same design, with the effects in the model file or without; and the best that PID control and
/// model reference adaptive control can do without them.
#[test]
fn an_improved_model_tracks_twice_as_well() {
    let design = "[controller.feedback_linearizing_pi]
settling_time_s = 0.45
feedforward = true
limit = 12.0
";
    let of = |trace: Trace| [0, 1].map(|i| trace.rms(i, 500));
    let before = of(drive(design, &nominal()));
    let after = of(drive(design, &improved()));
    let pid = best([0.025, 0.03, 0.035, 0.04, 0.05].iter().flat_map(|lambda| {
        [0.5, 1.0, 2.0].map(|slower| {
            // Skogestad's rule, with the integral faster and slower.
            let gain = |g: f64| 1.0 / (g * (lambda + 0.005));
            let (v, omega) = (gain(0.272), gain(1.312));
            format!(
                "[controller.pid]\nproportional = [{v}, {omega}]\nintegral = [{}, {}]\nlimit = 12.0\n",
                v * 15.146 / slower,
                omega * 9.573 / slower
            )
        })
    }));
    let mrac = best([0.1, 0.15, 0.2, 0.3].iter().flat_map(|settling| {
        [2.0, 5.0, 10.0, 20.0].map(|adaptation| {
            format!(
                "[controller.mrac]\nsettling_time_s = {settling}\nadaptation = {adaptation}\nlimit = 12.0\n"
            )
        })
    }));
    for i in 0..2 {
        println!(
            "{}: nominal {:.5}, improved {:.5}, best PID {:.5}, best MRAC {:.5}",
            ["m/s", "rad/s"][i],
            before[i],
            after[i],
            pid[i],
            mrac[i]
        );
        assert!(after[i] < 0.5 * before[i]);
        assert!(after[i] < 0.7 * pid[i].min(mrac[i]));
    }
}

/// With a friction that is overrated the loop pushes too hard, and still does not chatter at rest.
#[test]
fn compensated_friction_does_not_chatter() {
    let level = |level: f64| {
        model(&format!(
            "{TWIL}[[effect]]\n[effect.coulomb_friction]\nat = [\"wheel.right\", \"wheel.left\"]\nlevel = {level}\n\
             width = 0.03\n{ENCODERS}"
        ))
    };
    let loop_file = "period_s = 0.01
model = \"model.toml\"
[driver.simulated]
model = \"robot.toml\"
step_s = 0.001
noise = { linear_velocity = 0.002, angular_velocity = 0.01 }
[controller.feedback_linearizing_pi]
settling_time_s = 0.45
[reference]
linear_velocity = { steps = { at = [[0.5, 0.1], [3.0, 0.0]] } }
";
    // From command to command, mean over the time at the reference and at rest.
    let restless = |believed: &Model| {
        let trace = run(loop_file, believed, &level(1.0), 1000);
        [150..300, 500..1000].map(|range| {
            let steps = trace.applied[range]
                .windows(2)
                .map(|w| (w[1][0] - w[0][0]).abs());
            let (sum, count) = steps.fold((0.0, 0), |(s, n), c| (s + c, n + 1));
            sum / f64::from(count)
        })
    };
    let (without, with) = (restless(&level(1e-9)), restless(&level(1.3)));
    println!("V from tick to tick: without {without:.3?}, with {with:.3?}");
    assert!(
        (0..2).all(|i| with[i] < 1.1 * without[i]),
        "{without:?} {with:?}"
    );
}

/// An eight with friction and delay in the way: the pose as it really is, from the robot's own.
#[test]
fn an_eight_is_followed() {
    let text = |effects: &str| {
        format!(
            "{TWIL}{effects}{INSTANT}position_x = {{ sensor = \"instantaneous\" }}\n\
             position_y = {{ sensor = \"instantaneous\" }}\n"
        )
    };
    let effects = |level: f64, delay: f64| {
        format!(
            "[[effect]]\n[effect.coulomb_friction]\nat = [\"wheel.right\", \"wheel.left\"]\nlevel = {level}\n\
             [[effect]]\n[effect.input_delay]\nat = [\"input.right\", \"input.left\"]\ndelay = {delay}\n"
        )
    };
    let robot = model(&text(&effects(1.5, 0.04)));
    let (nominal, improved) = (model(&text("")), model(&text(&effects(1.42, 0.0385))));
    let path = loopsight_controllers::Path::FigureEight {
        length_m: 1.6,
        width_m: 0.8,
        lap_s: 40.0,
    };
    // Distance from where the path is, rms from the tick `from` on; `start` as in the settings.
    let off = |believed: &Model, velocity: &str, start: [f64; 3], from: usize| {
        let loop_file = format!(
            "period_s = 0.01
model = \"model.toml\"
[driver.simulated]
model = \"robot.toml\"
step_s = 0.001
limit = 12.0
[controller.trajectory]
path = {{ figure_eight = {{ length_m = 1.6, width_m = 0.8, lap_s = 40.0 }} }}
start = {start:?}
[controller.trajectory.velocity.{velocity}
limit = 12.0
"
        );
        let trace = run(&loop_file, believed, &robot, 4500);
        let (sin, cos) = start[2].sin_cos();
        let squares = trace.measured.iter().enumerate().skip(from).map(|(k, y)| {
            let goal = path.at(0.01 * k as f64, 1.0).position;
            let x = start[0] + cos * y[2] - sin * y[3] - goal[0];
            let y = start[1] + sin * y[2] + cos * y[3] - goal[1];
            x * x + y * y
        });
        (squares.sum::<f64>() / (4500 - from) as f64).sqrt()
    };
    let law = "feedback_linearizing_pi]\nsettling_time_s = 0.45";
    let (before, after) = (
        off(&nominal, law, [0.0; 3], 0),
        off(&improved, law, [0.0; 3], 0),
    );
    let pid = off(&nominal, "pid]\nclosed_loop_time_s = 0.035", [0.0; 3], 0);
    println!("off the eight: nominal {before:.4} m, improved {after:.4} m, PID {pid:.4} m");
    assert!(after < 0.5 * before && after < 0.7 * pid);
    let beside = off(&improved, law, [-0.1, 0.11, 0.5], 2000);
    println!("20 s after a start beside it {beside:.4} m");
    assert!(beside < 2.0 * after);
}

/// Samples that get lost are predicted over, where there is a predictor.
#[test]
fn lost_samples_are_predicted_over() {
    let of = |fault: &str| {
        let law = "[controller.feedback_linearizing_pi]\nsettling_time_s = 0.45\nlimit = 12.0";
        let trace = drive(&format!("{fault}\n{law}"), &improved());
        [0, 1].map(|i| trace.rms(i, 500))
    };
    let (whole, lossy) = (of(""), of("fault = [{ stale = { share = 0.05 } }]"));
    println!("tracking {whole:.5?}, with one sample in twenty lost {lossy:.5?}");
    assert!((0..2).all(|i| lossy[i] < 1.2 * whole[i]));
}
