//! Ties: what a plant declares of parameters that a recording may not show.

use crate::{Real, Role};

/// A part of a plant that shows only when its inputs are combined in one way, and what its parameters are
/// likely to be where they never are.
///
/// A recording of a vehicle that only drives straight does not show how it turns. Left free, the parameters of
/// turning take any value, and friction at one wheel fits as well as friction at both. Tied, they follow from the
/// parameters of driving straight, for a vehicle with equal sides that do not act on each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unshown {
    /// What it is, in words: `turning`.
    pub what: &'static str,
    /// The combination of inputs that shows it: inputs by their ids, with their shares.
    pub shown_by: &'static [(&'static str, f64)],
    /// What its parameters are where it does not show.
    pub ties: &'static [Tie],
    /// Efforts, by the ids of their channels, that act on this part alone. What the ties assume cannot be told from
    /// an effect there.
    pub channels: &'static [&'static str],
    /// Quantities that stay near zero where it does not show. What they would tell of an effect is not known then:
    /// [`Parameter::shown_by`](crate::Parameter::shown_by).
    pub still: &'static [Role],
    /// Why they are likely to be so, in one sentence.
    pub because: &'static str,
}

/// A parameter that is a product of powers of others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tie {
    /// The parameter of the equations.
    pub parameter: &'static str,
    /// The others, with their exponents: `[("K_C", 1), ("half_track", -1)]` is `K_C/half_track`.
    pub factors: &'static [(&'static str, i8)],
}

impl Tie {
    /// The product, with the values of the factors in their order.
    pub fn value<S: Real>(&self, factors: impl Iterator<Item = S>) -> S {
        let mut product = S::of(1.0);
        for ((_, exponent), value) in self.factors.iter().zip(factors) {
            for _ in 0..exponent.unsigned_abs() {
                product = if *exponent > 0 {
                    product * value
                } else {
                    product / value
                };
            }
        }
        product
    }
}

impl core::fmt::Display for Tie {
    /// `K_C/half_track`.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        for (index, (name, exponent)) in self.factors.iter().enumerate() {
            for again in 0..exponent.unsigned_abs() {
                match (*exponent > 0, index == 0 && again == 0) {
                    (true, true) => write!(f, "{name}")?,
                    (true, false) => write!(f, " {name}")?,
                    (false, true) => write!(f, "1/{name}")?,
                    (false, false) => write!(f, "/{name}")?,
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use std::string::ToString;

    use super::*;

    #[test]
    fn a_tie_is_a_product_of_powers() {
        let tie = Tie {
            parameter: "K_F",
            factors: &[("K_C", 1), ("half_track", -1)],
        };
        assert_eq!(tie.value([3.0f64, 0.5].into_iter()), 6.0);
        assert_eq!(tie.to_string(), "K_C/half_track");
    }
}
