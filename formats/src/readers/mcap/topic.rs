//! One topic of a bag: how its messages are decoded, and where their values go.

use std::rc::Rc;

use super::Schema;
use super::json;
use crate::error::FormatError;
use crate::ros::{Layout, Ros};
use crate::sink::{ChannelInfo, Kind, Sink, Stamps};
use crate::tree::{Out, Slot};

pub(super) struct Topic {
    root: Slot,
    decoder: Rc<Decoder>,
    clock: Option<usize>,
    opaque: Option<usize>,
    messages: usize,
    /// Messages that did not fit their schema.
    broken: usize,
}

/// How the messages of a schema are decoded; topics of one schema share it.
pub(super) enum Decoder {
    Json,
    Ros(Box<Layout>),
    Protobuf(Box<super::protobuf::Layout>),
    /// Not decoded; what it is, and why.
    Opaque {
        declared: String,
        why: String,
    },
}

impl Decoder {
    /// What an encoding and a schema ask for.
    pub(super) fn new(encoding: &str, schema: &Schema) -> Self {
        Self::make(encoding, schema).unwrap_or_else(|why| Decoder::Opaque {
            declared: format!("{encoding} {}", schema.name),
            why,
        })
    }

    fn make(encoding: &str, schema: &Schema) -> Result<Self, String> {
        let text = || String::from_utf8_lossy(&schema.data);
        let ros = |text: &str, ros| {
            let layout = Layout::new(&schema.name, text, ros);
            match layout.lacks() {
                Some(lacking) => Err(format!("the definition of {lacking} is incomplete")),
                None => Ok(Decoder::Ros(Box::new(layout))),
            }
        };
        match (encoding, schema.encoding.as_str()) {
            ("json", _) => Ok(Decoder::Json),
            ("cdr", "ros2msg") => ros(&text(), Ros::Two),
            ("cdr", _) => match crate::ros::definition_of(&schema.name) {
                Some(text) => ros(&text, Ros::Two),
                None => Err(format!(
                    "the file has no definition (ros2msg) of {}",
                    schema.name
                )),
            },
            ("ros1", "ros1msg") => ros(&text(), Ros::One),
            ("protobuf", "protobuf") => {
                let layout = super::protobuf::Layout::new(&schema.name, &schema.data)?;
                Ok(Decoder::Protobuf(Box::new(layout)))
            }
            (encoding, schema) => Err(format!(
                "messages in `{encoding}` with a schema in `{schema}` are not read"
            )),
        }
    }
}

impl Topic {
    pub(super) fn new(name: &str, decoder: Rc<Decoder>, sink: &mut dyn Sink) -> Self {
        if let Decoder::Opaque { why, .. } = &*decoder {
            sink.note(format!("{name}: {why}"));
        }
        Self {
            root: Slot::root(name),
            decoder,
            clock: None,
            opaque: None,
            messages: 0,
            broken: 0,
        }
    }

    pub(super) fn name(&self) -> &str {
        self.root.path()
    }

    /// Takes a message logged at a time in ns.
    pub(super) fn message(
        &mut self,
        time: i128,
        data: &[u8],
        stamps: &mut Stamps,
        places: &mut usize,
        sink: &mut dyn Sink,
    ) -> Result<(), FormatError> {
        self.messages += 1;
        let clock = *self
            .clock
            .get_or_insert_with(|| sink.clock(self.root.path()));
        let time = stamps.seconds(time, sink);
        sink.tick(clock, time)?;
        let mut out = Out {
            sink,
            clock,
            places,
        };
        let whole = match &*self.decoder {
            Decoder::Json => json::decode(data, &mut self.root, &mut out)?,
            Decoder::Ros(layout) => layout.decode(data, &mut self.root, stamps, &mut out)?,
            Decoder::Protobuf(layout) => layout.decode(data, &mut self.root, stamps, &mut out)?,
            Decoder::Opaque { declared, .. } => {
                let channel = match self.opaque {
                    Some(channel) => channel,
                    None => {
                        let info =
                            ChannelInfo::new(self.root.path(), Kind::Opaque, declared.as_str());
                        let channel = out.sink.channel(info.at(clock))?;
                        *self.opaque.insert(channel)
                    }
                };
                out.sink.opaque(channel)?;
                true
            }
        };
        self.broken += usize::from(!whole);
        Ok(())
    }

    pub(super) fn finish(&self, sink: &mut dyn Sink) {
        if self.broken > 0 {
            sink.note(format!(
                "{}: {} of {} messages do not fit their definition",
                self.name(),
                self.broken,
                self.messages
            ));
        }
    }
}
