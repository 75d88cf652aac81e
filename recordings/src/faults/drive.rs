//! What drives a signal: the input or the combination of inputs that ought to move it.

use loopsight_core::unit::parse;
use loopsight_model::run::Run;

use crate::map::MappedSignal;

/// Combination of inputs that moves a signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Drive {
    /// This input alone.
    Input(usize),
    /// Right and left added: a vehicle going straight.
    Sum(usize, usize),
    /// Right minus left: a vehicle turning.
    Difference(usize, usize),
    /// Any of them, in no known way.
    Any,
}

/// `Right`, `left`, or neither, of an id such as `voltage_right`; and the id without it.
pub(crate) fn side(id: &str) -> (Option<bool>, String) {
    let mut right = None;
    let rest: Vec<&str> = id
        .split('_')
        .filter(|token| match *token {
            "right" => {
                right = Some(true);
                false
            }
            "left" => {
                right = Some(false);
                false
            }
            _ => true,
        })
        .collect();
    (right, rest.join("_"))
}

/// True for a coordinate of the world, whose sign depends on the heading.
pub(crate) fn is_coordinate(id: &str) -> bool {
    id.contains("position") || id.ends_with("_x") || id.ends_with("_y")
}

impl Drive {
    /// Finds the drive of a signal by names and units.
    pub(crate) fn of(signal: &MappedSignal, inputs: &[&str]) -> Self {
        if inputs.len() == 1 {
            return Drive::Input(0);
        }
        let sides: Vec<(Option<bool>, String)> = inputs.iter().map(|id| side(id)).collect();
        let only = |right: bool| {
            let mut found = sides.iter().enumerate().filter(|(_, s)| s.0 == Some(right));
            match (found.next(), found.next()) {
                (Some((at, _)), None) => Some(at),
                _ => None,
            }
        };
        let (Some(right), Some(left)) = (only(true), only(false)) else {
            return Drive::Any;
        };
        if inputs.len() != 2 || sides[right].1 != sides[left].1 {
            return Drive::Any;
        }
        match (side(&signal.id).0, parse(&signal.unit).map(|u| u.dimension)) {
            (Some(true), _) => Drive::Input(right),
            (Some(false), _) => Drive::Input(left),
            (None, Ok(d)) if d.radian == 1 && d.metre == 0 => Drive::Difference(right, left),
            // A coordinate may well stand still while the vehicle goes along the other one.
            (None, Ok(d)) if d.metre == 1 && d.radian == 0 && is_coordinate(&signal.id) => {
                Drive::Difference(right, left)
            }
            (None, Ok(d)) if d.metre == 1 && d.radian == 0 => Drive::Sum(right, left),
            _ => Drive::Any,
        }
    }

    /// Its value at a sample; the largest input where the combination is unknown.
    pub(crate) fn at(self, run: &Run, k: usize) -> f64 {
        let u = run.input(k);
        let get = |i: usize| u.get(i).copied().unwrap_or(0.0);
        let value = match self {
            Drive::Input(i) => return get(i),
            Drive::Sum(r, l) => get(r) + get(l),
            Drive::Difference(r, l) => get(r) - get(l),
            Drive::Any => {
                return u
                    .iter()
                    .copied()
                    .fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
            }
        };
        // What rounding leaves of equal inputs drives nothing.
        let scale = u.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        if value.abs() <= 1e-9 * scale {
            0.0
        } else {
            value
        }
    }

    /// True when it differs from zero at a sample with another after it: what acts at the last one alone
    /// is not measured any more.
    pub(crate) fn acts(self, run: &Run) -> bool {
        (1..run.len()).any(|after| self.at(run, after - 1) != 0.0)
    }

    /// In words.
    pub(crate) fn describe(self, inputs: &[&str]) -> String {
        let name = |i: usize| inputs.get(i).copied().unwrap_or("?");
        match self {
            Drive::Input(i) => format!("`{}`", name(i)),
            Drive::Sum(r, l) => format!("`{}` + `{}`", name(r), name(l)),
            Drive::Difference(r, l) => format!("`{}` - `{}`", name(r), name(l)),
            Drive::Any => "the inputs".into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_units_tell_the_drive() {
        let signal = |id: &str, unit: &str| MappedSignal {
            id: id.into(),
            unit: unit.into(),
            ..MappedSignal::default()
        };
        let both = ["voltage_right", "voltage_left"];
        for (id, unit, drive) in [
            ("track_speed_left", "m/s", Drive::Input(1)),
            ("angular_velocity", "rad/s", Drive::Difference(0, 1)),
            ("linear_velocity", "m/s", Drive::Sum(0, 1)),
            ("position_x", "m", Drive::Difference(0, 1)),
            ("temperature", "K", Drive::Any),
        ] {
            assert_eq!(Drive::of(&signal(id, unit), &both), drive, "{id}");
        }
        assert_eq!(
            Drive::of(&signal("speed_left", "m/s"), &["voltage"]),
            Drive::Input(0)
        );
        assert_eq!(
            Drive::of(&signal("speed_left", "m/s"), &["a", "b"]),
            Drive::Any
        );
    }
}
