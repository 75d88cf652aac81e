//! A plant with its effects, as a control law aboard sees it.

use loopsight_core::{AffineModel, Array, ControlAffine, Real};

use crate::Efforts;
use crate::parts::{Parts, PerInput, PerParameter};

/// A plant with effects on its efforts, in fixed sizes: `dy/dt = f(y) + H(y) w(x̄) + G(y) u`.
///
/// | symbol | what |
/// |---|---|
/// | `f`, `G`, `H` | of the plant's [`ControlAffine`] view |
/// | `w` | efforts of the effects, [`Efforts`] |
/// | `x̄` | `y` moved towards where it is wanted, by a band at most: dry friction is taken in the direction of the motion that is to begin |
///
/// It is the robot's counterpart of the host's `Affine`, for effects that act at once as forces. Delays, lags and
/// what lies between a command and the plant are not compensated.
///
/// Reference: H. Olsson, K. J. Åström, C. Canudas de Wit, M. Gäfvert, P. Lischinsky (1998), "Friction models
/// and friction compensation", European Journal of Control 4, 176–195, section 5.
pub struct AffinePlant<R: Parts> {
    /// Parameters of the plant.
    pub parameters: PerParameter<R>,
    efforts: Efforts<R>,
    bands: PerInput<R>,
    aim: PerInput<R>,
}

impl<R: Parts> AffinePlant<R> {
    /// The plant with these parameters and effects; `bands` is how far from rest each controlled state
    /// has a direction.
    pub fn new(parameters: PerParameter<R>, efforts: Efforts<R>, bands: PerInput<R>) -> Self {
        Self {
            parameters,
            efforts,
            bands,
            aim: PerInput::<R>::filled(R::Scalar::of(0.0)),
        }
    }
}

impl<R: Parts> AffineModel<R::Scalar> for AffinePlant<R> {
    fn size(&self) -> usize {
        PerInput::<R>::LENGTH
    }

    #[inline(always)]
    fn evaluate(
        &mut self,
        y: &[R::Scalar],
        drift: &mut [R::Scalar],
        input_matrix: &mut [R::Scalar],
    ) {
        let Some(y) = PerInput::<R>::from_slice(y) else {
            return;
        };
        let towards = PerInput::<R>::from_fn(|i| {
            let (band, way) = (self.bands[i], self.aim[i] - y[i]);
            if way.abs() > band {
                y[i] + way.clamp(-band, band)
            } else {
                self.aim[i]
            }
        });
        let p = &self.parameters;
        let w = self.efforts.at(&towards);
        let (f, push) = (R::Plant::drift(y, p), R::Plant::push(y, &w, p));
        let g = R::Plant::input_matrix(y, p);
        for (to, (f, push)) in drift.iter_mut().zip(f.into_iter().zip(push)) {
            *to = f + push;
        }
        // By rows, whose length is known when this is compiled.
        let rows = PerInput::<R>::chunks_mut(input_matrix);
        for (to, from) in rows.iter_mut().zip(g) {
            *to = from;
        }
    }

    fn aim(&mut self, wanted: &[R::Scalar]) {
        if let Some(wanted) = PerInput::<R>::from_slice(wanted) {
            self.aim = *wanted;
        }
    }

    fn learn(&mut self, parameter: usize, value: R::Scalar) {
        if let Some(known) = self.parameters.as_mut().get_mut(parameter)
            && value.is_finite()
        {
            *known = value;
        }
    }

    /// All of them, or none: a sum is finite where all of it is.
    fn learn_all(&mut self, values: &[R::Scalar]) {
        if let Some(values) = PerParameter::<R>::from_slice(values)
            && (values.as_ref().iter())
                .fold(R::Scalar::of(0.0), |sum, v| sum + *v)
                .is_finite()
        {
            self.parameters = *values;
        }
    }
}
