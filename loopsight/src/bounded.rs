//! How much work a request may be: looked at before it begins.

use loopsight_model::model::Model as Composed;
use loopsight_model::run::Run;

use crate::error::{Error, Result};

/// Most integration steps between two samples. A model that needs so many has long forgotten the one before.
const MOST_BETWEEN: f64 = 1e6;
/// Most integration steps of one run of a model over a log, each as long as its plant or its file has it.
const MOST_STEPS: f64 = 3e8;
/// Most integration steps of a simulated robot.
const MOST_OF_ROBOT: f64 = 1e9;

/// Refuses a log of which one simulation would take minutes: its samples are too far apart, or too many.
///
/// # Errors
///
/// It is such a log, with the figures.
pub(crate) fn log(name: &str, model: &Composed, runs: &[Run]) -> Result<()> {
    let step = model.step();
    let pairs = runs.iter().flat_map(|run| run.time().windows(2));
    let spans = pairs.map(|pair| (pair[0], pair[1] - pair[0]));
    let widest = spans.clone().max_by(|a, b| a.1.total_cmp(&b.1));
    let milliseconds = "are its time stamps milliseconds in a column that says seconds? A model of something slow \
                        says how long its steps may be: `max_step_s` in [simulation]";
    if let Some((from, span)) = widest.filter(|(_, span)| span / step > MOST_BETWEEN) {
        return Err(Error::request(format!(
            "{name}: the samples at {from} s and {} s are {span} s apart, {:.1e} integration steps of the model's \
             {step} s, expected at most {MOST_BETWEEN:e}: {milliseconds}",
            from + span,
            span / step
        )));
    }
    let length: f64 = spans.map(|(_, span)| span).sum();
    if length / step > MOST_STEPS {
        return Err(Error::request(format!(
            "{name}: it lasts {length} s, {:.1e} integration steps of the model's {step} s, expected at most \
             {MOST_STEPS:e}: {milliseconds}",
            length / step
        )));
    }
    Ok(())
}

/// What is wrong with a simulated robot that runs for `duration_s` with steps of `step_s`, if anything; a step that is
/// not above zero is refused elsewhere.
pub(crate) fn robot(duration_s: f64, step_s: f64) -> Option<String> {
    let steps = duration_s / step_s;
    (step_s > 0.0 && steps > MOST_OF_ROBOT).then(|| {
        format!(
            "{duration_s} s are {steps:.1e} integration steps of the simulated robot's {step_s} s, expected at \
             most {MOST_OF_ROBOT:e}: give a shorter time, or the robot a longer `step_s`"
        )
    })
}

#[cfg(test)]
mod tests {
    use loopsight_model::run::Rows;

    use super::*;

    fn checked(time: Vec<f64>) -> Result<()> {
        let text = "[plant.ddmr]\nK_A = -15.0\nK_B = 0.0\nK_C = 0.1\nK_D = -9.0\nK_E = 0.0\nK_F = 0.6\n\
                    half_track = 0.131\nwheel_radius = 0.05\n";
        let model = Composed::from_toml("model.toml", text).unwrap().0;
        let n = time.len();
        let (nu, ny) = (model.plant.inputs.len(), model.measured.len());
        let rows = |width: usize| Rows::new(width, vec![0.0; n * width]);
        let run = Run::new("", time, rows(nu), rows(ny)).unwrap();
        log("log.csv", &model, &[run])
    }

    #[test]
    fn samples_far_apart_and_logs_without_end_are_refused_with_their_figures() {
        checked((0..1000).map(|k| f64::from(k) * 0.01).collect()).unwrap();
        let error = checked(vec![0.0, 1.0, 10_001.0]).unwrap_err().to_string();
        assert!(
            error.contains("at 1 s and 10001 s are 10000 s apart"),
            "{error}"
        );
        assert!(error.contains("4.0e6 integration steps"), "{error}");
        let error = checked((0..2000).map(|k| f64::from(k) * 1e3).collect());
        let error = error.unwrap_err().to_string();
        assert!(error.contains("lasts 1999000 s"), "{error}");
        assert_eq!(robot(1e5, 1e-4), None);
        assert!(
            robot(1e7, 1e-4)
                .unwrap()
                .contains("1.0e11 integration steps")
        );
    }
}
