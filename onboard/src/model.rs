//! A plant with its effects, as a control law aboard sees it.

use loopsight_core::{AffineModel, ControlAffine, Plant, Real};

use crate::Efforts;

/// A plant with effects on its efforts, in fixed sizes: `dy/dt = f(y) + H(y) w(x̄) + G(y) u`.
///
/// | symbol | what |
/// |---|---|
/// | `f`, `G`, `H` | of the plant's [`ControlAffine`] view |
/// | `w` | efforts of the effects, [`Efforts`] |
/// | `x̄` | `y` moved towards where it is wanted, by a band at most: dry friction is taken in the direction of the motion that is to begin |
///
/// It is to a robot what `Affine` is to a host, for effects that act at once as forces; delays, lags and what
/// lies between a command and the plant are not made up for.
///
/// Reference: H. Olsson, K. J. Åström, C. Canudas de Wit, M. Gäfvert, P. Lischinsky (1998), "Friction models
/// and friction compensation", European Journal of Control 4, 176–195, section 5.
pub struct Model<
    S: 'static,
    P,
    const NX: usize,
    const NU: usize,
    const NW: usize,
    const NP: usize,
    const NY: usize,
> {
    /// Parameters of the plant.
    pub parameters: [S; NP],
    efforts: Efforts<S, NU>,
    bands: [S; NU],
    aim: [S; NU],
    plant: core::marker::PhantomData<P>,
}

impl<S, P, const NX: usize, const NU: usize, const NW: usize, const NP: usize, const NY: usize>
    Model<S, P, NX, NU, NW, NP, NY>
where
    S: Real,
    P: Plant<NX, NU, NW, NP, NY> + ControlAffine<NU, NU, NW, NP>,
{
    /// The plant with these parameters and effects; `bands` is how far from rest each controlled state
    /// has a direction.
    pub fn new(parameters: [S; NP], efforts: Efforts<S, NU>, bands: [S; NU]) -> Self {
        Self {
            parameters,
            efforts,
            bands,
            aim: [S::zero(); NU],
            plant: core::marker::PhantomData,
        }
    }
}

impl<S, P, const NX: usize, const NU: usize, const NW: usize, const NP: usize, const NY: usize>
    AffineModel<S> for Model<S, P, NX, NU, NW, NP, NY>
where
    S: Real,
    P: Plant<NX, NU, NW, NP, NY> + ControlAffine<NU, NU, NW, NP>,
{
    fn size(&self) -> usize {
        NU
    }

    #[inline(always)]
    fn evaluate(&mut self, y: &[S], drift: &mut [S], input_matrix: &mut [S]) {
        let Ok(y) = <&[S; NU]>::try_from(y) else {
            return;
        };
        let towards = core::array::from_fn(|i| {
            let (band, way) = (self.bands[i], self.aim[i] - y[i]);
            if way.abs() > band {
                y[i] + way.held(-band, band)
            } else {
                self.aim[i]
            }
        });
        let p = &self.parameters;
        let w = self.efforts.at(&towards);
        let (f, push, g) = (P::drift(y, p), P::push(y, &w, p), P::input_matrix(y, p));
        for (to, (f, push)) in drift.iter_mut().zip(f.iter().zip(push)) {
            *to = *f + push;
        }
        // By rows, whose length is known when this is compiled.
        let (rows, _) = input_matrix.as_chunks_mut::<NU>();
        for (to, from) in rows.iter_mut().zip(g) {
            *to = from;
        }
    }

    fn aim(&mut self, wanted: &[S]) {
        if wanted.len() == NU {
            self.aim = core::array::from_fn(|i| wanted[i]);
        }
    }

    fn learn(&mut self, parameter: usize, value: S) {
        if let Some(known) = self.parameters.get_mut(parameter)
            && value.is_finite()
        {
            *known = value;
        }
    }

    /// All of them, or none: a sum is finite where all of it is.
    fn learn_all(&mut self, values: &[S]) {
        if let Ok(values) = <&[S; NP]>::try_from(values)
            && (values.iter().fold(S::zero(), |sum, v| sum + *v)).is_finite()
        {
            self.parameters = *values;
        }
    }
}
