//! The person in front of the robot.

use std::io::BufRead as _;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, TryRecvError, channel};
use std::time::Duration;

use super::bench::Bench;
use crate::cli::failure::Failure;
use crate::cli::output;

/// Answers, line by line, from standard input.
pub(super) struct Person {
    answers: Receiver<String>,
    interrupted: Arc<AtomicBool>,
}

/// How often it is looked whether somebody pressed Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);

impl Person {
    pub(super) fn new(interrupted: Arc<AtomicBool>) -> Self {
        let (say, hear) = channel();
        // It ends with the process, or when nobody listens any more.
        std::thread::spawn(move || {
            for line in std::io::stdin().lock().lines() {
                let Ok(line) = line else { return };
                if say.send(line.trim().to_lowercase()).is_err() {
                    return;
                }
            }
        });
        Self {
            answers: hear,
            interrupted,
        }
    }

    fn gone() -> Failure {
        Failure::work("nobody answers: bring-up needs a person who looks at the robot")
    }

    /// The answer to a question, while nothing is driven.
    pub(super) fn answer(&self, question: &str) -> Result<String, Failure> {
        output::note(question);
        loop {
            match self.answers.recv_timeout(LOOK) {
                Ok(answer) => return Ok(answer),
                Err(RecvTimeoutError::Disconnected) => return Err(Self::gone()),
                Err(RecvTimeoutError::Timeout) if self.interrupted.load(Ordering::SeqCst) => {
                    return Err(Failure::work("stopped by Ctrl-C"));
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// The answer, while the robot is kept at 0.
    pub(super) fn answer_at(
        &self,
        bench: &mut Bench<'_>,
        question: &str,
    ) -> Result<String, Failure> {
        output::note(question);
        loop {
            bench.rest()?;
            match self.answers.try_recv() {
                Ok(answer) => return Ok(answer),
                Err(TryRecvError::Disconnected) => return Err(Self::gone()),
                // A simulated robot's clock does not wait for anybody.
                Err(TryRecvError::Empty) => {
                    match self.answers.recv_timeout(Duration::from_millis(1)) {
                        Ok(answer) => return Ok(answer),
                        Err(RecvTimeoutError::Timeout) => {}
                        Err(RecvTimeoutError::Disconnected) => return Err(Self::gone()),
                    }
                }
            }
        }
    }

    /// One of these words, asked for until it is one of them.
    pub(super) fn choose_at(
        &self,
        bench: &mut Bench<'_>,
        question: &str,
        words: &[&'static str],
    ) -> Result<&'static str, Failure> {
        let full = format!("{question} [{}]", words.join("/"));
        loop {
            let answer = self.answer_at(bench, &full)?;
            if let Some(word) = words.iter().find(|w| **w == answer) {
                return Ok(word);
            }
            output::note(&format!("found `{answer}`, expected {}", words.join(", ")));
        }
    }
}
