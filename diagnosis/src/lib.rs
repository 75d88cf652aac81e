//! Hold a model against measurements: free run and one-step prediction ([`compare`](compare())),
//! recursive and output-error fits ([`fit`]) with intervals that mean what they say.

mod advice;
mod candidates;
mod choose;
mod compare;
mod conclusion;
mod derived;
mod diagnose;
mod experiment;
pub mod fit;
mod flatness;
mod floor;
mod growth;
mod holdout;
mod improve;
mod judge;
mod motion;
mod noise;
mod observer;
mod output_error;
mod positions;
mod prediction;
mod problem;
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

pub use advice::Advice;
pub use compare::{CompareError, Comparison, RunTrace, SignalTrace, compare};
pub use conclusion::{Conclusion, Diagnosis, Explanation, Level, Place};
pub use diagnose::diagnose;
pub use experiment::{
    Considered, Drive, Limits, Plan, Promise, Question, QuestionError, experiment, place,
};
pub use fit::{Estimate, Fit, FitError, FitSettings, Method, Verdict};
pub use improve::{Improvement, Step, improve};
pub use observer::{Because, Held};
pub use regression::{Regression, Scheme};
pub use residual_force::{Bin, Curve, Dependence, Expression, ResidualForce, residual_force};
pub use score::SignalScore;
pub use where_it_fails::Statement;
