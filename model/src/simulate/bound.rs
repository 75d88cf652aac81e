//! Effects at their channels, ready to be evaluated.

use std::ops::Range;

use crate::model::Model;
use crate::registry::{AnyPhysics, HostReal};
use loopsight_core::{Channel, Now, Past, Place, Reading, Role, Spot};

/// An effect at one channel.
#[derive(Clone)]
pub(crate) struct Bound {
    /// Index of the effect in the model.
    pub(crate) effect: usize,
    physics: &'static dyn AnyPhysics,
    /// Its parameters among those of the model.
    parameters: Range<usize>,
    pub(crate) place: Place,
    side: f64,
    is_position: bool,
    /// See [`Reading::shortest`].
    shortest: f64,
    /// The signals that play roles at its channel.
    reads: [Option<usize>; Role::COUNT],
    /// Signals it reads beside those.
    signals: Vec<usize>,
    /// First of its states in the extended state vector.
    pub(crate) z: usize,
    /// Number of its states.
    pub(crate) n_z: usize,
    /// Index into the histories, for effects with memory.
    pub(crate) history: Option<usize>,
    /// How far ahead it sees its channel, s.
    pub(crate) ahead: f64,
    /// What it adds follows from the channel's value and its parameters alone.
    pub(super) is_static: bool,
}

impl Bound {
    /// The signals that it reads, the one that it acts on included.
    fn signals(&self) -> impl Iterator<Item = usize> + '_ {
        let own = match self.place {
            Place::Output(i) => Some(i),
            _ => None,
        };
        let named = self.reads.iter().flatten().copied();
        named.chain(self.signals.iter().copied()).chain(own)
    }

    /// Whether a parameter of the model, by index, is its own.
    pub(super) fn has(&self, parameter: usize) -> bool {
        self.parameters.contains(&parameter)
    }

    /// The speeds that it reads, as signals by index.
    pub(super) fn speeds(&self) -> impl Iterator<Item = usize> + '_ {
        let roles = [Role::Flow, Role::Forward, Role::Yaw];
        roles
            .into_iter()
            .filter_map(|role| self.reads[role as usize])
    }

    /// Whether the effect knows its input already, where so many samples of a run are `foreseen`.
    pub(super) fn knows_ahead(&self, foreseen: usize) -> bool {
        foreseen > 0 && self.ahead > 0.0
    }
}

/// All effects of a model by the kind of place they act at, in the model's order. On inputs the laws of an
/// actuator's output come last.
#[derive(Clone, Default)]
pub(crate) struct Bounds {
    /// With memory, on inputs.
    pub(crate) input_memory: Vec<Bound>,
    pub(crate) inputs: Vec<Bound>,
    pub(crate) efforts: Vec<Bound>,
    pub(crate) bodies: Vec<Bound>,
    pub(crate) outputs: Vec<Bound>,
    /// With memory, on outputs.
    pub(crate) output_memory: Vec<Bound>,
    /// Number of histories.
    pub(crate) histories: usize,
    /// Number of effect states.
    pub(crate) states: usize,
}

impl Bounds {
    /// Binds the effects of `model`; their states follow the plant's.
    pub(crate) fn of(model: &Model) -> Self {
        let mut bounds = Self::default();
        let plant_states = model.n_states();
        for (index, effect) in model.effects.iter().enumerate() {
            for (channel, reads) in effect.at.iter().zip(&effect.reads) {
                let history = effect.meta.memory.then_some(bounds.histories);
                bounds.histories += usize::from(effect.meta.memory);
                let first = effect.first_parameter;
                let bound = Bound {
                    effect: index,
                    physics: effect.physics,
                    parameters: first..first + effect.meta.parameters.len(),
                    place: channel.place,
                    side: f64::from(channel.side),
                    is_position: matches!(channel.place, Place::Output(i)
                        if reads_position(model, channel) == Some(i)),
                    shortest: model.shortest_lag,
                    reads: *reads,
                    signals: effect.signals.clone(),
                    z: plant_states + bounds.states,
                    n_z: effect.meta.states,
                    history,
                    ahead: effect.meta.ahead_s,
                    is_static: effect.meta.is_static,
                };
                bounds.states += effect.meta.states;
                match (channel.place, effect.meta.memory) {
                    (Place::Input(_), true) => bounds.input_memory.push(bound),
                    (Place::Input(_), false) => bounds.inputs.push(bound),
                    (Place::Output(_), true) => bounds.output_memory.push(bound),
                    (Place::Output(_), false) => bounds.outputs.push(bound),
                    (Place::Effort(_), _) => bounds.efforts.push(bound),
                    (Place::Rate(_), _) => bounds.bodies.push(bound),
                }
            }
        }
        let last = |bound: &Bound| model.effects[bound.effect].meta.acts_last;
        bounds.inputs.sort_by_key(last);
        bounds
    }

    /// All of them.
    pub(crate) fn all(&self) -> impl Iterator<Item = &Bound> {
        self.input_memory
            .iter()
            .chain(&self.inputs)
            .chain(&self.efforts)
            .chain(&self.bodies)
            .chain(&self.outputs)
            .chain(&self.output_memory)
    }

    /// Signals that effects acting within a step read.
    pub(crate) fn read(&self) -> impl Iterator<Item = usize> + '_ {
        self.input_memory
            .iter()
            .chain(&self.inputs)
            .chain(&self.efforts)
            .chain(&self.bodies)
            .chain(&self.outputs)
            .flat_map(Bound::signals)
    }

    /// Signals that any effect reads.
    pub(crate) fn shown(&self) -> impl Iterator<Item = usize> + '_ {
        self.all().flat_map(Bound::signals)
    }
}

/// One effect at all its channels of one kind of place.
#[derive(Clone)]
pub(super) struct Group {
    physics: &'static dyn AnyPhysics,
    parameters: Range<usize>,
    spots: Vec<Spot>,
}

impl Group {
    /// The effects of `bounds`, which are without memory, in their order. Their states are counted from `first`.
    pub(super) fn of(bounds: &[Bound], first: usize) -> Vec<Self> {
        let of_one = bounds.chunk_by(|a, b| a.effect == b.effect);
        let group = |of_one: &[Bound]| {
            let effect = of_one.first()?;
            let spot = |bound: &Bound| Spot {
                to: match bound.place {
                    Place::Input(i) | Place::Output(i) | Place::Effort(i) | Place::Rate(i) => i,
                },
                side: bound.side,
                is_position: bound.is_position,
                reads: bound.reads,
                z: bound.z - first..bound.z - first + bound.n_z,
                shortest: bound.shortest,
            };
            Some(Self {
                physics: effect.physics,
                parameters: effect.parameters.clone(),
                spots: of_one.iter().map(spot).collect(),
            })
        };
        of_one.filter_map(group).collect()
    }

    /// Adds what the effect contributes to `to`, and puts the rates of its states into `dz`. `values` are those of the
    /// whole model.
    #[inline(always)]
    pub(super) fn act<S: HostReal>(
        &self,
        now: &Now<'_, S>,
        values: &[S],
        to: &mut [S],
        dz: &mut [S],
    ) {
        let p = &values[self.parameters.clone()];
        S::physics(self.physics).act(&self.spots, now, p, to, dz);
    }
}

fn reads_position(model: &Model, channel: &Channel) -> Option<usize> {
    let id = channel.read(Role::Position)?;
    model.find_signal(id).ok()
}

/// What an effect is evaluated with.
#[derive(Clone, Copy)]
pub(crate) struct Scene<'a, S> {
    /// Parameter values of the whole model.
    pub(crate) values: &'a [S],
    /// Extended state.
    pub(crate) x: &'a [S],
    pub(crate) signals: &'a [S],
    pub(crate) time: f64,
    /// Interval over which a contribution with memory holds.
    pub(crate) interval: (f64, f64),
}

impl<S: HostReal> Scene<'_, S> {
    fn reading<'p>(
        &'p self,
        bound: &'p Bound,
        nominal: S,
        past: &'p dyn Past<S>,
    ) -> Reading<'p, S> {
        Reading {
            time: self.time,
            from: self.interval.0,
            to: self.interval.1,
            nominal,
            side: S::of(bound.side),
            is_position: bound.is_position,
            roles: [None; Role::COUNT],
            reads: Some(&bound.reads),
            signals: self.signals,
            shortest: bound.shortest,
            past,
        }
    }

    fn parameters(&self, bound: &Bound) -> &[S] {
        &self.values[bound.parameters.clone()]
    }

    /// What the effect adds to its channel.
    pub(crate) fn contribution(&self, bound: &Bound, nominal: S, past: &dyn Past<S>) -> S {
        S::physics(bound.physics).contribution(
            &self.reading(bound, nominal, past),
            &self.x[bound.z..bound.z + bound.n_z],
            self.parameters(bound),
        )
    }

    /// The rates of its states.
    pub(crate) fn rates(&self, bound: &Bound, nominal: S, past: &dyn Past<S>, dx: &mut [S]) {
        if bound.n_z > 0 {
            S::physics(bound.physics).state_derivative(
                &self.reading(bound, nominal, past),
                &self.x[bound.z..bound.z + bound.n_z],
                self.parameters(bound),
                &mut dx[bound.z..bound.z + bound.n_z],
            );
        }
    }

    /// Its states at the start of a run, into `z`.
    pub(crate) fn initial(&self, bound: &Bound, nominal: S, past: &dyn Past<S>, z: &mut [S]) {
        S::physics(bound.physics).initial_state(
            &self.reading(bound, nominal, past),
            self.parameters(bound),
            z,
        );
    }

    /// Brings its states within their limits.
    pub(crate) fn confine(values: &[S], bound: &Bound, x: &mut [S]) {
        if bound.n_z > 0 {
            S::physics(bound.physics).confine(
                &mut x[bound.z..bound.z + bound.n_z],
                &values[bound.parameters.clone()],
            );
        }
    }
}
