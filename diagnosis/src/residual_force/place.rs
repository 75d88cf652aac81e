//! Where a residual force may act, and what it may depend on there.

use loopsight_core::{Channel, Place, Role};
use loopsight_model::model::{Model, signals};
use loopsight_model::run::Run;
use nalgebra::DMatrix;

use super::filter::Filtered;
use super::response::{Column, Responses};
use super::select::Choice;
use super::shape::{Quantity, Shape, Term, Variable, both, coldest, terms, turns};

/// Channels of one unit: forces at them are found together.
#[derive(Clone, Debug)]
pub(super) struct Group {
    pub(super) channels: Vec<&'static Channel>,
    pub(super) quantities: Vec<Quantity>,
    /// Ways in which forces may act there.
    pub(super) ways: Vec<Way>,
    terms: Vec<Term>,
    /// By channel and quantity, its value in the middle of each interval, all runs in order.
    pub(super) series: Vec<Vec<Vec<f64>>>,
}

/// A way in which forces act at the channels of a group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    /// The same law at all of them.
    Alike,
    /// The same terms at all of them, each with its own numbers.
    Own,
    /// At one of them only.
    One(usize),
}

/// Forces with their numbers, ready to be evaluated.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Law {
    /// Channels of the group.
    pub(super) at: Vec<usize>,
    pub(super) terms: Vec<(Shape, f64)>,
}

/// The groups of `model`: efforts, where it has none inputs.
pub(super) fn groups(model: &Model, runs: &[Run], filtered: &[Filtered]) -> Vec<Group> {
    let all = &model.plant.channels;
    let effort = |c: &&'static Channel| matches!(c.place, Place::Effort(_));
    let input = |c: &&'static Channel| matches!(c.place, Place::Input(_));
    let mut channels: Vec<&'static Channel> = all.iter().filter(effort).collect();
    if channels.is_empty() {
        channels = all.iter().filter(input).collect();
    }
    let mut groups: Vec<Vec<&'static Channel>> = Vec::new();
    for channel in channels {
        match groups.iter_mut().find(|g| g[0].unit == channel.unit) {
            Some(group) => group.push(channel),
            None => groups.push(vec![channel]),
        }
    }
    groups
        .into_iter()
        .map(|channels| Group::new(model, runs, filtered, channels))
        .collect()
}

impl Group {
    fn new(
        model: &Model,
        runs: &[Run],
        filtered: &[Filtered],
        channels: Vec<&'static Channel>,
    ) -> Self {
        let index = |channel: &Channel, role: Role| -> Option<usize> {
            model.find_signal(channel.read(role)?).ok()
        };
        let mut quantities: Vec<Quantity> = Vec::new();
        let mut series: Vec<Vec<Vec<f64>>> = vec![Vec::new(); channels.len()];
        let mut seen: Vec<Vec<usize>> = Vec::new();
        let roles = Role::ALL.into_iter().filter_map(|role| {
            let played: Option<Vec<usize>> = channels.iter().map(|c| index(c, role)).collect();
            Some((Variable::Role(role), played?))
        });
        // What is measured elsewhere in the machine may act here, too.
        let elsewhere = model.measured.iter().filter_map(|m| {
            let signal = signals(model.plant).nth(m.index)?;
            Some((Variable::Signal(signal.id), vec![m.index; channels.len()]))
        });
        for (variable, played) in roles.chain(elsewhere) {
            if seen.contains(&played) {
                continue;
            }
            let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
            let (mut squares, mut n) = (0.0, 0.0);
            for (to, signal) in series.iter_mut().zip(&played) {
                let values: Vec<f64> = filtered
                    .iter()
                    .flat_map(|f| f.signals.iter().map(|s| s[*signal]))
                    .collect();
                for v in &values {
                    (low, high) = (low.min(*v), high.max(*v));
                    squares += v * v;
                    n += 1.0;
                }
                to.push(values);
            }
            let unit = signals(model.plant)
                .nth(played[0])
                .map_or("1", |s| s.unit)
                .to_owned();
            quantities.push(Quantity {
                variable,
                turns: turns(&unit, low, high),
                both: both(low, high),
                coldest: coldest(&unit, low, high),
                unit,
                rms: (squares / f64::max(n, 1.0)).sqrt(),
            });
            seen.push(played);
        }
        let times: Vec<f64> = runs
            .iter()
            .flat_map(|r| r.time().iter().map(move |t| t - r.time()[0]))
            .collect();
        let squares: f64 = times.iter().map(|t| t * t).sum();
        quantities.push(Quantity {
            variable: Variable::Time,
            unit: "s".to_owned(),
            turns: false,
            both: false,
            coldest: None,
            rms: (squares / times.len().max(1) as f64).sqrt(),
        });
        for to in &mut series {
            to.push(times.clone());
        }
        // A force cannot depend on a quantity that never changes.
        let useful: Vec<bool> = (0..quantities.len())
            .map(|q| {
                series.iter().any(|s| {
                    let values = &s[q];
                    values.iter().all(|v| v.is_finite()) && values.iter().any(|v| *v != values[0])
                })
            })
            .collect();
        for list in &mut series {
            let mut keep = useful.iter();
            list.retain(|_| keep.next() == Some(&true));
        }
        let mut keep = useful.iter();
        quantities.retain(|_| keep.next() == Some(&true));
        let ways = if channels.len() > 1 {
            [Way::Alike, Way::Own]
                .into_iter()
                .chain((0..channels.len()).map(Way::One))
                .collect()
        } else {
            vec![Way::One(0)]
        };
        Self {
            terms: terms(&quantities),
            channels,
            quantities,
            ways,
            series,
        }
    }

    /// The value of a variable at a channel of the group, by sample.
    fn value(&self, channel: usize, variable: Variable, k: usize) -> f64 {
        self.quantities
            .iter()
            .position(|q| q.variable == variable)
            .map_or(0.0, |q| self.series[channel][q][k])
    }

    /// The channels at which forces act in this `way`.
    pub(super) fn at(&self, way: Way) -> Vec<usize> {
        match way {
            Way::Alike | Way::Own => (0..self.channels.len()).collect(),
            Way::One(c) => vec![c],
        }
    }

    /// Number of samples.
    pub(super) fn samples(&self) -> usize {
        self.series
            .first()
            .and_then(|s| s.first())
            .map_or(0, Vec::len)
    }

    fn shapes(&self) -> impl Iterator<Item = &Shape> {
        self.terms.iter().flatten()
    }

    /// One column per channel and shape.
    pub(super) fn columns(&self) -> Vec<Column> {
        let mut all = Vec::new();
        for (c, channel) in self.channels.iter().enumerate() {
            for shape in self.shapes() {
                let series = (0..self.samples())
                    .map(|k| shape.value(&|v| self.value(c, v, k)))
                    .collect();
                all.push(Column::Force(vec![(channel.place, series)]));
            }
        }
        all
    }

    /// The columns `known`, then those of [`Group::columns`], then, if there are several channels, those of the
    /// same force at all of them.
    pub(super) fn joined(&self, known: &Responses, forces: &Responses) -> Responses {
        let (rows, n_known) = known.columns.shape();
        let per_channel = self.shapes().count();
        let n = forces.columns.ncols();
        let alike = if self.channels.len() > 1 {
            per_channel
        } else {
            0
        };
        let mut columns = DMatrix::zeros(rows, n_known + n + alike);
        columns.columns_mut(0, n_known).copy_from(&known.columns);
        columns.columns_mut(n_known, n).copy_from(&forces.columns);
        for s in 0..alike {
            for c in 0..self.channels.len() {
                let from = forces.columns.column(c * per_channel + s);
                let mut to = columns.column_mut(n_known + n + s);
                to += from;
            }
        }
        Responses {
            innovations: known.innovations.clone(),
            columns,
        }
    }

    /// The terms to choose from where forces act in this `way`; their columns follow `known`
    /// others.
    pub(super) fn choices(&self, way: Way, known: usize) -> Vec<Choice> {
        let per_channel = self.shapes().count();
        let firsts: Vec<usize> = match way {
            Way::Alike => vec![known + self.channels.len() * per_channel],
            Way::Own => (0..self.channels.len())
                .map(|c| known + c * per_channel)
                .collect(),
            Way::One(c) => vec![known + c * per_channel],
        };
        let mut shape = 0;
        self.terms
            .iter()
            .map(|term| {
                let range = shape..shape + term.len();
                shape += term.len();
                Choice {
                    columns: firsts
                        .iter()
                        .flat_map(|first| range.clone().map(move |s| first + s))
                        .collect(),
                    complexity: firsts.len() * term.len() + term[0].variables().len(),
                }
            })
            .collect()
    }

    /// The chosen terms with their numbers, in the order of [`Group::choices`]' columns.
    pub(super) fn laws(&self, way: Way, chosen: &[usize], numbers: &[f64]) -> Vec<Law> {
        let at: Vec<Vec<usize>> = match way {
            Way::Alike => vec![(0..self.channels.len()).collect()],
            Way::Own => (0..self.channels.len()).map(|c| vec![c]).collect(),
            Way::One(c) => vec![vec![c]],
        };
        let mut laws: Vec<Law> = at
            .into_iter()
            .map(|at| Law {
                at,
                terms: Vec::new(),
            })
            .collect();
        let mut numbers = numbers.iter();
        for term in chosen {
            for law in &mut laws {
                for shape in &self.terms[*term] {
                    if let Some(number) = numbers.next().filter(|n| **n != 0.0) {
                        law.terms.push((shape.clone(), *number));
                    }
                }
            }
        }
        laws.retain(|law| !law.terms.is_empty());
        laws
    }

    /// What `laws` add at a channel in the interval that ends with sample `k`.
    pub(super) fn force(&self, laws: &[Law], channel: usize, k: usize) -> f64 {
        laws.iter()
            .filter(|law| law.at.contains(&channel))
            .flat_map(|law| &law.terms)
            .map(|(shape, number)| number * shape.value(&|v| self.value(channel, v, k)))
            .sum()
    }
}
