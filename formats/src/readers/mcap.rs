//! MCAP containers with messages in JSON, CDR (ROS 2), ROS 1 and protobuf.
//!
//! Records `opcode u8, size u64, content`, most of them in chunks that are packed by LZ4 or zstd.
//! A topic is a clock, by the time at which each message was logged; the fields of its messages
//! are channels: `/joint_states/velocity[0]`, or `/joint_states/velocity[shoulder]` where a field
//! `name` beside it names the elements.
//!
//! Reference: the MCAP format, <https://mcap.dev/spec>.

mod chunk;
mod json;
mod protobuf;
mod topic;

use std::collections::{HashMap, HashSet};
use std::rc::Rc;

use crate::bytes::{Bytes, Stream};
use crate::detect::Format;
use crate::error::FormatError;
use crate::input::Input;
use crate::sink::{Sink, Stamps};
use topic::{Decoder, Topic};

const MAGIC: u64 = 8;

const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const DATA_END: u8 = 0x0f;
const FOOTER: u8 = 2;

/// Reads all messages.
pub(crate) fn read(input: &mut Input, sink: &mut dyn Sink) -> Result<(), FormatError> {
    let mut reader = Reader::new(input.name());
    reader.records(input, sink)?;
    reader.finish(sink);
    Ok(())
}

/// A schema as it stands in the file.
#[derive(Clone, Debug, Default)]
pub(super) struct Schema {
    pub(super) name: String,
    pub(super) encoding: String,
    pub(super) data: Vec<u8>,
}

/// What is known while messages are read: topics, schemas, one origin of time.
pub(super) struct Reader {
    log: String,
    schemas: HashMap<u16, Schema>,
    decoders: HashMap<(u16, String), Rc<Decoder>>,
    topics: Vec<Topic>,
    /// Topics by name, encoding and type.
    names: HashMap<(String, String, String), usize>,
    taken: HashSet<String>,
    /// Topics by the number that messages carry.
    ids: HashMap<u16, usize>,
    pub(super) stamps: Stamps,
    places: usize,
    orphans: usize,
}

impl Reader {
    pub(super) fn new(log: &str) -> Self {
        Self {
            log: log.to_owned(),
            schemas: HashMap::new(),
            decoders: HashMap::new(),
            topics: Vec::new(),
            names: HashMap::new(),
            taken: HashSet::new(),
            ids: HashMap::new(),
            stamps: Stamps::default(),
            places: 0,
            orphans: 0,
        }
    }

    pub(super) fn records(
        &mut self,
        input: &mut Input,
        sink: &mut dyn Sink,
    ) -> Result<(), FormatError> {
        let mut stream = Stream::new(input)?;
        if !stream.skip(MAGIC)? {
            sink.cut(0, "the header");
            return Ok(());
        }
        loop {
            let at = stream.at();
            let head = stream.take(9)?.map(Bytes::new);
            let head = head.and_then(|mut h| Some((h.u8()?, h.u64()?)));
            let Some((opcode, size)) = head else {
                sink.cut(at, "a record");
                return Ok(());
            };
            match opcode {
                DATA_END | FOOTER => return Ok(()),
                SCHEMA | CHANNEL | MESSAGE | CHUNK => {
                    let name = stream.name().to_owned();
                    let Some(content) = stream.take(size)? else {
                        sink.cut(at, "a record");
                        return Ok(());
                    };
                    let done = match opcode {
                        CHUNK => self.chunk(content, at, &name, sink)?,
                        _ => self.record(opcode, content, sink)?,
                    };
                    if done.is_none() {
                        return Err(self.damaged(at, "a whole record", "one that is too short"));
                    }
                }
                0 => return Err(self.damaged(at, "a record", "the opcode 0")),
                _ => {
                    if !stream.skip(size)? {
                        sink.cut(at, "a record");
                        return Ok(());
                    }
                }
            }
        }
    }

    fn damaged(&self, at: u64, expected: &str, found: &str) -> FormatError {
        FormatError::Damaged {
            log: self.log.as_str().into(),
            format: Format::Mcap,
            position: at,
            expected: expected.into(),
            found: found.into(),
        }
    }

    /// The records of a chunk.
    fn chunk(
        &mut self,
        content: &[u8],
        at: u64,
        name: &str,
        sink: &mut dyn Sink,
    ) -> Result<Option<()>, FormatError> {
        let Some(chunk) = chunk::Chunk::parse(content) else {
            return Ok(None);
        };
        let data = chunk.unpack(at, name)?;
        let mut bytes = Bytes::new(&data);
        while !bytes.is_empty() {
            let record = (bytes.u8(), bytes.u64());
            let (Some(opcode), Some(size)) = record else {
                return Ok(None);
            };
            let content = usize::try_from(size).ok().and_then(|n| bytes.take(n));
            let Some(content) = content else {
                return Ok(None);
            };
            if self.record(opcode, content, sink)?.is_none() {
                return Ok(None);
            }
        }
        Ok(Some(()))
    }

    /// One record; none when it is too short.
    fn record(
        &mut self,
        opcode: u8,
        content: &[u8],
        sink: &mut dyn Sink,
    ) -> Result<Option<()>, FormatError> {
        let mut bytes = Bytes::new(content);
        match opcode {
            SCHEMA => Ok(self.schema(&mut bytes)),
            CHANNEL => Ok(self.channel(&mut bytes, sink)),
            MESSAGE => {
                let head = (bytes.u16(), bytes.u32(), bytes.u64(), bytes.u64());
                let (Some(id), _, Some(time), Some(_)) = head else {
                    return Ok(None);
                };
                self.message(id, i128::from(time), bytes.rest(), sink)?;
                Ok(Some(()))
            }
            _ => Ok(Some(())),
        }
    }

    fn schema(&mut self, bytes: &mut Bytes<'_>) -> Option<()> {
        let id = bytes.u16()?;
        let name = String::from_utf8_lossy(bytes.text32()?).into_owned();
        let encoding = String::from_utf8_lossy(bytes.text32()?).into_owned();
        let data = bytes.text32()?;
        let data = data.to_vec();
        self.define(
            id,
            Schema {
                name,
                encoding,
                data,
            },
        );
        Some(())
    }

    fn channel(&mut self, bytes: &mut Bytes<'_>, sink: &mut dyn Sink) -> Option<()> {
        let (id, schema) = (bytes.u16()?, bytes.u16()?);
        let topic = String::from_utf8_lossy(bytes.text32()?).into_owned();
        let encoding = String::from_utf8_lossy(bytes.text32()?).into_owned();
        if !self.ids.contains_key(&id) {
            self.add(id, &topic, &encoding, schema, sink);
        }
        Some(())
    }

    /// Takes a schema.
    pub(super) fn define(&mut self, id: u16, schema: Schema) {
        // A recorder writes a schema into every chunk that needs it.
        self.schemas.entry(id).or_insert(schema);
    }

    /// Forgets the numbers of the file before; topics of the same name go on.
    pub(super) fn next_file(&mut self) {
        self.schemas.clear();
        self.decoders.clear();
        self.ids.clear();
    }

    /// Announces a topic whose messages have a schema.
    pub(super) fn add(
        &mut self,
        id: u16,
        topic: &str,
        encoding: &str,
        schema: u16,
        sink: &mut dyn Sink,
    ) {
        let none = Schema::default();
        let shape = self.schemas.get(&schema).unwrap_or(&none);
        let key = (topic.to_owned(), encoding.to_owned(), shape.name.clone());
        if let Some(at) = self.names.get(&key) {
            self.ids.insert(id, *at);
            return;
        }
        let decoder = self.decoders.entry((schema, encoding.to_owned()));
        let decoder = decoder.or_insert_with(|| Rc::new(Decoder::new(encoding, shape)));
        // Two kinds of messages under one name.
        let name = match self.taken.insert(topic.to_owned()) {
            true => topic.to_owned(),
            false => format!("{topic}#{id}"),
        };
        let at = self.topics.len();
        self.topics
            .push(Topic::new(&name, Rc::clone(decoder), sink));
        self.names.insert(key, at);
        self.ids.insert(id, at);
    }

    /// Takes a message of a topic.
    pub(super) fn message(
        &mut self,
        id: u16,
        time: i128,
        data: &[u8],
        sink: &mut dyn Sink,
    ) -> Result<(), FormatError> {
        let topic = self.ids.get(&id).and_then(|at| self.topics.get_mut(*at));
        let Some(topic) = topic else {
            self.orphans += 1;
            return Ok(());
        };
        topic.message(time, data, &mut self.stamps, &mut self.places, sink)
    }

    pub(super) fn finish(self, sink: &mut dyn Sink) {
        if self.orphans > 0 {
            let n = self.orphans;
            sink.note(format!("{n} messages belong to no topic and were left out"));
        }
        for topic in &self.topics {
            topic.finish(sink);
        }
    }
}
