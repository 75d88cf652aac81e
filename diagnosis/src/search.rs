//! The search among candidates: which get a short fit, and which of these a full one.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use crate::both_ways::is_the_same_both_ways;
use crate::candidates::Candidate;
use crate::conclusion::Explanation;
use crate::criteria::{Criteria, SearchCriteria};
use crate::early::{Finding, Promised, TOLD};
use crate::explain::{explain, place};
use crate::judge::nrmse;
use crate::progress::{Stage, Work};
use crate::promise::Promises;
use crate::starts::{Extent, first_starts, fresh_starts, starts_from};
use crate::substance::{does_something, is_a_simpler_one};
use crate::trial::{Judged, Nominal, finish, look};

/// Short fits that are made to their end whatever they find. They show how far the others have to come.
const MOST_PROMISING: usize = 4;

/// A candidate by its index, and where to start it from.
type Attempt = (usize, Vec<f64>);

/// A search among candidates.
pub(crate) struct Search<'a> {
    pub(crate) all: &'a [Candidate],
    pub(crate) nominal: &'a Nominal<'a>,
    pub(crate) work: &'a Work<'a>,
    /// What the recording can show in time.
    pub(crate) extent: Extent,
    /// How late time stamps may be of their own, s.
    pub(crate) shift: f64,
}

/// The candidates that were looked at.
struct Looked {
    /// By their indices.
    found: Vec<(usize, Judged)>,
    /// What the best of them leaves. Of the root of its cost and the error that it is ranked by the larger one counts: what
    /// a fit sees may be easier than the rest of the log, or harder.
    least: f64,
}

impl Looked {
    const NOTHING: Self = Self {
        found: Vec::new(),
        least: f64::INFINITY,
    };
}

/// What a search found.
#[derive(Default)]
pub(crate) struct Found {
    /// The candidates that do best, with their full fits, the best first.
    pub(crate) finalists: Vec<(Judged, Explanation)>,
    /// Where the work was cancelled: those with a short fit, the best first.
    pub(crate) looked: Vec<Judged>,
}

impl Search<'_> {
    /// The candidates that do best.
    ///
    /// 1. *Promise*: for each start of each candidate, the error that one Gauss–Newton step predicts.
    /// 2. *Look*: the most promising get a fit of a few iterations. A candidate that contains another one starts
    ///    from where that one ended.
    /// 3. *Finish*: the best are fitted until they converge.
    ///
    /// All of them begin where the fit of the plain model ended. Where that may have gone astray, they begin a second time from
    /// the model as it was given: a pendulum that lacks friction swings on, and a fit to that ends anywhere.
    pub(crate) fn run(&self) -> Found {
        let found = self.ended(self.looked_at());
        if self.work.is_cancelled() || !self.went_astray(&found.finalists) {
            return found;
        }
        let afresh = self.ended(self.looked_at_from_given());
        let Found {
            mut finalists,
            mut looked,
        } = found;
        looked.extend(afresh.looked);
        for again in afresh.finalists {
            let mut same = finalists.iter_mut();
            match same.find(|other| other.0.candidate.is_again(&again.0.candidate)) {
                Some(other) if again.0.error() < other.0.error() => *other = again,
                Some(_) => {}
                None => finalists.push(again),
            }
        }
        in_order(&mut finalists);
        Found { finalists, looked }
    }

    /// Whether the plain model's fit may have ended in another valley than that of the machine: it leaves much, none of
    /// the `finalists`, which begin where it ended, removes half of that, and the model as it was given is elsewhere.
    fn went_astray(&self, finalists: &[(Judged, Explanation)]) -> bool {
        let start = &self.work.criteria().start;
        let left = nrmse(self.nominal.rank);
        let helped =
            least(finalists.iter().map(|(found, _)| found)) < self.criteria().astray * left;
        left > start.poor && !helped && self.given_is_elsewhere().unwrap_or(false)
    }

    /// Whether the model as it was given is not where the plain fit ended; none where it lacks values.
    fn given_is_elsewhere(&self) -> Option<bool> {
        let given = self.nominal.given;
        if !given.missing_values().is_empty() {
            return None;
        }
        let problem = self.nominal.problem(given, self.nominal.held)?;
        let scaled = problem.pack(&given.values(), &self.nominal.solution.states);
        let cost = problem.residual_vector(&scaled).ok()?.norm_squared();
        let same = self.work.criteria().choice.never_same;
        Some(cost.is_nan() || cost > same.powi(2) * self.nominal.cost)
    }

    /// The best of those that were looked at, fitted until they converge.
    fn ended(&self, looked: Vec<(usize, Judged)>) -> Found {
        if self.work.is_cancelled() {
            let finalists = Vec::new();
            let looked = best_first(looked);
            return Found { finalists, looked };
        }
        let contest = contest(looked, self.work.criteria());
        let of = contest.len() as u64;
        let done = AtomicU64::new(0);
        self.work.tell(Stage::Finalists, 0, of);
        let mut finalists: Vec<(Judged, Explanation)> = contest
            .par_iter()
            .filter_map(|first| {
                let found = self.finished(first.clone());
                if let Some((_, explanation)) = &found {
                    self.work.know(|| Finding::Finalist(explanation.into()));
                }
                self.tell(Stage::Finalists, &done, of);
                found
            })
            .collect();
        in_order(&mut finalists);
        for found in self.shrunk(&finalists) {
            finalists.retain(|(other, _)| !other.candidate.is_again(&found.0.candidate));
            finalists.push(found);
        }
        in_order(&mut finalists);
        let looked = if self.work.is_cancelled() {
            contest
        } else {
            Vec::new()
        };
        Found { finalists, looked }
    }

    fn criteria(&self) -> &SearchCriteria {
        &self.work.criteria().search
    }

    /// The full fit of a candidate. An effect whose fitted size is nothing explains nothing, whatever the other
    /// parameters gained; nor does a shift in time that the stamps may have of their own, nor directions that are alike, nor
    /// what is a simpler effect for all that the log shows.
    fn finished(&self, first: Judged) -> Option<(Judged, Explanation)> {
        let (judged, fit) = finish(first, self.nominal)?;
        let explanation = explain(&judged, &fit, self.nominal).ok()?;
        let criteria = self.work.criteria();
        let stands_in = is_the_same_both_ways(&judged.candidate, &explanation, criteria);
        let acts = does_something(&explanation, criteria.search.does_nothing, self.shift);
        let simpler = is_a_simpler_one(&judged.candidate, &explanation, self.extent.period);
        (acts && !stands_in && !simpler).then_some((judged, explanation))
    }

    /// Special cases of the best of `finalists` that ended behind it, fitted anew from where it ended: what it found,
    /// they may have missed. Those that come near it then.
    fn shrunk(&self, finalists: &[(Judged, Explanation)]) -> Vec<(Judged, Explanation)> {
        let alone = |(best, _): &&(Judged, Explanation)| best.candidate.replaces.is_none();
        let Some((best, _)) = finalists.first().filter(alone) else {
            return Vec::new();
        };
        let choice = &self.work.criteria().choice;
        let near = |special: &Candidate| {
            let allowance = choice.allowance(best.candidate.complexity(), special.complexity());
            allowance * best.error()
        };
        let missed = |candidate: &&Candidate| {
            let is_near = |other: &Judged| {
                other.candidate.is_again(candidate) && other.error() <= near(candidate)
            };
            candidate.is_special(&best.candidate)
                && candidate.separate == best.candidate.separate
                && candidate.replaces.is_none()
                && !finalists.iter().any(|(other, _)| is_near(other))
        };
        let fitted = |candidate: &Candidate| {
            let starts = starts_from(candidate, best, self.extent);
            let looks = starts.iter().filter_map(|start| {
                look(&candidate.chosen(start), start, self.nominal, f64::INFINITY)
            });
            let (first, _) = looks.min_by(|(a, _), (b, _)| a.error().total_cmp(&b.error()))?;
            let found = self.finished(first)?;
            (found.0.error() <= near(candidate)).then_some(found)
        };
        (self.all.par_iter().filter(missed))
            .filter_map(fitted)
            .collect()
    }

    /// One more is done of a stage.
    fn tell(&self, stage: Stage, done: &AtomicU64, of: u64) {
        let now = done.fetch_add(1, Ordering::Relaxed) + 1;
        self.work.tell(stage, now.min(of), of);
    }

    /// All that were looked at, by their indices.
    fn looked_at(&self) -> Vec<(usize, Judged)> {
        let attempts: Vec<Attempt> = (self.all.iter().enumerate())
            .filter(|(_, c)| !c.separate && !c.further)
            .flat_map(|(i, c)| {
                let starts = first_starts(c, self.nominal.model, self.extent);
                let fresh = fresh_starts(c, self.nominal, self.extent);
                starts.into_iter().chain(fresh).map(move |start| (i, start))
            })
            .collect();
        let promising = self.promising(attempts);
        let simple = |i: usize| !promising.iter().any(|(j, _)| self.grows(i, *j));
        let (first, mut waiting): (Vec<Attempt>, Vec<Attempt>) =
            promising.iter().cloned().partition(|(i, _)| simple(*i));
        let mut tried: BTreeSet<usize> = first.iter().map(|(i, _)| *i).collect();
        let mut looked = Looked::NOTHING;
        let (most, others) = first.split_at(first.len().min(MOST_PROMISING));
        self.look_at(most, others.len() + waiting.len(), &mut looked);
        self.look_at(others, waiting.len(), &mut looked);
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
    fn looked_at_from_given(&self) -> Vec<(usize, Judged)> {
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

    /// The starts that promise most, the best first.
    fn promising(&self, attempts: Vec<Attempt>) -> Vec<Attempt> {
        let (done, of) = (AtomicU64::new(0), attempts.len() as u64);
        self.work.tell(Stage::Promises, 0, of);
        let promises = Promises::new(self.nominal);
        let mut promising: Vec<(f64, Attempt)> = attempts
            .into_par_iter()
            .filter_map(|(i, start)| {
                let candidate = self.all[i].chosen(&start);
                let promise = promises.of(&candidate, &start);
                self.tell(Stage::Promises, &done, of);
                Some((promise?, (i, start)))
            })
            .collect();
        promising.sort_by(|a, b| a.0.total_cmp(&b.0));
        let criteria = self.criteria();
        // An effect with many starts must not crowd the others out.
        let mut taken = vec![0; self.all.len()];
        promising.retain(|(_, (i, _))| {
            taken[*i] += 1;
            taken[*i] <= criteria.looks_each
        });
        promising.truncate(criteria.looks);
        self.work.know(|| self.promised(&promising));
        promising.into_iter().map(|(_, attempt)| attempt).collect()
    }

    /// The effects that promise most, each at its most promising place.
    fn promised(&self, promising: &[(f64, Attempt)]) -> Finding {
        let mut seen = BTreeSet::new();
        let candidates = (promising.iter())
            .map(|(cost, (i, _))| (cost, &self.all[*i]))
            .filter(|(_, candidate)| seen.insert(candidate.meta.id))
            .take(TOLD)
            .map(|(cost, candidate)| Promised {
                place: place(candidate),
                nrmse: cost.sqrt(),
            })
            .collect();
        Finding::Promised { candidates }
    }

    /// Makes the short fits of some attempts; `waiting` more are to come. What cannot come as near to the best so far as a
    /// finalist must is given up.
    fn look_at(&self, attempts: &[Attempt], waiting: usize, looked: &mut Looked) {
        let before = looked.found.len();
        let done = AtomicU64::new(before as u64);
        let of = (before + attempts.len() + waiting) as u64;
        self.work.tell(Stage::FirstLooks, before as u64, of);
        let worth = self.criteria().behind * looked.least;
        let found: Vec<(usize, (Judged, f64))> = (attempts.par_iter())
            .filter_map(|(i, start)| {
                let found = self.look(*i, start, worth);
                self.tell(Stage::FirstLooks, &done, of);
                Some((*i, found?))
            })
            .collect();
        for (i, (judged, left)) in found {
            looked.least = looked.least.min(left.max(judged.error()));
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
        let again = candidate.faint(start).and_then(|faint| {
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
            // A fuller form comes where it is better at all.
            let nothing_left = !candidate.further && error <= allowance * self.nominal.floor;
            let starts = starts_from(candidate, simpler, self.extent);
            let worth = error < criteria.worth_growing * least_of_all
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

/// The least error among some candidates.
fn least<'j>(found: impl Iterator<Item = &'j Judged>) -> f64 {
    found.map(Judged::error).fold(f64::INFINITY, f64::min)
}

/// Puts finalists in order, the best first.
fn in_order(finalists: &mut [(Judged, Explanation)]) {
    finalists.sort_by(|a, b| a.0.error().total_cmp(&b.0.error()));
}

/// The candidates that were looked at, each from its best start, the best first.
fn best_first(mut looked: Vec<(usize, Judged)>) -> Vec<Judged> {
    looked.sort_by(|a, b| a.1.error().total_cmp(&b.1.error()));
    let mut seen = BTreeSet::new();
    looked.retain(|(i, _)| seen.insert(*i));
    looked.into_iter().map(|(_, judged)| judged).collect()
}

/// Those of the candidates looked at that are fitted to the end, the best first.
fn contest(mut looked: Vec<(usize, Judged)>, criteria: &Criteria) -> Vec<Judged> {
    let (close, criteria) = (criteria.choice.close, &criteria.search);
    looked.sort_by(|a, b| a.1.error().total_cmp(&b.1.error()));
    let mut finalists: Vec<Judged> = Vec::new();
    for k in 0..looked.len() {
        let (i, found) = &looked[k];
        let (id, error) = (found.candidate.meta.id, found.error());
        // Of several starts of one candidate the best counts.
        let again = looked[..k].iter().any(|(j, _)| i == j);
        let needless = looked.iter().any(|(_, other)| {
            spares(&other.candidate, &found.candidate) && other.error() < close * error
        });
        let siblings: Vec<&Judged> = (finalists.iter())
            .filter(|j| j.candidate.meta.id == id)
            .collect();
        let elsewhere = siblings.first().is_some_and(|best| {
            best.candidate.at != found.candidate.at && error > criteria.elsewhere * best.error()
        });
        // A special case of one that did well may only need more iterations, so it may stay.
        let special = |j: &Judged| found.candidate.is_special(&j.candidate);
        let best = finalists.first();
        let far = best.is_some_and(|best| error > criteria.behind * best.error())
            && !finalists.iter().any(special);
        let places = if far {
            criteria.finalists_at_least
        } else {
            criteria.finalists
        };
        // The simplest explanation is not crowded out by what explains less than the one that contains it.
        let simplest = best.is_some_and(special);
        let full = finalists.len() >= places && !simplest;
        let crowded = siblings.len() >= criteria.finalists_each || full;
        if !again && !needless && !elsewhere && !crowded {
            finalists.push(found.clone());
        }
    }
    finalists
}

/// Whether `other` makes a candidate needless where both are about as good: it is a special case of the candidate,
/// the same effect with common parameters, or the same effect at more channels. (On a straight run an effect at
/// one wheel looks like one at both; then both are taken.)
fn spares(other: &Candidate, candidate: &Candidate) -> bool {
    let same = other.meta.id == candidate.meta.id && !other.separate;
    let alike = same && candidate.separate && other.at == candidate.at;
    let wider = same
        && candidate.at.iter().all(|c| other.at.contains(c))
        && other.at.len() > candidate.at.len();
    other.is_special(candidate) || alike || wider
}
