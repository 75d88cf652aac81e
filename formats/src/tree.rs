//! Messages with fields within fields, as channels.
//!
//! A [`Slot`] stands for one place in a message (`/joint_states/velocity[2]`) and remembers its
//! channel, so that a path is written once and not for every message.

use std::collections::HashMap;

use crate::error::FormatError;
use crate::sink::{ChannelInfo, Kind, Sink};

/// Messages within messages that are followed.
pub(crate) const DEPTH: usize = 32;

/// Places of all messages of a log.
const PLACES: usize = 20_000;

/// One place in a message.
#[derive(Debug, Default)]
pub(crate) struct Slot {
    path: String,
    alias: Option<String>,
    channel: Option<usize>,
    fields: Vec<Slot>,
    elements: Vec<Slot>,
    /// Fields or elements that are found by a name.
    names: HashMap<String, usize>,
}

/// Where the values of a message go.
pub(crate) struct Out<'s> {
    pub(crate) sink: &'s mut dyn Sink,
    pub(crate) clock: usize,
    /// Places made so far, of all topics.
    pub(crate) places: &'s mut usize,
}

impl Slot {
    /// The place of a whole message.
    pub(crate) fn root(topic: &str) -> Self {
        Self {
            path: topic.to_owned(),
            ..Self::default()
        }
    }

    pub(crate) fn path(&self) -> &str {
        &self.path
    }

    /// The field number `at`; none when there are too many places.
    pub(crate) fn field(&mut self, at: usize, name: &str, out: &mut Out<'_>) -> Option<&mut Slot> {
        while self.fields.len() <= at {
            *out.places += 1;
            if *out.places > PLACES {
                return None;
            }
            self.fields.push(Slot::default());
        }
        let slot = self.fields.get_mut(at)?;
        if slot.path.is_empty() {
            slot.path = format!("{}/{name}", self.path);
            slot.alias = self.alias.as_ref().map(|alias| format!("{alias}/{name}"));
        }
        Some(slot)
    }

    /// The field of a name.
    pub(crate) fn named(&mut self, name: &str, out: &mut Out<'_>) -> Option<&mut Slot> {
        let at = match self.names.get(name) {
            Some(at) => *at,
            None => {
                let at = self.fields.len();
                self.names.insert(name.to_owned(), at);
                at
            }
        };
        self.field(at, name, out)
    }

    /// The element number `at` of an array; where the array's elements have names, that of the
    /// name, which keeps the number that it had first.
    pub(crate) fn element(
        &mut self,
        at: usize,
        name: Option<&str>,
        out: &mut Out<'_>,
    ) -> Option<&mut Slot> {
        let at = match name {
            Some(name) => match self.names.get(name) {
                Some(known) => *known,
                None => {
                    let at = self.elements.len();
                    self.names.insert(name.to_owned(), at);
                    at
                }
            },
            None => at,
        };
        while self.elements.len() <= at {
            *out.places += 1;
            if *out.places > PLACES {
                return None;
            }
            let index = self.elements.len();
            let base = self.alias.as_ref().unwrap_or(&self.path);
            let alias = match name {
                Some(name) => Some(format!("{base}[{name}]")),
                None => self.alias.as_ref().map(|alias| format!("{alias}[{index}]")),
            };
            self.elements.push(Slot {
                path: format!("{}[{index}]", self.path),
                alias,
                ..Self::default()
            });
        }
        self.elements.get_mut(at)
    }

    /// The channel of this place, announced when it is first needed.
    fn channel(
        &mut self,
        kind: Kind,
        declared: &str,
        unit: Option<&str>,
        out: &mut Out<'_>,
    ) -> Result<usize, FormatError> {
        if let Some(channel) = self.channel {
            return Ok(channel);
        }
        let mut info = ChannelInfo::new(&self.path, kind, declared).in_unit(unit);
        info.alias = self.alias.clone();
        let channel = out.sink.channel(info.at(out.clock))?;
        self.channel = Some(channel);
        Ok(channel)
    }

    pub(crate) fn number(
        &mut self,
        value: f64,
        declared: &str,
        out: &mut Out<'_>,
    ) -> Result<(), FormatError> {
        let channel = self.channel(Kind::Number, declared, None, out)?;
        out.sink.number(channel, value)
    }

    pub(crate) fn boolean(&mut self, value: bool, out: &mut Out<'_>) -> Result<(), FormatError> {
        let channel = self.channel(Kind::Boolean, "bool", None, out)?;
        out.sink.number(channel, f64::from(value))
    }

    /// A point in time or a duration, s.
    pub(crate) fn seconds(
        &mut self,
        value: f64,
        declared: &str,
        out: &mut Out<'_>,
    ) -> Result<(), FormatError> {
        let channel = self.channel(Kind::Number, declared, Some("s"), out)?;
        out.sink.number(channel, value)
    }

    pub(crate) fn text(&mut self, value: &str, out: &mut Out<'_>) -> Result<(), FormatError> {
        let channel = self.channel(Kind::Text, "string", None, out)?;
        out.sink.text(channel, value)
    }

    pub(crate) fn opaque(&mut self, declared: &str, out: &mut Out<'_>) -> Result<(), FormatError> {
        let channel = self.channel(Kind::Opaque, declared, None, out)?;
        out.sink.opaque(channel)
    }
}
