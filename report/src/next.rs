//! What to type next.

use loopsight_diagnosis::{Conclusion, Diagnosis, Improvement};

use crate::html::escape;
use crate::page::Context;
use crate::words::diagnosis::found;
use crate::words::place_to_type;

/// A sentence and a command.
type Hint = (String, String);

/// A list of sentences with their commands.
pub(crate) fn list(hints: &[Hint]) -> String {
    let items: String = hints
        .iter()
        .map(|(why, command)| {
            format!(
                "<li>{}<pre><code>{}</code></pre></li>",
                escape(why),
                escape(command)
            )
        })
        .collect();
    format!("<ol class=\"next\">{items}</ol>\n")
}

/// What to do after a diagnosis.
pub(crate) fn after_diagnosis(context: &Context, diagnosis: &Diagnosis) -> Vec<Hint> {
    let files = Files::of(context);
    match (diagnosis.verdict, found(diagnosis)) {
        (Conclusion::EffectMissing, Some(best)) => {
            let mut hints = Vec::new();
            if let Some(model) = &files.model {
                for other in &best.indistinguishable_from {
                    hints.push((
                        format!(
                            "Plan the experiment that tells {} from {}.",
                            best.place.effect, other.effect
                        ),
                        format!(
                            "loopsight experiment {} --separate {} {} -o experiment.csv",
                            word(model),
                            word(&place_to_type(&best.place)),
                            word(&place_to_type(other))
                        ),
                    ));
                }
                let new = with_suffix(model, &best.place.effect);
                let at: String = best
                    .place
                    .at
                    .iter()
                    .map(|c| format!(" {}", word(c)))
                    .collect();
                let at = if at.is_empty() {
                    at
                } else {
                    format!(" --at{at}")
                };
                hints.push((
                    format!("Write a model file with {} added.", best.place.effect),
                    format!(
                        "loopsight add {} {}{at} -o {}",
                        word(model),
                        word(&best.place.effect),
                        word(&new)
                    ),
                ));
                hints.push((
                    "Fit it, and look at what error is left.".into(),
                    format!(
                        "loopsight fit {} {}{} -o {} --html fit.html",
                        word(&new),
                        word(&files.log),
                        files.test(),
                        word(&with_suffix(&new, "fitted"))
                    ),
                ));
            }
            let both = match files.model {
                Some(_) => "Or let loopsight add and fit until nothing more is missing.",
                None => "Let loopsight add effects and fit until nothing more is missing.",
            };
            hints.push((
                both.into(),
                format!(
                    "loopsight improve {} -o {} --html improvement.html",
                    files.all(),
                    word(&files.improved())
                ),
            ));
            hints.push((
                "Read about the effect: its equation, how it shows, what helps against it.".into(),
                format!("loopsight explain {}", word(&best.place.effect)),
            ));
            hints
        }
        (Conclusion::NothingMissing, _) => vec![(
            "The model is ready for what this log exercises. Diagnose it on a log of another kind: other \
             speeds, turns, loads."
                .into(),
            files.on_another("diagnose", "diagnosis.html"),
        )],
        (Conclusion::EffectMissing | Conclusion::UnknownEffect, _) => vec![(
            "Record what is advised above and diagnose again. The charts above show what the residual \
             depends on."
                .into(),
            files.on_another("diagnose", "diagnosis.html"),
        )],
        (Conclusion::DataInsufficient | Conclusion::LogFaulty | Conclusion::NotFitted | Conclusion::Cancelled, _) => {
            again(&files, "diagnose")
        }
    }
}

/// What to do after an improvement.
pub(crate) fn after_improvement(context: &Context, improvement: &Improvement) -> Vec<Hint> {
    let files = Files::of(context);
    if improvement.best.is_none() {
        return again(&files, "improve");
    }
    let written = option(&context.command, &["-o", "--output"]);
    let mut hints = Vec::new();
    let best = written.clone().unwrap_or_else(|| files.improved());
    if written.is_none() {
        hints.push((
            "Write the best model to a file.".into(),
            format!("loopsight improve {} -o {}", files.all(), word(&best)),
        ));
    }
    hints.push((
        format!("Compare the improved model in {best} with a log that it has not seen."),
        format!(
            "loopsight compare {} ANOTHER_LOG --html comparison.html",
            word(&best)
        ),
    ));
    hints
}

fn again(files: &Files, verb: &str) -> Vec<Hint> {
    vec![
        (
            "Record again, and check the new log.".into(),
            "loopsight check NEW_LOG".into(),
        ),
        (
            "Then try again with the new log.".into(),
            files.on_another(verb, "page.html"),
        ),
    ]
}

/// The files of a command.
struct Files {
    model: Option<String>,
    log: String,
    test: Option<String>,
}

impl Files {
    fn of(context: &Context) -> Self {
        let log = match context.log_file.as_str() {
            "" => "LOG".into(),
            log => log.to_owned(),
        };
        Self {
            model: context.model_file.clone(),
            log,
            test: option(&context.command, &["--test"]),
        }
    }

    fn test(&self) -> String {
        match &self.test {
            Some(test) => format!(" --test {}", word(test)),
            None => String::new(),
        }
    }

    fn model(&self) -> String {
        match &self.model {
            Some(model) => format!("{} ", word(model)),
            None => String::new(),
        }
    }

    fn all(&self) -> String {
        format!("{}{}{}", self.model(), word(&self.log), self.test())
    }

    fn improved(&self) -> String {
        match &self.model {
            Some(model) => with_suffix(model, "improved"),
            None => "improved.toml".into(),
        }
    }

    fn on_another(&self, verb: &str, page: &str) -> String {
        format!("loopsight {verb} {}NEW_LOG --html {page}", self.model())
    }
}

/// `file` with `_suffix` before its extension, in the folder one is in.
fn with_suffix(file: &str, suffix: &str) -> String {
    let name = file.rsplit(['/', '\\']).next().unwrap_or(file);
    let stem = name.strip_suffix(".toml").unwrap_or(name);
    format!("{stem}_{suffix}.toml")
}

/// The value of an option in a command as it was typed.
fn option(command: &str, names: &[&str]) -> Option<String> {
    let words = words(command);
    words.iter().enumerate().find_map(|(at, word)| {
        if names.contains(&word.as_str()) {
            return words.get(at + 1).cloned();
        }
        let (name, value) = word.split_once('=')?;
        names.contains(&name).then(|| value.to_owned())
    })
}

/// The words of a command; in single quotes they may contain spaces.
fn words(command: &str) -> Vec<String> {
    let mut words = Vec::new();
    let (mut word, mut quoted) = (String::new(), false);
    for c in command.chars() {
        match c {
            '\'' => quoted = !quoted,
            ' ' if !quoted => words.push(std::mem::take(&mut word)),
            _ => word.push(c),
        }
    }
    words.push(word);
    words.retain(|w| !w.is_empty());
    words
}

/// A word for a shell.
fn word(text: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "_-./\\:+=,@%~".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_found_in_commands() {
        let command = "loopsight improve m.toml 'my log.csv' --test='b c.csv' -o best.toml";
        assert_eq!(option(command, &["--test"]).as_deref(), Some("b c.csv"));
        assert_eq!(
            option(command, &["-o", "--output"]).as_deref(),
            Some("best.toml")
        );
        assert_eq!(option(command, &["--html"]), None);
        assert_eq!(option("loopsight diagnose --test", &["--test"]), None);
    }

    #[test]
    fn words_are_safe_in_a_shell() {
        assert_eq!(word("a/b_c.csv"), "a/b_c.csv");
        assert_eq!(word("a b; rm"), "'a b; rm'");
        assert_eq!(word("it's"), "'it'\\''s'");
        assert_eq!(word(""), "''");
    }

    #[test]
    fn files_are_named_after_the_model() {
        assert_eq!(
            with_suffix("a/model.toml", "improved"),
            "model_improved.toml"
        );
        assert_eq!(with_suffix("", "x"), "_x.toml");
    }
}
