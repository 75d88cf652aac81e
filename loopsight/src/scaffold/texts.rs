//! The other files of a new robot: experiment, loop, README.

use loopsight_core::PlantMeta;

use crate::pace::{Pace, rounded_down};

/// Of an input that is driven, in sizes of its signal: 9 V at a motor.
pub(super) const DRIVE: f64 = 9.0;

/// Of an input at its limit, in sizes of its signal: 12 V at a motor.
const LIMIT: f64 = 12.0;

pub(super) fn quoted(text: &str) -> String {
    // A JSON string is a TOML string.
    serde_json::Value::from(text).to_string()
}

/// Without the digits that are rounding errors of a product.
fn tidy(value: f64) -> f64 {
    format!("{value:.6e}").parse().unwrap_or(value)
}

pub(super) fn experiment_text(meta: &PlantMeta, noise: &[(&str, f64)], pace: Pace) -> String {
    let mut text = format!(
        "# What the robot is driven with, and how it is measured.\nduration_s = {:?}\nperiod_s = {:?}\n\n\
         # Pseudo-random: plus or minus the amplitude, drawn anew every hold_s.\n[inputs]\n",
        pace.duration(),
        pace.period()
    );
    for input in meta.inputs {
        text.push_str(&format!(
            "{} = {{ prbs = {{ amplitude = {:?}, hold_s = {:?}, seed = 1 }} }}   # {}\n",
            input.id,
            tidy(DRIVE * input.size),
            pace.hold(),
            input.unit
        ));
    }
    text.push_str(&format!(
        "\n# The simulated robot: its integration step, and the white noise of its sensors.\n\
         [robot]\nstep_s = {:?}\nseed = 1\n",
        tidy(pace.robot_step())
    ));
    if !noise.is_empty() {
        let noise: Vec<String> = noise
            .iter()
            .map(|(id, s)| format!("{id} = {s:?}"))
            .collect();
        text.push_str(&format!("noise = {{ {} }}\n", noise.join(", ")));
    }
    text
}

pub(super) fn loop_text(
    name: &str,
    meta: &PlantMeta,
    deviations: &[f64],
    pace: Pace,
    learns: bool,
) -> String {
    let limits: Vec<f64> = meta.inputs.iter().map(|i| tidy(LIMIT * i.size)).collect();
    let alike = limits.windows(2).all(|w| w[0] == w[1]);
    let (driver, controller) = match limits.first() {
        Some(limit) if alike => (format!("{limit:?}"), format!("{limit:?}")),
        _ => {
            let named: Vec<String> = meta
                .inputs
                .iter()
                .zip(&limits)
                .map(|(input, limit)| format!("{} = {limit:?}", input.id))
                .collect();
            (format!("{{ {} }}", named.join(", ")), format!("{limits:?}"))
        }
    };
    let (hold, n) = (pace.hold(), meta.controlled.len() as f64);
    let mut text = format!(
        "# A loop: the controller knows model.toml, the robot is simulated from it.\n\
         name = {}\nmodel = \"model.toml\"\nperiod_s = {:?}\nduration_s = {:?}\nlog = \"loop.csv\"\n\n\
         # In place of the robot; a `model` of its own could have what the controller's lacks.\n\
         [driver.simulated]\nstep_s = {:?}\nlimit = {driver}\nseed = 1\n\n\
         # `loopsight explain feedback_linearizing_pi` has all settings.\n\
         [controller.feedback_linearizing_pi]\nsettling_time_s = {:?}\nrule = \"exact\"\nlimit = {controller}\n",
        quoted(&format!("{name} follows its references")),
        pace.period(),
        tidy((6.0 * n + 2.0) * hold),
        tidy(pace.robot_step()),
        tidy(0.8 * hold),
    );
    if learns {
        text.push_str(
            "\n# Watches and learns the parameters; the controller does not use them.\n[estimator.rls]\n",
        );
    }
    text.push_str(
        "\n# What the controlled signals should do: `at` holds [time, value].\n[reference]\n",
    );
    for (i, state) in meta.controlled.iter().enumerate() {
        let signal = &meta.states[*state];
        let height = rounded_down(deviations.get(i).copied().unwrap_or(signal.size));
        let first = 2.0 * i as f64 + 1.0;
        let at = |step: f64| tidy((first + 2.0 * n * step) * hold);
        text.push_str(&format!(
            "{} = {{ steps = {{ at = [[{:?}, {height:?}], [{:?}, {:?}], [{:?}, 0.0]] }} }}   # {}\n",
            signal.id,
            at(0.0),
            at(1.0),
            -height,
            at(2.0),
            signal.unit
        ));
    }
    text
}

/// The name of this program: that of a crate with parts of its own is not `loopsight`.
pub(super) fn program() -> String {
    let path = std::env::args_os().next().map(std::path::PathBuf::from);
    let name = path.and_then(|p| Some(p.file_stem()?.to_string_lossy().into_owned()));
    name.unwrap_or_else(|| "loopsight".to_owned())
}

/// What to type next.
pub(super) fn commands() -> [String; 3] {
    [
        "check model.toml experiment.toml",
        "simulate model.toml experiment.toml -o log.csv",
        "fit model.toml log.csv -o fitted.toml --html fit.html",
    ]
    .map(|rest| format!("{} {rest}", program()))
}

pub(super) fn readme_text(name: &str, meta: &PlantMeta, looped: bool) -> String {
    let mut text = format!(
        "# {name}\n\nA `{}`: {}.\n\n| file | what |\n|---|---|\n\
         | `model.toml` | the model of the robot: every parameter with unit and range |\n\
         | `experiment.toml` | what a simulated robot is driven with |\n",
        meta.id, meta.summary
    );
    if looped {
        text.push_str("| `loop.toml` | a velocity loop with a controller |\n");
    }
    text.push_str(&format!(
        "\nThe next three commands, in this folder:\n\n```sh\n{}\n```\n\n\
         They look the files over, make the log of a simulated robot, and fit the model to it;\n\
         `fit.html` opens in any browser.\n\nThen take a log of your own robot in the place of `log.csv`:\n\n```sh\n\
         {program} compare model.toml log.csv --html compare.html\n\
         {program} diagnose model.toml log.csv --html why.html\n\
         {program} improve model.toml log.csv -o better.toml\n",
        commands().join("\n"),
        program = program()
    ));
    if looped {
        text.push_str(&format!("{} run loop.toml --html run.html\n", program()));
    }
    text.push_str(&format!(
        "```\n\n`{} explain {}` tells what the robot is made of and which effects fit where.\n",
        program(),
        meta.id
    ));
    text
}
