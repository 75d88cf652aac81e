//! Compare a model with measurements, fit it, find which physical effect is missing, and design the next
//! experiment.
//!
//! # Workflow
//!
//! 1. [`compare`](compare()): how far is the model from the measurements? The *free run* is simulated from the
//!    inputs alone, the *one-step prediction* from the measured state. [`Comparison::where_it_fails`] says
//!    under which conditions the error is large.
//! 2. [`fit`](fit()): which parameters make the free run agree best, and how well do the data determine each?
//!    Intervals hold for coloured noise; what is not determined is named.
//! 3. [`diagnose`](diagnose()): which effect of the library is missing? Each is added at every channel it fits,
//!    all parameters are fitted again, and it is judged on validation data. Effects that the data cannot tell
//!    apart are named together.
//! 4. [`improve`](improve()): add the missing effect and begin again, until nothing more is missing.
//! 5. [`experiment`](experiment()): which inputs tell two effects apart, or determine a parameter?
//! 6. [`residual_force`](residual_force()): where no effect of the library fits, what does the missing force
//!    depend on?
//!
//! ```
//! use loopsight_diagnosis::{Conclusion, Measurements, Work, compare, diagnose};
//! use loopsight_model::model::Model;
//! use loopsight_model::run::{Rows, Run};
//! use loopsight_model::simulate::Simulator;
//! use loopsight_plants as _; // the library of plants and effects
//!
//! // A motor with dry friction, measured every 10 ms while its voltage jumps between some levels.
//! let axis = "[plant.dc_axis]\nK_A = -2.0\nK_C = 8.0\n\n[log.measured.speed]\n";
//! let friction = "\n[[effect]]\n[effect.coulomb_friction]\nat = [\"shaft\"]\nlevel = 0.8\n";
//! let (machine, _) = Model::from_toml("machine.toml", &format!("{axis}{friction}"))?;
//! let mut simulator = Simulator::new(&machine, &machine.values());
//! let (mut time, mut voltage, mut speed) = (Vec::new(), Vec::new(), Vec::new());
//! for k in 0..1500_u32 {
//!     let level = [3.0, -2.0, 1.5, -4.0, 0.5, -1.0][(k / 50) as usize % 6];
//!     time.push(0.01 * f64::from(k));
//!     voltage.push(level);
//!     // The sensor rounds to a hundredth.
//!     speed.push((100.0 * simulator.state()[0]).round() / 100.0);
//!     simulator.advance(0.01 * f64::from(k + 1), &[level]);
//! }
//! let runs = [Run::new("", time, Rows::new(1, voltage), Rows::new(1, speed))?];
//!
//! // What does the plain model lack?
//! let (model, _) = Model::from_toml("axis.toml", axis)?;
//! let measurements = Measurements::new(&runs);
//! let before = compare(&model, &measurements, &Work::quiet())?;
//! let diagnosis = diagnose(&model, &measurements, &Work::quiet())?;
//! assert_eq!(diagnosis.verdict, Conclusion::EffectMissing);
//! let found = &diagnosis.candidates[0];
//! assert_eq!(found.place.effect, "coulomb_friction");
//! assert!((found.parameters["level"].value - 0.8).abs() < 0.05);
//! assert!(found.nrmse < 0.1 * before.nrmse);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Long work
//!
//! A diagnosis takes seconds to minutes. [`Work`] reports how far it is ([`Progress`]) and stops it
//! ([`CancelToken`]); work that is cancelled keeps what it has found. [`Work::decided_by`] sets other
//! [`Criteria`] than the default ones: these are all thresholds that decide a verdict, each with unit and reason.
//!
//! # Features
//!
//! None: the crate needs `std`, and builds for `wasm32-unknown-unknown` as well. The effects that are tried are
//! those linked into the program. The library of them is `loopsight-plants`; effects of other crates are tried as
//! well. An expression in the model file is a part of the model: it is fitted with whatever is tried beside it.

mod advice;
mod along;
mod arrive;
mod both_ways;
mod candidates;
#[cfg(test)]
mod chance;
mod choose;
mod commands;
mod compare;
mod conclude;
mod conclusion;
pub mod criteria;
mod derived;
mod diagnose;
mod discover;
mod early;
mod effect_at;
mod ending;
mod ends;
mod equivalent;
mod error;
mod estimate;
mod estimates;
mod excerpt;
mod experiment;
mod explain;
mod figure;
mod first;
mod fit;
mod fitted;
mod flatness;
mod floor;
mod goes;
mod gram;
mod growth;
mod holdout;
mod improve;
mod improvement;
mod in_motion;
mod in_place;
mod judge;
mod kept;
mod levenberg_marquardt;
mod linearised;
mod long;
mod looks;
mod measurements;
mod motion;
mod moves;
mod narrow;
mod noise;
mod observer;
mod omitted;
mod output_error;
mod pace;
mod pairs;
mod passage;
mod places;
mod plausible;
mod positions;
mod prediction;
mod problem;
mod progress;
mod promise;
mod refine;
mod refined;
mod regressed;
mod regression;
mod residual_force;
mod rls;
mod rounding;
mod scatter;
mod score;
mod search;
mod sensitivities;
mod set_aside;
mod settings;
mod sharpness;
mod shows;
mod signs;
mod simplify;
mod sizes;
mod solve;
mod speeds;
mod split;
mod stamps;
mod starts;
mod stride;
mod substance;
mod sufficiency;
mod suited;
#[cfg(test)]
mod swing;
mod telling;
pub mod tracking;
mod trial;
mod unfold;
mod unshown;
mod untried;
mod where_it_fails;
mod whole;
mod window;
mod worth;

pub use arrive::{Convergence, Tried};
pub use compare::{Comparison, RunTrace, SignalTrace, compare};
pub use conclusion::{Advice, Conclusion, Diagnosis, Explanation, Level};
pub use criteria::{Criteria, Criterion, Reason};
pub use derived::Known;
pub use diagnose::diagnose;
pub use early::{Early, Finding, Fitted, Promised};
pub use effect_at::EffectAt;
pub use error::{CompareError, FitError};
pub use estimate::{Estimate, OfRun, ParameterVerdict};
pub use experiment::{
    Considered, Drive, ExperimentLimits, Plan, Promise, Question, QuestionError, effect_at,
    experiment,
};
pub use fit::fit;
pub use fitted::Fit;
pub use improve::improve;
pub use improvement::{Improvement, ImprovementStep};
pub use in_motion::{InMotion, in_motion};
pub use measurements::Measurements;
pub use observer::{Because, Correction};
pub use progress::{CancelToken, Cancelled, Progress, Simulated, Stage, Work};
pub use residual_force::{
    ForceBin, ForceCurve, ForceDependence, ForceExpression, ResidualForce, residual_force,
};
pub use score::SignalScore;
pub use settings::{FitSettings, ImproveSettings, Method, Scheme};
pub use untried::Untried;
pub use where_it_fails::Statement;
