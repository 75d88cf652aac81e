//! Plants: the trait that authors implement, and the object-safe trait that is made from it.

use crate::{Array, Channel, Derived, Parameter, Place, Real, Signal, Unshown};

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

impl PlantMeta {
    /// Number of effort channels: the length of `w`.
    pub const fn efforts(&self) -> usize {
        let (mut efforts, mut i) = (0, 0);
        while i < self.channels.len() {
            if let Place::Effort(_) = self.channels[i].place {
                efforts += 1;
            }
            i += 1;
        }
        efforts
    }

    /// Effort channels are numbered from 0 without gaps, and there are as many controlled states as inputs,
    /// or none. [`declare_plant!`](crate::declare_plant) asks for it when a program is compiled.
    pub const fn is_consistent(&self) -> bool {
        let mut effort = 0;
        while effort < self.efforts() {
            let (mut found, mut i) = (0, 0);
            while i < self.channels.len() {
                if let Place::Effort(c) = self.channels[i].place
                    && c == effort
                {
                    found += 1;
                }
                i += 1;
            }
            if found != 1 {
                return false;
            }
            effort += 1;
        }
        self.controlled.is_empty() || self.controlled.len() == self.inputs.len()
    }
}

/// Another set of parameters, from which those of the equations are computed.
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

/// The arrays of a plant, as long as its [`PlantMeta`] says. Written by
/// [`declare_plant!`](crate::declare_plant).
#[diagnostic::on_unimplemented(
    message = "the plant `{Self}` is not declared",
    label = "its arrays are not known",
    note = "write `declare_plant!({Self}, \"the_id_of_its_meta\");` beside `impl Plant for {Self}`"
)]
pub trait PlantArrays {
    /// One element per state: `x`.
    type State<T: Copy + Send>: Array<T> + Copy + Send;
    /// One element per input: `u`. A [`ControlAffine`] plant has as many controlled states.
    type Input<T: Copy + Send>: Array<T> + Copy + Send;
    /// One element per effort channel: `w`.
    type Effort<T: Copy + Send>: Array<T> + Copy + Send;
    /// One element per parameter of the equations: `p`.
    type Parameters<T: Copy + Send>: Array<T> + Copy + Send;
}

/// A plant, as its author writes it: `dx/dt = f(t, x, u, w; p)`.
///
/// The lengths of `x`, `u`, `w` and `p` are those of the tables in [`Plant::META`]. An author writes them
/// as arrays, `x: &[S; 2]`; an array of another length does not compile. `w[c]` is the sum of what the
/// effects add on effort channel `c`. [`declare_plant!`](crate::declare_plant) does the rest.
///
/// ```
/// use loopsight_core::{
///     Channel, Parameter, Place, Plant, PlantMeta, Reads, Real, Role, Signal, declare_plant,
/// };
///
/// /// A flywheel that a torque turns: `ω' = (τ + w)/J`.
/// struct Flywheel;
///
/// impl Plant for Flywheel {
///     const META: PlantMeta = PlantMeta {
///         id: "flywheel",
///         summary: "a wheel turned by a torque",
///         equation: "omega' = (torque + w)/J",
///         reference: "Newton (1687), second law",
///         assumptions: "a rigid wheel",
///         example: "[plant.flywheel]\nJ = 0.02\n",
///         states: &[Signal::new("speed", "omega", "rad/s", "speed of the wheel")],
///         inputs: &[Signal::new("torque", "tau", "N m", "torque at the wheel")],
///         outputs: &[],
///         integrals: &[],
///         channels: &[Channel {
///             id: "shaft",
///             place: Place::Effort(0),
///             unit: "N m",
///             equation: "tau -> tau + w",
///             reads: &[Reads(Role::Flow, "speed"), Reads(Role::Drive, "torque")],
///             side: 0,
///             size: 1.0,
///             doc: "torques at the wheel",
///         }],
///         parameters: &[Parameter::new("J", "J", "kg m^2", "inertia").above(0.0).nonlinear()],
///         parameterizations: &[],
///         controlled: &[0],
///     };
///
///     fn derivative<S: Real>(_x: &[S; 1], u: &[S; 1], w: &[S; 1], p: &[S; 1]) -> [S; 1] {
///         [(u[0] + w[0]) / p[0]]
///     }
///
///     fn output<S: Real>(_index: usize, _x: &[S; 1], _u: &[S; 1], _p: &[S; 1]) -> S {
///         S::zero()
///     }
/// }
///
/// declare_plant!(Flywheel, "flywheel");
///
/// let rate = <Flywheel as Plant>::derivative(&[0.0], &[0.1], &[-0.02], &[0.02]);
/// assert!((rate[0] - 4.0f64).abs() < 1e-12);
/// ```
pub trait Plant: PlantArrays + Sized + Send + Sync + 'static {
    /// Names, units, channels, parameters, equation, reference.
    const META: PlantMeta;

    /// Quantities that follow from the parameters.
    const DERIVED: &'static [Derived] = &[];

    /// Parts that a recording may not show, and what their parameters are then.
    const UNSHOWN: &'static [Unshown] = &[];

    /// States that only record where the machine went, by index: no rate and no output depends on them.
    /// [`Plant::motion`] does without them.
    const TRAIL: &'static [usize] = &[];

    /// Longest integration step where a model file gives none, s: a quarter of the fastest time
    /// constant that is usual, or less.
    const MAX_STEP_S: f64 = MAX_STEP_S;

    /// The rate of the state, in the state's units per second.
    fn derivative<S: Real>(
        x: &Self::State<S>,
        u: &Self::Input<S>,
        w: &Self::Effort<S>,
        p: &Self::Parameters<S>,
    ) -> Self::State<S>;

    /// As [`Plant::derivative`], with rates of zero for the [`Plant::TRAIL`]: for simulations of which nobody reads it.
    fn motion<S: Real>(
        x: &Self::State<S>,
        u: &Self::Input<S>,
        w: &Self::Effort<S>,
        p: &Self::Parameters<S>,
    ) -> Self::State<S> {
        Self::derivative(x, u, w, p)
    }

    /// The `index`-th of [`PlantMeta::outputs`]; one at a time, since most are not needed.
    fn output<S: Real>(
        index: usize,
        x: &Self::State<S>,
        u: &Self::Input<S>,
        p: &Self::Parameters<S>,
    ) -> S;

    /// Those of the outputs that `which` lists, each to its place in `y`, with the values of [`Plant::output`]. A plant
    /// whose outputs have much in common computes that once here.
    #[inline(always)]
    fn outputs<S: Real>(
        which: &[usize],
        x: &Self::State<S>,
        u: &Self::Input<S>,
        p: &Self::Parameters<S>,
        y: &mut [S],
    ) {
        for index in which {
            if let Some(to) = y.get_mut(*index) {
                *to = Self::output(*index, x, u, p);
            }
        }
    }

    /// Parameters of the equations from those of [`PlantMeta::parameterizations`]`[set]`.
    ///
    /// `from` has the length of that set. `None` when the set does not exist.
    fn lower<S: Real>(set: usize, from: &[S]) -> Option<Self::Parameters<S>> {
        let _ = (set, from);
        None
    }

    /// The `index`-th of [`Plant::DERIVED`].
    fn derived<S: Real>(index: usize, p: &Self::Parameters<S>) -> S {
        let _ = (index, p);
        S::zero()
    }
}

/// A plant whose controlled states obey `dy/dt = f(y) + G(y) u + H(y) w`, for controllers that invert
/// `G`.
///
/// Written for code without `std`, where probing a [`Dynamics`](crate::Dynamics) at run time would cost too much. There are
/// as many controlled states ([`PlantMeta::controlled`]) as inputs, so `y` has the length of `u`.
pub trait ControlAffine: Plant {
    /// The drift `f(y)`, in units of the controlled states per second.
    fn drift<S: Real>(y: &Self::Input<S>, p: &Self::Parameters<S>) -> Self::Input<S>;
    /// The input matrix `G(y)`, row by row.
    fn input_matrix<S: Real>(
        y: &Self::Input<S>,
        p: &Self::Parameters<S>,
    ) -> Self::Input<Self::Input<S>>;
    /// What efforts `w` on the plant's channels add to the rates: `H(y) w`.
    fn push<S: Real>(
        y: &Self::Input<S>,
        w: &Self::Effort<S>,
        p: &Self::Parameters<S>,
    ) -> Self::Input<S>;
}
