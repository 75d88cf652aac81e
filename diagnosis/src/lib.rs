//! Hold a model against measurements: free run and one-step prediction ([`compare`](compare())),
//! recursive and output-error fits ([`fit`]) with intervals that mean what they say.

mod advice;
mod candidates;
mod choose;
mod compare;
mod conclude;
mod conclusion;
pub mod criteria;
mod derived;
mod diagnose;
mod error;
mod experiment;
mod explain;
pub mod fit;
mod flatness;
mod floor;
mod growth;
mod holdout;
mod improve;
mod judge;
mod measurements;
mod motion;
mod noise;
mod observer;
mod output_error;
mod positions;
mod prediction;
mod problem;
mod progress;
mod refine;
mod regression;
mod residual_force;
mod rls;
mod rounding;
mod score;
mod search;
mod solve;
mod starts;
mod stride;
mod sufficiency;
pub mod tracking;
mod trial;
mod where_it_fails;
mod window;

pub use advice::Advice;
pub use compare::{Comparison, RunTrace, SignalTrace, compare};
pub use conclusion::{Conclusion, Diagnosis, Explanation, Level, Place};
pub use criteria::{Criteria, Criterion, Reason};
pub use diagnose::diagnose;
pub use error::{CompareError, FitError};
pub use experiment::{
    Considered, Drive, Limits, Plan, Promise, Question, QuestionError, experiment, place,
};
pub use fit::{Estimate, Fit, FitSettings, Method, Verdict};
pub use improve::{Improvement, Step, improve};
pub use measurements::Measurements;
pub use observer::{Because, Held};
pub use progress::{CancelToken, Cancelled, Progress, Stage, Work};
pub use regression::{Regression, Scheme};
pub use residual_force::{Bin, Curve, Dependence, Expression, ResidualForce, residual_force};
pub use score::SignalScore;
pub use where_it_fails::Statement;
