//! What to do next.

use loopsight_model::model::Model;

use crate::conclusion::{Advice, Conclusion, Explanation};
use crate::effect_at::EffectAt;

pub(crate) fn advice(
    model: &Model,
    verdict: Conclusion,
    best: Option<&Explanation>,
    explained: Option<&Explanation>,
) -> Vec<Advice> {
    let mut list = Vec::new();
    if let (Conclusion::EffectMissing, Some(best)) = (verdict, best) {
        list.extend(to_tell_apart(&best.place, &best.indistinguishable_from));
    }
    if verdict == Conclusion::DataInsufficient {
        let log =
            "the log is explained down to its noise, the test recording is not: what is missing";
        list.push(Advice {
            why: match explained {
                None => format!("{log} never shows in the log"),
                Some(by) => format!(
                    "with `{}` at {} {log} has some influence in the log, but not enough to identify it",
                    by.place.effect,
                    by.place.at.join(", ")
                ),
            },
            experiment: "fit to a recording with inputs like those of the test recording: several levels, slow ramps through zero, rests, both directions".to_owned(),
        });
    }
    if verdict == Conclusion::NotFitted {
        list.push(Advice {
            why: "from every start the model leaves as much as a constant would".to_owned(),
            experiment: "look at the signs and units of inputs and measured signals, at what the equations lack entirely, and give values or ranges to start from".to_owned(),
        });
    }
    if verdict == Conclusion::UnknownEffect {
        list.push(Advice {
            why: "no effect of the library explains what the model does not".to_owned(),
            experiment: format!(
                "record several levels of each input of `{}`, slow ramps through zero and rests, and look at the residual against each quantity on the page",
                model.plant.id
            ),
        });
    }
    list
}

/// Experiments that tell an effect from those of its class. One of a kind serves several of them: its command is that
/// for the first, and each reason says which pair it is for.
pub(crate) fn to_tell_apart(place: &EffectAt, class: &[EffectAt]) -> Vec<Advice> {
    let mut kinds: Vec<(&str, String)> = Vec::new();
    let advice = class.iter().map(|other| {
        let kind = separating(&place.effect, &other.effect);
        let pair = format!("--separate {} {}", named(place), named(other));
        let known = kinds.iter().find(|(known, _)| *known == kind);
        let first = known.map_or_else(|| pair.clone(), |(_, first)| first.clone());
        let why = format!(
            "these data cannot tell `{}` at {} from `{}` at {}",
            place.effect,
            place.at.join(", "),
            other.effect,
            other.at.join(", ")
        );
        let why = match first == pair {
            true => why,
            false => format!("{why} (`{pair}` for these)"),
        };
        let experiment =
            format!("{kind}; `loopsight experiment MODEL {first} -o plan.csv` makes it");
        if first == pair {
            kinds.push((kind, pair));
        }
        Advice { why, experiment }
    });
    advice.collect()
}

/// An effect with its channels, as the command `experiment` reads it.
fn named(place: &EffectAt) -> String {
    format!("{}@{}", place.effect, place.at.join("+"))
}

/// The experiment that separates two effects.
fn separating(a: &str, b: &str) -> &'static str {
    let either = |names: &[&str]| names.contains(&a) || names.contains(&b);
    if either(&[
        "input_delay",
        "actuator_lag",
        "sensor_delay",
        "sensor_lag",
        "sensor_window",
    ]) {
        "fast steps and a chirp up to the loop's bandwidth, sampled as fast as the sensor allows; for input against sensor delay, disturb the robot by hand: a disturbance passes the sensor only"
    } else if either(&["elastic_coupling"]) {
        "a chirp through the frequency at which it rings, small and large, and steps, sampled ten times in each swing: a spring rings at one frequency at any size"
    } else if either(&["lugre_friction"]) {
        "to and fro over ways of several lengths, some shorter than the friction takes to build up, very slowly and fast: a state of friction shows after each turn, its excess only where the motion creeps"
    } else if either(&["hysteresis"]) {
        "to and fro over ways of several lengths, from one side and from the other, slowly and again faster: a loop of hysteresis is as wide at any speed, and wider over longer ways"
    } else if either(&["end_stop", "overflow"]) {
        "slowly up to the limit and harder against it, several times, and the same range again from the other side"
    } else if either(&[
        "dead_zone",
        "coulomb_friction",
        "stribeck_friction",
        "input_saturation",
        "input_power",
        "bridge_coast",
        "pulse_coast",
        "gain_asymmetry",
    ]) {
        "several levels of the input, slow ramps through zero in both directions, and coasting from speed with the input at zero"
    } else if either(&["wheel_radius_mismatch", "sensor_scale", "encoder_ripple"]) {
        "a straight run and turns on the spot in both directions, with the position measured from outside"
    } else {
        "inputs of several levels and frequencies, both directions of motion, turns and straight runs"
    }
}
