//! Effects and where they act.

use loopsight_diagnosis::EffectAt;
use loopsight_model::registry;

/// An effect and where it acts, for a sentence: `coulomb_friction at wheel.right and wheel.left`.
pub fn place(place: &EffectAt) -> String {
    if place.at.is_empty() {
        place.effect.clone()
    } else {
        format!("{} at {}", place.effect, enumerated(&place.at))
    }
}

/// An effect and where it acts, for a table: `coulomb_friction @ wheel.right+wheel.left`.
pub fn place_in_table(place: &EffectAt) -> String {
    format!("{} @ {}", place.effect, place.at.join("+"))
}

/// An effect and where it acts, for a command: `coulomb_friction@wheel.right+wheel.left`.
pub fn place_to_type(place: &EffectAt) -> String {
    if place.at.is_empty() {
        place.effect.clone()
    } else {
        format!("{}@{}", place.effect, place.at.join("+"))
    }
}

/// An effect and where it acts, for an enumeration: `coulomb_friction (wheel.right, wheel.left)`.
pub(crate) fn place_in_brackets(place: &EffectAt) -> String {
    if place.at.is_empty() {
        place.effect.clone()
    } else {
        format!("{} ({})", place.effect, place.at.join(", "))
    }
}

/// `a`, `a and b`, `a, b and c`.
pub fn enumerated<T: AsRef<str>>(names: &[T]) -> String {
    match names {
        [] => String::new(),
        [one] => one.as_ref().to_owned(),
        [first @ .., last] => {
            let first: Vec<&str> = first.iter().map(AsRef::as_ref).collect();
            format!("{} and {}", first.join(", "), last.as_ref())
        }
    }
}

/// What an effect is, in a few words; empty where no effect has the id.
pub fn what_it_is(effect: &str) -> &'static str {
    registry::effects()
        .iter()
        .find(|meta| meta.id == effect)
        .map_or("", |meta| meta.summary)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_said_typed_and_listed() {
        let friction = EffectAt {
            effect: "coulomb_friction".into(),
            at: ["a", "b", "c"].map(str::to_owned).to_vec(),
        };
        assert_eq!(place(&friction), "coulomb_friction at a, b and c");
        assert_eq!(place_in_table(&friction), "coulomb_friction @ a+b+c");
        assert_eq!(place_to_type(&friction), "coulomb_friction@a+b+c");
        assert_eq!(place_in_brackets(&friction), "coulomb_friction (a, b, c)");
        let nowhere = EffectAt {
            at: vec![],
            ..friction
        };
        assert_eq!(place(&nowhere), "coulomb_friction");
        assert_eq!(place_to_type(&nowhere), "coulomb_friction");
        assert_eq!(what_it_is("no_such_effect"), "");
    }
}
