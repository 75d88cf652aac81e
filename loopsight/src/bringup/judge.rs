//! What a motion tells about the wiring.

/// Which input a robot's motion looks like, compared with what each would do to the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Looks {
    /// Nothing was counted.
    Still,
    /// As if this input had been driven, forwards or not.
    Input(usize, bool),
    /// Like none of them.
    Unclear,
}

/// A motion less than this share of the expected one is none.
const STILL: f64 = 0.1;

/// Cosine from which on two motions look alike.
const ALIKE: f64 = 0.8;

/// Compares a motion with that of each input, signal by signal in units of the largest expected one.
///
/// ```text
/// cos_k = Σ_j m_j p_kj / (|m| |p_k|),   each signal divided by max_k |p_kj|
/// ```
pub(super) fn looks(moved: &[f64], expected: &[Vec<f64>], driven: usize) -> Looks {
    let scale: Vec<f64> = (0..moved.len())
        .map(|j| expected.iter().map(|p| p[j].abs()).fold(0.0, f64::max))
        .collect();
    let scaled = |v: &[f64]| -> Vec<f64> {
        let pairs = v.iter().zip(&scale);
        pairs
            .filter(|(_, s)| **s > 0.0)
            .map(|(v, s)| v / s)
            .collect()
    };
    let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let motion = scaled(moved);
    let own = norm(&scaled(&expected[driven]));
    if norm(&motion).is_nan() || norm(&motion) <= STILL * own {
        return Looks::Still;
    }
    let mut best = (0.0, Looks::Unclear);
    for (k, p) in expected.iter().enumerate() {
        let p = scaled(p);
        let dot: f64 = motion.iter().zip(&p).map(|(a, b)| a * b).sum();
        let cosine = dot / (norm(&motion) * norm(&p));
        if cosine.abs() > ALIKE && cosine.abs() > best.0 {
            best = (cosine.abs(), Looks::Input(k, cosine > 0.0));
        }
    }
    best.1
}

/// What was seen by the person: whether it turned, and which way.
pub(super) const SEEN: [&str; 4] = ["forwards", "backwards", "another", "nothing"];

/// Judges input `driven` (of `ids`) by what the person saw and what was counted; an error says what to do.
pub(super) fn judge(seen: &str, looks: Looks, driven: usize, ids: &[&str]) -> Result<(), String> {
    let id = ids[driven];
    let other = |k: usize| ids[k];
    match (seen, looks) {
        ("forwards", Looks::Input(k, true)) if k == driven => Ok(()),
        ("forwards", Looks::Input(k, false)) if k == driven => Err(format!(
            "the encoder of `{id}` counts backwards: swap its channels A and B, or set `encoder_reversed`"
        )),
        ("backwards", Looks::Input(k, false)) if k == driven => Err(format!(
            "the motor of `{id}` turns backwards: swap its two wires, or set `motor_reversed`"
        )),
        ("backwards", Looks::Input(k, true)) if k == driven => Err(format!(
            "motor and encoder of `{id}` are both reversed: swap the wires of both, or set \
             `motor_reversed` and `encoder_reversed`"
        )),
        ("another", Looks::Input(k, _)) if k != driven => Err(format!(
            "`{id}` drives the motor of `{}`: swap the outputs of the two motors",
            other(k)
        )),
        ("another", _) => Err(format!(
            "`{id}` drives another motor, and the encoders are not where the file says: check both"
        )),
        ("forwards" | "backwards", Looks::Input(k, _)) => Err(format!(
            "the encoder behind `{id}` is that of `{}`: swap the two encoders",
            other(k)
        )),
        ("nothing", Looks::Still) => Err(format!(
            "`{id}` moves nothing: check supply, fuse, enable pin and PWM; a stiff gear may need a higher --volts"
        )),
        ("nothing", _) => Err(format!(
            "counts came while nothing moved with `{id}`: check the encoders' wires and shields"
        )),
        (_, Looks::Still) => Err(format!(
            "the motor of `{id}` turns and nothing is counted: check the encoder's supply, wires and counter"
        )),
        _ => Err(format!(
            "what was counted with `{id}` fits none of the inputs: check the gains (`of`) of the model's \
             encoders, and that one wheel moves at a time"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const IDS: [&str; 2] = ["voltage_right", "voltage_left"];

    /// A robot with two wheels: path and heading for each of them driven.
    fn expected() -> Vec<Vec<f64>> {
        vec![vec![0.02, 0.15], vec![0.02, -0.15]]
    }

    #[test]
    fn motions_are_told_apart_by_input_and_sign() {
        let seen = |moved: [f64; 2]| looks(&moved, &expected(), 0);
        assert_eq!(seen([0.018, 0.16]), Looks::Input(0, true));
        assert_eq!(seen([-0.03, -0.2]), Looks::Input(0, false));
        assert_eq!(seen([0.02, -0.15]), Looks::Input(1, true));
        assert_eq!(seen([-0.005, 0.04]), Looks::Input(1, false));
        assert_eq!(seen([1e-4, 2e-3]), Looks::Still);
        assert_eq!(seen([f64::NAN, 0.1]), Looks::Still);
        // Both wheels at once.
        assert_eq!(seen([0.04, 0.0]), Looks::Unclear);
    }

    #[test]
    fn each_mistake_in_the_wires_has_its_remedy() {
        let says = |seen, looks| judge(seen, looks, 0, &IDS).err().unwrap_or_default();
        assert_eq!(says("forwards", Looks::Input(0, true)), "");
        for (seen, looks, part) in [
            ("forwards", Looks::Input(0, false), "counts backwards"),
            (
                "backwards",
                Looks::Input(0, false),
                "motor of `voltage_right` turns backwards",
            ),
            ("backwards", Looks::Input(0, true), "both reversed"),
            ("another", Looks::Input(1, true), "swap the outputs"),
            (
                "another",
                Looks::Input(0, true),
                "another motor, and the encoders",
            ),
            ("forwards", Looks::Input(1, true), "swap the two encoders"),
            ("nothing", Looks::Still, "moves nothing"),
            ("nothing", Looks::Input(0, true), "while nothing moved"),
            ("forwards", Looks::Still, "nothing is counted"),
            ("forwards", Looks::Unclear, "fits none of the inputs"),
        ] {
            assert!(
                says(seen, looks).contains(part),
                "{seen}: {}",
                says(seen, looks)
            );
        }
    }
}
