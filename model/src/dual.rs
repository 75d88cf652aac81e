//! Dual numbers: a value with its derivatives.

use core::cmp::Ordering;
use core::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use num_traits::{One, Zero};

use loopsight_core::Real;

/// Number of derivatives one [`Dual`] carries; a fit with more unknowns makes several passes. A
/// differential drive has six parameters and two initial states that show: with two of an effect it takes one pass.
pub const DUAL_WIDTH: usize = 10;
/// The same of a [`NarrowDual`]: enough for an axis, for an effect on a differential drive whose start is known, and for
/// what a wide pass leaves over.
pub const NARROW_WIDTH: usize = 6;

/// The same of a [`TinyDual`]: the parameters that most effects have of their own. Two slopes fill one register on every
/// machine.
pub const TINY_WIDTH: usize = 2;

/// A value with its derivatives by [`DUAL_WIDTH`] quantities.
pub type Dual = DualOf<DUAL_WIDTH>;
/// A value with its derivatives by few quantities, which costs less than a [`Dual`].
pub type NarrowDual = DualOf<NARROW_WIDTH>;
/// A value with its derivatives by two quantities at most, which costs hardly more than the value.
pub type TinyDual = DualOf<TINY_WIDTH>;

/// A value with its derivatives by `N` quantities at once: forward-mode differentiation.
///
/// ```text
/// (a, a') (b, b') = (a b, a' b + a b')        f((a, a')) = (f(a), f'(a) a')
/// ```
///
/// Own code, because a diagnosis spends nearly all its time here: an array of fixed size lets the
/// compiler keep it in vector registers, three times as fast as num-dual's optional matrices,
/// against which it is tested. (A. Griewank, A. Walther, 2008, "Evaluating Derivatives", 2nd
/// edition, chapter 3.)
///
/// Comparisons look at the value only.
#[derive(Clone, Copy, Debug)]
pub struct DualOf<const N: usize> {
    value: f64,
    slopes: [f64; N],
}

/// The quantity `value`, differentiated by itself: its `index`-th derivative is one.
pub fn variable(value: f64, index: usize) -> Dual {
    variable_of(value, index)
}

/// As [`variable`], with any number of derivatives.
pub fn variable_of<const N: usize>(value: f64, index: usize) -> DualOf<N> {
    let mut slopes = [0.0; N];
    if let Some(slope) = slopes.get_mut(index) {
        *slope = 1.0;
    }
    DualOf { value, slopes }
}

/// The derivative of `dual` by the `index`-th quantity of its pass; zero beyond its width.
pub fn derivative<const N: usize>(dual: &DualOf<N>, index: usize) -> f64 {
    dual.slopes.get(index).copied().unwrap_or(0.0)
}

/// Where a number is so small that its square is no normal number, 1.5e-154, nothing is left of it; zero then.
///
/// What decays, as a speed at rest or its derivative by a state at the start, would go on to numbers below the smallest
/// normal one, with which a processor computes a hundred times more slowly: friction with a time constant of 5 ms is there
/// after 3.6 s.
#[inline(always)]
pub(crate) fn died_out(x: f64) -> f64 {
    const NOTHING: f64 = 1.491_668_146_240_041_3e-154;
    if x.abs() < NOTHING { 0.0 } else { x }
}

impl<const N: usize> DualOf<N> {
    /// Zero for what has [died out](died_out).
    #[inline(always)]
    pub(crate) fn settled(self) -> Self {
        Self {
            value: died_out(self.value),
            slopes: self.slopes.map(died_out),
        }
    }

    /// `(value, slope · self')`: the chain rule.
    #[inline(always)]
    fn chain(self, value: f64, slope: f64) -> Self {
        let mut slopes = self.slopes;
        for s in &mut slopes {
            *s *= slope;
        }
        Self { value, slopes }
    }
}

impl<const N: usize> Add for DualOf<N> {
    type Output = Self;
    #[inline(always)]
    fn add(mut self, other: Self) -> Self {
        self.value += other.value;
        for (a, b) in self.slopes.iter_mut().zip(other.slopes) {
            *a += b;
        }
        self
    }
}

impl<const N: usize> Sub for DualOf<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(mut self, other: Self) -> Self {
        self.value -= other.value;
        for (a, b) in self.slopes.iter_mut().zip(other.slopes) {
            *a -= b;
        }
        self
    }
}

impl<const N: usize> Mul for DualOf<N> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let mut slopes = self.slopes;
        for (a, b) in slopes.iter_mut().zip(other.slopes) {
            *a = *a * other.value + self.value * b;
        }
        Self {
            value: self.value * other.value,
            slopes,
        }
    }
}

impl<const N: usize> Div for DualOf<N> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let inverse = 1.0 / other.value;
        let value = self.value * inverse;
        let mut slopes = self.slopes;
        for (a, b) in slopes.iter_mut().zip(other.slopes) {
            *a = (*a - value * b) * inverse;
        }
        Self { value, slopes }
    }
}

impl<const N: usize> Neg for DualOf<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

macro_rules! assign {
    ($($trait:ident $method:ident $by:ident),*) => {$(
        impl<const N: usize> $trait for DualOf<N> {
            #[inline(always)]
            fn $method(&mut self, other: Self) {
                *self = self.$by(other);
            }
        }
    )*};
}
assign!(AddAssign add_assign add, SubAssign sub_assign sub, MulAssign mul_assign mul, DivAssign div_assign div);

impl<const N: usize> PartialEq for DualOf<N> {
    fn eq(&self, other: &Self) -> bool {
        self.value == other.value
    }
}

impl<const N: usize> PartialOrd for DualOf<N> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.value.partial_cmp(&other.value)
    }
}

impl<const N: usize> Zero for DualOf<N> {
    fn zero() -> Self {
        Self::of(0.0)
    }
    fn is_zero(&self) -> bool {
        self.value == 0.0
    }
}

impl<const N: usize> One for DualOf<N> {
    fn one() -> Self {
        Self::of(1.0)
    }
}

impl<const N: usize> Real for DualOf<N> {
    #[inline(always)]
    fn of(value: f64) -> Self {
        Self {
            value,
            slopes: [0.0; N],
        }
    }
    fn value(self) -> f64 {
        self.value
    }
    #[inline(always)]
    fn times(self, constant: Self) -> Self {
        self.chain(self.value * constant.value, constant.value)
    }
    fn sin(self) -> Self {
        let (sin, cos) = libm::sincos(self.value);
        self.chain(sin, cos)
    }
    fn cos(self) -> Self {
        let (sin, cos) = libm::sincos(self.value);
        self.chain(cos, -sin)
    }
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = libm::sincos(self.value);
        (self.chain(sin, cos), self.chain(cos, -sin))
    }
    fn tanh(self) -> Self {
        let tanh = Real::tanh(self.value);
        self.chain(tanh, 1.0 - tanh * tanh)
    }
    fn exp(self) -> Self {
        let exp = Real::exp(self.value);
        self.chain(exp, exp)
    }
    fn sqrt(self) -> Self {
        let sqrt = libm::sqrt(self.value);
        self.chain(sqrt, steep(0.5 / sqrt))
    }
    fn ln(self) -> Self {
        self.chain(libm::log(self.value), 1.0 / self.value)
    }
    fn atan2(self, other: Self) -> Self {
        let (y, x) = (self.value, other.value);
        let square = x * x + y * y;
        let mut slopes = self.slopes;
        for (a, b) in slopes.iter_mut().zip(other.slopes) {
            *a = (x * *a - y * b) / square;
        }
        Self {
            value: libm::atan2(y, x),
            slopes,
        }
    }
    fn powf(self, exponent: Self) -> Self {
        let (base, power) = (self.value, exponent.value);
        let value = libm::pow(base, power);
        let by_base = steep(power * libm::pow(base, power - 1.0));
        // At or below zero there is a power only where the exponent stays a whole number.
        let by_power = if base > 0.0 {
            value * libm::log(base)
        } else {
            0.0
        };
        let mut slopes = self.slopes;
        for (a, b) in slopes.iter_mut().zip(exponent.slopes) {
            *a = by_base * *a + by_power * b;
        }
        Self { value, slopes }
    }
}

/// A slope, or none where it is vertical: at zero a root and a power below 1 rise without bound, and
/// infinity times the zero slope of a constant is no number. The value is right all the same, and so is
/// the derivative by everything else (of an exponent, say).
#[inline(always)]
fn steep(slope: f64) -> f64 {
    if slope.is_infinite() { 0.0 } else { slope }
}

#[cfg(test)]
mod tests {
    use num_dual::{DualNum, DualSVec64};

    use super::*;

    type Oracle = DualSVec64<DUAL_WIDTH>;

    fn expression(x: Dual, y: Dual) -> Dual {
        let half = Dual::of(0.5);
        (Real::sin(x) * y + Real::exp(-x * half)) / (Dual::one() + Real::sqrt(y * y + half))
            - Real::tanh(x - y) * Real::cos(y)
    }

    fn oracle(x: Oracle, y: Oracle) -> Oracle {
        (x.sin() * y + (-x * 0.5).exp()) / ((y * y + 0.5).sqrt() + 1.0) - (x - y).tanh() * y.cos()
    }

    #[test]
    fn agrees_with_num_dual() {
        for (a, b) in [(0.3, -1.2), (2.0, 0.7), (-1.5, -0.1)] {
            let got = expression(variable(a, 2), variable(b, 7));
            let want = oracle(
                Oracle::from_re(a).derivative(2),
                Oracle::from_re(b).derivative(7),
            );
            assert!((got.value() - want.re).abs() < 1e-14);
            let eps = want.eps.0.unwrap();
            for i in 0..DUAL_WIDTH {
                assert!((derivative(&got, i) - eps[i]).abs() < 1e-13, "{i}");
            }
        }
    }

    /// Narrow ones have the digits of a wide one.
    #[test]
    fn the_width_changes_no_digit() {
        fn of<const N: usize>(a: f64, b: f64) -> [f64; 3] {
            let (x, y) = (variable_of::<N>(a, 0), variable_of::<N>(b, 1));
            let all = Real::powf(x * x, y) / Real::atan2(x, y) - Real::tanh(x) * Real::exp(y);
            [all.value(), derivative(&all, 0), derivative(&all, 1)]
        }
        for (a, b) in [(0.3, -1.2), (2.0, 0.7)] {
            let wide = of::<DUAL_WIDTH>(a, b);
            assert_eq!(of::<NARROW_WIDTH>(a, b), wide);
            assert_eq!(of::<TINY_WIDTH>(a, b), wide);
        }
    }

    #[test]
    fn a_branch_takes_the_derivative_of_its_side() {
        let x = variable(-2.0, 3);
        assert_eq!(Real::abs(x).value(), 2.0);
        assert_eq!(derivative(&Real::abs(x), 3), -1.0);
        assert_eq!(derivative(&x.clamp(Dual::of(-1.0), Dual::of(1.0)), 3), 0.0);
    }

    /// An input at 0 V to the power of a parameter below 1: the input is a constant, the power is not.
    #[test]
    fn a_power_at_zero_has_a_derivative() {
        let power = Dual::of(0.0).powf(variable(0.5, 0));
        assert_eq!((power.value(), derivative(&power, 0)), (0.0, 0.0));
        let root = Real::sqrt(variable(0.0, 0) * Dual::of(0.0));
        assert_eq!((root.value(), derivative(&root, 0)), (0.0, 0.0));
    }

    #[test]
    fn elementary_functions_have_their_derivatives() {
        let h = 1e-6;
        type Pair = (fn(f64) -> f64, fn(Dual) -> Dual);
        let functions: [Pair; 9] = [
            (Real::sin, Real::sin),
            (Real::cos, Real::cos),
            (Real::tanh, Real::tanh),
            (Real::exp, Real::exp),
            (Real::sqrt, Real::sqrt),
            (Real::ln, Real::ln),
            (|x| Real::atan2(x, 2.0 - x), |x| x.atan2(Dual::of(2.0) - x)),
            (|x| Real::powf(x, 1.5 * x), |x| x.powf(Dual::of(1.5) * x)),
            (|x| Real::powf(-x, 3.0), |x| (-x).powf(Dual::of(3.0))),
        ];
        for (plain, dual) in functions {
            let numeric = (plain(0.7 + h) - plain(0.7 - h)) / (2.0 * h);
            assert!((derivative(&dual(variable(0.7, 0)), 0) - numeric).abs() < 1e-9);
        }
    }
}
