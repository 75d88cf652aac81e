//! The inverse of what lies between command and plant, found by solving equations.

/// Largest change of a command per change of the wanted input. Across a dead zone the exact inverse jumps, and the
/// least noise would toggle the command between its two sides.
const STEEPEST: f64 = 50.0;
/// Relative change at which a solution stands.
const CLOSE: f64 = 1e-10;
/// Turns over all commands, where they act on each other (a supply that all of them load).
const TURNS: usize = 30;
/// Doublings of a bracket after which a command counts as having no effect.
const DOUBLINGS: usize = 40;

/// Finds commands `V` with `E(V) = u`, where `E` is known by evaluating it.
///
/// ```text
/// V_i <- the v of least size with E_i(V_1, …, v, …, V_n) = u_i     in turns, until no V_i changes
/// |V_i| <= 50 |u_i - E_i(V_i = 0)|
/// ```
///
/// Each line is a scalar equation in a function that grows with `v`, flat parts allowed (dead
/// zone): bracketed by doubling, then solved by the Illinois method, with a halving in every third
/// step for where the function is not smooth. Where nothing reaches `u_i` (saturation), the least `v` that comes
/// nearest is taken. The second line rounds the jump at a dead zone off; outside it changes nothing.
///
/// Reference: M. Dowell, P. Jarratt (1971), "A modified regula falsi method for computing the root
/// of an equation", BIT 11, 168–174; D. M. Young (1971), "Iterative Solution of Large Linear
/// Systems", ch. 3 (solving in turns).
#[derive(Clone, Debug, Default)]
pub(super) struct Inversion {
    wanted: Vec<f64>,
    tried: Vec<f64>,
}

impl Inversion {
    pub(super) fn new(n: usize) -> Self {
        Self {
            wanted: vec![0.0; n],
            tried: vec![0.0; n],
        }
    }

    /// Replaces the inputs wanted by commands; `forward` replaces commands by inputs. False where
    /// an input is out of reach, or the commands do not come to rest.
    pub(super) fn solve(&mut self, input: &mut [f64], forward: &mut dyn FnMut(&mut [f64])) -> bool {
        self.wanted.copy_from_slice(input);
        if input.iter().any(|v| !v.is_finite()) {
            return false;
        }
        for _ in 0..TURNS {
            let (mut reached, mut moved) = (true, false);
            for i in 0..input.len() {
                let tried = &mut self.tried;
                let mut at = |v: f64| {
                    tried.copy_from_slice(input);
                    tried[i] = v;
                    forward(tried);
                    tried[i]
                };
                let (v, found) = least(self.wanted[i], &mut at);
                reached &= found;
                moved |= (v - input[i]).abs() > 1e-7 * v.abs().max(1e-6);
                input[i] = v;
            }
            if !moved {
                return reached;
            }
        }
        false
    }
}

/// The `v` of least size with `e(v) = wanted`, and whether there is one; else the least that comes
/// nearest.
fn least(wanted: f64, e: &mut dyn FnMut(f64) -> f64) -> (f64, bool) {
    let rest = e(0.0);
    let way = wanted - rest;
    if way == 0.0 || !way.is_finite() {
        return (0.0, way == 0.0);
    }
    let sign = way.signum();
    let mut gap = |v: f64, goal: f64| sign * (e(sign * v) - goal);
    let hair = 1e-9 * way.abs();
    let (mut low, mut high, mut goal) = (0.0, way.abs(), wanted);
    let mut there = gap(high, goal);
    // What came nearest; flat before it grew is a dead zone, flat or falling after that a limit.
    let mut best = (0.0, -way.abs());
    for doubling in 0..=DOUBLINGS {
        if there >= 0.0 {
            break;
        }
        let grown = best.1 > hair - way.abs();
        if there > best.1 + hair {
            best = (high, there);
        } else if grown || !there.is_finite() || doubling == DOUBLINGS {
            goal = wanted + sign * (best.1 - hair);
            (low, high) = (0.0, best.0);
            there = gap(high, goal);
            break;
        }
        low = high;
        high *= 2.0;
        there = gap(high, goal);
    }
    let found = goal == wanted;
    let mut here = gap(low, goal);
    let mut side = 0;
    for turn in 0..120 {
        if high - low <= CLOSE * high || there == 0.0 {
            break;
        }
        let mut v = (low * there - high * here) / (there - here);
        // Halved now and then: beside a limit the secant creeps.
        if turn % 3 == 2 || !(v > low && v < high) {
            v = 0.5 * (low + high);
        }
        let value = gap(v, goal);
        if value < 0.0 {
            low = v;
            here = value;
            if side == -1 {
                there *= 0.5;
            }
            side = -1;
        } else {
            high = v;
            there = value;
            if side == 1 {
                here *= 0.5;
            }
            side = 1;
        }
    }
    (sign * high.min(STEEPEST * way.abs()), found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn inverse(wanted: f64, e: impl Fn(f64) -> f64) -> (f64, bool) {
        least(wanted, &mut |v| e(v))
    }

    fn dead(v: f64) -> f64 {
        if v.abs() > 1.5 {
            v - 1.5 * v.signum()
        } else {
            0.0
        }
    }

    #[test]
    fn gains_offsets_and_dead_zones_are_inverted() {
        for wanted in [-7.0, -0.3, 0.2, 4.0] {
            let (v, found) = inverse(wanted, |v| 0.7 * v + 0.4);
            assert!(found && (0.7 * v + 0.4 - wanted).abs() < 1e-9, "{wanted}");
            let (v, found) = inverse(wanted, dead);
            assert!(
                found && (v - wanted - 1.5 * wanted.signum()).abs() < 1e-8,
                "{v}"
            );
        }
        assert_eq!(inverse(0.0, dead), (0.0, true));
        // The jump is a steep slope.
        let (v, _) = inverse(0.001, dead);
        assert!((v - 0.05).abs() < 1e-12, "{v}");
        // Across a curve, from a guess that is far off.
        let (v, found) = inverse(20.0, |v: f64| v * v.abs() * 1e-4 + 1e-6 * v);
        assert!(found && (v * v * 1e-4 + 1e-6 * v - 20.0).abs() < 1e-6);
    }

    #[test]
    fn out_of_reach_is_said_and_the_least_command_taken() {
        for (wanted, expected) in [(9.0, 6.0), (-30.0, -6.0)] {
            let (v, found) = inverse(wanted, |v: f64| v.clamp(-6.0, 6.0));
            assert!(!found && (v - expected).abs() < 1e-5, "{v}");
        }
        let (v, found) = inverse(5.999, |v: f64| v.clamp(-6.0, 6.0));
        assert!(found && (v - 5.999).abs() < 1e-8);
    }

    /// Two motors on one supply: each lowers the voltage of both.
    #[test]
    fn commands_that_act_on_each_other_are_solved_in_turns() {
        let mut forward = |u: &mut [f64]| {
            let load = 0.001 * (u[0] * u[0] + u[1] * u[1]);
            u.iter_mut().for_each(|v| *v *= 1.0 - load);
        };
        let mut inversion = Inversion::new(2);
        let mut u = [6.0, -4.0];
        assert!(inversion.solve(&mut u, &mut forward));
        forward(&mut u);
        assert!(
            (u[0] - 6.0).abs() < 1e-5 && (u[1] + 4.0).abs() < 1e-5,
            "{u:?}"
        );
        let mut u = [f64::NAN, 1.0];
        assert!(!inversion.solve(&mut u, &mut forward));
    }
}
