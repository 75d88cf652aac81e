//! A log in memory.

use crate::detect::Format;
use crate::error::FormatError;
use crate::input::too_large;
use crate::sink::{ChannelInfo, Kind, Sink};

/// Everything that is in a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Log {
    /// File name, or what else the log is called.
    pub source: String,
    /// Its format.
    pub format: Format,
    /// Sequences of time stamps.
    pub clocks: Vec<Clock>,
    /// Channels, in the order in which the file has them.
    pub channels: Vec<Channel>,
    /// Zero of all clocks, ns since 1970 (UTC), where the file says so.
    pub origin: Option<i64>,
    /// What the file says of itself, and what was done to read it.
    pub notes: Vec<String>,
    /// Where the file ends too early; what is before it was read.
    pub cut: Option<Cut>,
}

/// The end of a file that was cut.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cut {
    /// Byte of the unpacked content at which what is cut begins.
    pub at: u64,
    /// What is cut.
    pub what: String,
}

/// Time stamps that one or more channels share.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Clock {
    /// Topic or entry.
    pub name: String,
    /// Time stamps, s, as the file has them: not necessarily rising.
    pub time: Vec<f64>,
}

/// One quantity of a log.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// What it is.
    pub info: ChannelInfo,
    /// Its values: one for each time stamp of its clock, where it has one.
    pub values: Values,
}

/// A column of a log.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Numbers; NaN: missing. A boolean is 0 or 1.
    Numbers(Vec<f64>),
    /// Texts.
    Texts(Texts),
    /// So many of something that is no number and no text.
    Opaque(usize),
}

/// A column of texts: each differing one is kept once.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Texts {
    words: Vec<String>,
    rows: Vec<u32>,
    find: std::collections::HashMap<String, u32>,
}

/// In [`Texts::rows`]: no text here.
const MISSING: u32 = u32::MAX;

impl Texts {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// True without any row.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// The text of a row; none where it is missing.
    pub fn get(&self, row: usize) -> Option<&str> {
        let word = *self.rows.get(row)?;
        self.words.get(word as usize).map(String::as_str)
    }

    /// The index of the text of a row in [`Texts::words`]; none where it is missing.
    pub fn word(&self, row: usize) -> Option<usize> {
        let word = *self.rows.get(row)? as usize;
        (word < self.words.len()).then_some(word)
    }

    /// The texts that occur, in the order in which they first do.
    pub fn words(&self) -> &[String] {
        &self.words
    }

    /// All rows.
    pub fn iter(&self) -> impl Iterator<Item = Option<&str>> {
        (0..self.len()).map(|row| self.get(row))
    }

    /// Bytes that a further row takes.
    fn push(&mut self, text: &str) -> u64 {
        if let Some(word) = self.find.get(text) {
            self.rows.push(*word);
            return 4;
        }
        let word = self.words.len() as u32;
        self.words.push(text.to_owned());
        self.find.insert(text.to_owned(), word);
        self.rows.push(word);
        2 * text.len() as u64 + 100
    }
}

impl Values {
    /// Number of rows.
    pub fn len(&self) -> usize {
        match self {
            Values::Numbers(values) => values.len(),
            Values::Texts(values) => values.len(),
            Values::Opaque(count) => *count,
        }
    }

    /// True without any row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl Channel {
    /// The numbers; none when it has texts or something else.
    pub fn numbers(&self) -> Option<&[f64]> {
        match &self.values {
            Values::Numbers(values) => Some(values),
            _ => None,
        }
    }

    /// The texts; none when it has something else.
    pub fn texts(&self) -> Option<&Texts> {
        match &self.values {
            Values::Texts(values) => Some(values),
            _ => None,
        }
    }
}

impl Log {
    /// The channel of a path or an alias. `.` and `/` may stand for each other, and the first of
    /// them may be left out.
    pub fn find(&self, path: &str) -> Option<&Channel> {
        self.channels.get(self.position(path)?)
    }

    /// The index of the channel that [`Log::find`] finds.
    pub fn position(&self, path: &str) -> Option<usize> {
        let place = |wanted: &dyn Fn(&str) -> bool| {
            let fits =
                |c: &Channel| wanted(&c.info.path) || c.info.alias.as_deref().is_some_and(wanted);
            self.channels.iter().position(fits)
        };
        let loose = normal(path);
        place(&|name| name == path).or_else(|| place(&|name| normal(name) == loose))
    }

    /// Time stamps of a channel, s; none for one without a clock.
    pub fn time(&self, channel: &Channel) -> Option<&[f64]> {
        let clock = self.clocks.get(channel.info.clock?)?;
        Some(&clock.time)
    }
}

fn normal(path: &str) -> String {
    path.replace('.', "/").trim_start_matches('/').to_owned()
}

/// Bytes of memory for each byte of input.
pub const MEMORY_FACTOR: u64 = 64;
/// Bytes of memory for any input.
pub const MEMORY_LEAST: u64 = 8 << 20;

/// Makes a [`Log`] of what a reader finds, in memory that is bounded by the size of the input.
#[derive(Debug)]
pub struct LogBuilder {
    log: Log,
    limit: u64,
    left: u64,
}

impl LogBuilder {
    /// An empty log of an input of `size` bytes.
    pub fn new(source: &str, format: Format, size: u64) -> Self {
        let limit = MEMORY_LEAST.max(size.saturating_mul(MEMORY_FACTOR));
        Self {
            log: Log {
                source: source.to_owned(),
                format,
                clocks: Vec::new(),
                channels: Vec::new(),
                origin: None,
                notes: Vec::new(),
                cut: None,
            },
            limit,
            left: limit,
        }
    }

    /// The log, with every channel as long as its clock.
    ///
    /// # Errors
    ///
    /// [`FormatError::TooLarge`].
    pub fn finish(mut self) -> Result<Log, FormatError> {
        for channel in 0..self.log.channels.len() {
            let ticks = self.ticks(channel);
            self.fill(channel, ticks)?;
        }
        Ok(self.log)
    }

    fn take(&mut self, bytes: u64) -> Result<(), FormatError> {
        match self.left.checked_sub(bytes) {
            Some(left) => {
                self.left = left;
                Ok(())
            }
            None => Err(too_large(&self.log.source, "the content", self.limit)),
        }
    }

    /// Ticks of the clock of a channel; none: it has no clock.
    fn ticks(&self, channel: usize) -> Option<usize> {
        let clock = self.log.channels.get(channel)?.info.clock?;
        Some(self.log.clocks.get(clock)?.time.len())
    }

    /// Makes a channel so long by missing values.
    fn fill(&mut self, channel: usize, rows: Option<usize>) -> Result<(), FormatError> {
        let (Some(rows), Some(it)) = (rows, self.log.channels.get(channel)) else {
            return Ok(());
        };
        let missing = rows.saturating_sub(it.values.len());
        if missing == 0 {
            return Ok(());
        }
        self.take(8 * missing as u64)?;
        if let Some(it) = self.log.channels.get_mut(channel) {
            match &mut it.values {
                Values::Numbers(values) => values.resize(rows, f64::NAN),
                Values::Texts(values) => values.rows.resize(rows, MISSING),
                Values::Opaque(_) => {}
            }
        }
        Ok(())
    }

    /// Makes room for a value at the last tick; one that is there already stays.
    fn ready(&mut self, channel: usize) -> Result<bool, FormatError> {
        let Some(ticks) = self.ticks(channel) else {
            return Ok(true);
        };
        self.fill(channel, Some(ticks.saturating_sub(1)))?;
        let len = self.log.channels.get(channel).map_or(0, |c| c.values.len());
        Ok(len < ticks)
    }
}

impl Sink for LogBuilder {
    fn clock(&mut self, name: &str) -> usize {
        self.log.clocks.push(Clock {
            name: name.to_owned(),
            time: Vec::new(),
        });
        self.log.clocks.len() - 1
    }

    fn channel(&mut self, info: ChannelInfo) -> Result<usize, FormatError> {
        let text = info.path.len() + info.declared.len();
        self.take(400 + 2 * text as u64)?;
        let values = match info.kind {
            Kind::Number | Kind::Boolean => Values::Numbers(Vec::new()),
            Kind::Text => Values::Texts(Texts::default()),
            Kind::Opaque => Values::Opaque(0),
        };
        self.log.channels.push(Channel { info, values });
        Ok(self.log.channels.len() - 1)
    }

    fn tick(&mut self, clock: usize, time: f64) -> Result<(), FormatError> {
        self.take(8)?;
        if let Some(clock) = self.log.clocks.get_mut(clock) {
            clock.time.push(time);
        }
        Ok(())
    }

    fn number(&mut self, channel: usize, value: f64) -> Result<(), FormatError> {
        if !self.ready(channel)? {
            return Ok(());
        }
        self.take(8)?;
        if let Some(Values::Numbers(values)) =
            self.log.channels.get_mut(channel).map(|c| &mut c.values)
        {
            values.push(value);
        }
        Ok(())
    }

    fn text(&mut self, channel: usize, value: &str) -> Result<(), FormatError> {
        if !self.ready(channel)? {
            return Ok(());
        }
        let mut bytes = 0;
        if let Some(Values::Texts(values)) =
            self.log.channels.get_mut(channel).map(|c| &mut c.values)
        {
            bytes = values.push(value);
        }
        self.take(bytes)
    }

    fn opaque(&mut self, channel: usize) -> Result<(), FormatError> {
        if let Some(Values::Opaque(count)) =
            self.log.channels.get_mut(channel).map(|c| &mut c.values)
        {
            *count += 1;
        }
        Ok(())
    }

    fn note(&mut self, text: String) {
        if self.log.notes.len() < 100 && !self.log.notes.contains(&text) {
            self.log.notes.push(text);
        }
    }

    fn cut(&mut self, at: u64, what: &str) {
        self.log.cut.get_or_insert_with(|| Cut {
            at,
            what: what.to_owned(),
        });
    }

    fn origin(&mut self, nanoseconds: i64) {
        self.log.origin.get_or_insert(nanoseconds);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn builder() -> LogBuilder {
        LogBuilder::new("log", Format::Wpilog, 100)
    }

    #[test]
    fn what_comes_late_or_not_at_all_is_missing() {
        let mut log = builder();
        let clock = log.clock("c");
        let info = |path: &str| ChannelInfo::new(path, Kind::Number, "f64").at(clock);
        let a = log.channel(info("/a.x")).unwrap();
        log.tick(clock, 0.0).unwrap();
        log.number(a, 1.0).unwrap();
        log.tick(clock, 0.1).unwrap();
        let b = log.channel(info("/b")).unwrap();
        log.number(b, 2.0).unwrap();
        // A second value at one tick does not shift those behind it.
        log.number(b, 7.0).unwrap();
        log.tick(clock, 0.2).unwrap();
        log.number(a, 3.0).unwrap();
        let log = log.finish().unwrap();
        let text = |path: &str| format!("{:?}", log.find(path).unwrap().numbers().unwrap());
        assert_eq!(text("a/x"), "[1.0, NaN, 3.0]");
        assert_eq!(text("b"), "[NaN, 2.0, NaN]");
        assert_eq!(log.time(&log.channels[0]).unwrap(), [0.0, 0.1, 0.2]);
    }

    #[test]
    fn texts_are_kept_once() {
        let mut log = builder();
        let c = log
            .channel(ChannelInfo::new("s", Kind::Text, "string"))
            .unwrap();
        for word in ["up", "down", "up"] {
            log.text(c, word).unwrap();
        }
        let log = log.finish().unwrap();
        let texts = log.channels[0].texts().unwrap();
        assert_eq!(texts.words(), ["up", "down"]);
        assert_eq!(
            texts.iter().map(Option::unwrap).collect::<Vec<_>>(),
            ["up", "down", "up"]
        );
    }

    #[test]
    fn memory_is_bounded_by_the_input() {
        let mut log = builder();
        let clock = log.clock("c");
        let info = ChannelInfo::new("x", Kind::Number, "f64").at(clock);
        let mut full = Ok(());
        for _ in 0..2_000_000 {
            full = log.tick(clock, 0.0);
        }
        assert!(
            matches!(full, Err(FormatError::TooLarge { .. })),
            "{full:?}"
        );
        assert!(matches!(
            log.channel(info),
            Err(FormatError::TooLarge { .. })
        ));
    }
}
