//! HDF5 files, MATLAB v7.3 among them.
//!
//! Every dataset of numbers is a channel, `/group/name`; a matrix is one for each row (or column,
//! where those are fewer), a table (compound type) one for each member. The attributes `unit` or
//! `units` are its unit. In a file of MATLAB a path has dots, a matrix is also `y(:,2)`.
//!
//! Reference: The HDF Group, "HDF5 File Format Specification Version 3.0".

use hdf5_reader::error::Error;
use hdf5_reader::group::Group;
use hdf5_reader::{Dataset, Datatype, Hdf5File, OpenOptions, VarLenKind};

use crate::columns::{Array, Order};
use crate::detect::Format;
use crate::error::FormatError;
use crate::input::{Input, UNPACK_FACTOR, UNPACK_LEAST};
use crate::sink::{ChannelInfo, Kind, Sink};

/// Groups within groups.
const DEPTH: usize = 16;
/// Groups and datasets that are looked at.
const OBJECTS: usize = 20_000;

/// Reads all datasets.
pub(crate) fn read(input: Input, sink: &mut dyn Sink) -> Result<(), FormatError> {
    let name = input.name().to_owned();
    let refused = |e: Error| FormatError::Refused {
        log: name.as_str().into(),
        format: Format::Hdf5,
        message: e.to_string().into(),
    };
    let size = input.size();
    let limit = UNPACK_LEAST.max(size.saturating_mul(UNPACK_FACTOR));
    let limit = usize::try_from(limit).unwrap_or(usize::MAX);
    let options = OpenOptions::default()
        .with_max_chunk_bytes(limit)
        .with_max_read_bytes(limit)
        .with_chunk_cache_bytes(1 << 20);
    let bytes = input.into_bytes()?;
    let matlab = bytes.starts_with(b"MATLAB");
    let file = Hdf5File::from_vec_with_options(bytes, options).map_err(refused)?;
    let root = file.root_group().map_err(refused)?;
    let mut reader = Reader {
        matlab,
        objects: 0,
        left: limit,
    };
    reader.group(&root, "", 0, sink)
}

struct Reader {
    matlab: bool,
    objects: usize,
    /// Bytes that may still be read.
    left: usize,
}

impl Reader {
    fn group(
        &mut self,
        group: &Group,
        path: &str,
        depth: usize,
        sink: &mut dyn Sink,
    ) -> Result<(), FormatError> {
        let members = match group.members() {
            Ok(members) => members,
            Err(e) => {
                sink.note(format!("the group {path}/ cannot be read: {e}"));
                return Ok(());
            }
        };
        let (groups, datasets) = members;
        for dataset in &datasets {
            self.objects += 1;
            if self.objects > OBJECTS {
                return Ok(());
            }
            let path = self.path(path, dataset.name());
            if let Err(e) = self.dataset(dataset, &path, sink)? {
                sink.note(format!("{path} cannot be read: {e}"));
                let info = ChannelInfo::new(path, Kind::Opaque, "unreadable");
                let channel = sink.channel(info)?;
                sink.opaque(channel)?;
            }
        }
        for inner in &groups {
            self.objects += 1;
            // MATLAB keeps what cells refer to in groups that begin with `#`.
            let hidden = self.matlab && inner.name().starts_with('#');
            if depth < DEPTH && self.objects <= OBJECTS && !hidden {
                let path = self.path(path, inner.name());
                self.group(inner, &path, depth + 1, sink)?;
            }
        }
        Ok(())
    }

    fn path(&self, path: &str, name: &str) -> String {
        match (self.matlab, path) {
            (true, "") => name.to_owned(),
            (true, path) => format!("{path}.{name}"),
            (false, path) => format!("{path}/{name}"),
        }
    }

    fn dataset(
        &mut self,
        dataset: &Dataset,
        path: &str,
        sink: &mut dyn Sink,
    ) -> Result<Result<(), Error>, FormatError> {
        let attribute = |names: &[&str]| {
            let find = |name: &&str| dataset.attribute(name).ok()?.read_string().ok();
            names.iter().find_map(find)
        };
        let class = attribute(&["MATLAB_class"]);
        let empty = dataset.attribute("MATLAB_empty").is_ok();
        let unit = attribute(&["unit", "units", "Unit", "Units"]).filter(|u| !u.is_empty());
        let shape: Option<Vec<usize>> = dataset
            .shape()
            .iter()
            .map(|n| usize::try_from(*n).ok())
            .collect();
        let Some(shape) = shape else {
            return Ok(Err(Error::Other("its shape is too large".into())));
        };
        let opaque = |what: &str, sink: &mut dyn Sink| {
            let channel = sink.channel(ChannelInfo::new(path, Kind::Opaque, what))?;
            sink.opaque(channel)
        };
        if empty {
            return opaque("empty", sink).map(Ok);
        }
        let texts = match dataset.dtype() {
            Datatype::String { .. } => true,
            Datatype::VarLen { kind, .. } => *kind == VarLenKind::String,
            _ => false,
        };
        if texts {
            let texts = match dataset.read_strings() {
                Ok(texts) => texts,
                Err(e) => return Ok(Err(e)),
            };
            let info = ChannelInfo::new(path, Kind::Text, "string");
            let channel = sink.channel(info)?;
            for text in texts {
                sink.text(channel, &text)?;
            }
            return Ok(Ok(()));
        }
        let members = members(dataset.dtype());
        if members.is_empty() {
            return opaque(&format!("{:?}", dataset.dtype()), sink).map(Ok);
        }
        let bytes = match self.bytes(dataset) {
            Ok(bytes) => bytes,
            Err(e) => return Ok(Err(e)),
        };
        if class.as_deref() == Some("char") {
            let text: Vec<u16> = bytes
                .chunks_exact(2)
                .map(|c| u16::from_le_bytes([c[0], c[1]]))
                .collect();
            let channel = sink.channel(ChannelInfo::new(path, Kind::Text, "char"))?;
            sink.text(channel, &String::from_utf16_lossy(&text))?;
            return Ok(Ok(()));
        }
        let row = dataset.raw_element_size().unwrap_or(0).max(1);
        for member in &members {
            let values: Vec<f64> = bytes
                .chunks_exact(row)
                .filter_map(|row| member.value(row))
                .collect();
            let path = match &member.name {
                Some(name) => format!("{path}.{name}"),
                None => path.to_owned(),
            };
            let array = Array {
                path: &path,
                shape: &shape,
                order: Order::Row,
                kind: match (member.boolean, class.as_deref()) {
                    (true, _) | (_, Some("logical")) => Kind::Boolean,
                    _ => Kind::Number,
                },
                declared: &member.declared,
                unit: unit.clone(),
                matlab: self.matlab,
            };
            array.emit(&values, sink)?;
        }
        Ok(Ok(()))
    }

    fn bytes(&mut self, dataset: &Dataset) -> Result<Vec<u8>, Error> {
        let size = dataset.raw_byte_len()?;
        // An element of one byte becomes a number of eight.
        let row = dataset.raw_element_size().unwrap_or(0).max(1);
        let cost = size.max((size / row).saturating_mul(size_of::<f64>()));
        match self.left.checked_sub(cost) {
            Some(left) => self.left = left,
            None => {
                return Err(Error::Other(
                    "it is out of proportion to the file's size".into(),
                ));
            }
        }
        dataset.read_raw_bytes()
    }
}

/// A number within an element.
struct Member {
    name: Option<String>,
    at: usize,
    size: usize,
    float: bool,
    signed: bool,
    big: bool,
    boolean: bool,
    declared: String,
}

impl Member {
    fn value(&self, row: &[u8]) -> Option<f64> {
        let bytes = row.get(self.at..self.at.checked_add(self.size)?)?;
        let add = |sum: u64, b: &u8| (sum << 8) | u64::from(*b);
        let raw = match self.big {
            true => bytes.iter().fold(0, add),
            false => bytes.iter().rev().fold(0, add),
        };
        Some(match (self.float, self.size) {
            (true, 4) => f64::from(f32::from_bits(raw as u32)),
            (true, _) => f64::from_bits(raw),
            (false, n) if self.signed => {
                let up = 64 - 8 * n as u32;
                ((raw << up) as i64 >> up) as f64
            }
            _ => raw as f64,
        })
    }
}

fn members(of: &Datatype) -> Vec<Member> {
    match of {
        Datatype::Compound { fields, .. } => fields
            .iter()
            .filter_map(|field| {
                let mut member = member(&field.datatype)?;
                member.name = Some(field.name.clone());
                member.at = usize::try_from(field.byte_offset).ok()?;
                Some(member)
            })
            .collect(),
        other => member(other).into_iter().collect(),
    }
}

fn member(of: &Datatype) -> Option<Member> {
    let big = |order: &hdf5_reader::ByteOrder| *order == hdf5_reader::ByteOrder::BigEndian;
    let number = |size: u8, float, signed, big| {
        let letter = match (float, signed) {
            (true, _) => "float",
            (_, true) => "int",
            _ => "uint",
        };
        let fits = match float {
            true => matches!(size, 4 | 8),
            false => (1..=8).contains(&size),
        };
        fits.then(|| Member {
            name: None,
            at: 0,
            size: usize::from(size),
            float,
            signed,
            big,
            boolean: false,
            declared: format!("{letter}{}", u32::from(size) * 8),
        })
    };
    match of {
        Datatype::FixedPoint {
            size,
            signed,
            byte_order,
        } => number(*size, false, *signed, big(byte_order)),
        Datatype::FloatingPoint { size, byte_order } => number(*size, true, false, big(byte_order)),
        Datatype::Enum { base, members } => {
            let mut member = member(base)?;
            member.boolean = members.len() == 2;
            Some(member)
        }
        _ => None,
    }
}
