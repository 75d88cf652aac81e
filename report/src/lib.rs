//! What a person looks at: pages that show a model against measurements, a fit, what a model
//! lacks, or a loop at work.
//!
//! [`comparison_page`], [`fit_page`], [`diagnosis_page`], [`improvement_page`] and [`run_page`] return the text of an HTML file that needs
//! nothing but a browser: style, data and the charts' library (plotly.js) are inside, nothing is
//! fetched. [`save`] writes it whole or not at all. [`figure_svg`] draws static pictures for texts.
//!
//! Numbers are thinned out and rounded for drawing only; what a page *says* is computed from every
//! sample.

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
mod next;
mod numbers;
mod packed;
mod page;
mod record;
mod residual_force;
mod run;
mod run_figure;
mod save;
mod scatter;
mod thin;
mod words;

#[cfg(test)]
mod findings;
#[cfg(test)]
mod fixtures;

pub use comparison::comparison_page;
pub use diagnosis::diagnosis_page;
pub use figure::{Figure, FigurePanel, FigureTrace, Style, figure_svg};
pub use fit::fit_page;
pub use improvement::improvement_page;
pub use numbers::ASTRAY;
pub use page::Context;
pub use record::{
    ControlledTrace, InnovationTrace, InputTrace, LoopRecord, ParameterTrace, Timing,
};
pub use run::run_page;
pub use run_figure::run_figure;
pub use save::{ReportError, save};
