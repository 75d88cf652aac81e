//! Hold a model against measurements: free run and one-step prediction ([`compare`](compare())),
//! recursive and output-error fits ([`fit`]) with intervals that mean what they say.

mod compare;
pub mod fit;
mod flatness;
mod noise;
mod output_error;
mod prediction;
mod problem;
mod regression;
mod rls;
mod score;
pub mod tracking;

pub use compare::{CompareError, Comparison, RunTrace, SignalTrace, compare};
pub use fit::{Estimate, Fit, FitError, FitSettings, Method, Verdict};
pub use regression::{Regression, Scheme};
pub use score::SignalScore;
