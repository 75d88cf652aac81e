//! What is in a log, whatever wrote it: channels with unit, rate, range and what is missing.

mod clock;
mod count;
mod picture;
mod survey;

use loopsight_core::unit::{parse, split_name};
use loopsight_formats::Kind;

use crate::channels::last;
use crate::naming::{self, brackets, is_time};
use crate::source::Source;
use crate::table::Table;
use clock::ClockCount;
use count::{ValueCount, short};

pub use picture::Picture;
pub use survey::survey;

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
    /// The first texts that occur, long ones in part.
    pub words: Vec<String>,
    /// Root mean square change from value to value over the standard deviation: small for what is smooth, √2 for noise.
    pub roughness: Option<f64>,
    /// How it runs; empty for texts.
    pub picture: Picture,
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
            Source::Channels(log) => survey::of_log(log),
        }
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
    let factor = time.and_then(seconds).unwrap_or(1.0);
    let stamp = |row: &[f64]| time.map(|column| factor * row[column]);
    let mut count = ClockCount::default();
    for run in &table.runs {
        count.restart();
        let stamps = run.rows.chunks_exact(width).filter_map(stamp);
        stamps.for_each(|t| count.tick(t));
    }
    let clock = count.facts();
    let channels = table.columns.iter().enumerate().map(|(at, column)| {
        let words = table.labels.get(&at);
        let kind = words.map_or(Kind::Number, |_| Kind::Text);
        let mut count = ValueCount::default();
        let rows = table
            .runs
            .iter()
            .flat_map(|run| run.rows.chunks_exact(width));
        for (number, row) in rows.enumerate() {
            count.number(stamp(row).unwrap_or(number as f64), row[at]);
        }
        ChannelFacts {
            path: column.text.clone(),
            kind,
            declared: String::new(),
            unit: column.unit.clone().map(|unit| UnitFact {
                unit,
                why: match brackets(&column.text) {
                    Some(_) => "the brackets at the end of the name",
                    None if naming::split(&column.text).1.is_none() => "the file says so",
                    None => "the end of the name",
                },
            }),
            values: count.values,
            missing: count.missing,
            range: count.range(kind),
            roughness: count.roughness().filter(|_| words.is_none()),
            words: words.map_or_else(Vec::new, |w| {
                w.iter().take(count::WORDS).map(|w| short(w)).collect()
            }),
            clock: clock.filter(|_| time != Some(at)),
            is_time: time == Some(at),
            picture: match words {
                Some(_) => Picture::default(),
                None => count.picture,
            },
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
    // "Current Gyro Yaw" is the yaw now, "MotorCurrent" and "current_1" are in amperes.
    let now = words
        .strip_prefix("current")
        .is_some_and(|rest| rest.contains(char::is_alphabetic));
    let found =
        (guesses.iter()).find(|(word, _)| words.contains(word) && !(now && *word == "current"));
    found.map(|(_, unit)| fact(unit, "a guess from the name"))
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
        assert_eq!(
            (of("NT:/Current Gyro Yaw"), of("currentAngle")),
            (None, None)
        );
        let ampere = Some(("A".into(), "a guess from the name"));
        assert_eq!(
            (of("Current_1"), of("motorCurrent")),
            (ampere.clone(), ampere)
        );
        assert_eq!(unit(Some("rad"), "x").unwrap().why, "the file says so");
    }
}
