//! Plants behind one interface for any of them, and how a plant gets there.

use crate::integrator::{bend, rk4_stages};
use crate::plant::MAX_STEP_S;
use crate::{Array, Derived, Plant, Real, Unshown};

/// Steps of equal length.
#[derive(Clone, Copy, Debug)]
pub struct Steps<S> {
    /// How many.
    pub count: usize,
    /// Length of one, s.
    pub length: S,
    /// Whether it is asked how far the rates bend.
    pub watched: bool,
}

/// What a plant moves under while effects act on its efforts.
#[derive(Clone, Copy, Debug)]
pub struct Under<'a, S> {
    /// The steps.
    pub span: Steps<S>,
    /// Inputs, constant.
    pub u: &'a [S],
    /// Efforts beside those of the effects, constant.
    pub w: &'a [S],
    /// Parameters.
    pub p: &'a [S],
    /// States that the effects read, by index.
    pub states: &'a [usize],
    /// Outputs that they read, by index.
    pub outputs: &'a [usize],
    /// The [trail](Plant::TRAIL) moves, too.
    pub trail: bool,
}

/// Adds to the efforts what effects contribute: the step and the stage of the method in it, all signals of the plant, of
/// which those that are read are up to date, and the efforts.
pub type Act<'a, S> = dyn FnMut((usize, usize), &[S], &mut [S]) + 'a;

/// The object-safe view of a plant for one scalar, on slices.
///
/// Slice lengths are those of the [`PlantMeta`](crate::PlantMeta); a call with other lengths leaves the output as it
/// is (and is refused when a model is built, so that a running loop cannot meet it).
pub trait Dynamics<S: Real>: Send + Sync {
    /// `dx = f(x, u, w; p)`.
    fn derivative(&self, x: &[S], u: &[S], w: &[S], p: &[S], dx: &mut [S]);
    /// Steps of the plant alone with constant inputs and efforts. The result is exactly that of
    /// [`Rk4`](crate::Rk4) with [`Dynamics::derivative`], but without a call per stage.
    ///
    /// Returns how far the rates bend over a step at most, where that is [watched](Steps::watched); 1 where it is not known.
    fn steps(&self, x: &mut [S], span: Steps<S>, u: &[S], w: &[S], p: &[S]) -> f64;
    /// The same with efforts that change within a step: `act` adds to those of `w`. Nothing is done, and there is no
    /// answer, where the plant does not offer this.
    fn steps_under(
        &self,
        x: &mut [S],
        under: &Under<'_, S>,
        signals: &mut [S],
        act: &mut Act<'_, S>,
    ) -> Option<f64> {
        let _ = (x, under, signals, act);
        None
    }
    /// See [`Plant::TRAIL`].
    fn trail(&self) -> &'static [usize] {
        &[]
    }
    /// As [`Dynamics::derivative`], with rates of zero for the [trail](Dynamics::trail).
    fn motion(&self, x: &[S], u: &[S], w: &[S], p: &[S], dx: &mut [S]) {
        self.derivative(x, u, w, p, dx);
    }
    /// As [`Dynamics::steps`], of the [motion](Dynamics::motion).
    fn steps_of_motion(&self, x: &mut [S], span: Steps<S>, u: &[S], w: &[S], p: &[S]) -> f64 {
        self.steps(x, span, u, w, p)
    }
    /// `h_index(x, u; p)`; zero for slices of other lengths.
    fn output(&self, index: usize, x: &[S], u: &[S], p: &[S]) -> S;
    /// Those of the outputs that `which` lists, each to its place in `y`.
    fn outputs(&self, which: &[usize], x: &[S], u: &[S], p: &[S], y: &mut [S]) {
        for index in which {
            if let Some(to) = y.get_mut(*index) {
                *to = self.output(*index, x, u, p);
            }
        }
    }
    /// Parameters of the equations from the values the file gives (set 0 is the equations' own,
    /// set `i` is [`PlantMeta::parameterizations`](crate::PlantMeta::parameterizations)`[i - 1]`).
    fn lower(&self, set: usize, from: &[S], p: &mut [S]);
    /// See [`Plant::MAX_STEP_S`].
    fn max_step_s(&self) -> f64 {
        MAX_STEP_S
    }
    /// See [`Plant::DERIVED`].
    fn derivable(&self) -> &'static [Derived] {
        &[]
    }
    /// See [`Plant::UNSHOWN`].
    fn unshown(&self) -> &'static [Unshown] {
        &[]
    }
    /// See [`Plant::derived`]; zero for parameters of another length.
    fn derived(&self, index: usize, p: &[S]) -> S {
        let _ = (index, p);
        S::zero()
    }
}

/// [`Dynamics::steps`] of a plant whose states change at this `rate`.
#[doc(hidden)]
#[inline(always)]
pub fn steps_alone<S: Real, A: Array<S>>(x: &mut A, span: Steps<S>, rate: impl Fn(&A) -> A) -> f64 {
    let mut most = 0f64;
    if span.watched {
        for _ in 0..span.count {
            most = most.max(bend(&rk4_stages(x, span.length, |_, x| rate(x))));
        }
    } else {
        for _ in 0..span.count {
            rk4_stages(x, span.length, |_, x| rate(x));
        }
    }
    most
}

/// The same of the plant `P`, from slices.
#[doc(hidden)]
#[inline(always)]
pub fn steps_of<P, S>(
    x: &mut [S],
    span: Steps<S>,
    u: &[S],
    w: &[S],
    p: &[S],
    rate: impl Fn(&P::State<S>, &P::Input<S>, &P::Effort<S>, &P::Parameters<S>) -> P::State<S>,
) -> f64
where
    P: Plant,
    S: Real,
{
    let (Some(x), Some(u), Some(w), Some(p)) = (
        P::State::<S>::from_mut_slice(x),
        P::Input::<S>::from_slice(u),
        P::Effort::<S>::from_slice(w),
        P::Parameters::<S>::from_slice(p),
    ) else {
        return 1.0;
    };
    steps_alone(x, span, |x| rate(x, u, w, p))
}

/// [`Dynamics::steps_under`] of the plant `P` whose states change at this `rate`.
#[doc(hidden)]
#[inline(always)]
pub fn steps_under<P, S>(
    x: &mut [S],
    under: &Under<'_, S>,
    signals: &mut [S],
    act: &mut Act<'_, S>,
    rate: impl Fn(&P::State<S>, &P::Input<S>, &P::Effort<S>, &P::Parameters<S>) -> P::State<S>,
) -> Option<f64>
where
    P: Plant,
    S: Real,
{
    let (nx, nu) = (P::State::<S>::LENGTH, P::Input::<S>::LENGTH);
    let (Some(x), Some(u), Some(w), Some(p), Some(_)) = (
        P::State::<S>::from_mut_slice(x),
        P::Input::<S>::from_slice(under.u),
        P::Effort::<S>::from_slice(under.w),
        P::Parameters::<S>::from_slice(under.p),
        signals.get(nx + nu..),
    ) else {
        return None;
    };
    let mut most = 0f64;
    for (to, from) in signals[nx..].iter_mut().zip(u.as_ref()) {
        *to = *from;
    }
    for step in 0..under.span.count {
        let rates = rk4_stages(x, under.span.length, |stage, x| {
            for i in under.states {
                if let (Some(to), Some(from)) = (signals.get_mut(*i), x.as_ref().get(*i)) {
                    *to = *from;
                }
            }
            P::outputs(under.outputs, x, u, p, &mut signals[nx + nu..]);
            let mut w = *w;
            act((step, stage), signals, w.as_mut());
            rate(x, u, &w, p)
        });
        if under.span.watched {
            most = most.max(bend(&rates));
        }
    }
    Some(most)
}

/// Makes a [`Plant`] available behind [`Dynamics`].
///
/// The sizes are those of [`Plant::META`]; equations written for others do not compile. Nor does an id
/// that is not the one in `META`, nor effort channels that are not numbered from 0 without gaps.
///
/// The macro of the same name in `loopsight-model` does this and adds the plant to the registry. A crate
/// that builds with and without `std` chooses between the two once, in its `lib.rs`.
///
/// [`Plant`] has an example.
#[macro_export]
macro_rules! declare_plant {
    ($plant:ident, $id:literal) => {
        const _: () = {
            let meta = &<$plant as $crate::Plant>::META;
            assert!(
                $crate::__private::same_text(meta.id, $id),
                "the id of the plant differs from that of its PlantMeta"
            );
            assert!(
                meta.is_consistent(),
                "effort channels are numbered from 0 without gaps, and there are as many controlled states as inputs, or none"
            );
        };

        impl $crate::PlantArrays for $plant {
            type State<T: Copy + Send> = [T; <$plant as $crate::Plant>::META.states.len()];
            type Input<T: Copy + Send> = [T; <$plant as $crate::Plant>::META.inputs.len()];
            type Effort<T: Copy + Send> = [T; <$plant as $crate::Plant>::META.efforts()];
            type Parameters<T: Copy + Send> = [T; <$plant as $crate::Plant>::META.parameters.len()];
        }

        impl<S: $crate::Real> $crate::Dynamics<S> for $plant {
            fn derivative(&self, x: &[S], u: &[S], w: &[S], p: &[S], dx: &mut [S]) {
                let (Ok(x), Ok(u), Ok(w), Ok(p)) =
                    (x.try_into(), u.try_into(), w.try_into(), p.try_into())
                else {
                    return;
                };
                let rate = <$plant as $crate::Plant>::derivative::<S>(x, u, w, p);
                for (to, from) in dx.iter_mut().zip(rate) {
                    *to = from;
                }
            }
            fn steps(
                &self,
                x: &mut [S],
                span: $crate::Steps<S>,
                u: &[S],
                w: &[S],
                p: &[S],
            ) -> f64 {
                let rate = <$plant as $crate::Plant>::derivative::<S>;
                $crate::steps_of::<$plant, S>(x, span, u, w, p, rate)
            }
            fn steps_under(
                &self,
                x: &mut [S],
                under: &$crate::Under<'_, S>,
                signals: &mut [S],
                act: &mut $crate::Act<'_, S>,
            ) -> Option<f64> {
                if <$plant as $crate::Plant>::TRAIL.is_empty() || under.trail {
                    $crate::steps_under::<$plant, S>(
                        x,
                        under,
                        signals,
                        act,
                        <$plant as $crate::Plant>::derivative::<S>,
                    )
                } else {
                    $crate::steps_under::<$plant, S>(
                        x,
                        under,
                        signals,
                        act,
                        <$plant as $crate::Plant>::motion::<S>,
                    )
                }
            }
            fn trail(&self) -> &'static [usize] {
                <$plant as $crate::Plant>::TRAIL
            }
            fn motion(&self, x: &[S], u: &[S], w: &[S], p: &[S], dx: &mut [S]) {
                if <$plant as $crate::Plant>::TRAIL.is_empty() {
                    return $crate::Dynamics::derivative(self, x, u, w, p, dx);
                }
                let (Ok(x), Ok(u), Ok(w), Ok(p)) =
                    (x.try_into(), u.try_into(), w.try_into(), p.try_into())
                else {
                    return;
                };
                let rate = <$plant as $crate::Plant>::motion::<S>(x, u, w, p);
                for (to, from) in dx.iter_mut().zip(rate) {
                    *to = from;
                }
            }
            fn steps_of_motion(
                &self,
                x: &mut [S],
                span: $crate::Steps<S>,
                u: &[S],
                w: &[S],
                p: &[S],
            ) -> f64 {
                if <$plant as $crate::Plant>::TRAIL.is_empty() {
                    return $crate::Dynamics::steps(self, x, span, u, w, p);
                }
                let rate = <$plant as $crate::Plant>::motion::<S>;
                $crate::steps_of::<$plant, S>(x, span, u, w, p, rate)
            }
            fn output(&self, index: usize, x: &[S], u: &[S], p: &[S]) -> S {
                let (Ok(x), Ok(u), Ok(p)) = (x.try_into(), u.try_into(), p.try_into()) else {
                    return S::of(0.0);
                };
                <$plant as $crate::Plant>::output::<S>(index, x, u, p)
            }
            fn outputs(&self, which: &[usize], x: &[S], u: &[S], p: &[S], y: &mut [S]) {
                if let (Ok(x), Ok(u), Ok(p)) = (x.try_into(), u.try_into(), p.try_into()) {
                    <$plant as $crate::Plant>::outputs::<S>(which, x, u, p, y);
                }
            }
            fn lower(&self, set: usize, from: &[S], p: &mut [S]) {
                if set == 0 {
                    for (to, from) in p.iter_mut().zip(from) {
                        *to = *from;
                    }
                } else if let Some(lowered) = <$plant as $crate::Plant>::lower(set - 1, from) {
                    for (to, from) in p.iter_mut().zip(lowered) {
                        *to = from;
                    }
                }
            }
            fn max_step_s(&self) -> f64 {
                <$plant as $crate::Plant>::MAX_STEP_S
            }
            fn derivable(&self) -> &'static [$crate::Derived] {
                <$plant as $crate::Plant>::DERIVED
            }
            fn unshown(&self) -> &'static [$crate::Unshown] {
                <$plant as $crate::Plant>::UNSHOWN
            }
            fn derived(&self, index: usize, p: &[S]) -> S {
                let Ok(p) = p.try_into() else {
                    return S::of(0.0);
                };
                <$plant as $crate::Plant>::derived::<S>(index, p)
            }
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Channel, Parameter, Place, PlantMeta, Rk4, Signal};

    /// A weight on a spring, whose turns are counted.
    struct Swing;

    impl Plant for Swing {
        const META: PlantMeta = PlantMeta {
            id: "swing",
            summary: "",
            equation: "",
            reference: "",
            assumptions: "",
            example: "",
            states: &[
                Signal::new("speed", "v", "m/s", ""),
                Signal::new("place", "x", "m", ""),
                Signal::new("way", "s", "m", ""),
            ],
            inputs: &[Signal::new("push", "u", "m/s^2", "")],
            outputs: &[
                Signal::new("stretch", "d", "m", ""),
                Signal::new("square", "q", "m^2/s^2", ""),
            ],
            integrals: &[],
            channels: &[Channel {
                id: "weight",
                place: Place::Effort(0),
                unit: "m/s^2",
                equation: "",
                reads: &[],
                side: 0,
                size: 1.0,
                doc: "",
            }],
            parameters: &[Parameter::new("k", "k", "1/s^2", "")],
            parameterizations: &[],
            controlled: &[],
        };

        const TRAIL: &'static [usize] = &[2];

        fn derivative<S: Real>(x: &[S; 3], u: &[S; 1], w: &[S; 1], p: &[S; 1]) -> [S; 3] {
            let [rate, v, _] = <Self as Plant>::motion(x, u, w, p);
            [rate, v, v.abs()]
        }

        fn motion<S: Real>(x: &[S; 3], u: &[S; 1], w: &[S; 1], p: &[S; 1]) -> [S; 3] {
            [u[0] + w[0] - p[0] * x[1], x[0], S::zero()]
        }

        fn output<S: Real>(index: usize, x: &[S; 3], u: &[S; 1], _p: &[S; 1]) -> S {
            [x[1] - u[0], x[0] * x[0]][index]
        }
    }

    declare_plant!(Swing, "swing");

    /// Drag that grows with time, from the signals.
    fn drag(time: f64, signals: &[f64]) -> f64 {
        -time * signals[0] * signals[5] - 0.1 * signals[4]
    }

    /// Several steps at once are the stages one by one, digit for digit, with and without the trail.
    #[test]
    fn steps_under_efforts_have_the_digits_of_the_stages() {
        let (h, u, w, p) = (0.05, [0.3], [0.01], [4.0]);
        for trail in [true, false] {
            let (mut x, mut y) = ([0.2, 1.0, 0.0], [0.2, 1.0, 0.0]);
            let time = |step: usize, stage: usize| h * (step as f64 + [0.0, 0.5, 0.5, 1.0][stage]);
            let mut signals = [f64::NAN; 6];
            let under = Under {
                span: Steps {
                    count: 40,
                    length: h,
                    watched: false,
                },
                u: &u,
                w: &w,
                p: &p,
                states: &[0],
                outputs: &[0, 1],
                trail,
            };
            let mut act = |(step, stage): (usize, usize), signals: &[f64], w: &mut [f64]| {
                w[0] += drag(time(step, stage), signals);
            };
            let moved = Swing.steps_under(&mut x, &under, &mut signals, &mut act);
            assert_eq!(moved, Some(0.0));
            let mut rk4 = Rk4::new([0.0; 3]);
            for step in 0..40 {
                rk4.step(&mut y, h, |stage, x, dx| {
                    let stretch = x[1] - u[0];
                    let signals = [x[0], 0.0, 0.0, 0.0, stretch, x[0] * x[0]];
                    let w = [w[0] + drag(time(step, stage), &signals)];
                    if trail {
                        Swing.derivative(x, &u, &w, &p, dx);
                    } else {
                        Swing.motion(x, &u, &w, &p, dx);
                    }
                });
            }
            assert_eq!(x, y);
            assert_eq!(x[2] == 0.0, !trail);
            // Lengths that are not the plant's move nothing.
            let moved = Swing.steps_under(&mut y[..2], &under, &mut signals, &mut act);
            assert!(moved.is_none());
        }
    }
}
