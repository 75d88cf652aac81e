//! The search among candidates: which get a short fit, and which of these a full one.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use crate::both_ways::is_the_same_both_ways;
use crate::candidates::Candidate;
use crate::conclusion::Explanation;
use crate::criteria::SearchCriteria;
use crate::early::Finding;
use crate::explain::explain;
use crate::judge::nrmse;
use crate::progress::{Stage, Work};
use crate::starts::{Extent, starts_from};
use crate::substance::{does_something, is_a_simpler_one};
use crate::trial::{Judged, Nominal, finish, look};

/// A search among candidates.
pub(crate) struct Search<'a> {
    pub(crate) all: &'a [Candidate],
    pub(crate) nominal: &'a Nominal<'a>,
    pub(crate) work: &'a Work<'a>,
    /// What the recording can show in time.
    pub(crate) extent: Extent,
    /// How late time stamps may be of their own, s.
    pub(crate) shift: f64,
    /// Share of the plain model's error below which a candidate must come.
    pub(crate) leaves: f64,
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

    /// Whether the model as it was given lies in another valley than the one that the plain fit ended in; none where it lacks
    /// values. They are in one where a Gauss–Newton step from it comes to the cost of that fit, and the fit does as well on
    /// what it did not see.
    fn given_is_elsewhere(&self) -> Option<bool> {
        let (given, cost) = (self.nominal.given, self.nominal.cost);
        if !given.missing_values().is_empty() {
            return None;
        }
        let problem = self.nominal.problem(given, self.nominal.held)?;
        let states = &self.nominal.solution.states;
        let scaled = problem.pack(&given.values(), states);
        let there = problem.residual_vector(&scaled).ok()?.norm_squared();
        let same = self.work.criteria().choice.never_same;
        if there <= same.powi(2) * cost {
            return Some(false);
        }
        let (seen, unseen) = (cost.sqrt(), nrmse(self.nominal.rank));
        let leads_there = |after: f64| seen <= same * after.sqrt() && after.sqrt() <= same * seen;
        let promise = problem.promise(&given.values(), states).ok()?;
        let is_one = unseen <= same * seen && promise.is_some_and(|(_, after)| leads_there(after));
        Some(!is_one)
    }

    /// The best of those that were looked at, fitted until they converge.
    fn ended(&self, looked: Vec<(usize, Judged)>) -> Found {
        if self.work.is_cancelled() {
            let finalists = Vec::new();
            let looked = best_first(looked);
            return Found { finalists, looked };
        }
        let contest = self.contest(looked);
        let of = contest.len() as u64;
        let done = AtomicU64::new(0);
        self.work.tell(Stage::Finalists, 0, of);
        let any = (self.worth_trying()).map_or(f64::INFINITY, |left| left * self.nominal.cost);
        let most = any.min(self.most_promised(least(contest.iter())));
        let mut finalists: Vec<(Judged, Explanation)> = contest
            .par_iter()
            .enumerate()
            .filter_map(|(k, first)| {
                let spared = k >= self.criteria().finalists_at_least;
                let most = if spared { most } else { any };
                let found = self.finished(first.clone(), most);
                if let Some((_, explanation)) = &found {
                    self.work.know(|| Finding::Finalist(explanation.into()));
                }
                self.tell(Stage::Finalists, &done, of);
                found
            })
            .collect();
        in_order(&mut finalists);
        let regressed = self.regressed(&finalists);
        exchange(&mut finalists, regressed);
        let shrunk = self.shrunk(&finalists);
        exchange(&mut finalists, shrunk);
        let looked = if self.work.is_cancelled() {
            contest
        } else {
            Vec::new()
        };
        Found { finalists, looked }
    }

    pub(crate) fn criteria(&self) -> &SearchCriteria {
        &self.work.criteria().search
    }

    /// The full fit of a candidate, where that promises a cost of at most `most`. An effect whose fitted size is nothing
    /// explains nothing, whatever the other parameters gained; nor does a shift in time that the stamps may have of their
    /// own, nor directions that are alike, nor what is a simpler effect for all that the log shows.
    pub(crate) fn finished(&self, first: Judged, most: f64) -> Option<(Judged, Explanation)> {
        let (judged, fit) = finish(first, self.nominal, most)?;
        let explanation = explain(&judged, &fit, self.nominal).ok()?;
        let criteria = self.work.criteria();
        let stands_in = is_the_same_both_ways(&judged.candidate, &explanation, criteria);
        let acts = does_something(
            &judged.candidate,
            &explanation,
            criteria.search.does_nothing,
            self.shift,
        );
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
            let found = self.finished(first, f64::INFINITY)?;
            (found.0.error() <= near(candidate)).then_some(found)
        };
        (self.all.par_iter().filter(missed))
            .filter_map(fitted)
            .collect()
    }

    /// Those of the candidates looked at that are fitted to the end, the best first.
    fn contest(&self, mut looked: Vec<(usize, Judged)>) -> Vec<Judged> {
        let (close, criteria) = (self.work.criteria().choice.close, self.criteria());
        let least = least(looked.iter().map(|(_, found)| found));
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
            let full = finalists.len() >= places && !simplest
                || finalists.len() >= criteria.finalists_at_least && self.came_beside(error, least);
            let crowded = siblings.len() >= criteria.finalists_each || full;
            if !again && !needless && !elsewhere && !crowded {
                finalists.push(found.clone());
            }
        }
        finalists
    }

    /// One more is done of a stage.
    pub(crate) fn tell(&self, stage: Stage, done: &AtomicU64, of: u64) {
        let now = done.fetch_add(1, Ordering::Relaxed) + 1;
        self.work.tell(stage, now.min(of), of);
    }
}

/// The least error among some candidates.
pub(crate) fn least<'j>(found: impl Iterator<Item = &'j Judged>) -> f64 {
    found.map(Judged::error).fold(f64::INFINITY, f64::min)
}

/// Puts `better` fits in the place of those of the same candidates.
fn exchange(finalists: &mut Vec<(Judged, Explanation)>, better: Vec<(Judged, Explanation)>) {
    for found in better {
        finalists.retain(|(other, _)| !other.candidate.is_again(&found.0.candidate));
        finalists.push(found);
    }
    in_order(finalists);
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

#[cfg(test)]
mod tests {
    use loopsight_model::model::Model;
    use loopsight_plants as _;

    use super::*;
    use crate::holdout::Holdout;
    use crate::prediction::InitialStates;
    use crate::problem::Problem;
    use crate::solve::Effort;
    use crate::swing::swing;

    fn axis(values: &str, effect: &str) -> Model {
        let text = format!("[plant.dc_axis]\n{values}\n[log.measured.speed]\n{effect}");
        Model::from_toml("axis.toml", &text).unwrap().0
    }

    /// The values that the plain model's fit begins with.
    const START: &str = "K_A = -1.5\nK_C = 6.0";
    const FRICTION: &str = "[[effect]]\n[effect.coulomb_friction]\nat = [\"shaft\"]\nlevel = 0.8\n";

    /// What `ask` says of a search that begins with `given`, on an axis with friction that the model lacks; the plain model
    /// does `worse` by that factor where it is ranked.
    fn search<T>(given: &Model, worse: f64, ask: impl Fn(&Search<'_>) -> T) -> T {
        let machine = axis("K_A = -2.0\nK_C = 8.0", FRICTION);
        let runs = [swing(&machine, 600)];
        let work = Work::quiet();
        let model = axis(START, "");
        let holdout = Holdout::new(&model, &runs, None, &work.criteria().holdout);
        let states = InitialStates::guess(&model, &model.values(), &runs).states;
        let seen = holdout.seen.as_deref();
        let mut problem = Problem::with(&model, &runs, seen, None, Work::quiet()).unwrap();
        let solution = problem
            .solve_from(&model.values(), &states, Effort::FULL)
            .unwrap();
        let cost = problem.best().unwrap().0.powi(2);
        let mut rank = holdout.judge(&model, &solution, None, &work).unwrap().rank;
        rank.iter_mut().for_each(|loss| *loss *= worse.powi(2));
        let nominal = Nominal {
            given,
            model: &model,
            solution: &solution,
            cost,
            rank: &rank,
            floor: 1e-6,
            held: Some(&solution.states),
            holdout: &holdout,
            work: &work,
        };
        ask(&Search {
            all: &[],
            nominal: &nominal,
            work: &work,
            extent: Extent::of(&runs),
            shift: 0.0,
            leaves: f64::INFINITY,
        })
    }

    #[test]
    fn a_model_that_leads_to_the_plain_fit_is_not_elsewhere() {
        let elsewhere = |given: &Model, worse| search(given, worse, |s| s.given_is_elsewhere());
        // Near where the fit ends, and from where one step leads there.
        for values in ["K_A = -2.6\nK_C = 8.5", START] {
            assert_eq!(elsewhere(&axis(values, ""), 1.0), Some(false), "{values}");
        }
        // The fit does worse on what it did not see, so it may be the one that went astray.
        assert_eq!(elsewhere(&axis(START, ""), 4.0), Some(true));
        // From four times the gain and a fiftieth of the damping one step leads elsewhere.
        let further = axis("K_A = -0.04\nK_C = 32.0", "");
        assert_eq!(elsewhere(&further, 1.0), Some(true));
        // Where the file gives no values there is nowhere to begin a second time.
        assert_eq!(elsewhere(&axis("", ""), 4.0), None);
    }

    /// A tenth of what the best one explains: of all of it, of none of it, and of three quarters.
    #[test]
    fn a_full_fit_must_promise_its_share_of_what_the_best_explains() {
        search(&axis(START, ""), 1.0, |search| {
            let (plain, error) = (search.nominal.cost, nrmse(search.nominal.rank));
            for (least, share) in [(0.0, 0.9), (error, 1.0), (0.5 * error, 0.925)] {
                let most = search.most_promised(least) / plain;
                assert!((most - share).abs() < 1e-12, "{least}: {most}");
            }
        });
    }

    /// A tenth of what matters, which is two tenths of the noise; where more is left than noise, anything may be missing.
    #[test]
    fn at_the_floor_an_effect_must_promise_what_would_matter() {
        search(&axis(START, ""), 1.0, |search| {
            let left = |floors: f64| {
                let floor = nrmse(search.nominal.rank) / floors;
                let nominal = Nominal {
                    floor,
                    ..*search.nominal
                };
                let at_floor = Search {
                    nominal: &nominal,
                    ..*search
                };
                at_floor.worth_trying()
            };
            for (floors, gains) in [(1.0, 0.1 * 0.04), (0.5, 0.1 * 0.16), (0.1, 0.1 * 4.0)] {
                let left = left(floors).unwrap();
                assert!((1.0 - left - gains).abs() < 1e-12, "{floors}: {left}");
            }
            assert_eq!(left(1.21), None);
            assert_eq!(left(f64::NAN), None);
        });
    }
}
