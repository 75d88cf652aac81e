//! Ties parameters that a recording does not show to those that it shows.

use std::borrow::Cow;

use loopsight_core::Unshown;
use loopsight_model::model::Model;
use loopsight_model::run::Run;

use crate::criteria::LogCriteria;

/// `model`, where the parts that `runs` do not show are tied as its plant declares.
///
/// A parameter with a value in the model file keeps it.
pub(crate) fn tied<'m>(model: &'m Model, runs: &[Run], criteria: &LogCriteria) -> Cow<'m, Model> {
    let mut present = Cow::Borrowed(model);
    for part in model.unshown() {
        let unknown = |id: &str| {
            let of_plant = model.plant.parameters.iter();
            let index = of_plant.into_iter().position(|p| p.id == id);
            let parameter = index.and_then(|i| model.parameters.get(i));
            parameter.is_some_and(|p| p.free && p.value.is_none())
        };
        let wanted = part.ties.iter().all(|tie| unknown(tie.parameter));
        if wanted && share(model, part, runs).is_some_and(|share| share < criteria.unshown) {
            present = Cow::Owned(present.tied(part));
        }
    }
    present
}

/// Root mean square of the combination of inputs that shows `part`, over that of its terms. It is 0 where the
/// terms cancel, and 1 where they are independent. None without inputs.
fn share(model: &Model, part: &Unshown, runs: &[Run]) -> Option<f64> {
    let inputs = model.plant.inputs;
    let terms: Option<Vec<(usize, f64)>> = (part.shown_by.iter())
        .map(|(id, share)| Some((inputs.iter().position(|s| s.id == *id)?, *share)))
        .collect();
    let terms = terms?;
    let (mut together, mut each) = (0.0, 0.0);
    for run in runs {
        for k in 0..run.len() {
            let values = || terms.iter().map(|(i, share)| share * run.input(k)[*i]);
            let sum: f64 = values().sum();
            if sum.is_finite() {
                together += sum * sum;
                each += values().map(|v| v * v).sum::<f64>();
            }
        }
    }
    (each > 0.0).then(|| f64::sqrt(together / each))
}
