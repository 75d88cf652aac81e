//! What `list` and `explain` show of effects and plants that a model file defines.

use crate::registry::{PartMeta, Setting};

/// What is known of plants as expressions before one is read.
pub(crate) const PLANT_PART: PartMeta = PartMeta {
    id: "expression",
    role: "plant",
    summary: "a plant of your own, as expressions in the model file",
    equation: "x_i' = rate_i(states, inputs, outputs, efforts; parameters);  y_j = value_j(states, inputs, outputs; parameters)",
    reference: "docs/own-in-toml.md",
    example: "[plant.expression.states]
angle = { unit = \"rad\", rate = \"speed\" }
speed = { unit = \"rad/s\", rate = \"k * (voltage + shaft) - a * sin(angle) - d * speed\" }

[plant.expression.inputs]
voltage = { unit = \"V\" }

[plant.expression.channels]
shaft = { unit = \"V\", flow = \"speed\", position = \"angle\", drive = \"voltage\" }

[plant.expression.parameters]
k = { value = 3.0, unit = \"rad/s^2/V\" }
a = { value = 20.0, unit = \"rad/s^2\", range = [0.0, 100.0] }
d = { value = 0.5, unit = \"1/s\", range = [0.0, 10.0] }
",
    settings: &[
        Setting::new(
            "states",
            "",
            "a table for each: unit, rate (an expression), doc, symbol, size",
        ),
        Setting::new("inputs", "", "a table for each: unit, doc, symbol, size"),
        Setting::new(
            "outputs",
            "",
            "a table for each: unit, value (an expression), integral_of, doc, symbol, size",
        ),
        Setting::new(
            "channels",
            "",
            "a table for each: unit, the signals that play roles (flow, position, drive, …), side, size, doc; an effort, whose name stands in the rates, or at an `input`, `rate` or `output`",
        ),
        Setting::new(
            "parameters",
            "",
            "a table for each: value, unit, range (or above, below), held, scale, symbol, doc; or just a number",
        ),
        Setting::new(
            "controlled",
            "",
            "the states a velocity controller acts on, as many as inputs; without it those that are more than integrals, where they are such states",
        ),
        Setting::new("summary", "", "one sentence for reports"),
        Setting::new("assumptions", "", "what was assumed"),
        Setting::new("reference", "", "where the equations come from"),
    ],
};

/// What is known of effects as expressions before one is read.
pub(crate) const EFFECT_PART: PartMeta = PartMeta {
    id: "expression",
    role: "effect",
    summary: "an effect of your own, as expressions in the model file; it may have states",
    equation: "w = force(states, flow, position, drive, …, nominal, side, time, signals; parameters);  z_i' = rate_i(the same)",
    reference: "docs/own-in-toml.md",
    example: "[[effect]]
[effect.expression]
at = [\"wheel.right\", \"wheel.left\"]
force = \"-c * tanh(flow / s)\"

[effect.expression.parameters]
c = { value = 0.9, unit = \"V\", range = [0.0, 12.0], doc = \"size of the friction\" }
s = { value = 0.1, unit = \"rad/s\", above = 0.0, held = true, doc = \"width of the smoothing\" }
",
    settings: &[
        Setting::new("at", "", "the channels it acts on; `on` is the same"),
        Setting::new("on", "", "the same as `at`"),
        Setting::new(
            "force",
            "",
            "what is added there, in the channel's unit; names: the channel's roles (flow, position, drive, …), nominal, side, time, signals of the plant, the parameters, the states",
        ),
        Setting::new(
            "states",
            "",
            "a table for each, of its own at each channel: unit, rate (an expression), start (a number or an expression, 0 without it), limits (two numbers, or expressions of parameters; what exceeds them is lost), doc",
        ),
        Setting::new(
            "max_step_s",
            "s",
            "longest integration step that follows its states; without it that of the model",
        ),
        Setting::new(
            "name",
            "",
            "name in reports and of its parameters; `expression` without it",
        ),
        Setting::new("summary", "", "one sentence for reports"),
        Setting::new(
            "parameters",
            "",
            "a table for each: value, unit, range (or above, below), held, scale, symbol, doc; or just a number",
        ),
    ],
};
