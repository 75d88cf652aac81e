//! The committed recordings: one folder per effect, and an index.

use std::fs;
use std::path::Path;

use loopsight_recordings::{RecordingError, output};

use crate::error::HiddenError;
use crate::truth::Concealed;
use crate::{Experiment, Hidden, Recording, Robot, catalogue, nrmse, overall, record, refit};

/// Seed of the committed logs to fit to; that of the test logs is one more.
const SEED: u64 = 1;
/// The index stands between these lines of the README.
const BEGIN: &str = "<!-- index: written by the program, changes are lost -->";
const END: &str = "<!-- end of the index -->";

/// Writes `folder/<case>/{model.toml, prbs.csv, multi_level.csv, truth.toml}` for every entry of
/// [`catalogue`] at size 1 (`mixed.csv` where that is [`Robot::lesson`]), the same for both clean
/// machines of motors and wheels, and the index in `folder/README.md`, whose other text
/// is kept.
///
/// # Errors
///
/// [`HiddenError`] when something cannot be written.
pub fn write_library(folder: &Path) -> Result<(), HiddenError> {
    let mut index = String::from(
        "| folder | robot | what is hidden | at | value a fit should find | change | after refit | on test | floor |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    for robot in [Robot::Twil, Robot::Axis] {
        let name = robot.case(None);
        let (log, test) = write_pair(&folder.join(&name), robot, &[])?;
        row(
            &mut index,
            &name,
            [robot.name(), "nothing", "", "", ""],
            &log,
            &test,
        );
    }
    for (robot, effect) in catalogue() {
        let name = robot.case(Some(effect));
        let (log, test) = write_pair(&folder.join(&name), robot, &[(effect, 1.0)])?;
        let truth = log.truth.hidden.first();
        let at = truth.map_or(String::new(), |h| h.at.join(", "));
        let values = truth.map_or(String::new(), values);
        let doc = truth.map_or(effect.doc(), |h| h.doc);
        let change = percent(visibility(
            robot,
            effect,
            1.0,
            robot.lesson(Some(effect)),
            SEED,
        )?);
        let words = [robot.name(), doc, &at, &values, &change];
        row(&mut index, &name, words, &log, &test);
    }
    write_index(&folder.join("README.md"), &index)
}

/// A line of the index.
fn row(index: &mut String, name: &str, words: [&str; 5], log: &Recording, test: &Recording) {
    let fit = refit(log);
    let [left, on_test, floor] = [fit.left(log), fit.left(test), log.floor()].map(percent);
    index.push_str(&format!(
        "| [`{name}`]({name}) | {} | {left} | {on_test} | {floor} |\n",
        words.join(" | ")
    ));
}

/// The values of a hidden effect in one line.
fn values(of: &Concealed) -> String {
    let (listed, mark) = match (of.fitted.is_empty(), of.approximate) {
        (true, _) => (&of.physical, "(parts) "),
        (false, true) => (&of.fitted, "about: "),
        (false, false) => (&of.fitted, ""),
    };
    let all: Vec<String> = listed
        .iter()
        .map(|q| {
            let unit = if q.unit == "1" { "" } else { q.unit };
            let value = crate::truth::significant(q.value, 4);
            format!("{} {value} {unit}", q.name).trim_end().to_owned()
        })
        .collect();
    format!("{mark}{}", all.join(", "))
}

/// How much an effect changes what is measured: root mean square of the difference to the clean
/// machine under the same commands, over the standard deviation of the clean signal, root mean
/// square over signals, without rounding to counts. What a fit can then hide in its parameters is
/// not taken off.
///
/// # Errors
///
/// As [`record`].
pub fn visibility(
    robot: Robot,
    effect: Hidden,
    size: f64,
    experiment: Experiment,
    seed: u64,
) -> Result<f64, HiddenError> {
    let clean = record(robot, &[], experiment, seed)?;
    let with = record(robot, &[(effect, size)], experiment, seed)?;
    Ok(overall(&nrmse(&clean.exact, &with.exact)))
}

/// Writes one folder; returns the recording to fit to and the test.
fn write_pair(
    folder: &Path,
    robot: Robot,
    effects: &[(Hidden, f64)],
) -> Result<(Recording, Recording), HiddenError> {
    fs::create_dir_all(folder).map_err(|e| io(folder, e))?;
    let lesson = robot.lesson(effects.first().map(|(effect, _)| *effect));
    let log = record(robot, effects, lesson, SEED)?;
    log.write_csv(&folder.join(format!("{}.csv", lesson.name())))?;
    let test = record(robot, effects, Experiment::MultiLevel, SEED + 1)?;
    test.write_csv(&folder.join("multi_level.csv"))?;
    write(&folder.join("model.toml"), &log.model_toml)?;
    write(&folder.join("truth.toml"), &log.truth.to_toml())?;
    Ok((log, test))
}

/// Puts the index into the README, or makes one that is nothing else.
fn write_index(path: &Path, index: &str) -> Result<(), HiddenError> {
    let old = fs::read_to_string(path).unwrap_or_else(|_| format!("{BEGIN}\n{END}\n"));
    let block = format!("{BEGIN}\n\n{index}\n{END}");
    let text = match (old.find(BEGIN), old.find(END)) {
        (Some(from), Some(to)) if from < to => {
            format!("{}{block}{}", &old[..from], &old[to + END.len()..])
        }
        _ => format!("{old}\n{block}\n"),
    };
    write(path, &text)
}

fn write(path: &Path, text: &str) -> Result<(), HiddenError> {
    output::save(path, text.as_bytes()).map_err(RecordingError::from)?;
    Ok(())
}

fn io(path: &Path, source: std::io::Error) -> HiddenError {
    HiddenError::Io {
        path: path.to_owned(),
        source,
    }
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_index_replaces_itself_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("README.md");
        fs::write(&path, format!("before\n{BEGIN}\nold\n{END}\nafter\n")).unwrap();
        for _ in 0..2 {
            write_index(&path, "new").unwrap();
            let text = fs::read_to_string(&path).unwrap();
            assert_eq!(text, format!("before\n{BEGIN}\n\nnew\n{END}\nafter\n"));
        }
    }
}
