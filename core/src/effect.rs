//! Effects: physics that can be added to a plant, at its channels.

use crate::{Array, Parameter, PlaceKind, Real, Role};

/// What a recording must have for an effect to show in it. Where it has not, a diagnosis does not try the effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shows {
    /// Nothing in particular: it shows wherever something moves.
    Anywhere,
    /// The signal measured at the channel is never below zero, although an input goes both ways.
    NeverNegative,
    /// The input at the channel rests at zero between other values.
    InputAtZero,
    /// The input at the channel has commands of several sizes.
    InputSizes,
    /// The position (or head) at the channel stays at one end of where it goes, or turns round there again and again.
    AtEnd,
    /// The recording is one run. What changes with time alone does not begin anew with every run, and how long the machine
    /// ran between two of them is not known.
    OneRun,
    /// The plant has one mass. Where several move, what lies between them is the plant's own, and an observer that corrects
    /// one of them would be given a second filter.
    OneMass,
}

/// What an effect says about itself.
#[derive(Clone, Copy, Debug)]
pub struct EffectMeta {
    /// Identifier in TOML, e.g. `coulomb_friction`.
    pub id: &'static str,
    /// One sentence: what it is.
    pub summary: &'static str,
    /// What a person sees in the residual when it is missing.
    pub symptom: &'static str,
    /// What can be done about it, in the controller or with a screwdriver.
    pub remedy: &'static str,
    /// The equation in plain text.
    pub equation: &'static str,
    /// Where it comes from: author, year, equation or page.
    pub reference: &'static str,
    /// A TOML entry that adds it.
    pub example: &'static str,
    /// Kinds of places it attaches to.
    pub places: &'static [PlaceKind],
    /// Roles it reads at its channel; a channel that does not offer them all is refused.
    pub reads: &'static [Role],
    /// Channels that offer one of these are refused: they are left to a more specific effect or to
    /// the plant itself.
    pub yields_to: &'static [Role],
    /// It acts oppositely on two sides; a channel without a [`crate::Channel::side`] is refused.
    pub sided: bool,
    /// Its parameters, shared by all the channels of one instance. In their units `channel` stands
    /// for the unit of the channel, `flow`, `position` and `head` for those of the signals with these
    /// roles there; such parameters count in sizes, see [`crate::Channel::size`].
    pub parameters: &'static [Parameter],
    /// Acts on all its channels together, as one instance: one supply, one body.
    pub shared_only: bool,
    /// It acts before the machine, on the way of a command through driver and supply. An input that was
    /// measured at the machine has gone that way already.
    pub before_input: bool,
    /// It is the law of the actuator's output: at its inputs it acts on what all other effects leave of the command.
    pub acts_last: bool,
    /// A static map of its channel: what it adds follows from [`Reading::nominal`], [`Reading::side`] and the parameters
    /// alone, not from time, a signal or a state. On an input that is held it is evaluated once per interval.
    pub is_static: bool,
    /// What a recording must have for it to show.
    pub shows: Shows,
    /// How rare it is: 0 nearly every machine has it, 1 common, 2 rare. Orders explanations that a
    /// recording cannot tell apart.
    pub rarity: u8,
    /// Ids of effects that it contains as special cases: it has to earn its further parameters.
    pub simpler: &'static [&'static str],
    /// States per channel it is attached to.
    pub states: usize,
    /// It looks back in time at its channel, through [`Reading::past`]. Such effects are evaluated
    /// first at their channel, once per integration step.
    pub memory: bool,
    /// How far ahead it sees its channel, s, beside the past: an effect of how a recording was written, which is known to
    /// its end. In a running loop there is nothing to see, and the newest value holds.
    pub ahead_s: f64,
    /// Longest integration step that follows its states, s: a model with it takes none longer, whatever
    /// its plant and its file allow.
    pub max_step_s: f64,
}

impl EffectMeta {
    /// Nothing filled in, and nothing special: what most effects write `..EffectMeta::PLAIN` for.
    pub const PLAIN: Self = Self {
        id: "",
        summary: "",
        symptom: "",
        remedy: "",
        equation: "",
        reference: "",
        example: "",
        places: &[],
        reads: &[],
        yields_to: &[],
        sided: false,
        shared_only: false,
        before_input: false,
        acts_last: false,
        is_static: false,
        shows: Shows::Anywhere,
        rarity: 1,
        simpler: &[],
        parameters: &[],
        states: 0,
        memory: false,
        ahead_s: 0.0,
        max_step_s: f64::INFINITY,
    };

    /// Whether what the effect does now depends on what went before: it has states, or looks back in time.
    pub const fn is_dynamic(&self) -> bool {
        self.memory || self.states > 0
    }
}

/// Time constant below which a lag is followed by its area alone, s, where nothing says that the samples are closer: integration
/// steps of up to 10 ms can follow it.
pub const SHORTEST_LAG_S: f64 = 0.004;

/// What an effect sees at one of its channels at one instant.
///
/// For an effect with memory the contribution is one that holds over `from..to`.
#[derive(Clone, Copy)]
pub struct Reading<'a, S> {
    /// Time since the start of the run, s.
    pub time: f64,
    /// Start of the interval over which the contribution holds, s since the start of the run.
    pub from: f64,
    /// End of that interval, s.
    pub to: f64,
    /// The channel's value without this effect: the command on an input, the signal on an output,
    /// the nominal rate on a body channel, the sum of the other efforts on an effort channel.
    pub nominal: S,
    /// `+1`, `-1` or `0`, see [`crate::Channel::side`].
    pub side: S,
    /// The channel's own signal is the one that plays [`Role::Position`]: an angle, not its rate.
    pub is_position: bool,
    /// The signals by role, where the channel binds one and the effect declares it. Unused with [`reads`](Self::reads).
    pub roles: [Option<&'a S>; Role::COUNT],
    /// Where those signals stand among [`signals`](Self::signals). A composed model says this, which costs less there than
    /// references; on a board the compiler sees through references.
    pub reads: Option<&'a [Option<usize>; Role::COUNT]>,
    /// All signals of the plant: states, inputs, outputs. Those that nobody asked for may be of an
    /// earlier instant.
    pub signals: &'a [S],
    /// Shortest time constant that the simulation follows, s: [`SHORTEST_LAG_S`], or less where its samples are closer.
    pub shortest: f64,
    /// The channel's nominal value in the past, and in the future as far as [`EffectMeta::ahead_s`] says and it is known.
    pub past: &'a dyn Past<S>,
}

impl<'a, S: Real> Reading<'a, S> {
    /// A reading in which everything is zero, and nothing has a past.
    pub fn nothing() -> Self {
        Self {
            time: 0.0,
            from: 0.0,
            to: 0.0,
            nominal: S::zero(),
            side: S::zero(),
            is_position: false,
            roles: [None; Role::COUNT],
            reads: None,
            signals: &[],
            shortest: SHORTEST_LAG_S,
            past: &NoPast,
        }
    }

    /// The same with the signal that plays `role`. Not for a reading that a composed model made: there
    /// [`reads`](Self::reads) says which signal does.
    pub fn with(mut self, role: Role, signal: &'a S) -> Self {
        self.roles[role as usize] = Some(signal);
        self
    }

    /// The signal that plays `role` at this channel; zero where the effect does not declare that.
    #[inline(always)]
    pub fn get(&self, role: Role) -> S {
        let signal = match self.reads {
            Some(reads) => reads[role as usize].and_then(|index| self.signals.get(index)),
            None => self.roles[role as usize],
        };
        signal.copied().unwrap_or_else(S::zero)
    }
}

/// The past of one channel. A reading may be kept, and taken to another thread with whoever keeps it.
pub trait Past<S>: Sync {
    /// Mean of the channel's nominal value between two instants, s since the start of the run.
    ///
    /// Differentiable in both bounds. Before the run began the value is that at its start.
    fn mean(&self, from: S, to: S) -> S;
}

/// For effects without memory: a past that is always zero.
#[derive(Clone, Copy, Debug)]
pub struct NoPast;

impl<S: Real> Past<S> for NoPast {
    fn mean(&self, _from: S, _to: S) -> S {
        S::zero()
    }
}

/// The arrays of an effect, as long as its [`EffectMeta`] says. Written by
/// [`declare_effect!`](crate::declare_effect).
#[diagnostic::on_unimplemented(
    message = "the effect `{Self}` is not declared",
    label = "its arrays are not known",
    note = "write `declare_effect!({Self}, \"the_id_of_its_meta\");` beside `impl Effect for {Self}`"
)]
pub trait EffectArrays {
    /// One element per state at one channel: `z`.
    type State<T: Copy + Send>: Array<T> + Copy + Send;
    /// One element per parameter: `p`.
    type Parameters<T: Copy + Send>: Array<T> + Copy + Send;
}

/// A physical effect, as its author writes it: what it adds to a channel.
///
/// Parameters are shared by all channels of an instance; states are one set per channel. The lengths of
/// `p` and `z` are those of [`Effect::META`]: an author writes arrays, `p: &[S; 2]`, and an array of another
/// length does not compile. The value is immutable; parameters and states live outside. Derivatives come
/// from the scalar: a fit calls it with dual numbers, a microcontroller with `f32`.
/// [`declare_effect!`](crate::declare_effect) does the rest.
///
/// ```
/// use loopsight_core::{
///     Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role, declare_effect,
/// };
///
/// /// Drag of the air on a disc that turns: `w = -k ω |ω|`.
/// struct DiscDrag;
///
/// impl Effect for DiscDrag {
///     const META: EffectMeta = EffectMeta {
///         id: "disc_drag",
///         summary: "drag of the air on a disc",
///         equation: "w = -k flow |flow|",
///         reference: "Schlichting (1979), Boundary-Layer Theory, 7th ed., chapter V",
///         places: &[PlaceKind::Effort],
///         reads: &[Role::Flow],
///         parameters: &[Parameter::new("k", "k", "channel/flow^2", "drag")],
///         ..EffectMeta::PLAIN
///     };
///
///     fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
///         let speed = at.get(Role::Flow);
///         -p[0] * speed * speed.abs()
///     }
/// }
///
/// declare_effect!(DiscDrag, "disc_drag");
///
/// let speed = -2.0;
/// let at = Reading::nothing().with(Role::Flow, &speed);
/// assert_eq!(<DiscDrag as Effect>::contribution(&at, &[], &[0.5]), 2.0);
/// ```
pub trait Effect: EffectArrays + Sized + Send + Sync + 'static {
    /// Names, places, parameters, equation, symptom, remedy, reference.
    const META: EffectMeta;

    /// What is added to the channel, in the channel's unit.
    fn contribution<S: Real>(at: &Reading<'_, S>, z: &Self::State<S>, p: &Self::Parameters<S>)
    -> S;

    /// The rate of the effect's states.
    fn state_derivative<S: Real>(
        at: &Reading<'_, S>,
        z: &Self::State<S>,
        p: &Self::Parameters<S>,
    ) -> Self::State<S> {
        let _ = (at, z, p);
        Self::State::filled(S::zero())
    }

    /// The states at the start of a run, as if the reading had been constant before.
    fn initial_state<S: Real>(at: &Reading<'_, S>, p: &Self::Parameters<S>) -> Self::State<S> {
        let _ = (at, p);
        Self::State::filled(S::zero())
    }

    /// The states within their limits, asked for after every integration step: what exceeds them is lost.
    fn confine<S: Real>(z: &Self::State<S>, p: &Self::Parameters<S>) -> Self::State<S> {
        let _ = p;
        *z
    }
}
