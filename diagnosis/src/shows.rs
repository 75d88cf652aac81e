//! Whether an effect can show in a recording.

use loopsight_core::{Channel, EffectMeta, Place, Shows};
use loopsight_model::model::Model;
use loopsight_model::run::Run;

use crate::criteria::SearchCriteria;
use crate::ends::{Ends, limited};

/// Share of the largest command below which a command counts as zero.
const ZERO: f64 = 1e-3;
/// Least deviation of the commands' sizes from their mean, as a share of their root mean square: what is in proportion
/// to the size changes by a hundredth then.
const SIZES: f64 = 0.01;

/// Whether an effect at the channels `at` can show in `runs`. A candidate that cannot is not tried, so that the cost of
/// a diagnosis does not grow with every effect of the library. `ends` are those of the plant's signals.
pub(crate) fn can_show(
    model: &Model,
    meta: &EffectMeta,
    at: &[&str],
    runs: &[Run],
    ends: &[Ends],
    criteria: &SearchCriteria,
) -> bool {
    let mut channels = (model.plant.channels.iter()).filter(|c| at.contains(&c.id));
    match meta.shows {
        Shows::Anywhere => true,
        Shows::NeverNegative => {
            (0..model.plant.inputs.len()).any(|input| goes_both_ways(input, runs))
                && channels.all(|c| never_negative(model, c, runs, criteria.negative))
        }
        Shows::OneRun => runs.len() == 1,
        Shows::OneMass => masses(model) == 1,
        Shows::InputAtZero => channels.any(|c| rests(c, runs, criteria.rests_s)),
        Shows::InputSizes => channels.any(|c| has_sizes(c, runs)),
        Shows::AtEnd => channels.any(|c| {
            let ends = limited(model, c).and_then(|signal| ends.get(signal));
            ends.is_some_and(|ends| ends.iter().any(Option::is_some))
        }),
    }
}

/// The rates of a plant at which inertia acts.
fn masses(model: &Model) -> usize {
    let rates = model.plant.channels.iter();
    rates.filter(|c| matches!(c.place, Place::Rate(_))).count()
}

/// What a recording lacks in which an effect [cannot show](can_show); none where it is not the recording that lacks it.
/// The `runs` may be windows, `parts_of_one`.
pub(crate) fn what_is_absent(
    meta: &EffectMeta,
    model: &Model,
    runs: &[Run],
    parts_of_one: bool,
) -> Option<&'static str> {
    Some(match meta.shows {
        // That is a matter of the plant.
        Shows::Anywhere | Shows::OneMass => return None,
        Shows::NeverNegative
            if !(0..model.plant.inputs.len()).any(|input| goes_both_ways(input, runs)) =>
        {
            "no input goes both ways"
        }
        Shows::NeverNegative => "what is measured goes below zero",
        Shows::OneRun if parts_of_one => {
            "a log this long is searched in windows; a shorter part can show it"
        }
        Shows::OneRun => "the recording has several runs",
        Shows::AtEnd => "nothing stays at an end of where it goes",
        Shows::InputSizes => "the commands all have one size",
        Shows::InputAtZero => "no input rests at zero between other values",
    })
}

/// Whether an input has values of both signs.
fn goes_both_ways(input: usize, runs: &[Run]) -> bool {
    let all = || runs.iter().flat_map(|run| values(run, input));
    all().any(|u| u > 0.0) && all().any(|u| u < 0.0)
}

/// Whether the signal measured at a channel has hardly anything below zero.
fn never_negative(model: &Model, channel: &Channel, runs: &[Run], most: f64) -> bool {
    let Place::Output(index) = channel.place else {
        return false;
    };
    let Some(signal) = model.measured_index(index) else {
        return false;
    };
    let values = runs
        .iter()
        .flat_map(|run| (0..run.len()).map(|k| run.sample(k)[signal]));
    let (mut all, mut below) = (0.0, 0.0);
    for y in values.filter(|y| y.is_finite()) {
        all += y * y;
        below += y.min(0.0).powi(2);
    }
    all > 0.0 && below <= most * most * all
}

/// Whether the input at a channel is zero for as long as `least` s, once it was not.
fn rests(channel: &Channel, runs: &[Run], least: f64) -> bool {
    let Place::Input(input) = channel.place else {
        return false;
    };
    let all = runs.iter().flat_map(|run| values(run, input));
    let largest = all.map(f64::abs).fold(0.0, f64::max);
    let driven = |u: f64| u.abs() > ZERO * largest;
    let resting = |run: &Run| {
        values(run, input)
            .zip(run.time().windows(2))
            .skip_while(|(u, _)| !driven(*u))
            .filter(|(u, _)| u.abs() <= ZERO * largest)
            .map(|(_, ends)| ends[1] - ends[0])
            .sum::<f64>()
    };
    largest > 0.0 && runs.iter().map(resting).sum::<f64>() >= least
}

/// Whether the commands of the input at a channel have several sizes.
fn has_sizes(channel: &Channel, runs: &[Run]) -> bool {
    let Place::Input(input) = channel.place else {
        return false;
    };
    let sizes = runs.iter().flat_map(|run| values(run, input)).map(f64::abs);
    let (mut n, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for size in sizes.filter(|size| size.is_finite()) {
        n += 1.0;
        sum += size;
        squares += size * size;
    }
    squares * n - sum * sum > SIZES * SIZES * squares * n
}

/// The values of an input, sample by sample.
fn values(run: &Run, input: usize) -> impl Iterator<Item = f64> + '_ {
    (0..run.len()).map(move |k| run.input(k)[input])
}

#[cfg(test)]
mod tests {
    use loopsight_plants as _;

    use super::*;

    const AXIS: &str = "[plant.dc_axis]\nK_A = -3.0\nK_C = 8.0\n\
                        [log.measured]\nspeed = { sensor = \"instantaneous\" }\n";

    /// Whether an effect can show in 4 s of 100 Hz with this input and this measured speed.
    fn shows(what: Shows, at: &str, input: fn(f64) -> f64, speed: fn(f64) -> f64) -> bool {
        let (axis, _) = Model::from_toml("axis.toml", AXIS).unwrap();
        let mut run = Run::empty(1, 1);
        for k in 0..400 {
            let t = 0.01 * f64::from(k);
            run.push(t, &[input(t)], &[speed(t)]).unwrap();
        }
        let meta = EffectMeta {
            shows: what,
            ..EffectMeta::PLAIN
        };
        can_show(&axis, &meta, &[at], &[run], &[], &SearchCriteria::DEFAULT)
    }

    #[test]
    fn a_magnitude_is_never_negative_though_the_input_is() {
        let magnitude = |input, speed| shows(Shows::NeverNegative, "sensor.speed", input, speed);
        let wave: fn(f64) -> f64 = |t| 5.0 * (3.0 * t).sin();
        let folded: fn(f64) -> f64 = |t| (5.0 * (3.0 * t).sin()).abs();
        assert!(magnitude(wave, folded));
        assert!(
            magnitude(wave, |t| (5.0 * (3.0 * t).sin()).abs() - 0.1),
            "noise"
        );
        assert!(
            magnitude(wave, |t| if t < 1.0 { f64::NAN } else { t }),
            "missing samples"
        );
        assert!(!magnitude(wave, wave), "it goes below zero");
        assert!(!magnitude(folded, folded), "nothing goes backwards");
        assert!(
            !shows(Shows::NeverNegative, "sensor.angle", wave, folded),
            "not measured"
        );
    }

    #[test]
    fn a_bridge_coasts_where_the_command_returns_to_zero() {
        let coasts = |input| shows(Shows::InputAtZero, "input", input, |t| t);
        assert!(coasts(|t| if (1.0..2.0).contains(&t) { -5.0 } else { 0.0 }));
        assert!(
            coasts(|t| if t < 3.7 { 5.0 } else { 1e-4 }),
            "hardly more than zero"
        );
        assert!(
            !coasts(|t| if t < 3.0 { 0.0 } else { 5.0 }),
            "at rest before it"
        );
        assert!(!coasts(|t| if t < 3.9 { 5.0 } else { 0.0 }), "too short");
        assert!(!coasts(|t| 5.0 * (3.0 * t + 0.1).sin()), "in passing");
        assert!(!coasts(|_| 0.0));
    }

    #[test]
    fn what_goes_with_the_size_of_the_command_shows_in_several_sizes() {
        let sizes = |input| shows(Shows::InputSizes, "input", input, |t| t);
        assert!(!sizes(|t| if t % 1.0 < 0.5 { 5.0 } else { -5.0 }));
        assert!(!sizes(|_| 0.0));
        assert!(sizes(|t| if t < 2.0 { 5.0 } else { 4.0 }));
        assert!(sizes(|t| 5.0 * (3.0 * t).sin()));
    }

    #[test]
    fn a_drift_shows_in_one_run() {
        assert!(shows(Shows::OneRun, "input", |_| 1.0, |_| 0.0));
        let (axis, _) = Model::from_toml("axis.toml", AXIS).unwrap();
        let meta = EffectMeta {
            shows: Shows::OneRun,
            ..EffectMeta::PLAIN
        };
        let two = [Run::empty(1, 1), Run::empty(1, 1)];
        let criteria = SearchCriteria::DEFAULT;
        assert!(!can_show(&axis, &meta, &["input"], &two, &[], &criteria));
    }

    /// A cart and its pole are two.
    #[test]
    fn a_mass_is_divided_where_there_is_one() {
        assert!(shows(Shows::OneMass, "inertia", |_| 1.0, |_| 0.0));
        let text = "[plant.flexible_joint]\n[log.measured]\nmotor_speed = { sensor = \"instantaneous\" }\n";
        let (joint, _) = Model::from_toml("joint.toml", text).unwrap();
        let meta = EffectMeta {
            shows: Shows::OneMass,
            ..EffectMeta::PLAIN
        };
        let runs = [Run::empty(1, 1)];
        let criteria = SearchCriteria::DEFAULT;
        assert!(!can_show(
            &joint,
            &meta,
            &["inertia.motor"],
            &runs,
            &[],
            &criteria
        ));
    }

    #[test]
    fn other_effects_show_anywhere() {
        assert!(shows(Shows::Anywhere, "shaft", |_| 1.0, |_| 0.0));
    }
}
