//! The candidates of a diagnosis: every effect at every channel where it could be added to the model.

use loopsight_core::EffectMeta;
use loopsight_model::model::Model;
use loopsight_model::registry;
use loopsight_model::run::Run;

use crate::commands::Commands;
use crate::criteria::SearchCriteria;
use crate::ends::Ends;
use crate::estimate::ParameterVerdict;
use crate::fitted::Fit;
use crate::moves::Moves;
use crate::places::{channel_sets, has_another_name, unshown_part};
use crate::positions::Positions;
use crate::shows::can_show;
use crate::suited::{is_per_way, last_ends, smooth, suit, widths};

/// An effect at a set of channels.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
    pub(crate) meta: &'static EffectMeta,
    pub(crate) at: Vec<&'static str>,
    /// Each channel has parameters of its own; else they share them.
    pub(crate) separate: bool,
    /// In its fuller form, with the parameters that are declared as [`further`](loopsight_core::Parameter::further).
    pub(crate) further: bool,
    /// The effect of the nominal model that it replaces, because it contains it: id, and indices of the
    /// parameters that are removed.
    pub(crate) replaces: Option<(&'static str, std::ops::Range<usize>)>,
    /// The model with it, at neutral parameters.
    pub(crate) model: Model,
    /// How its channels move in the recording.
    pub(crate) moves: Moves,
    /// Where the position (or head) at its channels ends in the recording.
    pub(crate) ends: Ends,
    /// It can be tried at the measured positions: it reads a position, and no observer corrects the free runs.
    pub(crate) by_position: bool,
    /// Widths over which signs of all effects are smoothed at first, by index of the parameter.
    pub(crate) widths: Vec<(usize, f64)>,
    /// Its `[[effect]]` entries, where the library has no such effect.
    pub(crate) entries: Option<String>,
}

impl Candidate {
    /// Parameters of the model that the candidate brought, by index.
    pub(crate) fn own(&self) -> std::ops::Range<usize> {
        let first = self.model.effects.len() - self.instances();
        let effect = self.model.effects.get(first);
        let n = self.model.parameters.len();
        effect.map_or(n, |e| e.first_parameter)..n
    }

    /// How many times the effect is in the model.
    fn instances(&self) -> usize {
        if self.separate { self.at.len() } else { 1 }
    }

    /// Whether it is the same as another candidate, but for its values.
    pub(crate) fn is_again(&self, other: &Self) -> bool {
        self.meta.id == other.meta.id
            && self.at == other.at
            && self.separate == other.separate
            && self.further == other.further
            && self.replaces == other.replaces
    }

    /// Whether it is contained in another candidate at its place.
    pub(crate) fn is_special(&self, of: &Self) -> bool {
        let is_less = of.meta.id == self.meta.id && of.further && !self.further && !self.separate;
        (is_less || of.meta.simpler.contains(&self.meta.id)) && of.at == self.at
    }

    /// The name of one of its own parameters, by index in the model, as it is reported.
    pub(crate) fn name(&self, index: usize) -> String {
        let id = self.model.parameters[index].declaration.id;
        let mut effects = self.model.effects.iter().rev();
        let of = effects.find(|e| e.first_parameter <= index);
        match of.and_then(|effect| effect.at.first()) {
            Some(channel) if self.separate => format!("{id}@{}", channel.id),
            _ => id.to_owned(),
        }
    }

    /// How many of them are found from the log: estimated, or chosen from a list.
    pub(crate) fn complexity(&self) -> usize {
        self.own()
            .filter(|i| {
                let parameter = &self.model.parameters[*i];
                let listed = !parameter.declaration.starts.is_empty();
                parameter.free || listed && !parameter.is_left_out()
            })
            .count()
    }

    /// Its own non-linear parameters, where the effect reads a position and has linear parameters as well: at
    /// the measured positions a regression finds the linear ones.
    pub(crate) fn shape(&self) -> Option<Vec<usize>> {
        let linear = |i: &usize| self.model.parameters[*i].declaration.linear;
        let regressed = self.by_position && self.own().any(|i| linear(&i));
        regressed.then(|| self.own().filter(|i| !linear(i)).collect())
    }

    /// The candidate with its sign smoothed over this share of the flow; none where it has no sign.
    pub(crate) fn smoothed(&self, share: f64) -> Option<Self> {
        let mut sharp = self.clone();
        let n = self.instances();
        smooth(&mut sharp.model, n, share * sharp.moves.flow).then_some(sharp)
    }

    /// Its own widths over which signs are smoothed.
    pub(crate) fn own_widths(&self) -> Vec<usize> {
        let is_width = |i: &usize| self.model.parameters[*i].declaration.is_width();
        self.own().filter(is_width).collect()
    }

    /// Whether, at these `values`, one of its speeds is no larger than the smoothing width of its sign.
    /// Such an effect only sharpens the sign. Nor is one an effect of its own that gives way within the same share of the
    /// way: it is dry friction.
    pub(crate) fn drowns(&self, values: &[f64], criteria: &SearchCriteria) -> bool {
        let shortest = criteria.sign_width * self.moves.reach;
        let at_once = self.own().any(|i| {
            let per_way = is_per_way(self.model.parameters[i].declaration);
            per_way && values.get(i).is_some_and(|rate| rate * shortest > 1.0)
        });
        if at_once {
            return true;
        }
        let speeds = |width: bool| {
            self.own().filter_map(move |i| {
                let declaration = &self.model.parameters[i].declaration;
                (declaration.unit == "flow" && declaration.is_width() == width)
                    .then(|| values.get(i).copied())
                    .flatten()
            })
        };
        let width = speeds(true).fold(0.0, f64::max);
        speeds(false).any(|speed| speed < criteria.clear_of_sign * width)
    }

    /// Whether, at these `values`, the machine is beyond its limits on more of its way than a stop takes. Such a stop
    /// stops nothing: it stands in for a spring, or for another effect of the place.
    pub(crate) fn has_no_way(&self, values: &[f64], criteria: &SearchCriteria) -> bool {
        let beyond = self.own().filter_map(|i| {
            let parameter = &self.model.parameters[i];
            let limits = parameter.declaration.limits.filter(|_| parameter.free)?;
            let end = self.ends[limits as usize]?;
            Some(end.share_beyond(*values.get(i)?))
        });
        beyond.sum::<f64>() > criteria.end_beyond
    }

    /// Its model with every sign smoothed widely, those of earlier effects included. The derivative of a sharp
    /// sign is huge at zero and zero elsewhere: it gives a fit no direction.
    pub(crate) fn softened(&self) -> Model {
        let mut model = self.model.clone();
        for (index, width) in &self.widths {
            let value = &mut model.parameters[*index].value;
            *value = value.map(|present| present.max(*width));
        }
        model
    }

    /// The candidate with the values of `start` for those of its parameters that are not estimated.
    pub(crate) fn chosen(&self, start: &[f64]) -> Self {
        let mut chosen = self.clone();
        for i in self.own() {
            let parameter = &mut chosen.model.parameters[i];
            if !parameter.free {
                parameter.value = start.get(i).copied().or(parameter.value);
            }
        }
        chosen
    }

    /// The candidate without those of its limits that a fit ended beyond everything that moves: where the recording turns by
    /// chance there is no stop. None where it came to all that it looked for, or to none.
    pub(crate) fn without_unmet(&self, fit: &Fit) -> Option<Self> {
        let limits = self.own().filter(|i| {
            let parameter = &self.model.parameters[*i];
            parameter.free && parameter.declaration.limits.is_some()
        });
        let dead = |i: &usize| {
            let estimate = fit.parameters.get(&self.model.parameters[*i].name);
            estimate.is_some_and(|e| e.verdict == ParameterVerdict::Dead)
        };
        let (unmet, met): (Vec<usize>, Vec<usize>) = limits.partition(dead);
        if unmet.is_empty() || met.is_empty() {
            return None;
        }
        let mut without = self.clone();
        for i in unmet {
            without.model.parameters[i].free = false;
        }
        Some(without)
    }

    /// `start` with a hundredth of the sizes of the effect: its linear parameters that are zero without it, and its `times`. None where
    /// it has none, or they are nothing already. A lag of 20 ms is another machine where a swing takes 70 ms.
    pub(crate) fn faint(&self, start: &[f64], times: bool) -> Option<Vec<f64>> {
        let mut faint = start.to_vec();
        for i in self.own() {
            let parameter = &self.model.parameters[i];
            let declaration = parameter.declaration;
            let is_size = declaration.linear || (times && parameter.is_time());
            if parameter.free && is_size && declaration.default == Some(0.0) {
                faint[i] *= 0.01;
            }
        }
        (faint != start).then_some(faint)
    }
}

/// What was seen of the machine.
pub(crate) struct Seen<'a> {
    pub(crate) runs: &'a [Run],
    /// Root mean squares of the plant's signals in the recording. Smoothing widths are set from them, because
    /// machines move at very different speeds.
    pub(crate) rms: &'a [f64],
    /// Where these signals end.
    pub(crate) ends: &'a [Ends],
    /// An observer corrects the free runs.
    pub(crate) observed: bool,
    /// The `runs` are windows of one.
    pub(crate) parts_of_one: bool,
}

/// All candidates for `model`: each effect at every single channel it fits, and at all channels of a
/// family (both wheels, all inputs), alike and each with its own parameters; and those that the model file proposes.
///
/// Left out are effects that the model already has at these channels, effects on signals that are not
/// measured, and effects that cannot show in `runs`. Where the log's inputs were measured at the machine, effects
/// before that point are left out too, and where a part of the plant is tied because the log does not show it,
/// effects on that part. An effect that contains one of the model's at the same channels replaces it.
pub(crate) fn candidates(
    model: &Model,
    seen: &Seen<'_>,
    criteria: &SearchCriteria,
) -> Vec<Candidate> {
    let Seen {
        runs,
        rms,
        ends,
        observed,
        ..
    } = *seen;
    let sign_width = criteria.sign_width;
    let commands = Commands::of(model, runs);
    let mut found = Vec::new();
    let possible = |meta: &&EffectMeta| !(model.log.inputs_measured && meta.before_input);
    let known = registry::effects().into_iter().filter(possible);
    let known = known.map(|meta| (meta, channel_sets(model, meta), false));
    // Those of the file's own are tried where the file says.
    let own = model.candidates.iter().map(|proposed| {
        let at = proposed.at.iter().map(|c| c.id).collect();
        (proposed.meta(), vec![at], true)
    });
    for (meta, sets, own) in known.chain(own) {
        for at in sets {
            let present = model
                .effects
                .iter()
                .any(|e| e.meta.id == meta.id && e.at.iter().any(|c| at.contains(&c.id)));
            if present
                || !own && has_another_name(model, meta, &at)
                || unshown_part(model, &at).is_some()
                || !can_show(model, meta, &at, runs, ends, criteria)
            {
                continue;
            }
            let contained = model.effects.iter().position(|e| {
                meta.simpler.contains(&e.meta.id)
                    && e.at.iter().map(|c| c.id).eq(at.iter().copied())
            });
            let replaces = contained.map(|index| {
                let effect = &model.effects[index];
                (effect.meta.id, effect.own())
            });
            let base = match contained {
                Some(index) => model.without_effect(index),
                None => Some(model.clone()),
            };
            let each: Vec<&[&str]> = at.chunks(1).collect();
            let ways: &[(bool, bool, &[&[&str]])] = &[
                (false, false, &[&at]),
                (true, false, &each),
                (false, true, &[&at]),
            ];
            let has_further = meta.parameters.iter().any(|p| p.further);
            for (separate, further, sets) in ways {
                if *further && !has_further {
                    continue;
                }
                let alike_only = own || meta.shared_only || meta.sided || replaces.is_some();
                if *separate && (at.len() < 2 || alike_only) {
                    continue;
                }
                let mut with = base.clone();
                let mut flow = 0.0;
                for set in *sets {
                    with = with.and_then(|m| m.with_effect(meta.id, set));
                    if let Some(model) = with.as_mut().filter(|_| !own) {
                        flow = suit(model, rms, &commands, sign_width).max(flow);
                    }
                }
                if let Some(mut model) = with {
                    let moves = Moves {
                        flow,
                        ..Moves::of_last(&model, rms, &commands)
                    };
                    let own = model.effects.last().map_or(0, |e| e.first_parameter);
                    for parameter in &mut model.parameters[own..] {
                        parameter.free |= *further && parameter.declaration.further;
                    }
                    found.push(Candidate {
                        meta,
                        at: at.clone(),
                        separate: *separate,
                        further: *further,
                        replaces: replaces.clone(),
                        by_position: !observed && Positions::matter_to(meta),
                        widths: widths(&model, rms, sign_width),
                        ends: last_ends(&model, ends),
                        model,
                        moves,
                        entries: None,
                    });
                }
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use loopsight_plants as _;

    use super::*;

    const ROBOT: &str = "[plant.ddmr]\nK_B = 0.0\nK_E = 0.0\nhalf_track = 0.3\nwheel_radius = 0.07\n\
                         [log.measured]\ntrack_speed_right = { sensor = \"instantaneous\" }\n\
                         track_speed_left = { sensor = \"instantaneous\" }\n";

    /// The candidates, where this part of the robot does not show; all where none is named.
    fn tried(unshown: Option<&str>) -> Vec<Candidate> {
        let (robot, _) = Model::from_toml("robot.toml", ROBOT).unwrap();
        let mut parts = robot.unshown().iter();
        let part = unshown.map(|what| parts.find(|part| part.what == what).unwrap());
        let robot = part.map_or(robot.clone(), |part| robot.tied(part));
        let mut run = Run::empty(2, 2);
        for k in 0..100 {
            let u = if k < 50 { 3.0 } else { -3.0 };
            run.push(0.01 * f64::from(k), &[u, u], &[u, u]).unwrap();
        }
        let rms = vec![1.0; robot.n_signals()];
        let seen = Seen {
            runs: &[run],
            rms: &rms,
            ends: &[],
            observed: false,
            parts_of_one: false,
        };
        candidates(&robot, &seen, &SearchCriteria::DEFAULT)
    }

    fn channels(unshown: Option<&str>) -> Vec<&'static str> {
        let tried = tried(unshown);
        tried.into_iter().flat_map(|c| c.at).collect()
    }

    /// What a fit finds of gravity on a slope.
    fn of_slope(unshown: Option<&str>) -> Vec<String> {
        let tried = tried(unshown).into_iter();
        let slope = tried.filter(|c| c.meta.id == "gravity_slope");
        let own = |c: Candidate| {
            let parameters = c.model.parameters[c.own()].to_vec();
            parameters.into_iter().filter(|p| p.free).map(|p| p.name)
        };
        slope.flat_map(own).collect()
    }

    /// A vehicle that never turns says nothing of the force across its way.
    #[test]
    fn what_the_heading_would_show_is_held_where_it_stays() {
        let [along, across] = ["gravity_slope.cosine", "gravity_slope.sine"];
        assert_eq!(of_slope(None), [along, across]);
        assert_eq!(of_slope(Some("turning")), [along]);
    }

    #[test]
    fn nothing_is_tried_where_the_log_shows_nothing() {
        let all = channels(None);
        for channel in ["wheel.right", "body.forward", "body.yaw"] {
            assert!(all.contains(&channel), "{channel}");
        }
        for (part, hidden) in [
            ("turning", "body.yaw"),
            ("driving straight", "body.forward"),
        ] {
            let some = channels(Some(part));
            assert!(some.contains(&"wheel.right"), "{part}: {some:?}");
            // A change of the payload is one of the whole.
            assert!(some.contains(&"inertia.forward"), "{part}: {some:?}");
            assert!(!some.contains(&hidden), "{part}: {some:?}");
        }
    }
}
