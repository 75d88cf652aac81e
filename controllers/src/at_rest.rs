//! What a design takes from a model: its input matrix and damping at rest.

use loopsight_core::AffineModel;
use loopsight_model::affine::Affine;
use loopsight_model::model::Model;
use loopsight_model::registry::BuildError;

use crate::{Singular, solve};

/// Chords that are tried, each twice as long as the one before, from the size of the state on.
const CHORDS: u32 = 12;

/// A model at rest, as a controller is designed from it.
pub(crate) struct AtRest {
    /// Number of controlled states, and of inputs.
    pub(crate) n: usize,
    /// `G` at rest, row by row.
    pub(crate) matrix: Vec<f64>,
    /// Damping `-∂f_i/∂y_i`, 1/s: the least slope of a chord around rest. Dry friction, which has only a sign, does not
    /// count as damping, because a controller would cancel it.
    pub(crate) damping: Vec<f64>,
    /// Sizes of the controlled states.
    pub(crate) sizes: Vec<f64>,
}

/// The model at rest for the controller `id`; refused where it cannot be inverted.
pub(crate) fn at_rest(model: &Model, id: &str) -> Result<AtRest, BuildError> {
    let plant = model.plant;
    let Some(mut affine) = model.affine() else {
        return Err(BuildError::at(
            "",
            format!(
                "`{id}` needs a control-affine plant, but `{}` declares no controlled states",
                plant.id
            ),
        ));
    };
    let n = affine.size();
    let (mut drift, mut matrix) = (vec![f64::NAN; n], vec![f64::NAN; n * n]);
    affine.evaluate(&vec![0.0; n], &mut drift, &mut matrix);
    let shown: Vec<&[f64]> = matrix.chunks(n.max(1)).collect();
    let shown = format!("G = {shown:?}");
    let state = |row: usize| {
        plant
            .controlled
            .get(row)
            .map_or("?", |s| plant.states[*s].id)
    };
    let message = match solve(&mut matrix.clone(), &mut drift, &mut vec![0.0; n]) {
        Ok(()) => return Ok(AtRest::new(affine, model, matrix)),
        Err(Singular::Row(row)) => format!("no input moves `{}`", state(row)),
        Err(Singular::Column(column)) => format!(
            "`{}` moves none of the controlled states",
            plant.inputs.get(column).map_or("?", |s| s.id)
        ),
        Err(Singular::Dependent) => "the inputs do not move the controlled states independently \
             (what each does alone is less than a millionth of it)"
            .to_owned(),
        Err(Singular::NotFinite) => {
            let missing = model.missing_values();
            return Err(BuildError::at(
                "",
                if missing.is_empty() {
                    format!("the model of `{}` is not finite at rest, {shown}", plant.id)
                } else {
                    format!("the model has no value for {}", missing.join(", "))
                },
            )
            .help("fit the model first, or give the values in the model file"));
        }
    };
    Err(BuildError::at(
        "",
        format!(
            "the input matrix of `{}` cannot be inverted: {message}; {shown}",
            plant.id
        ),
    ))
}

impl AtRest {
    fn new(mut affine: Affine, model: &Model, matrix: Vec<f64>) -> Self {
        let n = affine.size();
        let sizes: Vec<f64> = (model.plant.controlled.iter())
            .map(|i| model.plant.states[*i].size)
            .collect();
        let mut unused = vec![0.0; n * n];
        let damping = (0..n).map(|i| {
            let mut drift_at = |y: f64| {
                let (mut state, mut drift) = (vec![0.0; n], vec![0.0; n]);
                state[i] = y;
                affine.evaluate(&state, &mut drift, &mut unused);
                drift[i]
            };
            let mut chord = |y: f64| (drift_at(-y) - drift_at(y)) / (2.0 * y);
            (0..CHORDS)
                .map(|k| chord(sizes[i] * f64::from(1 << k)))
                .fold(f64::INFINITY, f64::min)
        });
        Self {
            n,
            matrix,
            damping: damping.collect(),
            sizes,
        }
    }
}
