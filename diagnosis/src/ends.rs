//! Where the positions of a recording end.

use std::collections::BTreeSet;

use loopsight_core::{Channel, Place, Role, Shows};
use loopsight_model::model::{Model, misfit};
use loopsight_model::registry;
use loopsight_model::run::Run;
use loopsight_model::simulate::{Simulator, follow};
use nalgebra::DVector;

use crate::criteria::SearchCriteria;
use crate::positions::Positions;
use crate::progress::{Cancelled, Work};

/// Excursions to an end from which their turns are told from chance.
const SEVERAL: usize = 3;

/// The lower and the upper end of where a signal goes, where it stays at one of them or turns round there again and again.
///
/// What has a stop at one end may have come to the one at the other end too seldom to be seen. A fit begins before both
/// then, and lets a limit go that nothing came to ([`crate::candidates::Candidate::without_unmet`]).
pub(crate) type Ends = [Option<End>; 2];

/// An end of where a signal goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct End {
    /// Where a fit of a limit begins: hardly before the end, and where a stop that gives may begin. Of a signal that the log
    /// does not show, values within where the free run goes.
    pub(crate) starts: [f64; 2],
    /// The last value.
    last: f64,
    /// From one end to the other; without end for a signal that the log does not show.
    range: f64,
}

impl End {
    /// How much of the way lies between a `limit` and this end.
    pub(crate) fn share_beyond(&self, limit: f64) -> f64 {
        let [hardly, _] = self.starts;
        ((self.last - limit) * (self.last - hardly).signum()).max(0.0) / self.range
    }
}

/// Where a fit of a limit starts, in widths of an end before it: a stop that gives nothing, and one that gives much.
const STARTS: [f64; 2] = [0.1, 0.8];
/// The same in ranges where the log does not show the signal: the free run goes on beyond the limit.
const STARTS_WITHIN: [f64; 2] = [0.15, 0.35];

/// The signal of a channel that a limit would be one of.
pub(crate) fn limited(model: &Model, channel: &Channel) -> Option<usize> {
    let role = |role| model.find_signal(channel.read(role)?).ok();
    role(Role::Position).or_else(|| role(Role::Head))
}

/// The [`Ends`] of the plant's signals, each by its index; none of signals that no limit would be one of.
pub(crate) fn ends(
    model: &Model,
    values: &[f64],
    states: &[DVector<f64>],
    runs: &[Run],
    work: &Work<'_>,
) -> Result<Vec<Ends>, Cancelled> {
    let mut found = vec![[None; 2]; model.n_signals()];
    let wanted = wanted(model);
    if wanted.is_empty() {
        return Ok(found);
    }
    let positions = Positions::of(model, values);
    let mut shown: BTreeSet<usize> = positions.iter().flat_map(Positions::states).collect();
    shown.extend((0..model.n_signals()).filter(|i| model.measured_index(*i).is_some()));
    let mut paths = Vec::new();
    for (run, x0) in runs.iter().zip(states) {
        work.go_on()?;
        paths.push(path(model, values, positions.as_ref(), x0.as_slice(), run));
    }
    let criteria = &work.criteria().search;
    for (index, level) in wanted {
        let tracks: Vec<Vec<f64>> = (paths.iter().zip(runs))
            .map(|(path, run)| track(model, index, path, run))
            .collect();
        // A level has no stop below: nothing runs out upwards.
        let signs: &[f64] = if level { &[1.0] } else { &[-1.0, 1.0] };
        let unseen = !shown.contains(&index);
        if unseen || signs.iter().any(|sign| stops(&tracks, *sign, criteria)) {
            let shares = if unseen {
                STARTS_WITHIN
            } else {
                STARTS.map(|share| share * criteria.end)
            };
            let of = |sign| signs.contains(&sign).then(|| before(&tracks, sign, shares));
            found[index] = [-1.0, 1.0].map(|sign| {
                let mut end = of(sign).flatten()?;
                if unseen {
                    end.range = f64::INFINITY;
                }
                Some(end)
            });
        }
    }
    Ok(found)
}

/// The signals that an effect which acts at an end would limit, and whether each is a level.
fn wanted(model: &Model) -> BTreeSet<(usize, bool)> {
    let effects = registry::effects().into_iter();
    let at_end = effects.filter(|meta| meta.shows == Shows::AtEnd);
    at_end
        .flat_map(|meta| {
            let level = meta.reads.contains(&Role::Head);
            let channels = model.plant.channels.iter();
            channels
                .filter(|c| matches!(c.place, Place::Effort(_)) && misfit(c, meta).is_none())
                .filter_map(|c| Some((limited(model, c)?, level)))
                .collect::<Vec<_>>()
        })
        .collect()
}

/// All signals of the plant at each sample of a run, with the positions as measured where they are.
fn path(
    model: &Model,
    values: &[f64],
    positions: Option<&Positions>,
    x0: &[f64],
    run: &Run,
) -> Vec<Vec<f64>> {
    let mut simulator = Simulator::new(model, values);
    let mut path = Vec::with_capacity(run.len());
    match positions {
        // An observer corrects the positions as well.
        Some(positions) if run.observer().is_none() => {
            let n = model.measured.len();
            let each = |_: usize, _: &[f64]| Ok::<(), Cancelled>(());
            let keep = |now: &mut Simulator<'_, f64>| path.push(now.signals().to_vec());
            let _ = positions.run(&mut simulator, x0, run, n, each, keep);
        }
        _ => follow(&mut simulator, x0, run, |_, _, now| {
            path.push(now.signals().to_vec());
        }),
    }
    path
}

/// One signal along a run: as measured where it is, else along the path.
fn track(model: &Model, index: usize, path: &[Vec<f64>], run: &Run) -> Vec<f64> {
    match model.measured_index(index) {
        Some(signal) => (0..run.len()).map(|k| run.sample(k)[signal]).collect(),
        None => path.iter().map(|signals| signals[index]).collect(),
    }
}

/// The end of these tracks, the upper one where `sign` is 1 and the lower one where it is -1, with starts before it by some
/// shares of their range. None of what stands still.
fn before(tracks: &[Vec<f64>], sign: f64, shares: [f64; 2]) -> Option<End> {
    let [low, high] = extent(tracks, sign);
    let range = high - low;
    let normal = range.is_normal();
    normal.then(|| End {
        starts: shares.map(|share| sign * (high - share * range)),
        last: sign * high,
        range,
    })
}

/// The least and the greatest value of `sign` times these tracks.
fn extent(tracks: &[Vec<f64>], sign: f64) -> [f64; 2] {
    let all = tracks.iter().flatten().map(|x| sign * x);
    all.filter(|x| x.is_finite())
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
            [low.min(x), high.max(x)]
        })
}

/// Whether these tracks are stopped at an end, the upper one where `sign` is 1 and the lower one where it is -1.
///
/// A motion that passes through the region, or turns round anywhere in it, is at the end itself for the share of the
/// end in the region. One that is stopped stays longer; one that bounces off turns there whenever it comes into the
/// region. One that is stopped only once, among many excursions that are not, is cut off there: at its highest it spends
/// most of its time near the end on the last quarter of the way to it, where a smooth turn spends half.
fn stops(tracks: &[Vec<f64>], sign: f64, criteria: &SearchCriteria) -> bool {
    let [low, high] = extent(tracks, sign);
    let range = high - low;
    if !range.is_normal() {
        return false;
    }
    let near = high - criteria.end * range;
    let region = high - criteria.end_region * range;
    let last = high - 0.25 * criteria.end * range;
    let (mut stays, mut within) = (0usize, 0usize);
    let (mut excursions, mut turns) = (0usize, 0usize);
    let mut cut_off = false;
    for track in tracks {
        let mut highest = f64::NEG_INFINITY;
        let (mut at_near, mut at_last) = (0usize, 0usize);
        for x in track.iter().map(|x| sign * x).chain([f64::NEG_INFINITY]) {
            if x >= region {
                within += 1;
                stays += usize::from(x >= near);
                highest = highest.max(x);
                at_near += usize::from(x >= near);
                at_last += usize::from(x >= last);
            } else if x < region && highest.is_finite() {
                cut_off |= highest >= high && at_last as f64 >= criteria.cut_off * at_near as f64;
                (at_near, at_last) = (0, 0);
                excursions += 1;
                turns += usize::from(highest >= near);
                highest = f64::NEG_INFINITY;
            }
        }
    }
    let share = |of: usize, all: usize| of as f64 >= criteria.stays_at_end * all as f64;
    share(stays, within) || cut_off || excursions >= SEVERAL && share(turns, excursions)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The ends of a motion over 40 s.
    fn found(motion: impl Fn(f64) -> f64) -> [bool; 2] {
        let track: Vec<f64> = (0..4000).map(|k| motion(0.01 * f64::from(k))).collect();
        let tracks = std::slice::from_ref(&track);
        [-1.0, 1.0].map(|sign| stops(tracks, sign, &SearchCriteria::DEFAULT))
    }

    /// It wanders as a sum of waves does.
    fn wander(t: f64) -> f64 {
        (0.9 * t).sin() + 0.8 * (2.3 * t + 1.0).sin() + 0.7 * (0.37 * t).cos()
    }

    #[test]
    fn a_motion_that_is_stopped_ends_there() {
        assert_eq!(found(wander), [false, false]);
        assert!(found(|t| wander(t).min(0.5))[1]);
        assert!(found(|t| wander(t).max(-0.8))[0]);
        assert_eq!(found(|t| wander(t).clamp(-0.8, 0.5)), [true, true]);
        assert_eq!(found(|_| 1.0), [false, false]);
    }

    /// The highest of several excursions reaches the stop, and the others do not.
    #[test]
    fn one_that_is_stopped_once_does_too() {
        let height = |t: f64| 0.8 + 0.02 * t;
        let swing = |t: f64| height(t) * (0.8 * t).sin();
        assert_eq!(found(swing), [false, false]);
        assert_eq!(found(|t| swing(t).min(1.4)), [false, true]);
    }

    #[test]
    fn one_that_bounces_off_does_too() {
        let folded = |t: f64| 0.5 - (0.5 - wander(t)).abs();
        assert!(found(folded)[1]);
    }

    #[test]
    fn a_fit_starts_a_little_before_the_end() {
        let track: Vec<f64> = (0..4000)
            .map(|k| wander(0.01 * f64::from(k)).min(0.5))
            .collect();
        let shares = STARTS.map(|share| share * SearchCriteria::DEFAULT.end);
        let end = before(std::slice::from_ref(&track), 1.0, shares).unwrap();
        let starts = end.starts;
        assert!(starts.iter().all(|x| (0.3..0.5).contains(x)), "{starts:?}");
        // Of the way from the lowest value up to 0.5.
        let low = track.iter().copied().fold(f64::INFINITY, f64::min);
        assert!((end.share_beyond(0.5 * (low + 0.5)) - 0.5).abs() < 1e-12);
        assert_eq!(end.share_beyond(0.6), 0.0);
        let end = before(&[track], -1.0, shares).unwrap();
        assert!((end.share_beyond(0.5 * (low + 0.5)) - 0.5).abs() < 1e-12);
        assert_eq!(end.share_beyond(low - 0.1), 0.0);
        assert!(before(&[vec![1.0; 9]], 1.0, shares).is_none());
    }
}
