//! A model compared with a log.

use loopsight_diagnosis::{FitSettings, Measurements, compare, fit};

use crate::answers::CompareAnswer;
use crate::error::Result;
use crate::session::Session;
use crate::watch::{Watch, watched};

/// How a model is compared with a log.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct CompareOptions {
    /// Whether the answer has the series of numbers, sample by sample; by default it has not.
    pub series: bool,
    /// Who gets the progress, and what stops the work.
    pub watch: Watch,
}

watched!(CompareOptions);

impl CompareOptions {
    /// Whether the answer has the series of numbers, sample by sample.
    #[must_use]
    pub fn series(mut self, series: bool) -> Self {
        self.series = series;
        self
    }
}

impl Session {
    /// Compares the model with the log: free run and one-step prediction, and where it fails.
    ///
    /// The model of a log that describes itself has no values, so they are fitted first. The answer then is the least
    /// error that the plain model can have on this log.
    ///
    /// # Errors
    ///
    /// Values are missing, nothing is measured, or the free run diverges.
    pub fn compare(&self, options: &CompareOptions) -> Result<CompareAnswer> {
        let data = self.data()?;
        let mut about = self.about(data);
        let work = options.watch.work();
        let comparison = if self.described {
            data.refuse_fatal()?;
            about.notes.push(format!(
                "No model file was given: the parameters of the plain `{}` model were fitted to this \
                 log first, so this is the least error the model can have here.",
                data.model.plant.id
            ));
            let settings = FitSettings::default();
            let measured = Measurements::new(&data.runs).with_faults(&data.faults);
            fit(&data.model, &measured, &settings, &work)?.comparison
        } else {
            compare(&data.model, &data.measurements(), &work)?
        };
        Ok(CompareAnswer::new(comparison, about, options.series))
    }
}
