//! The scalar a component is written for.

use core::fmt::Debug;
use core::ops::{AddAssign, DivAssign, MulAssign, Neg, SubAssign};

use nalgebra::{ClosedAddAssign, ClosedDivAssign, ClosedMulAssign, ClosedSubAssign, Scalar};
use num_traits::{One, Zero};

/// A real number: `f32` on a microcontroller, `f64` on a desk, a dual number in a fit.
///
/// Plants and effects are written once for any `Real`. The elementary functions come from `libm`
/// for `f32` and `f64` alike (`tanh`, and `exp` in double precision, are this crate's own), so a loop
/// gives the same digits on every machine.
///
/// Comparisons look at the value only: a dual number compares by its real part, so a branch
/// (a dead zone, say) takes the derivative of the side it is on.
pub trait Real:
    Scalar
    + Copy
    + Debug
    + PartialOrd
    + Zero
    + One
    + Neg<Output = Self>
    + ClosedAddAssign
    + ClosedSubAssign
    + ClosedMulAssign
    + ClosedDivAssign
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
    + Send
    + Sync
    + 'static
{
    /// The number nearest to `value`, with zero derivatives.
    fn of(value: f64) -> Self;
    /// The value as `f64`, without derivatives.
    fn value(self) -> f64;
    /// Sine of an angle in radians.
    fn sin(self) -> Self;
    /// Cosine of an angle in radians.
    fn cos(self) -> Self;
    /// Sine and cosine of an angle in radians, for little more than the price of one.
    fn sin_cos(self) -> (Self, Self);
    /// Hyperbolic tangent.
    fn tanh(self) -> Self;
    /// `e^x`.
    fn exp(self) -> Self;
    /// Square root; NaN below zero.
    fn sqrt(self) -> Self;
    /// Natural logarithm; minus infinity at zero, NaN below.
    fn ln(self) -> Self;
    /// Angle of the point (`other`, `self`), from -π to π.
    fn atan2(self, other: Self) -> Self;
    /// `self^exponent`; NaN below zero, unless the exponent is a whole number.
    fn powf(self, exponent: Self) -> Self;

    /// The product with a constant, whose derivatives are taken for zero: for a dual number half the work
    /// of a multiplication.
    fn times(self, constant: Self) -> Self {
        self * constant
    }

    /// Absolute value.
    fn abs(self) -> Self {
        if self < Self::zero() { -self } else { self }
    }

    /// The larger of the two; `self` when either is NaN.
    fn max(self, other: Self) -> Self {
        if other > self { other } else { self }
    }

    /// The smaller of the two; `self` when either is NaN.
    fn min(self, other: Self) -> Self {
        if other < self { other } else { self }
    }

    /// Within `[low, high]`; NaN stays NaN.
    fn clamp(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }

    /// Neither infinite nor NaN.
    fn is_finite(self) -> bool {
        self.value().is_finite()
    }
}

impl Real for f32 {
    fn of(value: f64) -> Self {
        value as f32
    }
    fn abs(self) -> Self {
        f32::abs(self)
    }
    fn value(self) -> f64 {
        f64::from(self)
    }
    fn sin(self) -> Self {
        libm::sinf(self)
    }
    fn cos(self) -> Self {
        libm::cosf(self)
    }
    fn sin_cos(self) -> (Self, Self) {
        libm::sincosf(self)
    }
    fn tanh(self) -> Self {
        crate::tanh::tanhf(self)
    }
    fn exp(self) -> Self {
        libm::expf(self)
    }
    fn sqrt(self) -> Self {
        libm::sqrtf(self)
    }
    fn ln(self) -> Self {
        libm::logf(self)
    }
    fn atan2(self, other: Self) -> Self {
        libm::atan2f(self, other)
    }
    fn powf(self, exponent: Self) -> Self {
        libm::powf(self, exponent)
    }
    fn is_finite(self) -> bool {
        f32::is_finite(self)
    }
}

impl Real for f64 {
    fn of(value: f64) -> Self {
        value
    }
    fn abs(self) -> Self {
        f64::abs(self)
    }
    fn value(self) -> f64 {
        self
    }
    fn sin(self) -> Self {
        libm::sin(self)
    }
    fn cos(self) -> Self {
        libm::cos(self)
    }
    fn sin_cos(self) -> (Self, Self) {
        libm::sincos(self)
    }
    fn tanh(self) -> Self {
        crate::tanh::tanh(self)
    }
    fn exp(self) -> Self {
        crate::exp::exp(self)
    }
    fn sqrt(self) -> Self {
        libm::sqrt(self)
    }
    fn ln(self) -> Self {
        libm::log(self)
    }
    fn atan2(self, other: Self) -> Self {
        libm::atan2(self, other)
    }
    fn powf(self, exponent: Self) -> Self {
        libm::pow(self, exponent)
    }
}
