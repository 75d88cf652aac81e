//! Reports: pages that a person looks at, and results in words.
//!
//! | page | shows |
//! |---|---|
//! | [`comparison_page`] | a model compared with measurements, and where it fails |
//! | [`fit_page`] | parameters with intervals, and the fitted model compared with measurements |
//! | [`diagnosis_page`] | which physical effect a model lacks, with the evidence |
//! | [`improvement_page`] | the error as it falls, effect by effect |
//! | [`run_page`] | a control loop at work |
//!
//! A page is the text of an HTML file. Style, data and the charts' library (plotly.js) are inside, compressed, so
//! it opens offline in any browser of 2023 or later. It fetches nothing and sends nothing. [`figure_svg`] draws static pictures for texts.
//!
//! ```
//! use loopsight_recordings::output;
//! use loopsight_report::{Context, ControlledTrace, LoopRecord, run_page};
//!
//! // What a loop did, tick by tick, in SI units. Here: one signal, three ticks.
//! let record = LoopRecord {
//!     period_s: 0.01,
//!     time: vec![0.0, 0.01, 0.02],
//!     controlled: vec![ControlledTrace {
//!         id: "speed".into(),
//!         unit: "m/s".into(),
//!         reference: vec![0.2, 0.2, 0.2],
//!         measured: vec![0.0, 0.1, 0.18],
//!         ideal: None,
//!     }],
//!     end: "the reference ended".into(),
//!     ..LoopRecord::default()
//! };
//! let context = Context {
//!     title: "First run".into(),
//!     model_name: "Twil".into(),
//!     ..Context::default()
//! };
//! let page = run_page(&context, &record);
//! assert!(page.contains("The loop ran 3 ticks of 10\u{a0}ms, 0.03\u{a0}s in all."));
//!
//! let folder = tempfile::tempdir()?;
//! output::save(&folder.path().join("run.html"), page.as_bytes())?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! What a page says is computed from every sample. Only what it draws is thinned out and rounded.
//!
//! All sentences are made in [`words`], as plain text. The command line prints the same ones, and JSON answers
//! have them under `summary`.

mod bars;
mod beside;
mod candidates;
mod chart;
mod comparison;
mod conclusion;
mod diagnosis;
mod errors;
mod figure;
mod fit;
mod html;
mod improvement;
mod intervals;
mod inventory;
mod next;
mod numbers;
mod packed;
mod page;
mod record;
mod residual_force;
mod run;
mod run_figure;
mod scatter;
mod symptom;
mod thin;
mod typeset;
pub mod words;

#[cfg(test)]
mod findings;
#[cfg(test)]
mod fixtures;
#[cfg(test)]
mod gallery;

pub use comparison::comparison_page;
pub use diagnosis::diagnosis_page;
pub use figure::{Figure, FigurePanel, FigureTrace, Style, figure_svg};
pub use fit::fit_page;
pub use improvement::improvement_page;
pub use inventory::inventory_page;
pub use page::{Context, PAGE_STYLE};
pub use record::{
    ControlledTrace, InnovationTrace, InputTrace, LoopRecord, ParameterTrace, Timing,
};
pub use run::run_page;
pub use run_figure::run_figure;
pub use symptom::{MeanAt, MeanOver, symptom_svg};
pub use words::ASTRAY;
