//! Parameters, declared once.

use crate::Role;

/// An end of where a position goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Its least value.
    Lower,
    /// Its greatest.
    Upper,
}

impl End {
    /// -1 at the lower end, 1 at the upper one.
    pub const fn sign(self) -> f64 {
        match self {
            Self::Lower => -1.0,
            Self::Upper => 1.0,
        }
    }
}

/// A number a component depends on: name, symbol, unit, range, default and one sentence.
///
/// Help, TOML templates, validation, fits, documentation and reports come from this declaration.
///
/// ```
/// use loopsight_core::Parameter;
///
/// const MASS: Parameter = Parameter::new("mass", "m", "kg", "mass of the whole robot").above(0.0);
/// assert!(MASS.admits(3.0) && !MASS.admits(0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Key in TOML and JSON.
    pub id: &'static str,
    /// Symbol in the equations.
    pub symbol: &'static str,
    /// SI unit (see [`crate::unit`]).
    pub unit: &'static str,
    /// One sentence.
    pub doc: &'static str,
    /// Least admissible value.
    pub min: f64,
    /// Greatest admissible value.
    pub max: f64,
    /// True when `min` and `max` themselves are not admissible.
    pub open: bool,
    /// A control law divides by it, so an estimate keeps its sign and stays away from zero. The value zero is still
    /// admissible: a machine without that drive.
    pub nonzero: bool,
    /// Value when the file gives none; `None` makes the parameter obligatory, unless a fit is to
    /// find it.
    pub default: Option<f64>,
    /// A fit estimates it unless told otherwise. Geometry that was measured with a ruler is not.
    pub estimated: bool,
    /// Enters the right-hand side linearly while the others of its kind are constant: linear regression can identify
    /// it.
    pub linear: bool,
    /// Size of a noticeable change, in the parameter's unit: scales a fit when the value is zero.
    pub scale: f64,
    /// Values a fit should start from where its surface has several minima; empty: one start.
    pub starts: &'static [f64],
    /// `starts` are fractions of the duration of the recording.
    pub starts_in_durations: bool,
    /// It is a limit of the position (or head), and a fit starts where that of the recording ends. A model file that does
    /// not give it has no such limit, and no fit looks for one.
    pub limits: Option<End>,
    /// It belongs to a fuller form of its effect: a fit estimates it only where the model file gives it, and a diagnosis tries the
    /// effect without it before it tries it with it.
    pub further: bool,
    /// At zero its effect is a simpler one: where a log does not determine it, that one is the explanation.
    pub vanishing: bool,
    /// Sides on which it acts, see [`crate::Channel::side`]; empty: everywhere. Where an effect is attached to none of
    /// them, it is frozen in a fit.
    pub sides: &'static [i8],
    /// A quantity that its influence is in proportion to, or nearly so: it has none while that stays at zero. Where the
    /// recording does not show that quantity (see [`crate::Unshown::still`]), it is frozen in a fit.
    pub shown_by: Option<Role>,
    /// A value that its channel never exceeds, as a command never does the supply. Where nothing says how large it is, a
    /// diagnosis takes the largest of the recording.
    pub bounds_channel: bool,
    /// The parameter that means the same in the other direction of motion. Where all such pairs are alike, the effect has no
    /// direction.
    pub opposite: Option<&'static str>,
}

impl Parameter {
    /// A linear, estimated parameter without bounds and without a default.
    pub const fn new(
        id: &'static str,
        symbol: &'static str,
        unit: &'static str,
        doc: &'static str,
    ) -> Self {
        Self {
            id,
            symbol,
            unit,
            doc,
            min: f64::NEG_INFINITY,
            max: f64::INFINITY,
            open: false,
            nonzero: false,
            default: None,
            estimated: true,
            linear: true,
            scale: 1.0,
            starts: &[],
            starts_in_durations: false,
            limits: None,
            further: false,
            vanishing: false,
            sides: &[],
            shown_by: None,
            bounds_channel: false,
            opposite: None,
        }
    }

    /// Restricts the value to `min <= value <= max`.
    pub const fn within(mut self, min: f64, max: f64) -> Self {
        self.min = min;
        self.max = max;
        self.open = false;
        self
    }

    /// Restricts the value to `value > min`.
    pub const fn above(mut self, min: f64) -> Self {
        self.min = min;
        self.open = true;
        self
    }

    /// Restricts the value to `value < max`.
    pub const fn below(mut self, max: f64) -> Self {
        self.max = max;
        self.open = true;
        self
    }

    /// An estimate keeps its sign and does not come near zero.
    pub const fn nonzero(mut self) -> Self {
        self.nonzero = true;
        self
    }

    /// The value when the file gives none.
    pub const fn or(mut self, default: f64) -> Self {
        self.default = Some(default);
        self
    }

    /// Frozen at its value in a fit, unless the model file frees it.
    pub const fn known(mut self) -> Self {
        self.estimated = false;
        self
    }

    /// Enters the right-hand side non-linearly.
    pub const fn nonlinear(mut self) -> Self {
        self.linear = false;
        self
    }

    /// Size of a noticeable change, in the parameter's unit.
    pub const fn scaled(mut self, scale: f64) -> Self {
        self.scale = scale;
        self
    }

    /// Values a fit should start from where its surface has several minima.
    pub const fn starting_at(mut self, starts: &'static [f64]) -> Self {
        self.starts = starts;
        self
    }

    /// Fractions of the recording's duration at which a fit should start.
    pub const fn starting_within(mut self, fractions: &'static [f64]) -> Self {
        self.starts = fractions;
        self.starts_in_durations = true;
        self
    }

    /// Belongs to a fuller form of its effect.
    pub const fn further(mut self) -> Self {
        self.further = true;
        self
    }

    /// At zero its effect is a simpler one.
    pub const fn vanishing(mut self) -> Self {
        self.vanishing = true;
        self
    }

    /// A limit of the position: a fit should start where that of the recording ends.
    pub const fn limiting(mut self, end: End) -> Self {
        self.limits = Some(end);
        self
    }

    /// Acts on these sides only.
    pub const fn on_sides(mut self, sides: &'static [i8]) -> Self {
        self.sides = sides;
        self
    }

    /// Has no influence while this quantity is zero.
    pub const fn shown_by(mut self, role: Role) -> Self {
        self.shown_by = Some(role);
        self
    }

    /// The values of its channel never exceed it.
    pub const fn bounding_channel(mut self) -> Self {
        self.bounds_channel = true;
        self
    }

    /// Means the same as this parameter, in the other direction of motion.
    pub const fn opposing(mut self, id: &'static str) -> Self {
        self.opposite = Some(id);
        self
    }

    /// Whether a model file that does not give it is without it: a limit, or a part of a fuller form.
    pub fn is_there_where_given(&self) -> bool {
        self.limits.is_some() || self.further
    }

    /// Whether it is a speed over which the sign of a force is smoothed.
    pub fn is_width(&self) -> bool {
        self.unit == "flow" && !self.estimated
    }

    /// Whether `value` lies in the declared range; never true for NaN or infinity.
    pub fn admits(&self, value: f64) -> bool {
        if !value.is_finite() {
            return false;
        }
        if self.open {
            value > self.min && value < self.max
        } else {
            value >= self.min && value <= self.max
        }
    }

    /// The nearest admissible value; the middle of the range for NaN.
    pub fn nearest(&self, value: f64) -> f64 {
        let (low, high) = self.bounds();
        if value.is_nan() {
            return if low.is_finite() && high.is_finite() {
                0.5 * (low + high)
            } else if low.is_finite() {
                low + self.scale
            } else if high.is_finite() {
                high - self.scale
            } else {
                0.0
            };
        }
        value.max(low).min(high)
    }

    /// Closed bounds: an open end is moved inwards by a millionth of the parameter's scale.
    pub fn bounds(&self) -> (f64, f64) {
        let margin = if self.open { 1e-6 * self.scale } else { 0.0 };
        (self.min + margin, self.max - margin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_hold() {
        let p = Parameter::new("k", "k", "1", "a gain").within(-1.0, 2.0);
        assert!(p.admits(-1.0) && p.admits(2.0) && !p.admits(2.1) && !p.admits(f64::NAN));
        assert_eq!(p.nearest(7.0), 2.0);
        assert_eq!(p.nearest(f64::NAN), 0.5);
        let q = Parameter::new("m", "m", "kg", "a mass").above(0.0);
        assert!(!q.admits(0.0) && q.admits(1e-9) && !q.admits(f64::INFINITY));
        assert!(q.nearest(-3.0) > 0.0);
    }
}
