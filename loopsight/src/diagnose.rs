//! Which physical effect a model lacks.

use loopsight_diagnosis::diagnose;

use crate::answers::DiagnoseAnswer;
use crate::error::Result;
use crate::session::Session;
use crate::watch::{Watch, heard, watched};

/// How a model is diagnosed.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct DiagnoseOptions {
    /// Whether the answer has the series of numbers, sample by sample; by default it has not.
    pub series: bool,
    /// Who gets the progress, and what stops the work.
    pub watch: Watch,
}

watched!(DiagnoseOptions);
heard!(DiagnoseOptions);

impl DiagnoseOptions {
    /// Whether the answer has the series of numbers, sample by sample.
    #[must_use]
    pub fn series(mut self, series: bool) -> Self {
        self.series = series;
        self
    }
}

impl Session {
    /// Adds every effect of the library to the model at every channel it fits, and refits all parameters each time.
    /// Each is judged by its free run on validation data: the test log, or else held-out parts of the log.
    ///
    /// A log that is faulty or too short for the model is a verdict, not an error.
    ///
    /// # Errors
    ///
    /// The model cannot be fitted at all.
    pub fn diagnose(&self, options: &DiagnoseOptions) -> Result<DiagnoseAnswer> {
        let data = self.data()?;
        let work = options.watch.work();
        let engine = diagnose(&data.model, &data.measurements(), &work)?;
        Ok(DiagnoseAnswer::new(
            engine,
            self.about(data),
            data.shown(),
            options.series,
        ))
    }
}
