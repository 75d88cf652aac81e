//! The residual force in words, and its expression as TOML.

use loopsight_model::expression::{EffectDraft, ParameterDraft};
use loopsight_model::model::Model;

use crate::figure::significant;

use super::dependence::ForceDependence;
use super::known::resembles;
use super::place::{Group, Law};
use super::shape::{Shape, Variable};

/// Name of an effect that is made of a residual force.
const NAME: &str = "discovered";
/// Quantities that are named.
const NAMED: usize = 3;
/// Significant digits of a number in an expression.
const DIGITS: i32 = 4;

/// `a`, `a and b`, `a, b and c`.
fn both(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// What the force depends on; shares below `telling` are left out.
pub(super) fn statement(
    at: &[String],
    depends_on: &[ForceDependence],
    expression: Option<(&[Law], f64)>,
    telling: f64,
) -> String {
    let at = both(at);
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    let named: Vec<String> = depends_on
        .iter()
        .filter(|d| d.share_of_variance > telling)
        .take(NAMED)
        .map(|d| format!("{}: {}", d.quantity, percent(d.share_of_variance)))
        .collect();
    let found = expression.map(|(laws, share)| {
        let mut names: Vec<String> = Vec::new();
        for variable in laws
            .iter()
            .flat_map(|l| &l.terms)
            .flat_map(|t| t.0.variables())
        {
            if !names.iter().any(|n| n == variable.name()) {
                names.push(variable.name().to_owned());
            }
        }
        let of = if names.is_empty() {
            "a constant".to_owned()
        } else {
            format!("an expression in {}", both(&names))
        };
        // A constant force has no variance to account for.
        if share > 0.0 {
            format!("{of} accounts for {}", percent(share))
        } else {
            format!("it begins with {of}")
        }
    });
    let depends = if named.is_empty() {
        format!("the residual force at {at} depends on no single quantity")
    } else {
        format!(
            "the residual force at {at} depends on {} of its variance",
            named.join(", on ")
        )
    };
    match found {
        Some(found) => format!("{depends}; {found}"),
        None => format!("{depends}; no expression stands out from the noise"),
    }
}

/// `[[effect]]` entries, and the force with its numbers.
pub(super) fn written(model: &Model, group: &Group, laws: &[Law]) -> (String, String) {
    let name = free_name(model);
    let drafts: Vec<(EffectDraft, String)> =
        laws.iter().map(|law| draft(&name, group, law)).collect();
    let toml: Vec<String> = drafts.iter().map(|(d, _)| d.to_toml()).collect();
    let forces: Vec<&str> = drafts.iter().map(|(_, f)| f.as_str()).collect();
    (toml.join("\n"), forces.join("; "))
}

/// A name that no effect of the model has: `discovered`, `discovered_2`, and so on.
fn free_name(model: &Model) -> String {
    let mut name = NAME.to_owned();
    let mut number = 1;
    while model.effects.iter().any(|e| e.meta.id == name) {
        number += 1;
        name = format!("{NAME}_{number}");
    }
    name
}

/// A law as an effect with parameters, and as one line with numbers.
fn draft(name: &str, group: &Group, law: &Law) -> (EffectDraft, String) {
    let unit = group.channels[law.at[0]].unit;
    let mut parameters = Vec::new();
    let mut scales: Vec<ParameterDraft> = Vec::new();
    let (mut force, mut plain) = (String::new(), String::new());
    for (k, (shape, number)) in law.terms.iter().enumerate() {
        let id = if law.terms.len() == 1 {
            "c".to_owned()
        } else {
            format!("c{}", k + 1)
        };
        let text = shape.text(&mut |variable, value| {
            let value = significant(value, DIGITS);
            let known = scales.iter().find(|s| s.value == Some(value));
            if let Some(known) = known {
                return known.id.clone();
            }
            let id = if scales.is_empty() {
                "s".to_owned()
            } else {
                format!("s{}", scales.len() + 1)
            };
            scales.push(ParameterDraft {
                id: id.clone(),
                value: Some(value),
                unit: unit_of(group, variable),
                range: Some([value / 10.0, value * 10.0].map(|v| significant(v, DIGITS))),
                held: true,
                doc: match shape {
                    Shape::Radiation(..) => {
                        format!("temperature of what {} radiates to", variable.name())
                    }
                    _ => format!(
                        "width over which the direction of {} counts as turning",
                        variable.name()
                    ),
                },
            });
            id
        });
        let bare = shape.text(&mut |_, value| significant(value, DIGITS).to_string());
        let number = significant(*number, DIGITS);
        let (times, plainly) = match shape {
            Shape::One => (id.clone(), format!("{}", number.abs())),
            _ => (
                format!("{id} * {text}"),
                format!("{} * {bare}", number.abs()),
            ),
        };
        force.push_str(if k == 0 { "" } else { " + " });
        force.push_str(&times);
        plain.push_str(match (k == 0, number < 0.0) {
            (true, true) => "-",
            (true, false) => "",
            (false, true) => " - ",
            (false, false) => " + ",
        });
        plain.push_str(&plainly);
        parameters.push(ParameterDraft {
            id,
            value: Some(number),
            unit: coefficient_unit(group, unit, shape),
            range: None,
            held: false,
            doc: resembles(shape).map_or_else(String::new, |known| format!("acts like {known}")),
        });
    }
    parameters.extend(scales);
    let draft = EffectDraft {
        name: name.to_owned(),
        at: law
            .at
            .iter()
            .map(|c| group.channels[*c].id.to_owned())
            .collect(),
        force,
        summary: "an expression for the residual force: edit it to describe what it is".to_owned(),
        parameters,
    };
    (draft, plain)
}

fn unit_of(group: &Group, variable: Variable) -> String {
    group
        .quantities
        .iter()
        .find(|q| q.variable == variable)
        .map_or_else(|| "1".to_owned(), |q| q.unit.clone())
}

/// The unit of a term's coefficient: that of the force over those of what it is multiplied with.
fn coefficient_unit(group: &Group, force: &str, shape: &Shape) -> String {
    let mut powers: Vec<(String, i32)> = Vec::new();
    for (variable, power) in shape.powers() {
        let unit = unit_of(group, variable);
        match powers.iter_mut().find(|p| p.0 == unit) {
            Some(known) => known.1 += power,
            None => powers.push((unit, power)),
        }
    }
    let mut unit = force.to_owned();
    for (of, power) in powers {
        let of = if of.contains(['/', ' ', '^']) {
            format!("({of})")
        } else {
            of
        };
        unit.push_str(&match power {
            1 => format!("/{of}"),
            _ => format!("/{of}^{power}"),
        });
    }
    unit
}
