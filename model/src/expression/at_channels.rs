//! The names an effect may use at its channels.

use super::Names;
use super::program::FIRST_BANK;
use super::states::StateTable;
use super::table::{Ordered, ParameterTable};
use super::tree::{Slot, Tree};
use crate::model::signals;
use loopsight_core::{Channel, PlantMeta, Reading, Real, Role};

pub(super) const PARAMETERS: u8 = FIRST_BANK;
pub(super) const ROLES: u8 = FIRST_BANK + 1;
pub(super) const SIGNALS: u8 = FIRST_BANK + 2;
pub(super) const HERE: u8 = FIRST_BANK + 3;
/// What an effect sees beside signals, in this order; its states follow.
pub(super) const HERE_NAMES: [&str; 3] = ["nominal", "side", "time"];

/// The signals that an effect reads by their `roles`, in this order; `N` at most.
#[inline(always)]
pub(super) fn read_roles<S: Real, const N: usize>(at: &Reading<'_, S>, roles: &[Role]) -> [S; N] {
    let mut read = [S::zero(); N];
    for (to, role) in read.iter_mut().zip(roles) {
        *to = at.get(*role);
    }
    read
}

/// Where in an effect an expression stands: not every name has a meaning everywhere.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Site {
    /// The force, or the rate of a state.
    Rate,
    /// The start of a state.
    Start,
    /// A limit of a state.
    Limit,
}

/// The names at some channels of a plant.
pub(super) struct AtChannels<'a> {
    pub(super) plant: &'static PlantMeta,
    pub(super) at: &'a [&'static Channel],
    pub(super) parameters: &'a Ordered<ParameterTable>,
    pub(super) states: &'a Ordered<StateTable>,
}

/// Those names at one site.
pub(super) struct AtSite<'a> {
    names: &'a AtChannels<'a>,
    site: Site,
}

impl AtChannels<'_> {
    pub(super) fn at_site(&self, site: Site) -> AtSite<'_> {
        AtSite { names: self, site }
    }

    fn signal(&self, id: &str) -> Option<usize> {
        signals(self.plant).position(|s| s.id == id)
    }

    /// The role of this name; where the plant has no signal `speed` that is the flow.
    fn role(&self, name: &str) -> Option<Role> {
        let other = name == "speed" && self.signal(name).is_none();
        let id = if other { Role::Flow.id() } else { name };
        Role::ALL.into_iter().find(|r| r.id() == id)
    }

    /// A role wins over a signal of the same name, unless they are different things.
    fn reading(&self, role: Role, name: &str) -> Result<Slot, String> {
        let played: Vec<Option<&str>> = self.at.iter().map(|c| c.read(role)).collect();
        let signal = self.signal(name);
        let of_role = slot(ROLES, role as usize);
        match signal {
            Some(index) if played.iter().flatten().all(|p| *p == name) => Ok(slot(SIGNALS, index)),
            Some(_) => Err(format!(
                "`{name}` is a signal of the plant, and the {} at `{}` is another",
                role.name(),
                self.at.first().map_or("", |c| c.id)
            )),
            None => match self.at.iter().find(|c| c.read(role).is_none()) {
                Some(channel) => {
                    let offered: Vec<&str> = channel.reads.iter().map(|r| r.0.id()).collect();
                    Err(format!(
                        "the channel `{}` offers no {}, it offers {}",
                        channel.id,
                        role.name(),
                        offered.join(", ")
                    ))
                }
                None => Ok(of_role),
            },
        }
    }
}

impl AtChannels<'_> {
    /// What is read at the channels.
    fn here(&self, name: &str) -> Option<Result<Tree, String>> {
        if let Some(index) = HERE_NAMES.iter().position(|n| *n == name) {
            return Some(Ok(Tree::Name(slot(HERE, index))));
        }
        if let Some(role) = self.role(name) {
            return Some(self.reading(role, name).map(Tree::Name));
        }
        self.signal(name)
            .map(|index| Ok(Tree::Name(slot(SIGNALS, index))))
    }
}

/// Where the `index`-th state of an effect is found.
pub(super) fn state_slot(index: usize) -> Slot {
    slot(HERE, HERE_NAMES.len() + index)
}

impl Names for AtSite<'_> {
    fn find(&self, name: &str) -> Option<Result<Tree, String>> {
        let names = self.names;
        if let Some(index) = names.parameters.position(name) {
            return Some(Ok(Tree::Name(slot(PARAMETERS, index))));
        }
        let state = names.states.position(name);
        match self.site {
            Site::Rate => match state {
                Some(index) => Some(Ok(Tree::Name(state_slot(index)))),
                None => names.here(name),
            },
            Site::Start if state.is_some() => {
                Some(Err(format!("the start of a state cannot read the state `{name}`")))
            }
            Site::Start => names.here(name),
            Site::Limit => (state.is_some() || names.here(name).is_some()).then(|| {
                Err(format!(
                    "the limit of a state is a number or depends on parameters, it cannot read `{name}`"
                ))
            }),
        }
    }

    fn known(&self) -> Vec<String> {
        let at = self.names;
        let mut names: Vec<String> = at.parameters.ids().map(str::to_owned).collect();
        if self.site == Site::Limit {
            return names;
        }
        if self.site == Site::Rate {
            names.extend(at.states.ids().map(str::to_owned));
        }
        let everywhere = |r: &Role| at.at.iter().all(|c| c.read(*r).is_some());
        let roles = Role::ALL.into_iter().filter(everywhere).map(Role::id);
        names.extend(roles.chain(HERE_NAMES).map(str::to_owned));
        for signal in signals(at.plant) {
            if !names.iter().any(|n| n == signal.id) {
                names.push(signal.id.to_owned());
            }
        }
        names
    }
}

pub(super) fn slot(bank: u8, index: usize) -> Slot {
    Slot {
        bank,
        index: index as u16,
    }
}
