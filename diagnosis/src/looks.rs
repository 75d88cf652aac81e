//! The first part of a search: what each candidate promises, and short fits of those that promise most.

use std::collections::BTreeSet;
use std::sync::atomic::AtomicU64;

use rayon::prelude::*;

use crate::criteria::Criteria;
use crate::early::{Finding, Promised, TOLD};
use crate::explain::place;
use crate::judge::nrmse;
use crate::progress::Stage;
use crate::promise::{Promise, Promises};
use crate::search::{Search, least};
use crate::starts::{first_starts, fresh_starts, starts_from};
use crate::trial::{Judged, look};

/// Short fits that are made to their end whatever they find. They show how far the others have to come.
const MOST_PROMISING: usize = 4;
/// Short fits before the first of them may spare others.
const FIRST_LOOKS: usize = 2;

/// A candidate by its index, and where to start it from.
type Attempt = (usize, Vec<f64>);

/// What an attempt promises, and the attempt.
type Promising = (Promise, Attempt);

/// The attempts of some that were promising.
fn attempts(of: impl Iterator<Item = Promising>) -> Vec<Attempt> {
    of.map(|(_, attempt)| attempt).collect()
}

/// The candidates that were looked at.
struct Looked {
    /// By their indices.
    found: Vec<(usize, Judged)>,
    /// All attempts, those that failed among them.
    attempts: Vec<Attempt>,
    /// What the best of them leaves. Of the root of its cost and the error that it is ranked by the larger one counts: what
    /// a fit sees may be easier than the rest of the log, or harder.
    least: f64,
    /// The least cost of any.
    cost: f64,
}

impl Looked {
    const NOTHING: Self = Self {
        found: Vec::new(),
        attempts: Vec::new(),
        least: f64::INFINITY,
        cost: f64::INFINITY,
    };

    /// The candidate that leaves the least error, and how much that is.
    fn best(&self) -> Option<(usize, f64)> {
        let errors = self.found.iter().map(|(i, found)| (*i, found.error()));
        errors.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// The least error of any.
    fn error(&self) -> f64 {
        least(self.found.iter().map(|(_, found)| found))
    }
}

impl Search<'_> {
    /// All that were looked at, by their indices.
    pub(crate) fn looked_at(&self) -> Vec<(usize, Judged)> {
        let mut looked = Looked::NOTHING;
        let promising = self.promising(&mut looked);
        let simple = |i: usize| self.is_simple(i, &promising);
        let all = promising.iter().map(|(_, (i, _))| *i);
        let mut tried: BTreeSet<usize> = all.filter(|i| simple(*i)).collect();
        let again = |(_, attempt): &Promising| looked.attempts.contains(attempt);
        let rest = promising.iter().filter(|one| !again(one)).cloned();
        let (mut others, mut waiting): (Vec<Promising>, Vec<Promising>) =
            rest.partition(|(_, (i, _))| simple(*i));
        // Each time as many as before, so that an explanation of the log spares the rest.
        loop {
            waiting.retain(|(promise, _)| !self.is_beside(*promise, &looked));
            others.retain(|(promise, (i, _))| {
                let is_part = waiting
                    .iter()
                    .any(|(_, (larger, _))| self.grows(*larger, *i));
                is_part || !self.is_beside(*promise, &looked)
            });
            if others.is_empty() || self.work.is_cancelled() {
                break;
            }
            let many = if self.is_explained(looked.error()) {
                others.len()
            } else {
                looked.attempts.len().max(FIRST_LOOKS).min(others.len())
            };
            let next = attempts(others.drain(..many));
            self.look_at(&next, others.len() + waiting.len(), &mut looked);
        }
        let mut waiting = attempts(waiting.into_iter());
        // A candidate that contains another one comes after it, and starts from where that one ended. Where that
        // one failed, it starts from its own best start.
        while !self.work.is_cancelled() {
            let mut next = self.grown(&looked.found, &tried, &mut waiting);
            next.append(&mut waiting);
            if next.is_empty() {
                break;
            }
            tried.extend(next.iter().map(|(i, _)| *i));
            self.look_at(&next, 0, &mut looked);
        }
        looked.found
    }

    /// All that were looked at from the values of the model as it was given, by their indices. A promise says nothing so far
    /// from the machine, so each candidate gets a short fit.
    pub(crate) fn looked_at_from_given(&self) -> Vec<(usize, Judged)> {
        let attempts: Vec<Attempt> = (self.all.iter().enumerate())
            .filter(|(_, c)| !c.separate && !c.further && c.replaces.is_none())
            .filter_map(|(i, c)| {
                let starts = first_starts(c, self.nominal.given, self.extent);
                Some((i, starts.into_iter().next()?))
            })
            .collect();
        let mut looked = Looked::NOTHING;
        self.look_at(&attempts, 0, &mut looked);
        looked.found
    }

    /// Whether the best of the candidates, which leaves the error `least`, explains the log.
    fn is_explained(&self, least: f64) -> bool {
        let Criteria {
            missing, search, ..
        } = self.work.criteria();
        least <= missing.above_floor * self.nominal.floor
            && search.elsewhere * least <= nrmse(self.nominal.rank)
    }

    /// What a candidate may leave at most, as a cost or the square of an error, so that it explains its share of what the
    /// `best` one explains of the `plain` model's.
    fn beside(&self, plain: f64, best: f64) -> f64 {
        plain - self.criteria().beside * (plain - best)
    }

    /// Whether a candidate with a `promise` has nothing to do with what is missing: the best of those `looked` at
    /// explains the log, and of what that one explains it promises to explain next to nothing; or it is not worth trying. One
    /// that promises to do worse than the plain model starts too far from it to tell.
    fn is_beside(&self, promise: Promise, looked: &Looked) -> bool {
        let of_best = self.tells(promise.cost)
            && self.is_explained(looked.error())
            && promise.cost > self.beside(self.nominal.cost, looked.cost);
        let shown = looked.attempts.len() >= MOST_PROMISING;
        of_best || shown && self.is_needless(promise)
    }

    /// Whether it is known what is worth trying, and a `promise` is not.
    fn is_needless(&self, promise: Promise) -> bool {
        let explains_less = |left| self.worth_trying().is_some_and(|most| left > most);
        promise.left.is_some_and(explains_less)
    }

    /// What anything that is worth trying may leave of the plain model's cost, where that is known: it explains its share of what
    /// it must explain. That is said by what the search is for, and where the plain model leaves hardly more than noise it
    /// is the part of that noise that an effect must explain to matter.
    pub(crate) fn worth_trying(&self) -> Option<f64> {
        let missing = &self.work.criteria().missing;
        let floors = nrmse(self.nominal.rank) / self.nominal.floor;
        let matters = (missing.matters / floors).powi(2);
        let at_floor = (floors <= missing.complete).then_some(1.0 - matters);
        let asked = (self.leaves < 1.0).then(|| self.leaves.powi(2));
        let least = at_floor.into_iter().chain(asked).reduce(f64::min)?;
        Some(self.beside(1.0, least))
    }

    /// Whether a promised `cost` tells anything.
    fn tells(&self, cost: f64) -> bool {
        cost <= self.criteria().elsewhere.powi(2) * self.nominal.cost || cost.is_infinite()
    }

    /// Whether a candidate that leaves an `error`, where the best leaves the `least`, has nothing to do with what is missing.
    pub(crate) fn came_beside(&self, error: f64, least: f64) -> bool {
        let plain = nrmse(self.nominal.rank);
        self.is_explained(least) && error.powi(2) > self.beside(plain.powi(2), least.powi(2))
    }

    /// The cost that a full fit must promise from where the short one ended, where of these the best leaves the error `least`. A
    /// cost is a share of the plain model's as the square of an error is.
    pub(crate) fn most_promised(&self, least: f64) -> f64 {
        let plain = self.nominal.cost;
        let left = (least / nrmse(self.nominal.rank)).powi(2);
        self.beside(plain, plain * left)
    }

    /// The root of the cost that a short fit must come below, with what those `looked` at came to.
    fn worth(&self, looked: &Looked) -> f64 {
        let behind = self.criteria().behind * looked.least;
        if self.is_explained(looked.error()) {
            let beside = self.beside(self.nominal.cost, looked.cost);
            behind.min(beside.max(0.0).sqrt())
        } else if looked.attempts.len() < MOST_PROMISING {
            f64::INFINITY
        } else {
            behind
        }
    }

    /// The starts that promise most, with what they promise, the best first.
    ///
    /// First come candidates at all places of their effect, and short fits of the best of them. Where one that acts alike on
    /// both sides of the machine explains the log, what promises next to nothing on both sides is not asked about each: it does
    /// half as much on one side, and something else that has one side only.
    fn promising(&self, looked: &mut Looked) -> Vec<Promising> {
        let starts = (self.all.iter().enumerate())
            .filter(|(_, c)| !c.separate && !c.further)
            .flat_map(|(i, c)| {
                let first = first_starts(c, self.nominal.model, self.extent);
                let fresh = fresh_starts(c, self.nominal, self.extent);
                first.into_iter().chain(fresh).map(move |start| (i, start))
            });
        let (whole, mut parts): (Vec<Attempt>, Vec<Attempt>) =
            starts.partition(|(i, _)| !(0..self.all.len()).any(|j| self.is_part(*i, j)));
        let (done, of) = (AtomicU64::new(0), (whole.len() + parts.len()) as u64);
        self.work.tell(Stage::Promises, 0, of);
        let asked = self.worth_trying().is_some();
        let promises = Promises::new(self.nominal, asked);
        let promised = |attempts: Vec<Attempt>| -> Vec<Promising> {
            let each = attempts.into_par_iter().filter_map(|attempt| {
                let promised = self.promise(&promises, attempt);
                self.tell(Stage::Promises, &done, of);
                promised
            });
            each.collect()
        };
        // What starts so strong that even with its step it is another machine promises nothing. It is asked from next to nothing;
        // times only while nothing explains the log, because any lag then promises a part of what friction does, and costs a fit.
        let faintly = |strong: Vec<Promising>, times: bool| -> Vec<Promising> {
            let each = (strong.into_par_iter()).map(|one| self.faintly(&promises, one, times));
            each.collect()
        };
        let mut all = promised(whole);
        let best = self.best_of(all.clone());
        let simple = |one: &&Promising| self.is_simple(one.1.0, &best);
        let first = best.iter().filter(simple).cloned();
        self.look_each(&attempts(first.take(FIRST_LOOKS)), looked, &|| {});
        let unexplained = !self.is_explained(looked.error());
        all = faintly(all, unexplained);
        // What another candidate promises, from the same start or else from its best one.
        let promised_by = |j: usize, start: &[f64]| {
            let of = || all.iter().filter(move |(_, (i, _))| *i == j);
            let same = of().find(|(_, (_, other))| other == start);
            let best = || of().min_by(|a, b| a.0.cost.total_cmp(&b.0.cost));
            same.or_else(best).map(|(promise, _)| *promise)
        };
        let explained = |(best, error)| self.is_explained(error) && self.acts_on_both_sides(best);
        let nothing = asked
            && all
                .iter()
                .all(|(p, _)| p.left.is_none() || self.is_needless(*p));
        if nothing || looked.best().is_some_and(explained) {
            let idle = |promise: Promise| {
                nothing || !self.tells(promise.cost) || self.is_beside(promise, looked)
            };
            parts.retain(|(i, start)| {
                let whole = (0..self.all.len()).filter(|j| self.is_part(*i, *j));
                let mut whole = whole.filter(|j| self.acts_on_both_sides(*j));
                let asked = whole.all(|j| !promised_by(j, start).is_some_and(idle));
                if !asked {
                    self.tell(Stage::Promises, &done, of);
                }
                asked
            });
        }
        all.extend(faintly(promised(parts), unexplained));
        let best = self.best_of(all);
        self.work.know(|| self.promised(&best));
        best
    }

    /// What a candidate promises from a start.
    fn promise(&self, promises: &Promises<'_>, (i, start): Attempt) -> Option<Promising> {
        let promise = promises.of(&self.all[i].chosen(&start), &start)?;
        Some((promise, (i, start)))
    }

    /// What a candidate promises from next to nothing, where that is more than from its start, which is too strong.
    fn faintly(&self, promises: &Promises<'_>, strong: Promising, times: bool) -> Promising {
        let (promise, (i, start)) = &strong;
        if self.tells(promise.cost) {
            return strong;
        }
        let faint = self.all[*i].faint(start, times);
        let again = faint.and_then(|start| self.promise(promises, (*i, start)));
        match again {
            Some(again) if self.matters(again.0.cost) => again,
            _ => strong,
        }
    }

    /// Whether an effect that leaves this cost would explain enough to matter beside noise.
    fn matters(&self, cost: f64) -> bool {
        let least = self.work.criteria().missing.matters * self.nominal.floor;
        cost <= self.nominal.cost - least.powi(2)
    }

    /// Whether a candidate grows from none of those that are `promising`.
    fn is_simple(&self, i: usize, promising: &[Promising]) -> bool {
        !promising.iter().any(|(_, (j, _))| self.grows(i, *j))
    }

    /// Whether a candidate is the effect of another one at some of its places.
    fn is_part(&self, part: usize, whole: usize) -> bool {
        let (part, whole) = (&self.all[part], &self.all[whole]);
        let alike = (part.separate, part.further, &part.replaces)
            == (whole.separate, whole.further, &whole.replaces);
        alike
            && part.meta.id == whole.meta.id
            && part.at.len() < whole.at.len()
            && part.at.iter().all(|place| whole.at.contains(place))
    }

    /// Whether a candidate acts alike on both sides of the machine, where it could act on one.
    fn acts_on_both_sides(&self, whole: usize) -> bool {
        let candidate = &self.all[whole];
        let channels = candidate.model.plant.channels.iter();
        let on = |side: i8| {
            channels
                .clone()
                .any(|c| c.side == side && candidate.at.contains(&c.id))
        };
        on(1) && on(-1) && (0..self.all.len()).any(|part| self.is_part(part, whole))
    }

    /// The most promising of `all`, the best first.
    fn best_of(&self, mut all: Vec<Promising>) -> Vec<Promising> {
        all.retain(|(promise, _)| promise.cost.is_finite());
        all.sort_by(|a, b| a.0.cost.total_cmp(&b.0.cost));
        let criteria = self.criteria();
        // An effect with many starts must not crowd the others out.
        let mut taken = vec![0; self.all.len()];
        all.retain(|(_, (i, _))| {
            taken[*i] += 1;
            taken[*i] <= criteria.looks_each
        });
        all.truncate(criteria.looks);
        all
    }

    /// The effects that promise most, each at its most promising place.
    fn promised(&self, promising: &[Promising]) -> Finding {
        let mut seen = BTreeSet::new();
        let candidates = (promising.iter())
            .map(|(promise, (i, _))| (promise.cost, &self.all[*i]))
            .filter(|(_, candidate)| seen.insert(candidate.meta.id))
            .take(TOLD)
            .map(|(cost, candidate)| Promised {
                place: place(candidate),
                nrmse: cost.sqrt(),
            })
            .collect();
        Finding::Promised { candidates }
    }

    /// Makes the short fits of some attempts; `waiting` more are to come.
    fn look_at(&self, attempts: &[Attempt], waiting: usize, looked: &mut Looked) {
        let before = looked.attempts.len();
        let done = AtomicU64::new(before as u64);
        let of = (before + attempts.len() + waiting) as u64;
        self.work.tell(Stage::FirstLooks, before as u64, of);
        self.look_each(attempts, looked, &|| {
            self.tell(Stage::FirstLooks, &done, of);
        });
    }

    /// Makes the short fits of some attempts, `and` does something after each. What cannot come as near to the best so far as
    /// a finalist must is given up.
    fn look_each(&self, attempts: &[Attempt], looked: &mut Looked, and: &(dyn Fn() + Sync)) {
        let worth = self.worth(looked);
        let found: Vec<(usize, (Judged, f64))> = (attempts.par_iter())
            .filter_map(|(i, start)| {
                let found = self.look(*i, start, worth);
                and();
                Some((*i, found?))
            })
            .collect();
        looked.attempts.extend_from_slice(attempts);
        for (i, (judged, left)) in found {
            looked.least = looked.least.min(left.max(judged.error()));
            looked.cost = looked.cost.min(left * left);
            looked.found.push((i, judged));
        }
    }

    /// A short fit of a candidate, from its start, and the root of its cost; given up where that cannot come below `worth`.
    /// The plain model is its special case. Where the fit ended well above that one, the start was too strong for this
    /// machine, and it is made again from next to nothing.
    fn look(&self, i: usize, start: &[f64], worth: f64) -> Option<(Judged, f64)> {
        let candidate = &self.all[i];
        let found = look(&candidate.chosen(start), start, self.nominal, worth);
        let most = self.criteria().elsewhere * nrmse(self.nominal.rank);
        if found
            .as_ref()
            .is_some_and(|(found, _)| found.error() <= most)
        {
            return found;
        }
        let again = candidate.faint(start, true).and_then(|faint| {
            let chosen = candidate.chosen(&faint);
            look(&chosen, &faint, self.nominal, worth)
        });
        found
            .into_iter()
            .chain(again)
            .min_by(|(a, _), (b, _)| a.error().total_cmp(&b.error()))
    }

    /// Whether a candidate should start from where another one ended. Strong breakaway friction is found when
    /// starting from dry friction, not from none; a level for each wheel from one level for both. A fuller form of an effect
    /// starts from its usual one.
    fn grows(&self, i: usize, from: usize) -> bool {
        let (candidate, other) = (&self.all[i], &self.all[from]);
        let contains =
            other.is_special(candidate) && !candidate.separate && candidate.replaces.is_none();
        let itself = candidate.meta.id == other.meta.id && candidate.at == other.at;
        let divides = candidate.separate && itself;
        (contains || divides) && (itself || !candidate.further) && !other.separate
    }

    /// Attempts at candidates that were not tried yet, starting from where simpler ones ended. They are taken
    /// out of `waiting`. What ended at the floor has left nothing for a larger one.
    fn grown(
        &self,
        looked: &[(usize, Judged)],
        tried: &BTreeSet<usize>,
        waiting: &mut Vec<Attempt>,
    ) -> Vec<Attempt> {
        let criteria = self.criteria();
        let least_of_all = least(looked.iter().map(|(_, found)| found));
        let mut attempts = Vec::new();
        for (i, candidate) in self.all.iter().enumerate() {
            let simpler = looked
                .iter()
                .filter(|(j, _)| !tried.contains(&i) && self.grows(i, *j))
                .map(|(_, found)| found)
                .min_by(|a, b| a.error().total_cmp(&b.error()));
            let Some(simpler) = simpler else { continue };
            let error = simpler.error();
            let places = looked.iter().map(|(_, found)| found).filter(|found| {
                found.candidate.meta.id == simpler.candidate.meta.id && !found.candidate.separate
            });
            let elsewhere = error > criteria.elsewhere * least(places);
            let divided = error < criteria.worth_dividing * nrmse(self.nominal.rank);
            let of = simpler.candidate.complexity();
            let allowance = (self.work.criteria().choice).allowance(candidate.complexity(), of);
            // A fuller form comes where the usual one is better at all.
            let close = self.work.criteria().choice.close;
            let nothing_left = if candidate.further {
                close * error > nrmse(self.nominal.rank)
            } else {
                error <= allowance * self.nominal.floor
            };
            let starts = starts_from(candidate, simpler, self.extent);
            let worth = error < criteria.worth_growing * least_of_all
                && !self.came_beside(error, least_of_all)
                && (!candidate.separate || divided)
                && starts.len() <= criteria.grown_starts;
            if elsewhere || worth || nothing_left {
                waiting.retain(|(j, _)| i != *j);
            }
            if worth && !elsewhere && !nothing_left {
                attempts.extend(starts.into_iter().map(|start| (i, start)));
            }
        }
        attempts
    }
}
