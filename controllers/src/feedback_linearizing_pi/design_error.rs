//! Why a controller could not be made.

use core::fmt;

/// A design that cannot be: which number, of which channel, was found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum DesignError {
    /// `K_p` not a number above 0.
    Proportional(usize, f64),
    /// `K_i` below 0 or not a number.
    Integral(usize, f64),
    /// A limit not above 0.
    Limit(usize, f64),
    /// An acceleration that is not a finite number.
    Acceleration(usize, f64),
    /// A period not a number above 0.
    Period(f64),
    /// Lists of different length.
    Lengths,
}

impl fmt::Display for DesignError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            DesignError::Proportional(i, v) => write!(
                f,
                "the proportional gain of channel {i} is {v} 1/s, expected a number above 0"
            ),
            DesignError::Integral(i, v) => write!(
                f,
                "the integral gain of channel {i} is {v} 1/s^2, expected a number from 0 upwards"
            ),
            DesignError::Limit(i, v) => {
                write!(
                    f,
                    "the limit of input {i} is {v}, expected a number above 0"
                )
            }
            DesignError::Acceleration(i, v) => write!(
                f,
                "the acceleration of channel {i} is {v}, expected a finite number"
            ),
            DesignError::Period(v) => {
                write!(f, "the period is {v} s, expected a number above 0")
            }
            DesignError::Lengths => f.write_str("gains and limits differ in length"),
        }
    }
}

impl core::error::Error for DesignError {}
