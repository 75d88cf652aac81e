//! The hyperbolic tangent in single precision.

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
}
