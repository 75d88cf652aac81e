//! Which known physics a term of a residual force resembles.

use loopsight_core::Role;

use super::shape::{Shape, Variable};

const FLOW: Variable = Variable::Role(Role::Flow);
const POSITION: Variable = Variable::Role(Role::Position);
const DRIVE: Variable = Variable::Role(Role::Drive);

/// What acts in the same way, in words; none where nothing known does.
pub(super) fn resembles(shape: &Shape) -> Option<&'static str> {
    Some(match shape {
        Shape::Radiation(..) => "heat that is radiated",
        Shape::One => "a constant load, or an offset",
        Shape::Is(x) => straight(*x)?,
        Shape::Product(a, b) => product(a, b).or_else(|| product(b, a))?,
        Shape::Cosine(_, 1) | Shape::Sine(_, 1) => "gravity on a mass beside the axis",
        Shape::Cosine(..) | Shape::Sine(..) => "cogging",
        Shape::Direction(FLOW, _) => "dry friction",
        Shape::SignedSquare(FLOW) => "drag of a fluid",
        Shape::Power(FLOW, 3) => "damping that grows with the speed",
        Shape::Magnitude(FLOW)
        | Shape::Positive(FLOW)
        | Shape::Negative(FLOW)
        | Shape::Power(FLOW, _) => "damping that differs by direction",
        Shape::Power(POSITION, 3) | Shape::SignedSquare(POSITION) => {
            "a spring that stiffens with its deflection"
        }
        Shape::Magnitude(POSITION)
        | Shape::Positive(POSITION)
        | Shape::Negative(POSITION)
        | Shape::Power(POSITION, _) => "a spring that differs by side",
        Shape::Direction(DRIVE, _) => "a dead zone, or what makes up for one",
        Shape::Power(DRIVE, 3) | Shape::SignedSquare(DRIVE) => {
            "an amplifier or a motor that does not follow its command in proportion"
        }
        Shape::Magnitude(DRIVE)
        | Shape::Positive(DRIVE)
        | Shape::Negative(DRIVE)
        | Shape::Power(DRIVE, _) => "an amplifier or a motor that is stronger to one side",
        Shape::Magnitude(Variable::Time) | Shape::Power(Variable::Time, _) => "a drift",
        _ => return None,
    })
}

/// A force in proportion to a variable.
fn straight(of: Variable) -> Option<&'static str> {
    Some(match of {
        FLOW => "viscous friction",
        POSITION => "a spring",
        DRIVE => "a gain of the input",
        Variable::Time => "a drift",
        Variable::Signal(_) => "a coupling to another part of the machine",
        Variable::Role(_) => return None,
    })
}

/// `a` times what `b` says.
fn product(a: &Shape, b: &Shape) -> Option<&'static str> {
    let wave = matches!(b, Shape::Cosine(..) | Shape::Sine(..));
    let time = matches!(
        b,
        Shape::Is(Variable::Time) | Shape::Magnitude(Variable::Time)
    );
    Some(match a {
        Shape::Positive(POSITION) | Shape::Negative(POSITION) if *b == Shape::Is(POSITION) => {
            "a spring on one side that stiffens with its deflection"
        }
        Shape::Positive(DRIVE) | Shape::Negative(DRIVE) if *b == Shape::Is(DRIVE) => {
            "an amplifier or a motor that is stronger to one side"
        }
        Shape::Is(DRIVE) if time => {
            "a battery that runs down, or a winding that warms up: the input changes its strength with time"
        }
        Shape::Is(DRIVE) if wave => "the torque ripple of a motor",
        Shape::Is(FLOW) if time => "a bearing that warms up: damping changes with time",
        Shape::Is(FLOW) if wave => "a shaft out of round: damping changes with its angle",
        Shape::Is(FLOW) if *b == Shape::Is(POSITION) => "damping that changes with the position",
        Shape::Is(FLOW) if *b == Shape::Is(DRIVE) => "damping that changes with the input",
        Shape::Direction(FLOW, _) if time => "dry friction that changes with time",
        Shape::Direction(FLOW, _) => "dry friction under a load that is not the same everywhere",
        Shape::Positive(FLOW) | Shape::Negative(FLOW) => "drag that differs by direction",
        Shape::Is(Variable::Signal(_)) => "a coupling to another part of the machine",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_term_is_known_in_either_order() {
        let drive = Shape::Is(DRIVE);
        let time = Shape::Is(Variable::Time);
        let known = resembles(&drive.times(&time)).unwrap_or_default();
        assert!(known.contains("battery"));
        assert_eq!(resembles(&time.times(&drive)), Some(known));
        let deflection = Shape::Is(POSITION);
        let known = resembles(&deflection.times(&Shape::Positive(POSITION)));
        assert!(
            known
                .unwrap_or_default()
                .starts_with("a spring on one side")
        );
        assert_eq!(resembles(&Shape::Power(DRIVE, 2).times(&time)), None);
    }
}
