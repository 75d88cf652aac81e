//! The text of a page, and of the gallery.

use std::fmt::Write as _;

use loopsight::answers::{Explained, ExplainedParameter};
use loopsight_core::PlaceKind;
use loopsight_model::registry;

/// What stands above the gallery.
const GALLERY: &str = "\
# Every effect, and how it shows

Each effect of the library has a page: its equation, its parameters, where it attaches, what to do about it. Its picture shows
a machine that hides it. At the left is a stretch of what was measured, the plain model fitted to it, and the model with the
effect. At the right is what the effect does, where the model's own parameters are right: the force that is missing, or else the
residual of the free run, as a mean over that quantity of the machine which tells most of it, with its standard error.

The machines are those of [examples/hidden-effect](../../examples/hidden-effect/README.md). They rest, and are driven by a chirp, steps and ramps.
The pages say what `loopsight explain EFFECT` says. They are remade by

    cargo run --release -p loopsight-tests --example effect_gallery -- docs/effects
";

/// The places, in the order of the gallery.
const PLACES: [(PlaceKind, &str); 4] = [
    (PlaceKind::Input, "Between the command and the machine"),
    (PlaceKind::Effort, "Forces on the machine"),
    (PlaceKind::Output, "Between the machine and the log"),
    (PlaceKind::Body, "The machine itself"),
];

/// The gallery.
pub(crate) fn gallery(drawn: &dyn Fn(&str) -> bool) -> String {
    let mut text = GALLERY.to_owned();
    let effects = registry::effects();
    for (place, title) in PLACES {
        let mut here = effects.iter().filter(|m| m.places[0] == place).peekable();
        if here.peek().is_some() {
            let _ = write!(text, "\n## {title}\n");
        }
        for meta in here {
            let (summary, symptom) = (capital(meta.summary), capital(meta.symptom));
            let _ = write!(text, "\n### [`{0}`]({0}.md)\n\n{summary}.\n", meta.id);
            if drawn(meta.id) {
                let _ = write!(text, "\n![{0}]({0}.svg)\n", meta.id);
            }
            let _ = write!(text, "\n{symptom}.\n");
        }
    }
    text
}

/// Everything on the page of an effect but its picture.
pub(crate) fn declared(part: &Explained) -> String {
    let symptom = part.symptom.unwrap_or_default();
    let remedy = part.remedy.unwrap_or_default();
    let mut text = format!(
        "# `{}`\n\n{}.\n\n```text\n{}\n```\n\n**Symptom:** {symptom}.\n\n**Remedy:** {remedy}.\n",
        part.id,
        capital(part.summary),
        part.equation
    );
    let _ = write!(
        text,
        "\n| parameter | unit | default | in a fit | what |\n|---|---|---|---|---|\n{}",
        part.parameters.iter().map(parameter).collect::<String>()
    );
    text.push_str("\n| plant | channels that it attaches to |\n|---|---|\n");
    for home in &part.attaches_to {
        let _ = writeln!(text, "| `{}` | {} |", home.plant, home.channels.join(", "));
    }
    let _ = write!(
        text,
        "\nIn a model file:\n\n```toml\n{}\n```\n\nReference: {}.\n",
        part.example.trim_end(),
        part.reference
    );
    text
}

fn parameter(p: &ExplainedParameter) -> String {
    let default = p
        .default
        .map_or_else(|| "none".to_owned(), |d| d.to_string());
    let estimated = if p.estimated { "estimated" } else { "known" };
    let what = format!("{}; {}", p.doc, p.range).replace('|', "\\|");
    format!(
        "| `{}` ({}) | {} | {default} | {estimated} | {what} |\n",
        p.id, p.symbol, p.unit
    )
}

/// With a capital at its beginning.
fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_uppercase().chain(letters).collect()
    })
}
