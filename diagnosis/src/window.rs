//! Bartlett's window: how autocovariances are weighted where they are added up to a variance.
//!
//! ```text
//! w(l) = 1 - l/(L + 1)        l = 1 … L
//! ```
//!
//! (M. S. Bartlett, 1946, "On the theoretical specification and sampling properties of autocorrelated
//! time-series", Supplement to the Journal of the Royal Statistical Society 8, 27–41; W. K. Newey, K. D. West,
//! 1987, "A simple, positive semi-definite, heteroskedasticity and autocorrelation consistent covariance
//! matrix", Econometrica 55, 703–708.) How many lags `L` there are is a criterion: comparisons of losses, the
//! number of independent losses and standard errors each have their own.

/// `L` for `n` samples: so many roots of their number, at most `most`.
pub(crate) fn lags(roots: f64, n: usize, most: usize) -> usize {
    ((roots * (n as f64).sqrt()) as usize).min(most)
}

/// The weight of a lag.
pub(crate) fn bartlett(lag: usize, lags: usize) -> f64 {
    1.0 - lag as f64 / (lags + 1) as f64
}
