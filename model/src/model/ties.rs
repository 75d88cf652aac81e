//! Parameters that follow from others.

use loopsight_core::{Real, Role, Tie, Unshown};

use super::Model;
use crate::config::{ConfigError, TomlSource, nearest};
use crate::registry::HostReal;

/// A parameter of the plant's equations that follows from others.
#[derive(Clone, Debug)]
pub(super) struct Tied {
    tie: &'static Tie,
    parameter: usize,
    /// Parameters, in the order of the tie's factors.
    factors: Vec<usize>,
}

/// Sets what is tied, in the parameters of the equations.
pub(super) fn apply<S: Real>(ties: &[Tied], p: &mut [S]) {
    for tied in ties {
        let factors = tied.factors.iter().filter_map(|i| p.get(*i).copied());
        let value = tied.tie.value(factors);
        if let Some(to) = p.get_mut(tied.parameter) {
            *to = value;
        }
    }
}

impl Model {
    /// What the plant says of the parts that a recording may not show; nothing where the file gives the
    /// parameters in another way than the equations have them.
    pub fn unshown(&self) -> &'static [Unshown] {
        match self.set {
            0 => f64::dynamics(self.dynamics).unshown(),
            _ => &[],
        }
    }

    /// The tie of the parameter `index`, if it has one.
    pub fn tie(&self, index: usize) -> Option<&'static Tie> {
        let found = self.ties.iter().find(|tied| tied.parameter == index);
        found.map(|tied| tied.tie)
    }

    /// Names of the parameters that are tied, in order.
    pub fn tied_names(&self) -> Vec<&str> {
        let tied = self.parameters.iter().enumerate();
        tied.filter(|(i, _)| self.tie(*i).is_some())
            .map(|(_, p)| p.name.as_str())
            .collect()
    }

    /// The parts of the plant whose parameters are tied.
    pub fn tied_parts(&self) -> impl Iterator<Item = &'static Unshown> + '_ {
        let bound = |tie: &Tie| self.ties.iter().any(|tied| tied.tie == tie);
        let parts = self.unshown().iter();
        parts.filter(move |part| part.ties.iter().all(bound))
    }

    /// Derivatives of the parameter `index` by those it follows from, with their indices; empty where it
    /// follows from none.
    pub fn tie_gradient(&self, index: usize) -> Vec<(usize, f64)> {
        let Some(tied) = self.ties.iter().find(|tied| tied.parameter == index) else {
            return Vec::new();
        };
        let value = |i: usize| {
            self.parameters
                .get(i)
                .and_then(|p| p.value)
                .unwrap_or(f64::NAN)
        };
        let own = value(index);
        let factors = tied.factors.iter().zip(tied.tie.factors);
        factors
            .map(|(i, (_, exponent))| (*i, f64::from(*exponent) * own / value(*i)))
            .collect()
    }

    /// The model with the parameters of `unshown` tied; no fit estimates them any more. Unchanged where one
    /// of them is frozen or follows already, or where one they would follow from is tied itself.
    #[must_use]
    pub fn tied(&self, unshown: &Unshown) -> Self {
        let mut model = self.clone();
        for tie in unshown.ties {
            match self.resolved(tie) {
                Some(tied) if self.parameters[tied.parameter].free => model.bind(tied),
                _ => return self.clone(),
            }
        }
        model.follow_ties();
        model.hold_unshown();
        model
    }

    /// Freezes the parameters of effects that have no influence while what the tied parts do not show stays at zero: how
    /// gravity acts across the way of a vehicle that never turns.
    pub(super) fn hold_unshown(&mut self) {
        let still: Vec<Role> = self
            .tied_parts()
            .flat_map(|part| part.still)
            .copied()
            .collect();
        for parameter in &mut self.parameters {
            let role = parameter.declaration.shown_by;
            parameter.free &= role.is_none_or(|role| !still.contains(&role));
        }
    }

    /// Ties the parameters of these names, as the plant says.
    pub(super) fn tie_named(
        &mut self,
        names: &[String],
        source: &TomlSource,
    ) -> Result<(), Box<ConfigError>> {
        for (i, name) in names.iter().enumerate() {
            let ties = || self.unshown().iter().flat_map(|u| u.ties);
            let found = ties().find(|tie| tie.parameter == name);
            let Some(tied) = found.and_then(|tie| self.resolved(tie)) else {
                let known: Vec<&str> = ties().map(|tie| tie.parameter).collect();
                let expected = match known.is_empty() {
                    true => "this plant has none that can be".to_owned(),
                    false => format!("expected some of {}", known.join(", ")),
                };
                return Err(source.error(
                    &["fit".into(), "tied".into(), i.into()],
                    &format!("`{name}` cannot be tied, {expected}"),
                    nearest(name, known).map(|n| format!("did you mean `{n}`?")),
                ));
            };
            self.bind(tied);
        }
        self.follow_ties();
        self.hold_unshown();
        Ok(())
    }

    /// The places of a tie's parameters; none where one of them is tied.
    fn resolved(&self, tie: &'static Tie) -> Option<Tied> {
        let place = |id: &str| {
            let of_plant = self.plant.parameters.iter();
            let index = of_plant.into_iter().position(|p| p.id == id)?;
            self.tie(index).is_none().then_some(index)
        };
        let factors: Option<Vec<usize>> = tie.factors.iter().map(|(id, _)| place(id)).collect();
        Some(Tied {
            tie,
            parameter: place(tie.parameter)?,
            factors: factors?,
        })
    }

    fn bind(&mut self, tied: Tied) {
        if let Some(parameter) = self.parameters.get_mut(tied.parameter) {
            parameter.free = false;
        }
        self.ties.push(tied);
    }

    /// Gives what is tied the value that follows, where it does.
    pub(super) fn follow_ties(&mut self) {
        for tied in &self.ties {
            let value = |i: &usize| self.parameters.get(*i).and_then(|p| p.value);
            let factors: Option<Vec<f64>> = tied.factors.iter().map(value).collect();
            let value = factors.map(|factors| tied.tie.value(factors.into_iter()));
            if let Some(parameter) = self.parameters.get_mut(tied.parameter) {
                parameter.value = value.filter(|v| v.is_finite());
            }
        }
    }
}
