//! Chance that is the same in every run of a test.

/// Draws of a fixed pseudo-random sequence, uniform in ±½.
pub(crate) fn uniform(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    }
}

/// `n` of them.
pub(crate) fn white(n: usize, seed: u64) -> Vec<f64> {
    std::iter::repeat_with(uniform(seed)).take(n).collect()
}

/// `n` sums of twelve of them: nearly normal, with a variance of one.
pub(crate) fn normal(n: usize, seed: u64) -> Vec<f64> {
    let all = white(12 * n, seed);
    all.chunks(12).map(|some| some.iter().sum()).collect()
}
