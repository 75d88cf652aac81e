//! The parameters of a model, found from a log.

use loopsight_core::Parameter;
use loopsight_diagnosis::{Fit, FitSettings, fit};
use loopsight_model::config::{PathSegment, TomlSource};
use loopsight_model::model::Origin;
use serde::Serialize;

use crate::answers::FitAnswer;
use crate::error::Result;
use crate::model::Model;
use crate::session::Session;
use crate::watch::{Watch, watched};

/// How parameters are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Method {
    /// Least squares on the error of the free run.
    #[default]
    OutputError,
    /// Recursive least squares on a regression.
    Rls,
}

impl From<loopsight_diagnosis::Method> for Method {
    fn from(method: loopsight_diagnosis::Method) -> Self {
        match method {
            loopsight_diagnosis::Method::OutputError => Self::OutputError,
            loopsight_diagnosis::Method::Rls => Self::Rls,
        }
    }
}

impl From<Method> for loopsight_diagnosis::Method {
    fn from(method: Method) -> Self {
        match method {
            Method::OutputError => Self::OutputError,
            Method::Rls => Self::Rls,
        }
    }
}

pub use loopsight_diagnosis::Scheme;

/// How a model is fitted.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct FitOptions {
    /// How the parameters are found: by default with the error of the free run.
    pub method: Method,
    /// The regression that recursive least squares is fed with: by default the integrated one.
    pub regression: Scheme,
    /// Most iterations of [`Method::OutputError`]: 100 by default.
    pub max_iterations: u64,
    /// Whether the answer has the series of numbers, sample by sample; by default it has not.
    pub series: bool,
    /// Who gets the progress, and what stops the work.
    pub watch: Watch,
}

watched!(FitOptions);

impl Default for FitOptions {
    fn default() -> Self {
        let settings = FitSettings::default();
        Self {
            method: settings.method.into(),
            regression: settings.scheme,
            max_iterations: settings.max_iterations,
            series: false,
            watch: Watch::default(),
        }
    }
}

impl FitOptions {
    /// How the parameters are found.
    #[must_use]
    pub fn method(mut self, method: Method) -> Self {
        self.method = method;
        self
    }

    /// The regression that recursive least squares is fed with.
    #[must_use]
    pub fn regression(mut self, regression: Scheme) -> Self {
        self.regression = regression;
        self
    }

    /// Most iterations of [`Method::OutputError`].
    #[must_use]
    pub fn max_iterations(mut self, max_iterations: u64) -> Self {
        self.max_iterations = max_iterations;
        self
    }

    /// Whether the answer has the series of numbers, sample by sample.
    #[must_use]
    pub fn series(mut self, series: bool) -> Self {
        self.series = series;
        self
    }
}

impl Session {
    /// Finds the parameters of the model from the log, with 95 % intervals and what the data do not
    /// determine. Errors are on the test log, where there is one.
    ///
    /// # Errors
    ///
    /// The log has a fatal fault or too few samples, nothing is free to be fitted, or the solver gives
    /// up.
    pub fn fit(&self, options: &FitOptions) -> Result<FitAnswer> {
        let data = self.data()?;
        data.refuse_fatal()?;
        let settings = FitSettings {
            method: options.method.into(),
            scheme: options.regression,
            max_iterations: options.max_iterations,
        };
        let work = options.watch.work();
        let engine = fit(&data.model, &data.measurements(), &settings, &work)?;
        let text = self.fitted_text(&engine)?;
        let model = Model::from_toml(&self.model.file, &text)?;
        Ok(FitAnswer::new(
            engine,
            model,
            self.about(data),
            options.series,
        ))
    }

    /// The model's text with the values of the fit in it.
    fn fitted_text(&self, fit: &Fit) -> Result<String> {
        let values: Vec<(Vec<PathSegment>, f64)> = fit
            .model
            .parameters
            .iter()
            .zip(&self.model.composed.parameters)
            .filter(|(new, old)| {
                let found = old.free || old.per_run || new.origin == Origin::Log;
                found && new.value != old.value
            })
            .filter_map(|(new, _)| {
                let error = fit.parameters.get(&new.name).and_then(|p| p.std_error);
                let value = written(new.declaration, new.value?, error);
                Some((new.path.clone(), value))
            })
            .collect();
        let text = self.model.source()?.with_values(&values);
        let tied = fit.model.tied_names();
        if tied.is_empty() {
            return Ok(text);
        }
        Ok(match TomlSource::parse(&self.model.file, &text) {
            Ok(valued) => valued.with_tied(&tied),
            Err(_) => text,
        })
    }
}

/// What the text says for `value`: legible, but within the range of the `parameter`.
fn written(parameter: &Parameter, value: f64, std_error: Option<f64>) -> f64 {
    let legible = legible(value, std_error);
    if parameter.admits(legible) {
        legible
    } else {
        value
    }
}

/// `value` to about a thousandth of its standard error: the digits behind that are noise.
fn legible(value: f64, std_error: Option<f64>) -> f64 {
    match std_error {
        Some(error) if error > 0.0 && error.is_finite() => {
            let decimals = (3.0 - error.log10().floor()).clamp(0.0, 17.0) as usize;
            format!("{value:.decimals$}").parse().unwrap_or(value)
        }
        _ => value,
    }
}

#[cfg(test)]
mod clocks;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_below_the_noise_are_dropped() {
        assert_eq!(legible(-15.146_524_758_853, Some(5.2e-4)), -15.146_524_8);
        assert_eq!(legible(12_345.678_9, Some(2.0e5)), 12_346.0);
        assert_eq!(legible(0.136_003_798_643, None), 0.136_003_798_643);
    }

    #[test]
    fn no_number_leaves_its_range() {
        let speed = Parameter::new("speed", "v", "flow", "decay").above(0.0);
        assert_eq!(written(&speed, 1e-6, Some(23.8)), 1e-6);
        assert_eq!(written(&speed, 1.234_567_8, Some(23.8)), 1.23);
    }
}
