//! PX4 flight logs (`.ulg`).
//!
//! A header, then messages `size u16, type u8, content`. `F` declares a format
//! (`name:type field;type[n] field;…`), `A` subscribes an instance of one, `D` is a sample of it,
//! whose field `timestamp` is its time in µs. Every topic has times of its own. Fields are
//! channels: `vehicle_attitude.q[0]`; further instances of a topic `sensor_accel[1].x`.
//!
//! Reference: PX4 User Guide, "ULog File Format".

mod format;

use std::collections::HashMap;

use crate::bytes::{Bytes, Stream, little};
use crate::detect::Format;
use crate::error::FormatError;
use crate::input::Input;
use crate::sink::{ChannelInfo, Kind, Sink, Stamps};
use format::{Formats, Layout};

/// Reads all topics.
pub(crate) fn read(input: &mut Input, sink: &mut dyn Sink) -> Result<(), FormatError> {
    let mut stream = Stream::new(input)?;
    if !stream.skip(16)? {
        sink.cut(0, "the header");
        return Ok(());
    }
    let mut reader = Reader::default();
    reader.messages(&mut stream, sink)?;
    let mut appended = std::mem::take(&mut reader.appended);
    appended.retain(|at| *at > 0 && *at < stream.at() + stream.left());
    for (k, at) in appended.iter().enumerate() {
        reader.appended = appended.get(k + 1..).unwrap_or_default().to_vec();
        stream.seek(*at)?;
        reader.messages(&mut stream, sink)?;
    }
    reader.finish(sink)
}

#[derive(Default)]
struct Reader {
    formats: Formats,
    /// Topics by the number that samples carry.
    topics: HashMap<u16, Topic>,
    messages: Option<(usize, usize)>,
    stamps: Stamps,
    /// Where data were appended to a file that was closed already.
    appended: Vec<u64>,
    flagged: bool,
    dropouts: (usize, u64),
    unknown: usize,
}

/// An instance of a topic.
struct Topic {
    name: String,
    layout: std::rc::Rc<Layout>,
    /// Clock and channels, from the first sample on.
    open: Option<(usize, Vec<usize>)>,
}

impl Reader {
    fn messages(
        &mut self,
        stream: &mut Stream<'_>,
        sink: &mut dyn Sink,
    ) -> Result<(), FormatError> {
        while stream.left() > 0 {
            let at = stream.at();
            // Data appended by a crash begin here; they are read on their own.
            if self.appended.contains(&at) {
                break;
            }
            let head = stream.take(3)?.map(|h| (little(&h[..2]), h[2]));
            let Some((size, kind)) = head else {
                sink.cut(at, "a message");
                break;
            };
            let Some(content) = stream.take(size)? else {
                sink.cut(at, "a message");
                break;
            };
            if self.message(kind, content, sink)?.is_none() {
                return Err(FormatError::Damaged {
                    log: stream.name().into(),
                    format: Format::Ulog,
                    position: at,
                    expected: format!("a message of the type `{}`", char::from(kind)).into(),
                    found: format!("{size} bytes that are none").into(),
                });
            }
        }
        Ok(())
    }

    /// Takes one message; none when it contradicts its type.
    fn message(
        &mut self,
        kind: u8,
        content: &[u8],
        sink: &mut dyn Sink,
    ) -> Result<Option<()>, FormatError> {
        let mut bytes = Bytes::new(content);
        match kind {
            b'B' => Ok(self.flags(&mut bytes)),
            b'F' => Ok(self.formats.define(content)),
            b'A' => Ok(self.subscribe(&mut bytes)),
            b'D' => self.sample(&mut bytes, sink),
            b'L' => self.logged(&mut bytes, sink),
            b'O' => {
                self.dropouts.0 += 1;
                self.dropouts.1 += u64::from(bytes.u16().unwrap_or(0));
                Ok(Some(()))
            }
            b'I' => {
                info(&mut bytes, sink);
                Ok(Some(()))
            }
            // Parameters, tags, synchronisation, and what later versions add.
            _ => Ok(Some(())),
        }
    }

    fn flags(&mut self, bytes: &mut Bytes<'_>) -> Option<()> {
        let _compatible: [u8; 8] = bytes.array()?;
        let incompatible: [u8; 8] = bytes.array()?;
        if std::mem::replace(&mut self.flagged, true) {
            return Some(());
        }
        for _ in 0..3 {
            self.appended.push(bytes.u64()?);
        }
        let known = incompatible[0] & !1 == 0 && incompatible[1..].iter().all(|b| *b == 0);
        if incompatible[0] & 1 == 0 {
            self.appended.clear();
        }
        known.then_some(())
    }

    fn subscribe(&mut self, bytes: &mut Bytes<'_>) -> Option<()> {
        let (instance, id) = (bytes.u8()?, bytes.u16()?);
        let format = std::str::from_utf8(bytes.rest()).ok()?;
        // A format that is missing or odd costs its own topic only.
        let layout = self.formats.layout(format);
        let name = match instance {
            0 => format.to_owned(),
            n => format!("{format}[{n}]"),
        };
        let topic = layout.map(|layout| Topic {
            name,
            layout,
            open: None,
        });
        match topic {
            Some(topic) => {
                self.topics.insert(id, topic);
            }
            None => {
                self.topics.remove(&id);
            }
        }
        Some(())
    }

    fn sample(
        &mut self,
        bytes: &mut Bytes<'_>,
        sink: &mut dyn Sink,
    ) -> Result<Option<()>, FormatError> {
        let Some(id) = bytes.u16() else {
            return Ok(None);
        };
        let Some(topic) = self.topics.get_mut(&id) else {
            self.unknown += 1;
            return Ok(Some(()));
        };
        let data = bytes.rest();
        let layout = std::rc::Rc::clone(&topic.layout);
        let stamp = layout.time.and_then(|at| data.get(at..at + 8)).map(little);
        let Some(stamp) = stamp else {
            self.unknown += 1;
            return Ok(Some(()));
        };
        let time = self.stamps.seconds_of_micros(i128::from(stamp), sink);
        if topic.open.is_none() {
            let clock = sink.clock(&topic.name);
            let mut channels = Vec::with_capacity(layout.fields.len());
            for field in &layout.fields {
                let path = format!("{}.{}", topic.name, field.path);
                let info = ChannelInfo::new(path, field.kind(), field.declared());
                channels.push(sink.channel(info.at(clock))?);
            }
            topic.open = Some((clock, channels));
        }
        let Some((clock, channels)) = &topic.open else {
            return Ok(Some(()));
        };
        sink.tick(*clock, time)?;
        for (field, channel) in layout.fields.iter().zip(channels) {
            match field.kind() {
                Kind::Opaque => sink.opaque(*channel)?,
                Kind::Text => {
                    if let Some(text) = field.text(data) {
                        sink.text(*channel, &text)?;
                    }
                }
                _ => {
                    if let Some(value) = field.number(data) {
                        sink.number(*channel, value)?;
                    }
                }
            }
        }
        Ok(Some(()))
    }

    /// A line that the vehicle logged.
    fn logged(
        &mut self,
        bytes: &mut Bytes<'_>,
        sink: &mut dyn Sink,
    ) -> Result<Option<()>, FormatError> {
        let (Some(_level), Some(micros)) = (bytes.u8(), bytes.u64()) else {
            return Ok(None);
        };
        let time = self.stamps.seconds_of_micros(i128::from(micros), sink);
        let (clock, channel) = match self.messages {
            Some(open) => open,
            None => {
                let clock = sink.clock("logged messages");
                let info = ChannelInfo::new("logged_messages", Kind::Text, "string").at(clock);
                *self.messages.insert((clock, sink.channel(info)?))
            }
        };
        sink.tick(clock, time)?;
        sink.text(channel, &String::from_utf8_lossy(bytes.rest()))?;
        Ok(Some(()))
    }

    fn finish(self, sink: &mut dyn Sink) -> Result<(), FormatError> {
        let (count, milliseconds) = self.dropouts;
        if count > 0 {
            sink.note(format!(
                "the logger dropped samples {count} times, {:.3} s in all",
                milliseconds as f64 / 1e3
            ));
        }
        if self.unknown > 0 {
            let n = self.unknown;
            sink.note(format!(
                "{n} samples have no format or no time and were left out"
            ));
        }
        Ok(())
    }
}

/// `char[5] sys_name` and its like: what the file says of itself.
fn info(bytes: &mut Bytes<'_>, sink: &mut dyn Sink) -> Option<()> {
    let n = usize::from(bytes.u8()?);
    let key = std::str::from_utf8(bytes.take(n)?).ok()?;
    let (kind, name) = key.split_once(' ')?;
    let wanted = ["sys_name", "ver_hw", "ver_sw_release"].contains(&name);
    if wanted && kind.starts_with("char[") {
        let value = String::from_utf8_lossy(bytes.rest()).into_owned();
        sink.note(format!("{name}: {}", value.trim_end_matches('\0')));
    }
    Some(())
}
