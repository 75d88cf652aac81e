//! The parameters of a composed model.

use loopsight_core::Parameter;

use crate::config::PathSegment;

/// A parameter of a composed model.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelParameter {
    /// Name within the model: `K_A`, `coulomb_friction.level`.
    pub name: String,
    /// Its declaration.
    pub declaration: &'static Parameter,
    /// SI unit, that of the channel filled in.
    pub unit: String,
    /// Its value; `None` where neither file nor declaration give one: a fit has to find it.
    pub value: Option<f64>,
    /// Where the value comes from that a fit begins with, or keeps.
    pub origin: Origin,
    /// A fit estimates it.
    pub free: bool,
    /// It differs from run to run: a fit estimates it in each, and `free` is not set.
    pub per_run: bool,
    /// What 1 of the declaration's default, scale and starts is here, in `unit`: 1 for parameters
    /// of a plant, for those of an effect see [`loopsight_core::Channel::size`].
    pub size: f64,
    /// Where it stands in the file.
    pub path: Vec<PathSegment>,
}

/// Where a value comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// The model file says it.
    File,
    /// The file says none: it is the default of the declaration, if there is one.
    Declaration,
    /// The file says none: it suits a recording.
    Log,
}

impl Origin {
    /// Of a value that is `given` in a file, or not.
    pub(crate) fn of(given: Option<f64>) -> Self {
        given.map_or(Self::Declaration, |_| Self::File)
    }
}

impl ModelParameter {
    /// Whether it is a time: a delay, a lag, a window.
    pub fn is_time(&self) -> bool {
        self.unit == "s"
    }

    /// Size of a noticeable change, in `unit`.
    pub fn scale(&self) -> f64 {
        self.declaration.scale * self.size
    }

    /// Takes sizes of times as those of a machine that takes `scale` s for what took it a second before; whether that changes any.
    pub(super) fn scale_time(&mut self, scale: f64) -> bool {
        let factor = match self.declaration.unit {
            "s" => scale,
            "1/s" | "rad/s" => scale.recip(),
            _ => return false,
        };
        self.size *= factor;
        factor != 1.0
    }

    /// Whether it belongs to a fuller form of its effect than this model has: it keeps its default.
    pub fn is_left_out(&self) -> bool {
        self.declaration.further && !self.free
    }

    /// Values from which a fit to a recording of `duration` s should start; empty where one start
    /// will do.
    pub fn starts(&self, duration: f64) -> Vec<f64> {
        let unit = if self.declaration.starts_in_durations {
            duration
        } else {
            self.size
        };
        self.declaration.starts.iter().map(|s| s * unit).collect()
    }
}
