//! `loopsight send`.

use crate::answers::{SendAnswer, SentParameter};
use crate::cli::arguments::SendArguments;
use crate::cli::output;
use crate::error::Result;
use crate::{Loop, SendOptions, Session};

pub(crate) fn run(arguments: &SendArguments) -> Result<()> {
    let control = Loop::from_file(&arguments.file)?;
    let session = Session::of_model(control.model()?);
    let line = arguments.line.clone();
    let answer = session.send(&control, &SendOptions { line })?;
    output::answer(&answer, &text(&answer), arguments.json)
}

fn list(parameters: &[SentParameter]) -> String {
    let of = |p: &SentParameter| {
        // The shortest digits that make the number which was sent.
        let text = format!("{} {} {}", p.name, p.value, p.unit);
        text.trim_end_matches(" 1").trim_end().to_owned()
    };
    parameters.iter().map(of).collect::<Vec<_>>().join(", ")
}

fn text(answer: &SendAnswer) -> String {
    let mut text = format!("{}\n  model: {}", answer.summary, list(&answer.parameters));
    for effect in &answer.effects {
        let (id, at) = (&effect.id, effect.at.join(", "));
        text.push_str(&format!("\n  {id} at {at}: {}", list(&effect.parameters)));
    }
    if answer.effects.is_empty() {
        text.push_str("\n  no effects");
    }
    text.push_str(if answer.learns {
        "\n  it learns"
    } else {
        "\n  it learns nothing"
    });
    text
}
