//! The exponential function in double precision.

use crate::tanh::{BIAS, EXPONENT, WHOLE};

/// `(e^r - 1 - r)/r²` by ascending powers of `r`.
const Q: [f64; 10] = [
    0.500_000_000_000_000_1,
    0.166_666_666_666_666_69,
    0.041_666_666_666_624_13,
    0.008_333_333_333_330_062,
    0.001_388_888_891_721_371_7,
    0.000_198_412_698_630_536_18,
    2.480_152_129_595_437_6e-5,
    2.755_726_845_999_706_4e-6,
    2.762_008_844_540_974_6e-7,
    2.510_038_549_551_032e-8,
];

/// `ln 2` in two parts: the first with so few digits that 1024 times it is exact.
const LN_2: [f64; 2] = [0.693_147_180_559_890_3, 5.497_923_018_708_371e-14];
/// `1/ln 2`.
const PER_LN_2: f64 = core::f64::consts::LOG2_E;
/// Up to here, in size, the result is a normal number.
const NORMAL: f64 = 708.0;

/// `e^x` to one unit of the last digit.
///
/// ```text
/// x = k ln 2 + r, |r| ≤ ln 2/2        e^x = 2^k (1 + (r + r² Q(r)))
/// ```
///
/// `Q` of degree 9 meets `(e^r - 1 - r)/r²` at the zeros of a Chebyshev polynomial (solved in 60 digits). It is off by
/// 1.6e-17 of the value at most, a seventh of what the last sum rounds.
///
/// It replaces the library's where the result is a normal number, for friction that falls with the speed asks for it at
/// every stage of a step: the library's chooses among ways by the size of `x`, which a processor cannot foresee there.
/// It has only sums and products, so it gives the same digits on every machine.
///
/// Reference: W. J. Cody, W. Waite (1980), "Software Manual for the Elementary Functions", ch. 6 (argument reduction with
/// a constant in two parts); E. W. Cheney (1966), "Introduction to Approximation Theory" (interpolation at the zeros of
/// Chebyshev polynomials); G. Estrin (1960), Proceedings of the Western Joint Computer Conference, 33–40 (a polynomial in
/// pairs of terms).
pub(crate) fn exp(x: f64) -> f64 {
    if x.abs() <= NORMAL {
        normal(x)
    } else {
        libm::exp(x)
    }
}

#[inline(always)]
fn normal(x: f64) -> f64 {
    let shifted = x * PER_LN_2 + WHOLE;
    let k = shifted - WHOLE;
    let r = (x - k * LN_2[0]) - k * LN_2[1];
    let t = r * r;
    let pair = |i: usize| Q[i] + Q[i + 1] * r;
    let low = pair(0) + t * pair(2);
    let high = (pair(4) + t * pair(6)) + t * t * pair(8);
    let near_one = 1.0 + (r + t * (low + t * t * high));
    // The lowest bits of `shifted` are `k`, and two's complement takes care of its sign.
    near_one * f64::from_bits(shifted.to_bits().wrapping_add(BIAS) << EXPONENT)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values known to 60 digits.
    #[test]
    fn it_has_its_last_digit_but_one() {
        for (x, exact) in [
            (-708.0, 3.307_553_003_638_408e-308),
            (-30.0, 9.357_622_968_840_175e-14),
            (-1.0, 0.367_879_441_171_442_33),
            (-0.346_6, 0.707_088_106_941_018_9),
            (0.346_5, 1.414_109_493_830_362_4),
            (0.5, 1.648_721_270_700_128_2),
            (10.0, 22_026.465_794_806_718),
            (708.0, 3.023_383_144_276_055e307),
        ] {
            let (y, exact): (f64, f64) = (exp(x), exact);
            assert!(y.to_bits().abs_diff(exact.to_bits()) <= 1, "{x}: {y}");
        }
        assert_eq!(exp(0.0), 1.0);
        assert_eq!(exp(-0.0), 1.0);
    }

    /// Numbers of every size, against the library's, which is off by one unit itself.
    #[test]
    fn it_is_that_of_the_library() {
        let mut worst = 0;
        for exponent in BIAS - 60..=BIAS + 10 {
            for i in 0..2000u64 {
                let bits = (exponent << EXPONENT) | (i * 2_251_799_813_703);
                for x in [f64::from_bits(bits), -f64::from_bits(bits)] {
                    let (y, library) = (exp(x), libm::exp(x));
                    worst = worst.max(y.to_bits().abs_diff(library.to_bits()));
                }
            }
        }
        assert!(worst <= 1, "{worst}");
    }

    #[test]
    fn it_ends_where_numbers_end() {
        assert_eq!(exp(710.0), f64::INFINITY);
        assert_eq!(exp(f64::INFINITY), f64::INFINITY);
        assert_eq!(exp(-746.0), 0.0);
        assert_eq!(exp(f64::NEG_INFINITY), 0.0);
        assert!(exp(-740.0) > 0.0);
        assert!(exp(f64::NAN).is_nan());
    }
}
