//! What acts within a step, as a list that is made once.

use super::bound::{Bounds, Group};

/// The effects that act within a step, in the order in which they do.
#[derive(Clone)]
pub(super) struct Plan {
    pub(super) inputs: Vec<Group>,
    /// Those on inputs add the same as long as the inputs are the same.
    pub(super) steady: bool,
    pub(super) efforts: Vec<Group>,
    pub(super) bodies: Vec<Group>,
    /// Something acts on the plant that its own steps do not offer: it is not steady inputs and efforts alone, or has states.
    pub(super) beside: bool,
    /// Nothing acts within a step.
    pub(super) alone: bool,
}

impl Plan {
    /// Of the effects of a model with so many states, beside which others may be integrated, `size` in all.
    pub(super) fn of(bounds: &Bounds, states: usize, size: usize) -> Self {
        let steady = bounds.inputs.iter().all(|bound| bound.is_static);
        Self {
            steady,
            inputs: Group::of(&bounds.inputs, states),
            efforts: Group::of(&bounds.efforts, states),
            bodies: Group::of(&bounds.bodies, states),
            beside: !steady || !bounds.bodies.is_empty() || size > states,
            alone: bounds.efforts.is_empty(),
        }
    }
}
