//! What is in a log, counted while it is read: none of its values is kept.

use std::path::Path;

use loopsight_formats::{
    ChannelInfo, Cut, Format, FormatError, Input, Kind, Log, MEMORY_FACTOR, MEMORY_LEAST, Sink,
    Values, read_into,
};

use super::clock::ClockCount;
use super::count::ValueCount;
use super::{ChannelFacts, ClockFacts, Inventory, unit};
use crate::channels::{self, is_own, last};
use crate::error::RecordingError;
use crate::naming::is_time;

/// Bytes that a channel takes, beside its names.
const CHANNEL: u64 = 4096;

/// Says what is in a file, in one pass and in memory that does not grow with the length of the log: some kB for each
/// channel, 1 MB for each clock. None of tables of text and SysId logs, and of what a loop wrote: they are read as a whole.
///
/// # Errors
///
/// As [`read`](crate::read).
pub fn survey(path: &Path) -> Result<Option<Inventory>, RecordingError> {
    let input = Input::open(path)?;
    if input.format() == Format::Text {
        return Ok(None);
    }
    let mut survey = Survey::new(input.name(), input.format(), input.size());
    for wrapper in input.packed() {
        survey.note(format!("unpacked: {wrapper}"));
    }
    read_into(input, &mut survey)?;
    if survey.channels.iter().any(|(info, _)| is_own(&info.path)) {
        return Ok(None);
    }
    Ok(Some(survey.finish()))
}

/// What is in a log that is in memory.
pub(super) fn of_log(log: &Log) -> Inventory {
    let mut survey = Survey::new(&log.source, log.format, 0);
    survey.notes.clone_from(&log.notes);
    survey.cut.clone_from(&log.cut);
    for clock in &log.clocks {
        let mut count = ClockCount::default();
        clock.time.iter().for_each(|t| count.tick(*t));
        survey.clocks.push(count);
    }
    for channel in &log.channels {
        let mut count = ValueCount::default();
        let time = log.time(channel);
        match &channel.values {
            Values::Numbers(values) => {
                for (at, value) in values.iter().enumerate() {
                    let now = time.map_or(Some(at as f64), |time| time.get(at).copied());
                    count.number(now.unwrap_or(f64::NAN), *value);
                }
            }
            Values::Texts(texts) => {
                // Each word once, and how often there is none.
                texts.words().iter().for_each(|word| count.text(word));
                count.values = texts.len();
                count.missing = texts.iter().filter(Option::is_none).count();
            }
            Values::Opaque(values) => count.values = *values,
        }
        survey.channels.push((channel.info.clone(), count));
    }
    survey.finish()
}

struct Survey {
    source: String,
    format: Format,
    clocks: Vec<ClockCount>,
    channels: Vec<(ChannelInfo, ValueCount)>,
    notes: Vec<String>,
    cut: Option<Cut>,
    limit: u64,
    left: u64,
}

impl Survey {
    fn new(source: &str, format: Format, size: u64) -> Self {
        let limit = MEMORY_LEAST.max(size.saturating_mul(MEMORY_FACTOR));
        Self {
            source: source.to_owned(),
            format,
            clocks: Vec::new(),
            channels: Vec::new(),
            notes: Vec::new(),
            cut: None,
            limit,
            left: limit,
        }
    }

    /// The channel, and the time of its value; none where it has one at this time already.
    fn at(&mut self, channel: usize) -> Option<(f64, &mut ValueCount)> {
        let (info, count) = self.channels.get_mut(channel)?;
        let Some(clock) = info.clock else {
            return Some((count.values as f64, count));
        };
        let clock = self.clocks.get(clock)?;
        if count.values >= clock.ticks {
            return None;
        }
        count.skip(clock.ticks - 1 - count.values);
        Some((clock.now(), count))
    }

    fn finish(mut self) -> Inventory {
        let clocks: Vec<Option<ClockFacts>> = self.clocks.iter().map(ClockCount::facts).collect();
        let mut notes = self.notes;
        notes.extend(self.cut.as_ref().map(channels::cut));
        for (info, count) in &mut self.channels {
            let ticks = info
                .clock
                .and_then(|at| self.clocks.get(at))
                .map(|c| c.ticks);
            if let Some(ticks) = ticks.filter(|_| info.kind != Kind::Opaque) {
                count.skip(ticks.saturating_sub(count.values));
            }
        }
        let channels: Vec<ChannelFacts> = (self.channels.into_iter())
            .map(|(info, count)| ChannelFacts {
                unit: unit(info.unit.as_deref(), &info.path),
                is_time: info.clock.is_none() && is_time(last(&info.path)),
                clock: info.clock.and_then(|at| *clocks.get(at)?),
                path: info.path,
                kind: info.kind,
                declared: info.declared,
                values: count.values,
                missing: count.missing,
                range: count.range(info.kind),
                roughness: count.roughness(),
                words: count.words,
                picture: count.picture,
            })
            .collect();
        let spans = || channels.iter().filter_map(|c| Some(c.clock?.span));
        let first = spans().map(|s| s.0).fold(f64::INFINITY, f64::min);
        let end = spans().map(|s| s.1).fold(f64::NEG_INFINITY, f64::max);
        let mut duration = (end >= first).then_some(end - first);
        if duration.is_none() {
            let time = channels.iter().find(|c| c.is_time);
            duration = time.and_then(|c| Some(c.range?.1 - c.range?.0));
        }
        Inventory {
            format: self.format.to_string(),
            duration,
            runs: 1,
            channels,
            notes,
        }
    }
}

impl Sink for Survey {
    fn clock(&mut self, _: &str) -> usize {
        self.clocks.push(ClockCount::default());
        self.clocks.len() - 1
    }

    fn channel(&mut self, info: ChannelInfo) -> Result<usize, FormatError> {
        // As many as the size of the file can stand for, whatever they take here.
        let text = info.path.len() + info.declared.len();
        match self.left.checked_sub(CHANNEL / 10 + 2 * text as u64) {
            Some(left) => self.left = left,
            None => {
                return Err(FormatError::TooLarge {
                    log: self.source.as_str().into(),
                    what: "the content".into(),
                    limit: self.limit,
                });
            }
        }
        self.channels.push((info, ValueCount::default()));
        Ok(self.channels.len() - 1)
    }

    fn tick(&mut self, clock: usize, time: f64) -> Result<(), FormatError> {
        if let Some(clock) = self.clocks.get_mut(clock) {
            clock.tick(time);
        }
        Ok(())
    }

    fn number(&mut self, channel: usize, value: f64) -> Result<(), FormatError> {
        if let Some((time, count)) = self.at(channel) {
            count.number(time, value);
        }
        Ok(())
    }

    fn text(&mut self, channel: usize, value: &str) -> Result<(), FormatError> {
        if let Some((_, count)) = self.at(channel) {
            count.text(value);
        }
        Ok(())
    }

    fn opaque(&mut self, channel: usize) -> Result<(), FormatError> {
        if let Some((_, count)) = self.channels.get_mut(channel) {
            count.values += 1;
        }
        Ok(())
    }

    fn note(&mut self, text: String) {
        if self.notes.len() < 100 && !self.notes.contains(&text) {
            self.notes.push(text);
        }
    }

    fn cut(&mut self, at: u64, what: &str) {
        self.cut.get_or_insert_with(|| Cut {
            at,
            what: what.to_owned(),
        });
    }

    fn origin(&mut self, _: i64) {}
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    /// Two topics at 100 and 30 Hz, with fields that come late, are missing or not numbers.
    fn recorded(path: &Path) {
        let file = std::fs::File::create(path).unwrap();
        let mut writer = mcap::Writer::new(file).unwrap();
        let schema = writer
            .add_schema("state", "jsonschema", b"{\"type\":\"object\"}")
            .unwrap();
        let ids = ["/fast", "/slow"].map(|topic| {
            writer
                .add_channel(schema, topic, "json", &BTreeMap::new())
                .unwrap()
        });
        let mut write = |id: u16, time: u64, text: String| {
            let header = mcap::records::MessageHeader {
                channel_id: id,
                sequence: 0,
                log_time: 1_700_000_000_000_000_000 + time,
                publish_time: 0,
            };
            writer
                .write_to_known_channel(&header, text.as_bytes())
                .unwrap();
        };
        for k in 0..2000_u64 {
            let pause = if k > 900 { 700_000_000 } else { 0 };
            let speed = (k as f64 / 40.0).sin();
            let late = if k > 100 {
                format!(",\"late\":{k}")
            } else {
                String::new()
            };
            let mode = if k < 500 { "idle" } else { "driving" };
            let text = format!(
                "{{\"speed\":{speed},\"mode\":\"{mode}\",\"on\":{}{late}}}",
                k % 2 == 0
            );
            write(ids[0], k * 10_000_000 + pause, text);
            if k % 3 == 0 {
                write(ids[1], k * 10_000_000, format!("{{\"x\":[{k},2]}}"));
            }
        }
        writer.finish().unwrap();
    }

    #[test]
    fn what_is_counted_on_the_way_is_what_is_in_the_log() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.mcap");
        recorded(&path);
        let counted = survey(&path).unwrap().unwrap();
        let kept = crate::read(&path).unwrap().inventory();
        assert!(counted == kept, "{:?}", counted.notes);
        let of = |name: &str| counted.channels.iter().find(|c| c.path == name).unwrap();
        let speed = of("/fast/speed");
        let clock = speed.clock.unwrap();
        assert!(
            (clock.period - 0.01).abs() < 1e-9 && clock.gaps == 1,
            "{clock:?}"
        );
        assert!(speed.roughness.unwrap() < 0.1, "{speed:?}");
        assert_eq!(
            (of("/fast/late").values, of("/fast/late").missing),
            (2000, 101)
        );
        assert_eq!(of("/fast/mode").words, ["idle", "driving"]);
        // A table of text is read as a whole.
        let path = folder.path().join("log.csv");
        std::fs::write(&path, "t_s,u_V\n0,1\n1,2\n").unwrap();
        assert!(survey(&path).unwrap().is_none());
    }
}
