//! Effects that a diagnosis does not try, and why.

use loopsight_core::EffectMeta;
use loopsight_model::model::Model;
use loopsight_model::registry;
use serde::Serialize;

use crate::candidates::Seen;
use crate::criteria::SearchCriteria;
use crate::places::{channel_sets, has_another_name, unshown_part};
use crate::shows::{can_show, what_is_absent};

/// An effect of the library that fits the plant and was not tried, because the recording cannot show it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Untried {
    /// Id of the effect.
    pub effect: String,
    /// What the recording does not show.
    pub why: String,
}

/// The effects that fit the plant of `model`, are not in it, and are tried at no channel.
pub(crate) fn untried(model: &Model, seen: &Seen<'_>, criteria: &SearchCriteria) -> Vec<Untried> {
    let in_model = |meta: &EffectMeta| model.effects.iter().any(|e| e.meta.id == meta.id);
    let effects = registry::effects();
    let others = effects.into_iter().filter(|meta| !in_model(meta));
    others
        .filter_map(|meta| {
            Some(Untried {
                effect: meta.id.to_owned(),
                why: why(model, meta, seen, criteria)?,
            })
        })
        .collect()
}

/// Why an effect is tried at none of the channels that it fits; none where it is tried, or fits none.
fn why(
    model: &Model,
    meta: &'static EffectMeta,
    seen: &Seen<'_>,
    criteria: &SearchCriteria,
) -> Option<String> {
    let mut sets = channel_sets(model, meta);
    sets.retain(|at| !has_another_name(model, meta, at));
    let first = sets.first()?;
    if model.log.inputs_measured && meta.before_input {
        return Some("the inputs were measured behind it".to_owned());
    }
    if let Some(part) = unshown_part(model, first)
        && sets.iter().all(|at| unshown_part(model, at).is_some())
    {
        return Some(format!("the log does not show {part}"));
    }
    let shows = |at: &Vec<&str>| can_show(model, meta, at, seen.runs, seen.ends, criteria);
    if sets.iter().any(shows) {
        return None;
    }
    what_is_absent(meta, model, seen.runs, seen.parts_of_one).map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use loopsight_model::run::Run;
    use loopsight_plants as _;

    use super::*;

    const AXIS: &str = "[plant.dc_axis]\n[log.measured]\nspeed = { sensor = \"instantaneous\" }\n";

    /// The effects that are not tried on runs with these commands, and why.
    fn of(model: &str, runs: &[&[f64]]) -> Vec<(String, String)> {
        seen_as(model, runs, false)
    }

    fn seen_as(model: &str, runs: &[&[f64]], parts_of_one: bool) -> Vec<(String, String)> {
        let (model, _) = Model::from_toml("axis.toml", model).unwrap();
        let runs: Vec<Run> = runs
            .iter()
            .map(|commands| {
                let mut run = Run::empty(1, 1);
                for k in 0..100 * commands.len() {
                    let u = commands[k / 100];
                    run.push(0.01 * k as f64, &[u], &[u]).unwrap();
                }
                run
            })
            .collect();
        let seen = Seen {
            runs: &runs,
            rms: &[],
            ends: &[],
            observed: false,
            parts_of_one,
        };
        let all = untried(&model, &seen, &SearchCriteria::DEFAULT);
        all.into_iter().map(|u| (u.effect, u.why)).collect()
    }

    fn why_of<'a>(all: &'a [(String, String)], effect: &str) -> Option<&'a str> {
        let found = all.iter().find(|(id, _)| id == effect);
        found.map(|(_, why)| why.as_str())
    }

    #[test]
    fn it_says_what_the_recording_lacks() {
        let two_levels = of(AXIS, &[&[3.0, -3.0, 3.0]]);
        let absent = "no input rests at zero between other values";
        assert_eq!(why_of(&two_levels, "bridge_coast"), Some(absent));
        let signed = "what is measured goes below zero";
        assert_eq!(why_of(&two_levels, "sensor_magnitude"), Some(signed));
        // One run shows what changes with time, and friction can be tried anywhere.
        assert_eq!(why_of(&two_levels, "gain_drift"), None);
        assert_eq!(why_of(&two_levels, "coulomb_friction"), None);
        let several = of(AXIS, &[&[3.0, 0.0, -3.0], &[3.0]]);
        let runs = "the recording has several runs";
        assert_eq!(why_of(&several, "gain_drift"), Some(runs));
        let windows = seen_as(AXIS, &[&[3.0, 0.0, -3.0], &[3.0]], true);
        let long = "a log this long is searched in windows; a shorter part can show it";
        assert_eq!(why_of(&windows, "gain_drift"), Some(long));
        assert_eq!(why_of(&several, "bridge_coast"), None);
    }

    #[test]
    fn what_is_in_the_model_or_fits_nowhere_is_not_listed() {
        let with = format!("{AXIS}[[effect]]\n[effect.bridge_coast]\nat = [\"input\"]\n");
        let all = of(&with, &[&[3.0, -3.0, 3.0]]);
        assert_eq!(why_of(&all, "bridge_coast"), None);
        assert_eq!(why_of(&all, "scrub_friction"), None);
    }

    #[test]
    fn what_happens_before_a_measured_input_is_not_tried() {
        let (log, rest) = AXIS.split_once("[log.measured]").unwrap();
        let measured = format!("{log}[log]\ninputs_measured = true\n[log.measured]{rest}");
        let all = of(&measured, &[&[3.0, 0.0, -3.0]]);
        let behind = "the inputs were measured behind it";
        assert_eq!(why_of(&all, "dead_zone"), Some(behind), "{all:?}");
    }
}
