//! Plants: the static view authors write, and the object-safe view made from it.

use crate::{Channel, Derived, Parameter, Real, Signal};

/// What a plant says about itself.
#[derive(Clone, Copy, Debug)]
pub struct PlantMeta {
    /// Identifier in TOML, e.g. `ddmr`.
    pub id: &'static str,
    /// One sentence.
    pub summary: &'static str,
    /// The equations in plain text.
    pub equation: &'static str,
    /// Where they come from: author, year, equation or page.
    pub reference: &'static str,
    /// What was assumed.
    pub assumptions: &'static str,
    /// A TOML table that builds it.
    pub example: &'static str,
    /// The states, in order.
    pub states: &'static [Signal],
    /// The inputs, in order.
    pub inputs: &'static [Signal],
    /// Further signals that a sensor could measure or an effect could read.
    pub outputs: &'static [Signal],
    /// Signals that are integrals of others: `(rate, integral)`. A sensor that reads the mean of the
    /// rate reads a difference of the integral.
    pub integrals: &'static [(&'static str, &'static str)],
    /// The places where effects attach. Effort channels are numbered from 0 without gaps.
    pub channels: &'static [Channel],
    /// The parameters of the equations, in the order of `p`.
    pub parameters: &'static [Parameter],
    /// Other ways to give the parameters.
    pub parameterizations: &'static [Parameterization],
    /// States a velocity controller acts on: as many as inputs, each affine in the inputs.
    /// Empty where the plant is not control-affine or not square.
    pub controlled: &'static [usize],
}

/// Another set of parameters from which those of the equations follow.
#[derive(Clone, Copy, Debug)]
pub struct Parameterization {
    /// Name of the sub-table in TOML, e.g. `physical`.
    pub id: &'static str,
    /// One sentence.
    pub summary: &'static str,
    /// Its parameters.
    pub parameters: &'static [Parameter],
}

/// Longest integration step of a machine on wheels or a motor, s.
pub const MAX_STEP_S: f64 = 0.0025;

/// A plant, as its author writes it: `dx/dt = f(t, x, u, w; p)`.
///
/// `NX` states, `NU` inputs, `NW` effort channels, `NP` parameters, `NY` outputs. `w[c]` is the
/// sum of what the effects add on effort channel `c`. Sizes must agree with [`PlantMeta`];
/// [`declare_plant!`](crate::declare_plant) checks that at compile time.
pub trait Plant<const NX: usize, const NU: usize, const NW: usize, const NP: usize, const NY: usize>:
    Sized + Send + Sync + 'static
{
    /// Names, units, channels, parameters, equation, reference.
    const META: PlantMeta;

    /// Quantities that follow from the parameters.
    const DERIVED: &'static [Derived] = &[];

    /// Longest integration step where a model file gives none, s: a quarter of the fastest time
    /// constant that is usual, or less.
    const MAX_STEP_S: f64 = MAX_STEP_S;

    /// The rate of the state, in the state's units per second.
    fn derivative<S: Real>(x: &[S; NX], u: &[S; NU], w: &[S; NW], p: &[S; NP]) -> [S; NX];

    /// The `index`-th of [`PlantMeta::outputs`]; one at a time, since most are not needed.
    fn output<S: Real>(index: usize, x: &[S; NX], u: &[S; NU], p: &[S; NP]) -> S;

    /// Parameters of the equations from those of [`PlantMeta::parameterizations`]`[set]`.
    ///
    /// `from` has the length of that set. `None` when the set does not exist.
    fn lower<S: Real>(set: usize, from: &[S]) -> Option<[S; NP]> {
        let _ = (set, from);
        None
    }

    /// The `index`-th of [`Plant::DERIVED`].
    fn derived<S: Real>(index: usize, p: &[S; NP]) -> S {
        let _ = (index, p);
        S::zero()
    }
}

/// A plant whose controlled states obey `dy/dt = f(y) + G(y) u + H(y) w`, for controllers that invert
/// `G`.
///
/// `M` controlled states, `NU` inputs, `NW` effort channels; written for `no_std` code where the
/// run-time probing of [`Dynamics`] would cost too much.
pub trait ControlAffine<const M: usize, const NU: usize, const NW: usize, const NP: usize> {
    /// The drift `f(y)`, in units of the controlled states per second.
    fn drift<S: Real>(y: &[S; M], p: &[S; NP]) -> [S; M];
    /// The input matrix `G(y)`, row by row.
    fn input_matrix<S: Real>(y: &[S; M], p: &[S; NP]) -> [[S; NU]; M];
    /// What efforts `w` on the plant's channels add to the rates: `H(y) w`.
    fn push<S: Real>(y: &[S; M], w: &[S; NW], p: &[S; NP]) -> [S; M];
}

/// The object-safe view of a plant for one scalar, on slices.
///
/// Slice lengths are those of the [`PlantMeta`]; a call with other lengths leaves the output as it
/// is (and is refused when a model is built, so that a running loop cannot meet it).
pub trait Dynamics<S: Real>: Send + Sync {
    /// `dx = f(x, u, w; p)`.
    fn derivative(&self, x: &[S], u: &[S], w: &[S], p: &[S], dx: &mut [S]);
    /// One step `h` (s) of the plant alone by [`Rk4`](crate::Rk4), inputs and efforts held: what
    /// that does with [`Dynamics::derivative`], to the last digit, without a call per stage.
    fn step(&self, x: &mut [S], h: S, u: &[S], w: &[S], p: &[S]);
    /// `h_index(x, u; p)`; zero for slices of other lengths.
    fn output(&self, index: usize, x: &[S], u: &[S], p: &[S]) -> S;
    /// Parameters of the equations from the values the file gives (set 0 is the equations' own,
    /// set `i` is [`PlantMeta::parameterizations`]`[i - 1]`).
    fn lower(&self, set: usize, from: &[S], p: &mut [S]);
    /// See [`Plant::MAX_STEP_S`].
    fn max_step_s(&self) -> f64 {
        MAX_STEP_S
    }
    /// See [`Plant::DERIVED`].
    fn derivable(&self) -> &'static [Derived] {
        &[]
    }
    /// See [`Plant::derived`]; zero for parameters of another length.
    fn derived(&self, index: usize, p: &[S]) -> S {
        let _ = (index, p);
        S::zero()
    }
}

/// Checks the sizes of a plant against its declaration; called by [`declare_plant!`](crate::declare_plant) in a constant.
pub const fn check_sizes(
    meta: &PlantMeta,
    nx: usize,
    nu: usize,
    nw: usize,
    np: usize,
    ny: usize,
) -> bool {
    let mut efforts = 0;
    let mut i = 0;
    while i < meta.channels.len() {
        if let crate::Place::Effort(c) = meta.channels[i].place {
            if c >= nw {
                return false;
            }
            efforts += 1;
        }
        i += 1;
    }
    meta.states.len() == nx
        && meta.inputs.len() == nu
        && efforts == nw
        && meta.parameters.len() == np
        && meta.outputs.len() == ny
        && (meta.controlled.is_empty() || meta.controlled.len() == nu)
}

/// Makes a [`Plant`] available behind [`Dynamics`].
///
/// The macro of the same name in `loopsight-model` does this and adds the plant to the registry. A crate
/// that builds with and without `std` chooses between the two once, in its `lib.rs`.
///
/// ```ignore
/// declare_plant!(Ddmr, "ddmr", <6, 2, 4, 8, 4>);
/// ```
#[macro_export]
macro_rules! declare_plant {
    ($plant:ident, $id:literal, <$nx:literal, $nu:literal, $nw:literal, $np:literal, $ny:literal>) => {
        const _: () = assert!(
            $crate::plant_check(
                &<$plant as $crate::Plant<$nx, $nu, $nw, $np, $ny>>::META,
                $nx,
                $nu,
                $nw,
                $np,
                $ny
            ),
            "the sizes of the plant differ from its PlantMeta"
        );

        impl<S: $crate::Real> $crate::Dynamics<S> for $plant {
            fn derivative(&self, x: &[S], u: &[S], w: &[S], p: &[S], dx: &mut [S]) {
                let (Ok(x), Ok(u), Ok(w), Ok(p)) =
                    (x.try_into(), u.try_into(), w.try_into(), p.try_into())
                else {
                    return;
                };
                let rate: [S; $nx] =
                    <$plant as $crate::Plant<$nx, $nu, $nw, $np, $ny>>::derivative(x, u, w, p);
                for (to, from) in dx.iter_mut().zip(rate) {
                    *to = from;
                }
            }
            fn step(&self, x: &mut [S], h: S, u: &[S], w: &[S], p: &[S]) {
                let (Ok(x), Ok(u), Ok(w), Ok(p)) = (
                    <&mut [S; $nx]>::try_from(x),
                    u.try_into(),
                    w.try_into(),
                    p.try_into(),
                ) else {
                    return;
                };
                $crate::rk4_step(x, h, |x| {
                    <$plant as $crate::Plant<$nx, $nu, $nw, $np, $ny>>::derivative(x, u, w, p)
                });
            }
            fn output(&self, index: usize, x: &[S], u: &[S], p: &[S]) -> S {
                let (Ok(x), Ok(u), Ok(p)) = (x.try_into(), u.try_into(), p.try_into()) else {
                    return S::of(0.0);
                };
                <$plant as $crate::Plant<$nx, $nu, $nw, $np, $ny>>::output(index, x, u, p)
            }
            fn lower(&self, set: usize, from: &[S], p: &mut [S]) {
                if set == 0 {
                    for (to, from) in p.iter_mut().zip(from) {
                        *to = *from;
                    }
                } else if let Some(lowered) =
                    <$plant as $crate::Plant<$nx, $nu, $nw, $np, $ny>>::lower(set - 1, from)
                {
                    for (to, from) in p.iter_mut().zip(lowered) {
                        *to = from;
                    }
                }
            }
            fn max_step_s(&self) -> f64 {
                <$plant as $crate::Plant<$nx, $nu, $nw, $np, $ny>>::MAX_STEP_S
            }
            fn derivable(&self) -> &'static [$crate::Derived] {
                <$plant as $crate::Plant<$nx, $nu, $nw, $np, $ny>>::DERIVED
            }
            fn derived(&self, index: usize, p: &[S]) -> S {
                let Ok(p) = p.try_into() else {
                    return S::of(0.0);
                };
                <$plant as $crate::Plant<$nx, $nu, $nw, $np, $ny>>::derived(index, p)
            }
        }
    };
}
