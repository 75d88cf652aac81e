//! The person in front of the robot, as the steps of a bring-up see them.

use std::time::Duration;

use super::bench::Bench;
use crate::error::{Error, Result};
use crate::watch::CancelToken;

/// A person who watches the robot and answers.
pub(crate) trait Person {
    /// Shows a question.
    fn ask(&mut self, question: &str);
    /// What was answered, within this time.
    fn reply(&mut self, wait: Duration) -> Reply;
    /// Shows the result of a step.
    fn tell(&mut self, result: &str);
}

/// An answer, or none.
pub(crate) enum Reply {
    /// A line, in lower case.
    Said(String),
    /// Nothing yet.
    NotYet,
    /// The person has left.
    Gone,
}

/// How often a wish to stop is looked for.
const LOOK: Duration = Duration::from_millis(50);

fn gone() -> Error {
    Error::work("no answer: bring-up needs a person who watches the robot")
}

/// The answer to a question, while nothing is driven.
pub(super) fn answer(
    person: &mut dyn Person,
    cancel: &CancelToken,
    question: &str,
) -> Result<String> {
    person.ask(question);
    loop {
        match person.reply(LOOK) {
            Reply::Said(answer) => return Ok(answer),
            Reply::Gone => return Err(gone()),
            Reply::NotYet if cancel.is_cancelled() => {
                return Err(Error::work("stopped by Ctrl-C"));
            }
            Reply::NotYet => {}
        }
    }
}

/// The answer, while the robot is kept at 0.
pub(super) fn answer_at(
    person: &mut dyn Person,
    bench: &mut Bench<'_>,
    question: &str,
) -> Result<String> {
    person.ask(question);
    loop {
        bench.rest()?;
        // A simulated robot's clock does not wait for a person.
        match person.reply(Duration::from_millis(1)) {
            Reply::Said(answer) => return Ok(answer),
            Reply::Gone => return Err(gone()),
            Reply::NotYet => {}
        }
    }
}

/// One of these words, asked for until it is one of them.
pub(super) fn choose_at(
    person: &mut dyn Person,
    bench: &mut Bench<'_>,
    question: &str,
    words: &[&'static str],
) -> Result<&'static str> {
    let full = format!("{question} [{}]", words.join("/"));
    loop {
        let answer = answer_at(person, bench, &full)?;
        if let Some(word) = words.iter().find(|w| **w == answer) {
            return Ok(word);
        }
        person.ask(&format!("found `{answer}`, expected {}", words.join(", ")));
    }
}
