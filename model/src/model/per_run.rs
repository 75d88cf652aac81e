//! Parameters that differ from run to run.
//!
//! A run begins with values of its own: the plant's state, and behind it the parameters of `[fit] per_run`. A state is
//! found anew in each run, and so are they.

use std::borrow::Cow;

use super::Model;
use crate::config::{ConfigError, TomlSource, nearest};

impl Model {
    /// Indices of the parameters that differ from run to run, in order.
    pub fn per_run(&self) -> impl Iterator<Item = usize> + '_ {
        let all = self.parameters.iter().enumerate();
        all.filter(|(_, p)| p.per_run).map(|(i, _)| i)
    }

    /// Number of values that a run begins with: the plant's states, then the parameters of its own.
    pub fn n_starts(&self) -> usize {
        self.n_states() + self.per_run().count()
    }

    /// The model with one value for all runs of what differs from run to run, found as any other parameter is.
    pub fn shared(&self) -> Cow<'_, Self> {
        if self.per_run().next().is_none() {
            return Cow::Borrowed(self);
        }
        let mut model = self.clone();
        for parameter in &mut model.parameters {
            parameter.free |= std::mem::take(&mut parameter.per_run);
        }
        Cow::Owned(model)
    }

    /// The parameter values and the plant's state of a run that begins with `start`: the state, and, where they are
    /// there, the parameters of its own.
    pub fn begun<'v, S: Copy>(&self, values: &'v [S], start: &'v [S]) -> (Cow<'v, [S]>, &'v [S]) {
        let (state, own) = start.split_at(self.n_states().min(start.len()));
        if own.is_empty() {
            return (Cow::Borrowed(values), state);
        }
        let mut values = values.to_vec();
        self.put_own(&mut values, own);
        (Cow::Owned(values), state)
    }

    /// Puts the parameters of one run among the values of all.
    pub(crate) fn put_own<S: Copy>(&self, values: &mut [S], own: &[S]) {
        for (i, value) in self.per_run().zip(own) {
            values[i] = *value;
        }
    }

    /// Marks the parameters of these names as different from run to run.
    pub(super) fn differ_named(
        &mut self,
        names: &[String],
        source: &TomlSource,
    ) -> Result<(), Box<ConfigError>> {
        for (i, name) in names.iter().enumerate() {
            let error = |message: String, help: Option<String>| {
                source.error(&["fit".into(), "per_run".into(), i.into()], &message, help)
            };
            let Some(index) = self.parameters.iter().position(|p| p.name == *name) else {
                let known: Vec<&str> = self.parameters.iter().map(|p| p.name.as_str()).collect();
                let message = format!(
                    "unknown parameter `{name}`, expected one of {}",
                    known.join(", ")
                );
                let help = nearest(name, known).map(|n| format!("did you mean `{n}`?"));
                return Err(error(message, help));
            };
            if let Some(tie) = self.tie(index) {
                let message = format!("`{name}` is tied ({tie}) and cannot differ from run to run");
                return Err(error(message, None));
            }
            let parameter = &mut self.parameters[index];
            parameter.free = false;
            parameter.per_run = true;
        }
        Ok(())
    }
}
