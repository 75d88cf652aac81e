//! What readers hand on, and to whom.

use crate::error::FormatError;

/// Whoever takes what a reader finds: a [`Log`](crate::Log) in the making, or a statistic.
///
/// A reader announces a clock or a channel before its first value. A value belongs to the last
/// tick of its channel's clock; a channel without a value at a tick is missing there. Channels
/// without a clock have values only.
pub trait Sink {
    /// A sequence of time stamps that one or more channels share; returns its number.
    fn clock(&mut self, name: &str) -> usize;

    /// A channel; returns its number.
    ///
    /// # Errors
    ///
    /// [`FormatError::TooLarge`] when there are more than the size of the input can stand for.
    fn channel(&mut self, info: ChannelInfo) -> Result<usize, FormatError>;

    /// The next time stamp of a clock, s.
    ///
    /// # Errors
    ///
    /// As [`Sink::channel`].
    fn tick(&mut self, clock: usize, time: f64) -> Result<(), FormatError>;

    /// A number at the last tick; a boolean is 0 or 1.
    ///
    /// # Errors
    ///
    /// As [`Sink::channel`].
    fn number(&mut self, channel: usize, value: f64) -> Result<(), FormatError>;

    /// A text at the last tick.
    ///
    /// # Errors
    ///
    /// As [`Sink::channel`].
    fn text(&mut self, channel: usize, value: &str) -> Result<(), FormatError>;

    /// Something that was there at the last tick and is no number and no text.
    ///
    /// # Errors
    ///
    /// As [`Sink::channel`].
    fn opaque(&mut self, channel: usize) -> Result<(), FormatError>;

    /// What the file says of itself, or what was done to read it.
    fn note(&mut self, text: String);

    /// The file ends in the middle of something, at this byte.
    fn cut(&mut self, at: u64, what: &str);

    /// What is zero on all clocks, in nanoseconds since 1970 (UTC), where the file says so.
    fn origin(&mut self, nanoseconds: i64);
}

/// What kind of values a channel has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// Numbers.
    Number,
    /// Numbers that are 0 or 1.
    Boolean,
    /// Texts.
    Text,
    /// Something else: images, bytes, long arrays. There are no values, only a count.
    Opaque,
}

/// What is known of a channel before its first value.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelInfo {
    /// Where it stands in the file: `/joint_states/velocity[0]`.
    pub path: String,
    /// Another way to say the path: `/joint_states/velocity[shoulder]`.
    pub alias: Option<String>,
    /// Kind of its values.
    pub kind: Kind,
    /// Its type in the file's own words: `float32`, `double[]`.
    pub declared: String,
    /// Its unit, where the file says one.
    pub unit: Option<String>,
    /// Its clock.
    pub clock: Option<usize>,
    /// Rows of one table share its number; channels of different tables have nothing in common.
    pub table: usize,
}

impl ChannelInfo {
    /// A channel without alias, unit and clock.
    pub fn new(path: impl Into<String>, kind: Kind, declared: impl Into<String>) -> Self {
        Self {
            path: path.into(),
            alias: None,
            kind,
            declared: declared.into(),
            unit: None,
            clock: None,
            table: 0,
        }
    }

    /// The same with a clock.
    pub fn at(mut self, clock: usize) -> Self {
        self.clock = Some(clock);
        self
    }

    /// The same with a unit.
    pub fn in_unit(mut self, unit: Option<impl Into<String>>) -> Self {
        self.unit = unit.map(Into::into);
        self
    }
}

/// Elements of an array of numbers that become channels of their own; a longer one is opaque.
pub const ARRAY_MOST: usize = 64;

/// Time stamps of a file, as seconds from one origin that all its clocks share.
///
/// Stamps that a number holds exactly stay as they are. Larger ones (nanoseconds since 1970) are
/// counted from the first, which is told to the sink as the origin.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Stamps {
    origin: Option<i128>,
}

/// Whole numbers up to here are exact in a double.
const EXACT: i128 = 1 << 53;

impl Stamps {
    /// Seconds of a stamp in nanoseconds.
    pub(crate) fn seconds(&mut self, nanoseconds: i128, sink: &mut dyn Sink) -> f64 {
        let origin = *self.origin.get_or_insert_with(|| {
            if nanoseconds.abs() < EXACT {
                return 0;
            }
            sink.origin(i64::try_from(nanoseconds).unwrap_or(i64::MAX));
            nanoseconds
        });
        (nanoseconds - origin) as f64 / 1e9
    }

    /// Seconds of a stamp in microseconds.
    pub(crate) fn seconds_of_micros(&mut self, microseconds: i128, sink: &mut dyn Sink) -> f64 {
        let origin = *self.origin.get_or_insert_with(|| {
            if microseconds.abs() < EXACT {
                return 0;
            }
            let nanoseconds = microseconds.saturating_mul(1000);
            sink.origin(i64::try_from(nanoseconds).unwrap_or(i64::MAX));
            nanoseconds
        });
        (microseconds - origin / 1000) as f64 / 1e6
    }
}
