//! The hyperbolic tangent in single and in double precision.

/// From here on `tanh x` is taken for 1; it is less by 3.4e-7 at most.
const LIMIT: f32 = 7.8;

/// Numerator, by ascending powers of `x²`.
const P: [f32; 4] = [0.999_999_9, 0.129_431_16, 2.969_889e-3, 1.163_571_9e-5];

/// Denominator.
const Q: [f32; 5] = [
    1.0,
    0.462_763_53,
    2.389_239_7e-2,
    2.413_546e-4,
    2.526_236_3e-7,
];

/// `tanh x` to four units of the last digit, odd, and never beyond 1.
///
/// ```text
/// tanh x ≈ x P(x²)/Q(x²)        |x| ≤ 7.8, ±1 beyond
/// ```
///
/// `P` and `Q` of degrees 3 and 4 are those that make the greatest relative error least over that range: it is
/// 1.2e-7, half of what rounding adds (found by Remez' exchange in 60 digits). The range ends where both together
/// still stay below 1.
///
/// It replaces the library's `tanhf`, because friction needs it once per wheel and regression in every tick of a
/// microcontroller. The library's, by way of `expm1`, takes more than twice as many instructions. This one has only
/// sums, products and one quotient, so it gives the same digits on every machine.
///
/// Reference: E. Y. Remez (1934), "Sur le calcul effectif des polynômes d'approximation de Tchebichef",
/// Comptes rendus 199, 337–340; E. W. Cheney (1966), "Introduction to Approximation Theory", ch. 5 (rational
/// approximation).
pub(crate) fn tanhf(x: f32) -> f32 {
    if x.abs() > LIMIT {
        return 1f32.copysign(x);
    }
    let t = x * x;
    let above = ((P[3] * t + P[2]) * t + P[1]) * t + P[0];
    let below = (((Q[4] * t + Q[3]) * t + Q[2]) * t + Q[1]) * t + Q[0];
    x * above / below
}

/// `P` less its 1, by ascending powers of `s²`.
const ABOVE: [f64; 3] = [
    0.128_166_899_489_241_76,
    0.002_792_957_722_830_962,
    7.359_723_449_007_344e-6,
];

/// `Q` less its 1.
const BELOW: [f64; 3] = [
    0.461_500_232_822_575_1,
    0.023_293_035_330_357_61,
    0.000_206_594_425_444_100_63,
];

/// `(P - Q)/s²`.
const BETWEEN: [f64; 3] = [
    ABOVE[0] - BELOW[0],
    ABOVE[1] - BELOW[1],
    ABOVE[2] - BELOW[2],
];

/// `ln 2/2` in two parts: the first with so few digits that 54 times it is exact.
const HALF_LN_2: [f64; 2] = [0.346_573_590_279_831_5, 1.411_764_528_151_578_9e-13];
/// `2/ln 2`.
const PER_HALF_LN_2: f64 = 2.885_390_081_777_926_8;
/// So much less than `x` in halves of `ln 2` is rounded to `k`: half for rounding down, the rest so that `s` stays large
/// enough for two terms of one sign.
const LATE: f64 = 1.1;
/// Up to here `k` would be 0; `tanh x` is just above 1/2.
const SMALL: f64 = 0.5545;
/// Added to a number below 2⁵¹ it leaves the nearest whole number in the lowest bits.
pub(crate) const WHOLE: f64 = 6_755_399_441_055_744.0;
/// From here on `tanh x` is nearest to 1.
const ONE_FROM: f64 = 19.1;
/// Where the exponent of a number begins.
pub(crate) const EXPONENT: u32 = 52;
/// The exponent of 1.
pub(crate) const BIAS: u64 = 1023;

/// `tanh x` to two units of the last digit, 0.3 on average; odd, and never beyond 1.
///
/// ```text
/// |x| = k ln 2/2 + s        e = 2⁻ᵏ        tanh s ≈ s P(s²)/Q(s²)
/// k = 0:  tanh |x| = s + s (P - Q)/Q
/// k > 0:  tanh |x| = 1 - 2 e (Q - s P)/((1 + e) Q + (1 - e) s P)
/// ```
///
/// The last line is the sum formula with `tanh(k ln 2/2) = (1 - e)/(1 + e)`, so one quotient does it all, without an
/// exponential. In both lines what rounding spoils is the small one of two terms. `k` is 0 up to 0.5545, where
/// `tanh x` is 1/2, and then the whole number that leaves `s` between 0.208 and 0.555.
///
/// `P` and `Q` of degree 3, both 1 at zero, meet `tanh s/s` at the zeros of a Chebyshev polynomial in `s²`, shifted so
/// that one of them is zero itself (solved in 60 digits). They are off by 1.3e-19 of the value at most, a thousandth of
/// what rounding adds. Measured against 120 bits, 180 000 numbers from 1e-300 to 22: 1.99 units at most, beyond
/// 2 and below 0.34 no more than 0.6. A larger `x` may have a value that is smaller by two units, near `ln 2`.
///
/// It replaces the library's, which goes by way of `expm1`, for the reason [`tanhf`] gives. It has only sums,
/// products and one quotient, so it gives the same digits on every machine.
///
/// Reference: J. F. Hart et al. (1968), "Computer Approximations" (argument reduction, and the hyperbolic
/// tangent by its sum formula); W. J. Cody, W. Waite (1980), "Software Manual for the Elementary Functions", ch. 6
/// (a constant in two parts) and 13 (`tanh` as `s + s R(s²)`); E. W. Cheney (1966) (interpolation at the zeros of
/// Chebyshev polynomials).
pub(crate) fn tanh(x: f64) -> f64 {
    let size = x.abs();
    if size >= ONE_FROM {
        return 1f64.copysign(x);
    }
    if size <= SMALL {
        let t = size * size;
        return (size + size * (t * between(t)) / below(t)).copysign(x);
    }
    let shifted = (size * PER_HALF_LN_2 - LATE) + WHOLE;
    let k = shifted - WHOLE;
    let e = f64::from_bits((BIAS - (shifted.to_bits() & 63)) << EXPONENT);
    let s = (size - k * HALF_LN_2[0]) - k * HALF_LN_2[1];
    let t = s * s;
    let (above, below) = (s * above(t), below(t));
    let rest = (e + e) * (below - above) / ((1.0 + e) * below + (1.0 - e) * above);
    (1.0 - rest).copysign(x)
}

/// `P` where `t = s²`.
#[inline(always)]
fn above(t: f64) -> f64 {
    (1.0 + t * ABOVE[0]) + t * t * (ABOVE[1] + t * ABOVE[2])
}

/// `Q`.
#[inline(always)]
fn below(t: f64) -> f64 {
    (1.0 + t * BELOW[0]) + t * t * (BELOW[1] + t * BELOW[2])
}

/// `(P - Q)/t`.
#[inline(always)]
fn between(t: f64) -> f64 {
    BETWEEN[0] + t * (BETWEEN[1] + t * BETWEEN[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of every size, against double precision.
    #[test]
    fn it_is_the_hyperbolic_tangent() {
        let mut worst = 0.0f64;
        // Every 997th number from 0 to infinity.
        for bits in (0..=f32::INFINITY.to_bits()).step_by(997) {
            let x = f32::from_bits(bits);
            let (y, exact) = (tanhf(x), libm::tanh(f64::from(x)));
            assert!((0.0..=1.0).contains(&y), "{x}: {y}");
            assert_eq!(tanhf(-x), -y);
            // Below the smallest normal number digits are lost.
            if x >= f32::MIN_POSITIVE {
                worst = worst.max((f64::from(y) / exact - 1.0).abs());
            }
        }
        println!("worst relative error {worst:.2e}");
        assert!(worst < 4.0 * f64::from(f32::EPSILON));
        // Every one of those that come near 1.
        for bits in 4f32.to_bits()..=LIMIT.to_bits() {
            assert!(tanhf(f32::from_bits(bits)) <= 1.0);
        }
        assert!(tanhf(f32::NAN).is_nan());
        assert_eq!(tanhf(f32::INFINITY), 1.0);
    }

    /// Values known to 60 digits, on both sides of where `k` changes.
    #[test]
    fn double_precision_has_its_last_digit_but_two() {
        for (x, exact) in [
            (1e-5, 9.999_999_999_666_668e-6),
            (0.1, 0.099_667_994_624_955_82),
            (0.25, 0.244_918_662_403_709_13),
            (0.5, 0.462_117_157_260_009_74),
            (0.55, 0.500_520_211_190_235_3),
            (0.626_639_424_891_792_1, 0.555_733_859_334_804),
            (0.859_717_087_612_655_9, 0.696_111_880_366_001_6),
            (1.5, 0.905_148_253_644_866_4),
            (3.0, 0.995_054_753_686_730_5),
            (8.0, 0.999_999_774_929_675_8),
            (18.5, 0.999_999_999_999_999_8),
            (19.1, 1.0),
        ] {
            let (y, exact): (f64, f64) = (tanh(x), exact);
            assert!(y.to_bits().abs_diff(exact.to_bits()) <= 2, "{x}: {y}");
        }
    }

    /// Numbers of every size, against the library's, which is off by one unit itself.
    #[test]
    fn double_precision_is_that_of_the_library() {
        let (mut worst, mut before) = (0, 0.0);
        // Some 2 000 numbers of each power of two, odd steps that show every low bit.
        for bits in (0..=f64::INFINITY.to_bits()).step_by((1 << 41) + 12_345) {
            let x = f64::from_bits(bits);
            let y = tanh(x);
            assert!((0.0..=1.0).contains(&y), "{x}: {y}");
            assert_eq!(tanh(-x).to_bits(), (-y).to_bits());
            worst = worst.max(y.to_bits().abs_diff(libm::tanh(x).to_bits()));
            assert!(y >= before, "{x}");
            before = y;
        }
        println!("worst: {worst} units");
        assert!(worst <= 3);
        assert!(tanh(f64::NAN).is_nan());
        assert_eq!(tanh(f64::INFINITY), 1.0);
        for x in [0.0, f64::from_bits(1), f64::MIN_POSITIVE, 1e-9] {
            assert_eq!(tanh(x), x);
        }
    }
}
