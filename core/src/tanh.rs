//! The hyperbolic tangent in single precision.

/// From here on `tanh x` rounds to 1.
const LIMIT: f32 = 9.02;

/// Numerator, by ascending powers of `x²`.
const P: [f32; 5] = [
    0.999_999_98,
    0.133_797_15,
    3.494_030_8e-3,
    2.058_342_3e-5,
    1.331_899_5e-8,
];

/// Denominator.
const Q: [f32; 5] = [1.0, 0.467_130_3, 2.587_105_9e-2, 3.283_087e-4, 7.761_987e-7];

/// `tanh x` to three units of the last digit, odd, and never beyond 1.
///
/// ```text
/// tanh x ≈ x P(x²)/Q(x²)        |x| ≤ 9.02, ±1 beyond
/// ```
///
/// `P` and `Q` of degree 4 are those that make the greatest relative error least over that range: it is
/// 2.1e-8, a third of what rounding leaves (found by Remez' exchange in 60 digits).
///
/// It stands in for `tanhf` of a library because friction asks for it once per wheel and regression in every
/// tick of a microcontroller: by way of `expm1` that is twice as many instructions as this, which is nothing
/// but sums, products and one quotient, and so has the same digits on every machine.
///
/// Reference: E. Y. Remez (1934), "Sur le calcul effectif des polynômes d'approximation de Tchebichef",
/// Comptes rendus 199, 337–340; E. W. Cheney (1966), "Introduction to Approximation Theory", ch. 5 (rational
/// approximation).
pub(crate) fn tanhf(x: f32) -> f32 {
    if x.abs() > LIMIT {
        return 1f32.copysign(x);
    }
    let t = x * x;
    let at = |c: &[f32; 5]| (((c[4] * t + c[3]) * t + c[2]) * t + c[1]) * t + c[0];
    let y = x * at(&P) / at(&Q);
    if y.abs() > 1.0 { 1f32.copysign(y) } else { y }
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
        assert!(worst < 3.0 * f64::from(f32::EPSILON));
        assert!(tanhf(f32::NAN).is_nan());
        assert_eq!(tanhf(f32::INFINITY), 1.0);
    }
}
