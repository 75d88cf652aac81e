//! Mistakes in expressions, with their places.

use std::fmt::Write as _;

use loopsight_model::model::{Model, ModelError};

use super::{AXIS, OWN_FRICTION};

/// What is wrong, where, and what would be right; one line each.
pub(super) fn shown(texts: &[String]) -> String {
    let mut all = String::new();
    for text in texts {
        match Model::from_toml("m", text) {
            Err(ModelError::Config(error)) => {
                let place = &error.text[error.span.clone()];
                writeln!(all, "{error}").unwrap();
                writeln!(all, "    at `{place}`").unwrap();
                if let Some(help) = &error.help {
                    writeln!(all, "    {help}").unwrap();
                }
            }
            other => panic!("{:?}\n{text}", other.map(|m| m.0)),
        }
    }
    all
}

#[test]
fn mistakes_in_effects_are_shown_where_they_stand() {
    let own = format!("[plant.dc_axis]\nK_A = -4.0\nK_C = 3.0\n{OWN_FRICTION}")
        .replace("\"wheel.right\", \"wheel.left\"", "\"shaft\"");
    let texts: Vec<String> = [
        ("speed /", "spede /"),
        ("tanh", "tahn"),
        ("tanh(", "tanh("),
        ("speed / s)", "speed / s"),
        ("-c * tanh(speed / s)", "-c * tanh(heading / s)"),
        ("-c * tanh(speed / s)", ""),
        ("unit = \"V\"", "unit = \"Vlt\""),
        ("value = 0.9", "value = 20"),
        ("range = [0.0, 12.0]", "range = [12.0, 0.0]"),
        ("above = 0.0", "above = 0.5"),
        ("value = 0.2, ", ""),
        ("held = true }", "held = true }\nunused = 1.0"),
        ("held = true", "hold = true"),
        ("held = true }", "held = true }\nflow = 1.0"),
        ("held = true }", "held = true }\nexp = 1.0"),
        ("on = [\"shaft\"]", "on = [\"shaft\"]\nat = [\"shaft\"]"),
        ("on = [\"shaft\"]", "on = [\"shift\"]"),
        ("on = [\"shaft\"]\n", ""),
        (
            "on = [\"shaft\"]",
            "on = [\"shaft\"]\nname = \"coulomb_friction\"",
        ),
        ("force = \"-c", "force = '''\n  -c /* 2 */"),
        ("force", "forse"),
    ]
    .map(|(right, wrong)| {
        assert!(own.contains(right), "{right}");
        let mut text = own.replacen(right, wrong, 1);
        if wrong == "tanh(" {
            text = text.replace("tanh(", "tanh(2, ");
        }
        if wrong.contains("'''") {
            text = text.replace("s)\"", "s)'''");
        }
        text
    })
    .to_vec();
    assert_eq!(shown(&texts), EFFECT_MISTAKES);
}

const EFFECT_MISTAKES: &str = r#"m:8:20: unknown name `spede`, expected one of c, s, flow, position, drive, load, armature, shaft, stall, nominal, side, time, speed, angle, voltage, supply_load, stall_load, linear_speed, travel, pi, π
    at `spede`
    did you mean `speed`?
m:8:15: unknown function `tahn`, expected one of abs, sign, sqrt, exp, ln, sin, cos, tan, asin, acos, atan, sinh, cosh, tanh, min, max, atan2
    at `tahn`
    did you mean `tanh`?
m:8:21: `tanh` takes one argument
    at `,`
m:8:19: the parenthesis that begins here is never closed
    at `(`
m:8:20: the channel `shaft` offers no heading, it offers flow, position, drive, load, stall, armature, shaft
    at `heading`
m:8:9: there is no expression
    at ``
m:10:28: the unit `Vlt`: no unit has this symbol
    at `Vlt`
m:10:15: `c` is 20 V, expected a number from 0 to 12 V
    at `20`
m:10:40: the range is from 12 to 0
    at `[12.0, 0.0]`
    the least value comes first: `range = [0.0, 12.0]`
m:11:15: `s` is 0.2 rad/s, expected a number above 0.5 rad/s
    at `0.2`
m:11:1: `s` is held and has no value
    at `s`
m:12:1: `unused` is not in the expression
    at `unused`
m:11:49: unknown name `hold` in `s`, expected one of value, unit, range, above, below, scale, held, symbol, doc
    at `hold`
    did you mean `held`?
m:12:1: `flow` is already the name of what an effect can read
    at `flow`
m:12:1: `exp` is the name of a function or a constant
    at `exp`
m:7:1: the channels are given as `at` and as `on`, expected one of them
    at `on`
m:7:7: the plant `dc_axis` has no channel `shift`, expected one of shaft, load, inertia, input, sensor.speed, sensor.angle, sensor.linear_speed, sensor.travel
    at `"shift"`
    did you mean `shaft`?
m:6:1: `expression` needs `at`: the channels it acts on
    at `[effect.expression]`
    channels of `dc_axis` where it fits: shaft, load, inertia, input, sensor.speed, sensor.angle, sensor.linear_speed, sensor.travel
m:8:8: `coulomb_friction` is the name of an effect of the library
    at `"coulomb_friction"`
m:9:7: a number or a name is missing before `*`
    at `*`
m:8:1: unknown name `forse` in `expression`, expected one of name, summary, at, on, force, max_step_s, states, parameters
    at `forse`
    did you mean `force`?
"#;

#[test]
fn mistakes_in_plants_are_shown_where_they_stand() {
    let texts: Vec<String> = [
        ("K_A * speed", "K_a * speed"),
        ("K_C * (voltage + shaft)", "K_C * (voltage + saft)"),
        ("rate = \"speed\"", "value = \"speed\""),
        ("voltage * armature", "voltage * (armature + shaft)"),
        ("voltage + K_A / K_C * speed", "voltage + 2 * supply_load"),
        ("voltage + K_A / K_C * speed", "armature"),
        (" + load\"", "\""),
        ("flow = \"speed\"", "flow = \"sped\""),
        ("shaft = { unit = \"V\", ", "shaft = { "),
        ("K_A = { value", "speed = { value"),
        ("voltage = { unit = \"V\" }", "voltage = { unit = \"V/\" }"),
        ("voltage = { unit = \"V\" }\n", ""),
        (
            "[plant.expression.states]",
            "[plant.expression]\ncontrolled = [\"sped\"]\n[plant.expression.states]",
        ),
        (
            "[plant.expression.states]",
            "[plant.expression]\ncontrolled = [\"speed\", \"angle\"]\n[plant.expression.states]",
        ),
        ("(voltage + shaft)", "(voltage^2 + shaft)"),
        (
            "\nload = { unit",
            "\nother = { rate = \"speed\", input = \"voltage\" }\nload = { unit",
        ),
        ("K_C = { value = 3.0", "K_C = { value = nan"),
        (
            "[plant.expression.parameters]",
            "[plant.expression.parameters]\nextra = 1.0",
        ),
        (
            "[plant.expression.states]\nspeed",
            "[plant.expression.states]\n\"a b\"",
        ),
    ]
    .map(|(right, wrong)| {
        assert!(AXIS.contains(right), "{right}");
        let mut text = AXIS.replacen(right, wrong, 1);
        if wrong.contains("(voltage^2") {
            text = format!("[plant.expression]\ncontrolled = [\"speed\"]\n{text}");
        }
        text
    })
    .to_vec();
    assert_eq!(shown(&texts), PLANT_MISTAKES);
}

const PLANT_MISTAKES: &str = r#"m:2:35: unknown name `K_a`, expected one of K_A, K_C, speed, angle, voltage, supply_load, stall_load, armature, shaft, load, pi, π
    at `K_a`
    did you mean `K_A`?
m:2:66: unknown name `saft`, expected one of K_A, K_C, speed, angle, voltage, supply_load, stall_load, armature, shaft, load, pi, π
    at `saft`
    did you mean `shaft`?
m:3:1: `angle` is a state and needs a `rate`: an expression
    at `angle`
m:7:62: the effort `shaft` acts on rates, an output cannot read it
    at `shaft`
m:9:49: an output depends on itself: supply_load needs armature needs supply_load
    at `supply_load`
m:9:35: an output depends on itself: armature needs armature
    at `armature`
m:12:1: `load` is in no rate: an effort acts where its name stands
    at `load`
m:11:30: there is no signal `sped`, expected one of speed, angle, voltage, supply_load, stall_load, armature
    at `"sped"`
    did you mean `speed`?
m:11:1: the channel `shaft` needs a `unit`: that of what is added there
    at `shaft`
m:14:1: `speed` is already the name of a state
    at `speed`
m:5:20: the unit `V/`: character 3: a unit is missing
    at `"V/"`
m:4:19: a plant needs an input
    at `inputs`
m:2:15: there is no state `sped`, expected one of speed, angle
    at `"sped"`
    did you mean `speed`?
m:2:1: 2 controlled states, expected as many as inputs: 1
    at `controlled`
m:2:15: the rate of `speed` is not affine in the inputs, so no velocity controller can act on it
    at `"speed"`
m:12:11: a channel is at one place, found two
    at `rate`
m:15:17: `K_C` is NaN rad/s^2/V, expected a finite number
    at `nan`
m:14:1: `extra` is in no expression
    at `extra`
m:2:1: `a b` is no name for an expression, expected letters, digits and `_`
    at `"a b"`
"#;
