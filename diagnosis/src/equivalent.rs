//! Channels at which an effect does the same up to a factor.

use loopsight_core::{Channel, Place, Role};
use loopsight_model::model::Model;

/// Agreement of two derivatives: rounding over a few operations.
const SAME: f64 = 1e-9;

/// Whether two channels are equivalent: in every state and with every input, an effort at `a` does to the plant
/// what a constant times that effort at `b` does, and effects read the same signals at both. An example is
/// friction in volts at a motor's shaft, and as an acceleration at its load. An effect at `a` is then the effect
/// at `b` with other parameters, and no measurement tells the two apart.
pub(crate) fn equivalent(model: &Model, a: &Channel, b: &Channel) -> bool {
    let (Place::Effort(i), Place::Effort(j)) = (a.place, b.place) else {
        return false;
    };
    let read = |role: Role| a.read(role) == b.read(role);
    if i == j || !read(Role::Flow) || !read(Role::Position) {
        return false;
    }
    let mut factor = None;
    for at in [0.0, 0.7] {
        for (of_a, of_b) in answers(model, i, at).into_iter().zip(answers(model, j, at)) {
            if of_a.abs() <= SAME && of_b.abs() <= SAME {
                continue;
            }
            let ratio = of_a / of_b;
            let known = *factor.get_or_insert(ratio);
            if !ratio.is_finite() || ratio == 0.0 || (ratio - known).abs() > SAME * known.abs() {
                return false;
            }
        }
    }
    factor.is_some()
}

/// Whether `channel` is the one to keep of two equivalent channels: it has the unit of an input.
pub(crate) fn preferred(model: &Model, channel: &Channel, over: &Channel) -> bool {
    let of_input = |c: &Channel| model.plant.inputs.iter().any(|input| input.unit == c.unit);
    of_input(channel) && !of_input(over)
}

/// What one unit of an effort adds to the rates of the states, with state and input `away` from rest.
fn answers(model: &Model, effort: usize, away: f64) -> Vec<f64> {
    let nx = model.n_states();
    let x: Vec<f64> = (0..nx).map(|i| away * (1.0 + 0.3 * i as f64)).collect();
    let u: Vec<f64> = (0..model.plant.inputs.len())
        .map(|i| away * (1.0 + 0.2 * i as f64))
        .collect();
    let values = model.values();
    let rates = |size: f64| {
        let mut w = vec![0.0; model.n_efforts()];
        w[effort] = size;
        model.rates_at(&values, &x, &u, &w)
    };
    rates(1.0)
        .into_iter()
        .zip(rates(0.0))
        .map(|(with, without)| with - without)
        .collect()
}

#[cfg(test)]
mod tests {
    use loopsight_plants as _;

    use super::*;

    fn channel(model: &Model, id: &str) -> &'static Channel {
        let channels = model.plant.channels.iter();
        channels.into_iter().find(|c| c.id == id).unwrap()
    }

    #[test]
    fn the_shaft_of_a_motor_and_its_load_are_one_place() {
        let text = "[plant.dc_axis]\nK_A = -2.0\nK_C = 8.0\n[log.measured.speed]\n";
        let (axis, _) = Model::from_toml("axis.toml", text).unwrap();
        let [shaft, load] = ["shaft", "load"].map(|id| channel(&axis, id));
        assert!(equivalent(&axis, shaft, load) && equivalent(&axis, load, shaft));
        assert!(preferred(&axis, shaft, load) && !preferred(&axis, load, shaft));
    }

    #[test]
    fn two_wheels_are_two_places() {
        let text = "[plant.ddmr]\nK_A = -15.0\nK_B = 0.0\nK_C = 0.1\nK_D = -9.0\nK_E = 0.0\nK_F = 0.6\n\
                    half_track = 0.13\nwheel_radius = 0.05\n[log.measured.linear_velocity]\n";
        let (robot, _) = Model::from_toml("robot.toml", text).unwrap();
        let [right, left] = ["wheel.right", "wheel.left"].map(|id| channel(&robot, id));
        assert!(!equivalent(&robot, right, left));
    }
}
