//! The measurements that a model is compared with, fitted to and judged on.

use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_recordings::Fault;

use crate::error::CompareError;

/// Measured runs: those to fit to, those to judge on, and what is wrong with the log.
#[derive(Clone, Copy, Debug, Default)]
pub struct Measurements<'a> {
    /// The runs that parameters are fitted to.
    pub runs: &'a [Run],
    /// Validation runs, which the fitted model is judged on; `None`: parts of `runs` are held out for that.
    pub test: Option<&'a [Run]>,
    /// Faults that were found in the log.
    pub faults: &'a [Fault],
}

impl<'a> Measurements<'a> {
    /// Runs without a fault; parts of them are held out for validation.
    pub fn new(runs: &'a [Run]) -> Self {
        Self {
            runs,
            ..Self::default()
        }
    }

    /// The same, judged on other runs where there are any.
    #[must_use]
    pub fn tested_on(mut self, test: Option<&'a [Run]>) -> Self {
        self.test = test;
        self
    }

    /// The same, with what is wrong with the log.
    #[must_use]
    pub fn with_faults(mut self, faults: &'a [Fault]) -> Self {
        self.faults = faults;
        self
    }

    /// Whether all runs have the inputs and the measured signals of `model`.
    pub(crate) fn check(&self, model: &Model) -> Result<(), CompareError> {
        let expected = [
            ("inputs", model.plant.inputs.len()),
            ("measured signals", model.measured.len()),
        ];
        let runs = self.runs.iter().chain(self.test.unwrap_or_default());
        for run in runs.filter(|run| !run.is_empty()) {
            let found = [run.n_inputs(), run.n_measured()];
            for ((what, expected), found) in expected.into_iter().zip(found) {
                if found != expected {
                    return Err(CompareError::OtherMachine {
                        what,
                        found,
                        expected,
                    });
                }
            }
        }
        Ok(())
    }
}
