//! What is compiled into a firmware.

use loopsight_core::{ControlAffine, PlantArrays, Real};

use crate::effects::EffectSet;
use crate::estimator::RowEstimator;
use crate::law::OnboardLaw;

/// The parts of a robot: what is compiled into its firmware. Written by [`aboard!`](crate::aboard).
///
/// All sizes follow from the parts, so [`Session`](crate::Session) and the rest of the loop have this one
/// type as their parameter.
pub trait Parts: Sized + 'static {
    /// The numbers of the loop: `f32` on a robot.
    type Scalar: Real;
    /// The plant, as a control law sees it.
    type Plant: ControlAffine;
    /// The effects that the loop can compensate.
    type Effects: EffectSet;
    /// The estimator of one controlled state.
    type Estimator: RowEstimator<Self::Scalar>;
    /// The control law.
    type Law: OnboardLaw<Self::Scalar>;
}

/// One element per state of the plant.
pub type PerState<R, T = <R as Parts>::Scalar> = <<R as Parts>::Plant as PlantArrays>::State<T>;

/// One element per input of the plant, or per controlled state: there are as many of the one as of the
/// other.
pub type PerInput<R, T = <R as Parts>::Scalar> = <<R as Parts>::Plant as PlantArrays>::Input<T>;

/// One element per effort channel of the plant.
pub type PerEffort<R, T = <R as Parts>::Scalar> = <<R as Parts>::Plant as PlantArrays>::Effort<T>;

/// One element per parameter of the plant.
pub type PerParameter<R, T = <R as Parts>::Scalar> =
    <<R as Parts>::Plant as PlantArrays>::Parameters<T>;

/// One element per parameter that is learned of one controlled state.
pub type PerRow<R, T = <R as Parts>::Scalar> =
    <<R as Parts>::Estimator as RowEstimator<<R as Parts>::Scalar>>::Row<T>;

/// Lists the parts of a robot: writes a type and its [`Parts`].
///
/// ```
/// use loopsight_estimators::Rls;
/// use loopsight_onboard::{Session, aboard};
/// use loopsight_plants::Ddmr;
/// use loopsight_plants::effects::{CoulombFriction, ViscousFriction};
/// use nalgebra::Const;
///
/// aboard! {
///     /// A differential drive that knows two kinds of friction.
///     pub struct Courier {
///         plant: Ddmr,
///         effects: [CoulombFriction, ViscousFriction],
///         estimator: Rls<f32, Const<3>>,
///     }
/// }
///
/// let robot = Session::<Courier, _>::new(10_000, ());
/// assert!(robot.output().is_none(), "nobody has configured it");
/// ```
///
/// | field | what |
/// |---|---|
/// | `scalar` | the numbers of the loop; left out: `f32`, which the messages of [`Session`](crate::Session) need |
/// | `plant` | a [`ControlAffine`](loopsight_core::ControlAffine) plant |
/// | `effects` | `library`: those of [`Twil`](crate::Twil); `[A, B]`: these; `library + [A, B]`: both. Each an [`Effect`](loopsight_core::Effect) that acts at once, as a force, and reads speeds only ([`acts_aboard`](crate::acts_aboard)); anything else does not compile |
/// | `estimator` | an [`OnboardEstimator`](crate::OnboardEstimator) for the parameters of one controlled state |
/// | `law` | an [`OnboardLaw`](crate::OnboardLaw); left out: [`FeedbackLinearizingPi`](loopsight_controllers::FeedbackLinearizingPi) |
#[macro_export]
macro_rules! aboard {
    (
        $(#[$attribute:meta])*
        $visible:vis struct $name:ident {
            $(scalar: $scalar:ty,)?
            plant: $plant:ty,
            effects: library $(+ [$($own:ident),+ $(,)?])?,
            estimator: $estimator:ty
            $(, law: $law:ty)? $(,)?
        }
    ) => {
        $crate::aboard! {
            @parts $(#[$attribute])* $visible $name [$($scalar)?] [$plant] [$estimator] [$($law)?]
            ConstantForce: $crate::__private::effects::ConstantForce,
            CoulombFriction: $crate::__private::effects::CoulombFriction,
            DirectionalFriction: $crate::__private::effects::DirectionalFriction,
            QuadraticDrag: $crate::__private::effects::QuadraticDrag,
            ScrubFriction: $crate::__private::effects::ScrubFriction,
            StribeckFriction: $crate::__private::effects::StribeckFriction,
            ViscousFriction: $crate::__private::effects::ViscousFriction,
            $($($own: $own,)+)?
        }
    };
    (
        $(#[$attribute:meta])*
        $visible:vis struct $name:ident {
            $(scalar: $scalar:ty,)?
            plant: $plant:ty,
            effects: [$($own:ident),* $(,)?],
            estimator: $estimator:ty
            $(, law: $law:ty)? $(,)?
        }
    ) => {
        $crate::aboard! {
            @parts $(#[$attribute])* $visible $name [$($scalar)?] [$plant] [$estimator] [$($law)?]
            $($own: $own,)*
        }
    };
    (
        @parts $(#[$attribute:meta])* $visible:vis $name:ident [$($scalar:ty)?] [$plant:ty] [$estimator:ty]
        [$($law:ty)?] $($variant:ident: $effect:ty,)*
    ) => {
        $(#[$attribute])*
        #[derive(Clone, Copy, Debug)]
        $visible struct $name;

        const _: () = {
            $(assert!(
                $crate::acts_aboard(&<$effect as $crate::__private::Effect>::META),
                concat!(
                    "`", stringify!($variant),
                    "` cannot be compensated aboard: an effect there acts at once, on efforts, and reads speeds only"
                )
            );)*
            const INPUTS_ABOARD: usize = <$plant as $crate::__private::Plant>::META.inputs.len();
            assert!(
                <$plant as $crate::__private::Plant>::META.controlled.len() == INPUTS_ABOARD,
                "a plant aboard has as many controlled states as inputs"
            );
            const ROW_ABOARD: usize = <$estimator as $crate::OnboardEstimator<
                $crate::aboard!(@or [$($scalar)?] f32),
            >>::PARAMETERS;

            /// The effects by name.
            #[derive(Clone, Copy, Debug)]
            #[allow(unreachable_pub, reason = "what it belongs to may be public")]
            pub enum EffectsAboard {
                $(
                    #[allow(missing_docs, reason = "the effect of this name")]
                    $variant,
                )*
            }

            impl $crate::EffectSet for EffectsAboard {
                type Reads<T: Copy + Send> = [T; $crate::__private::most_reads(&[
                    $(&<$effect as $crate::__private::Effect>::META),*
                ])];

                fn named(id: &str) -> Option<Self> {
                    $(if id == <$effect as $crate::__private::Effect>::META.id {
                        return Some(EffectsAboard::$variant);
                    })*
                    None
                }

                fn meta(self) -> &'static $crate::__private::EffectMeta {
                    match self {
                        $(EffectsAboard::$variant => &<$effect as $crate::__private::Effect>::META,)*
                    }
                }

                #[inline(always)]
                fn contribution<S: $crate::__private::Real>(
                    self,
                    nominal: S,
                    side: S,
                    signal: impl Fn(usize) -> S,
                    p: &[S; $crate::__private::PARAMETERS],
                ) -> S {
                    let _ = (nominal, side, &signal, p);
                    match self {
                        $(EffectsAboard::$variant => {
                            $crate::__private::contribution::<$effect, S, Self::Reads<S>>(
                                nominal, side, signal, p,
                            )
                        })*
                    }
                }
            }

            impl $crate::Parts for $name {
                type Scalar = $crate::aboard!(@or [$($scalar)?] f32);
                type Plant = $plant;
                type Effects = EffectsAboard;
                type Estimator = $crate::__private::Guarded<
                    Self::Scalar,
                    $estimator,
                    $crate::__private::Const<ROW_ABOARD>,
                >;
                type Law = $crate::aboard!(
                    @or [$($law)?]
                    $crate::__private::FeedbackLinearizingPi<
                        Self::Scalar,
                        $crate::__private::Const<INPUTS_ABOARD>,
                    >
                );
            }
        };
    };
    (@or [] $default:ty) => { $default };
    (@or [$given:ty] $default:ty) => { $given };
}

aboard! {
    /// A Twil: a differential drive with two motors, whose equations have three parameters for each of its
    /// two speeds; the effects of the library, and recursive least squares.
    pub struct Twil {
        plant: loopsight_plants::Ddmr,
        effects: library,
        estimator: loopsight_estimators::Rls<f32, nalgebra::Const<3>>,
    }
}
