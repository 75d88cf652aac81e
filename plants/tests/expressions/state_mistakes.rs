//! Mistakes in the states of effects, with their places.

use super::LIBRARY_AXIS;
use super::mistakes::shown;

const STUCK: &str = "
[[effect]]
[effect.expression]
at = [\"shaft\"]
force = \"-k * z\"
[effect.expression.states]
z = { unit = \"rad\", rate = \"flow - a * abs(flow) * z\", start = 0.5, limits = [-1.0, 1.0] }
[effect.expression.parameters]
k = { value = 3.0, unit = \"V/rad\" }
a = { value = 2.0, unit = \"1/rad\" }
";

#[test]
fn mistakes_in_states_are_shown_where_they_stand() {
    let own = format!("{LIBRARY_AXIS}{STUCK}");
    let texts: Vec<String> = [
        ("-k * z", "-k * zz"),
        ("flow - a", "flwo - a"),
        ("flow - a", "heading - a"),
        ("rate = \"flow - a * abs(flow) * z\"", "rate = \"\""),
        ("rate = \"flow - a * abs(flow) * z\", ", ""),
        ("rate =", "rat ="),
        ("unit = \"rad\", ", ""),
        ("unit = \"rad\"", "unit = \"rdd\""),
        ("z = {", "speed = {"),
        ("z = {", "a = {"),
        ("z = {", "flow = {"),
        ("z = {", "exp = {"),
        ("z = {", "y = { unit = \"1\", rate = \"-y\" }\nz = {"),
        ("start = 0.5", "start = nan"),
        ("start = 0.5", "start = 1.5"),
        ("start = 0.5", "start = \"z\""),
        ("start = 0.5", "start = \"angl\""),
        ("start = 0.5", "start = true"),
        ("start = 0.5, limits = [-1.0, 1.0]", "limits = [0.5, 1.0]"),
        ("[-1.0, 1.0]", "[1.0, -1.0]"),
        ("[-1.0, 1.0]", "[nan, 1.0]"),
        ("[-1.0, 1.0]", "[-1.0]"),
        ("[-1.0, 1.0]", "[-1.0, \"flow\"]"),
        ("[-1.0, 1.0]", "[-1.0, \"kk\"]"),
        ("a * abs(flow)", "abs(flow)"),
        ("force =", "max_step_s = 0.0\nforce ="),
        (
            "z = {",
            "b = { unit = \"1\", rate = \"z\" }\nc = { unit = \"1\", rate = \"b\" }\nz = {",
        ),
    ]
    .map(|(right, wrong)| {
        assert!(own.contains(right), "{right}");
        own.replacen(right, wrong, 1)
    })
    .to_vec();
    assert_eq!(shown(&texts), MISTAKES);
    let many: String = (0..9)
        .map(|i| format!("z{i} = {{ unit = \"1\", rate = \"1\" }}\n"))
        .collect();
    let text = own.replace("z = {", &format!("{many}z = {{"));
    assert_eq!(
        shown(&[text]),
        "m:9:20: 10 states, expected at most 8\n    at `states`\n"
    );
}

const MISTAKES: &str = r#"m:8:15: unknown name `zz`, expected one of k, a, z, flow, position, drive, load, armature, shaft, stall, nominal, side, time, speed, angle, voltage, supply_load, stall_load, linear_speed, travel, pi, π
    at `zz`
    did you mean `z`?
m:10:29: unknown name `flwo`, expected one of k, a, z, flow, position, drive, load, armature, shaft, stall, nominal, side, time, speed, angle, voltage, supply_load, stall_load, linear_speed, travel, pi, π
    at `flwo`
    did you mean `flow`?
m:10:29: the channel `shaft` offers no heading, it offers flow, position, drive, load, stall, armature, shaft
    at `heading`
m:10:28: there is no expression
    at ``
m:10:1: `z` is a state and needs a `rate`: an expression
    at `z`
m:10:21: unknown name `rat` in `z`, expected one of unit, rate, start, limits, doc
    at `rat`
    did you mean `rate`?
m:10:5: the key `unit` is missing here
    at `{ rate = "flow - a * abs(flow) * z", start = 0.5, limits = [-1.0, 1.0] }`
m:10:15: the unit `rdd`: no unit has this symbol
    at `rdd`
m:10:1: `speed` is already the name of a signal of the plant
    at `speed`
m:10:1: `a` is already the name of a parameter
    at `a`
m:10:1: `flow` is already the name of what an effect can read
    at `flow`
m:10:1: `exp` is the name of a function or a constant
    at `exp`
m:10:1: `y` is neither in the force nor in the rate of a state that is
    at `y`
m:10:64: `start` is NaN, expected a finite number or an expression
    at `nan`
m:10:64: `z` starts at 1.5, expected a number from -1 to 1: its limits
    at `1.5`
m:10:65: the start of a state cannot read the state `z`
    at `z`
m:10:65: unknown name `angl`, expected one of k, a, flow, position, drive, load, armature, shaft, stall, nominal, side, time, speed, angle, voltage, supply_load, stall_load, linear_speed, travel, pi, π
    at `angl`
    did you mean `angle`?
m:10:64: invalid type: boolean `true`, expected a number or an expression
    at `true`
m:10:65: `z` starts at 0 without a `start`, expected a number from 0.5 to 1: its limits
    at `[0.5, 1.0]`
m:10:78: the limits are from 1 to -1
    at `[1.0, -1.0]`
    the least value comes first: `limits = [0.0, 1.0]`
m:10:78: the limits are from NaN to 1
    at `[nan, 1.0]`
    the least value comes first: `limits = [0.0, 1.0]`
m:10:78: invalid length 1, expected an array of length 2
    at `[-1.0]`
m:10:86: the limit of a state is a number or depends on parameters, it cannot read `flow`
    at `flow`
m:10:86: unknown name `kk`, expected one of k, a, pi, π
    at `kk`
    did you mean `k`?
m:13:1: `a` is in no expression
    at `a`
m:8:14: `max_step_s` is 0, expected a number of 1e-7 s or more
    at `0.0`
m:10:1: `b` is neither in the force nor in the rate of a state that is
    at `b`
"#;
