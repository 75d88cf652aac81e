//! What is in a log, whatever wrote it: channels with unit, rate, range and what is missing.

use loopsight_core::unit::{parse, split_name};
use loopsight_formats::{Kind, Log, Values};

use crate::channels::{cut, last};
use crate::median::median;
use crate::naming::{self, brackets};
use crate::source::Source;
use crate::table::Table;

/// A pause is longer than so many periods.
const GAP: f64 = 5.0;
/// Words of a text that are shown.
const WORDS: usize = 12;
/// Beginnings of the names of columns of time stamps.
const TIME_NAMES: [&str; 3] = ["time", "timestamp", "stamp"];

/// What is in a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Inventory {
    /// `CSV`, `WPILOG`, `ULog` and so on.
    pub format: String,
    /// From the first time stamp to the last, s; none without time stamps.
    pub duration: Option<f64>,
    /// Number of runs that the file itself separates.
    pub runs: usize,
    /// The channels, in the order of the file.
    pub channels: Vec<ChannelFacts>,
    /// What the file says of itself, and where it ends too early.
    pub notes: Vec<String>,
}

/// What is known of a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelFacts {
    /// Its path or the header of its column.
    pub path: String,
    /// Kind of its values.
    pub kind: Kind,
    /// Its type in the file's own words; empty where the file has none.
    pub declared: String,
    /// Its unit, and why it is taken to be that.
    pub unit: Option<UnitFact>,
    /// Number of values, those that are missing included.
    pub values: usize,
    /// Number of those that are missing.
    pub missing: usize,
    /// Smallest and largest number.
    pub range: Option<(f64, f64)>,
    /// The first texts that occur.
    pub words: Vec<String>,
    /// Its time stamps; none without a clock.
    pub clock: Option<ClockFacts>,
    /// It is the column of time stamps itself.
    pub is_time: bool,
}

/// A unit and where it comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnitFact {
    /// The unit.
    pub unit: String,
    /// Why it is taken to be that.
    pub why: &'static str,
}

/// How a sequence of time stamps runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockFacts {
    /// The first and the last stamp, s.
    pub span: (f64, f64),
    /// Median time between stamps, s; 0 where most rows share one.
    pub period: f64,
    /// Median deviation from it, s.
    pub jitter: f64,
    /// Pauses of more than five periods.
    pub gaps: usize,
    /// The longest, s.
    pub longest_gap: f64,
    /// How often time goes back.
    pub backwards: usize,
}

impl Source {
    /// What is in the log.
    pub fn inventory(&self) -> Inventory {
        match self {
            Source::Table(table) => of_table(table, "CSV"),
            Source::SysId(log) => of_table(&log.table(), "SysId JSON"),
            Source::Channels(log) => of_channels(log),
        }
    }
}

fn of_channels(log: &Log) -> Inventory {
    let clocks: Vec<Option<ClockFacts>> = log.clocks.iter().map(|c| clock(&[&c.time])).collect();
    let channels: Vec<ChannelFacts> = log
        .channels
        .iter()
        .map(|channel| {
            let info = &channel.info;
            let (missing, range, words) = match &channel.values {
                Values::Numbers(values) => {
                    let (missing, range) = numbers(values.iter().copied());
                    (missing, range, Vec::new())
                }
                Values::Texts(texts) => {
                    let missing = texts.iter().filter(Option::is_none).count();
                    let words = texts.words().iter().take(WORDS).cloned().collect();
                    (missing, None, words)
                }
                Values::Opaque(_) => (0, None, Vec::new()),
            };
            ChannelFacts {
                path: info.path.clone(),
                kind: info.kind,
                declared: info.declared.clone(),
                unit: unit(info.unit.as_deref(), &info.path),
                values: channel.values.len(),
                missing,
                range,
                words,
                clock: info.clock.and_then(|at| *clocks.get(at)?),
                is_time: info.clock.is_none() && is_time(last(&info.path)),
            }
        })
        .collect();
    let spans = || channels.iter().filter_map(|c| Some(c.clock?.span));
    let first = spans().map(|s| s.0).fold(f64::INFINITY, f64::min);
    let end = spans().map(|s| s.1).fold(f64::NEG_INFINITY, f64::max);
    let mut notes = log.notes.clone();
    notes.extend(cut(log));
    let mut duration = (end >= first).then_some(end - first);
    if duration.is_none() {
        let time = channels.iter().find(|c| c.is_time);
        duration = time.and_then(|c| Some(c.range?.1 - c.range?.0));
    }
    Inventory {
        format: log.format.to_string(),
        duration,
        runs: 1,
        channels,
        notes,
    }
}

fn of_table(table: &Table, format: &str) -> Inventory {
    let width = table.columns.len().max(1);
    let time = table.stamps;
    let time = time.or_else(|| table.columns.iter().position(|c| is_time(&c.name)));
    let seconds = |column: usize| {
        let unit = table.columns.get(column)?.unit.as_deref()?;
        parse(unit).ok().map(|u| u.factor)
    };
    let stamps: Vec<Vec<f64>> = time.map_or_else(Vec::new, |column| {
        let factor = seconds(column).unwrap_or(1.0);
        let of = |rows: &[f64]| {
            rows.chunks_exact(width)
                .map(|r| factor * r[column])
                .collect()
        };
        table.runs.iter().map(|run| of(&run.rows)).collect()
    });
    let slices: Vec<&[f64]> = stamps.iter().map(Vec::as_slice).collect();
    let clock = clock(&slices);
    let channels = table.columns.iter().enumerate().map(|(at, column)| {
        let words = table.labels.get(&at);
        let all = || {
            table
                .runs
                .iter()
                .flat_map(|run| run.rows.chunks_exact(width))
        };
        let (missing, range) = numbers(all().map(|row| row[at]));
        ChannelFacts {
            path: column.text.clone(),
            kind: words.map_or(Kind::Number, |_| Kind::Text),
            declared: String::new(),
            unit: column.unit.clone().map(|unit| UnitFact {
                unit,
                why: match brackets(&column.text) {
                    Some(_) => "the brackets at the end of the name",
                    None if naming::split(&column.text).1.is_none() => "the file says so",
                    None => "the end of the name",
                },
            }),
            values: all().count(),
            missing,
            range: range.filter(|_| words.is_none()),
            words: words.map_or_else(Vec::new, |w| w.iter().take(WORDS).cloned().collect()),
            clock: clock.filter(|_| time != Some(at)),
            is_time: time == Some(at),
        }
    });
    Inventory {
        format: format.to_owned(),
        duration: clock.map(|c| c.span.1 - c.span.0),
        runs: table.runs.len(),
        channels: channels.collect(),
        notes: Vec::new(),
    }
}

fn is_time(name: &str) -> bool {
    let name = name.to_lowercase();
    name == "t" || TIME_NAMES.iter().any(|n| name.starts_with(n))
}

/// How many are missing, and the range of the others.
fn numbers(values: impl Iterator<Item = f64>) -> (usize, Option<(f64, f64)>) {
    let (mut missing, mut low, mut high) = (0, f64::INFINITY, f64::NEG_INFINITY);
    for value in values {
        if value.is_nan() {
            missing += 1;
        } else {
            (low, high) = (low.min(value), high.max(value));
        }
    }
    (missing, (low <= high).then_some((low, high)))
}

/// The unit that a file declares, or that the name says.
fn unit(declared: Option<&str>, path: &str) -> Option<UnitFact> {
    let fact = |unit: &str, why| UnitFact {
        unit: unit.to_owned(),
        why,
    };
    if let Some(unit) = declared {
        return Some(fact(unit, "the file says so"));
    }
    let name = last(path);
    if let (_, Some(unit)) = split_name(name) {
        return Some(fact(unit, "the end of the name"));
    }
    if let Some((_, unit)) = brackets(path) {
        return Some(fact(&unit, "the brackets at the end of the name"));
    }
    let words = name.to_lowercase();
    let guesses = [
        ("voltage", "V"),
        ("volts", "V"),
        ("amps", "A"),
        ("current", "A"),
        ("rpm", "rpm"),
    ];
    let found = guesses.iter().find(|(word, _)| words.contains(word));
    found.map(|(_, unit)| fact(unit, "a guess from the name"))
}

/// How time stamps run; runs follow each other.
fn clock(runs: &[&[f64]]) -> Option<ClockFacts> {
    let mut steps: Vec<f64> = Vec::new();
    let mut backwards = 0;
    let (mut first, mut end) = (f64::INFINITY, f64::NEG_INFINITY);
    for run in runs {
        for stamp in run.iter().filter(|t| t.is_finite()) {
            (first, end) = (first.min(*stamp), end.max(*stamp));
        }
        for pair in run.windows(2) {
            let step = pair[1] - pair[0];
            if step < 0.0 {
                backwards += 1;
            } else if step.is_finite() {
                steps.push(step);
            }
        }
    }
    if end < first {
        return None;
    }
    let period = median(&mut steps.clone());
    let mut deviations: Vec<f64> = steps.iter().map(|step| (step - period).abs()).collect();
    let pauses = || {
        steps
            .iter()
            .filter(|step| period > 0.0 && **step > GAP * period)
    };
    Some(ClockFacts {
        span: (first, end),
        period,
        jitter: median(&mut deviations),
        gaps: pauses().count(),
        longest_gap: pauses().copied().fold(0.0, f64::max),
        backwards,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read_bytes;

    #[test]
    fn a_table_is_told_by_its_columns() {
        let text = "t_s,voltage_V,mode,w\n0,1,a,2\n0.1,2,b,\n0.2,2,b,3\n1.2,3,b,4\n";
        let found = read_bytes(text.as_bytes(), "log").unwrap().inventory();
        assert_eq!(found.format, "CSV");
        assert_eq!(found.duration, Some(1.2));
        assert!(found.channels[0].is_time);
        let voltage = &found.channels[1];
        assert_eq!(voltage.unit.as_ref().unwrap().unit, "V");
        assert_eq!(voltage.range, Some((1.0, 3.0)));
        let clock = voltage.clock.unwrap();
        assert!((clock.period - 0.1).abs() < 1e-9, "{clock:?}");
        assert_eq!((clock.gaps, clock.backwards), (1, 0));
        assert_eq!(found.channels[2].words, ["a", "b"]);
        assert_eq!(found.channels[3].missing, 1);
    }

    #[test]
    fn units_in_names_say_where_they_come_from() {
        let of = |path: &str| unit(None, path).map(|u| (u.unit, u.why));
        let brackets = "the brackets at the end of the name";
        assert_eq!(of("NT:/Left Speed (M/s)"), Some(("m/s".into(), brackets)));
        assert_eq!(of("speed [rpm]"), Some(("rpm".into(), brackets)));
        assert_eq!(
            of("a/busVoltage"),
            Some(("V".into(), "a guess from the name"))
        );
        assert_eq!((of("omega"), of("weights[1]")), (None, None));
        assert_eq!(unit(Some("rad"), "x").unwrap().why, "the file says so");
    }
}
