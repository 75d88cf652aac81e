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
mod estimate;
mod experiment;
mod explain;
mod fit;
mod fitted;
mod flatness;
mod floor;
mod growth;
mod holdout;
mod improve;
mod improvement;
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
mod settings;
mod solve;
mod starts;
mod stride;
mod sufficiency;
pub mod tracking;
mod trial;
mod where_it_fails;
mod window;

pub use compare::{Comparison, RunTrace, SignalTrace, compare};
pub use conclusion::{Advice, Conclusion, Diagnosis, EffectAt, Explanation, Level};
pub use criteria::{Criteria, Criterion, Reason};
pub use diagnose::diagnose;
pub use error::{CompareError, FitError};
pub use estimate::{Estimate, ParameterVerdict};
pub use experiment::{
    Considered, Drive, ExperimentLimits, Plan, Promise, Question, QuestionError, effect_at,
    experiment,
};
pub use fit::fit;
pub use fitted::Fit;
pub use improve::improve;
pub use improvement::{Improvement, ImprovementStep};
pub use measurements::Measurements;
pub use observer::{Because, Correction};
pub use progress::{CancelToken, Cancelled, Progress, Stage, Work};
pub use residual_force::{
    ForceBin, ForceCurve, ForceDependence, ForceExpression, ResidualForce, residual_force,
};
pub use score::SignalScore;
pub use settings::{FitSettings, Method, Scheme};
pub use where_it_fails::Statement;
