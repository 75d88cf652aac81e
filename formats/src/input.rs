//! Where a log comes from: a file, a folder, bytes, standard input; packed or not.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use ruzstd::decoding::StreamingDecoder;

use crate::detect::{Content, Format, HEAD, detect};
use crate::error::FormatError;
use crate::foreign::by_name;

/// How many times its own size a packed file may unfold to.
pub const UNPACK_FACTOR: u64 = 64;
/// What any packed file may unfold to, bytes.
pub const UNPACK_LEAST: u64 = 16 << 20;
/// Bytes taken from standard input or a pipe.
pub const PIPE_MOST: u64 = 4 << 30;
/// Wrappers within wrappers.
const NESTED: usize = 3;

/// The content of a log, unpacked, ready to be read by a reader.
#[derive(Debug)]
pub struct Input {
    name: String,
    folder: Option<PathBuf>,
    data: Data,
    len: u64,
    format: Format,
    packed: Vec<&'static str>,
}

#[derive(Debug)]
enum Data {
    Memory(Cursor<Vec<u8>>),
    File(BufReader<File>),
}

impl Input {
    /// Opens a file, a folder of a ROS 2 bag, or standard input for the path `-`.
    ///
    /// # Errors
    ///
    /// [`FormatError`] when it cannot be read, is empty, or is of a format that is not read.
    pub fn open(path: &Path) -> Result<Self, FormatError> {
        let io = |e: io::Error| FormatError::Io {
            path: path.to_owned(),
            message: e.to_string().into(),
        };
        if path.as_os_str() == "-" {
            return Self::from_stream(io::stdin().lock(), "standard input");
        }
        let name = path.display().to_string();
        let about = std::fs::metadata(path).map_err(io)?;
        if about.is_dir() {
            return Ok(Self {
                name,
                folder: Some(path.to_owned()),
                data: Data::Memory(Cursor::default()),
                len: folder_size(path).map_err(io)?,
                format: Format::RosBag,
                packed: Vec::new(),
            });
        }
        let file = File::open(path).map_err(io)?;
        if !about.is_file() {
            return Self::from_stream(file, &name);
        }
        Self::identify(name, Data::File(BufReader::new(file)), about.len())
    }

    /// Takes bytes; `name` is what errors call them.
    ///
    /// # Errors
    ///
    /// As [`Input::open`].
    pub fn from_bytes(bytes: Vec<u8>, name: &str) -> Result<Self, FormatError> {
        let len = bytes.len() as u64;
        Self::identify(name.to_owned(), Data::Memory(Cursor::new(bytes)), len)
    }

    /// Takes all that a stream gives, up to [`PIPE_MOST`].
    ///
    /// # Errors
    ///
    /// As [`Input::open`].
    pub fn from_stream(stream: impl Read, name: &str) -> Result<Self, FormatError> {
        let bytes = read_bounded(stream, PIPE_MOST, name)?;
        Self::from_bytes(bytes, name)
    }

    fn identify(name: String, data: Data, len: u64) -> Result<Self, FormatError> {
        let mut input = Self {
            name,
            folder: None,
            data,
            len,
            format: Format::Text,
            packed: Vec::new(),
        };
        loop {
            let mut head = Vec::with_capacity(HEAD);
            input.rewind()?;
            let read = (&mut input).take(HEAD as u64).read_to_end(&mut head);
            read.map_err(|e| input.io(&e))?;
            if head.is_empty() {
                return Err(FormatError::Empty {
                    log: input.name.into(),
                });
            }
            let mut content = detect(&head);
            if content == Content::Log(Format::Text)
                && let Some((what, remedy)) = by_name(&input.name, &head)
            {
                content = Content::NotRead(what, remedy);
            }
            match content {
                Content::Log(format) => input.format = format,
                Content::Zip => input.format = input.zip()?,
                Content::NotRead(what, remedy) => {
                    return Err(FormatError::NotRead {
                        log: input.name.into(),
                        what: what.into(),
                        remedy: remedy.into(),
                    });
                }
                wrapper => {
                    input = input.unpack(wrapper)?;
                    continue;
                }
            }
            input.rewind()?;
            return Ok(input);
        }
    }

    fn unpack(mut self, wrapper: Content) -> Result<Self, FormatError> {
        let (what, format) = match wrapper {
            Content::Gzip => ("gzip", "packed by gzip"),
            Content::Zstd => ("zstd", "packed by zstd"),
            _ => ("UTF-16", "text as UTF-16"),
        };
        if self.packed.len() >= NESTED {
            return Err(FormatError::NotRead {
                log: self.name.into(),
                what: "packed again and again".into(),
                remedy: "unpack it".into(),
            });
        }
        self.rewind()?;
        let limit = UNPACK_LEAST.max(self.len.saturating_mul(UNPACK_FACTOR));
        let name = self.name.clone();
        let broken = |e: io::Error| FormatError::NotRead {
            log: name.as_str().into(),
            what: format.into(),
            remedy: format!("and cannot be unpacked: {e}").into(),
        };
        let mut bytes = Vec::new();
        let source = BufReader::new(&mut self);
        let read = match wrapper {
            Content::Gzip => flate2::read::MultiGzDecoder::new(source)
                .take(limit + 1)
                .read_to_end(&mut bytes),
            Content::Zstd => unpack_zstd(source, limit + 1, &mut bytes),
            Content::Utf16 { little } => unpack_utf16(source, little, limit, &mut bytes),
            _ => Ok(0),
        };
        // What was unpacked before the cut is there; the reader finds that it ends too early.
        match read {
            Err(e) if e.kind() != io::ErrorKind::UnexpectedEof || bytes.is_empty() => {
                return Err(broken(e));
            }
            _ => {}
        }
        if bytes.len() as u64 > limit {
            return Err(too_large(&self.name, "the unpacked content", limit));
        }
        self.packed.push(what);
        self.len = bytes.len() as u64;
        self.data = Data::Memory(Cursor::new(bytes));
        Ok(self)
    }

    /// A zip archive of NumPy arrays, or what else it is by the names of its entries.
    fn zip(&mut self) -> Result<Format, FormatError> {
        let name = self.name.clone();
        let not_read = |what: &str, remedy: &str| FormatError::NotRead {
            log: name.as_str().into(),
            what: what.into(),
            remedy: remedy.into(),
        };
        self.rewind()?;
        let archive = zip::ZipArchive::new(&mut *self)
            .map_err(|e| not_read("a zip archive", &format!("and is damaged: {e}")))?;
        let names: Vec<String> = archive
            .file_names()
            .filter_map(|name| Some(name.ok()?.into_owned()))
            .collect();
        let any = |test: fn(&str) -> bool| names.iter().any(|n| test(n));
        if any(|n| n.ends_with(".npy")) {
            return Ok(Format::Npz);
        }
        if any(|n| n.starts_with("xl/")) {
            return Err(not_read(
                "an Excel workbook (XLSX)",
                "save the sheet as CSV",
            ));
        }
        if any(|n| n.starts_with("simulink/")) {
            return Err(not_read(
                "a Simulink model (SLX)",
                "save the logged signals in a MAT file",
            ));
        }
        let first = names
            .first()
            .map_or(String::new(), |n| format!(": `{n}` is in it"));
        Err(not_read("a zip archive", &format!("unpack it{first}")))
    }

    /// File name, or what else errors call it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Format of the unpacked content.
    pub fn format(&self) -> Format {
        self.format
    }

    /// Size of the unpacked content, bytes.
    pub fn size(&self) -> u64 {
        self.len
    }

    /// Wrappers that were taken off, the outermost first.
    pub fn packed(&self) -> &[&'static str] {
        &self.packed
    }

    /// The folder, where it is one.
    pub fn folder(&self) -> Option<&Path> {
        self.folder.as_deref()
    }

    /// The whole content.
    ///
    /// # Errors
    ///
    /// [`FormatError::Io`].
    pub fn into_bytes(self) -> Result<Vec<u8>, FormatError> {
        match self.data {
            Data::Memory(cursor) => Ok(cursor.into_inner()),
            Data::File(reader) => {
                let (name, len) = (self.name, self.len);
                let io = |error: io::Error| FormatError::Io {
                    path: name.clone().into(),
                    message: error.to_string().into(),
                };
                // Past the buffer, into room for all of it: a large file is copied once.
                let mut file = reader.into_inner();
                file.rewind().map_err(io)?;
                let mut bytes = Vec::new();
                let room = usize::try_from(len).ok();
                let room = room.and_then(|len| bytes.try_reserve_exact(len.checked_add(1)?).ok());
                room.ok_or_else(|| io(io::ErrorKind::OutOfMemory.into()))?;
                file.read_to_end(&mut bytes).map_err(io)?;
                Ok(bytes)
            }
        }
    }

    /// Goes to the beginning.
    pub(crate) fn rewind(&mut self) -> Result<(), FormatError> {
        let sought = self.seek(SeekFrom::Start(0));
        sought.map(|_| ()).map_err(|e| self.io(&e))
    }

    /// An error of the operating system on this input.
    pub(crate) fn io(&self, error: &io::Error) -> FormatError {
        FormatError::Io {
            path: self.name.clone().into(),
            message: error.to_string().into(),
        }
    }
}

impl Read for Input {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match &mut self.data {
            Data::Memory(data) => data.read(buffer),
            Data::File(data) => data.read(buffer),
        }
    }
}

impl Seek for Input {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match &mut self.data {
            Data::Memory(data) => data.seek(to),
            Data::File(data) => data.seek(to),
        }
    }
}

/// Bytes of all files in a folder.
fn folder_size(path: &Path) -> io::Result<u64> {
    let mut sum = 0u64;
    for entry in std::fs::read_dir(path)? {
        let about = entry?.metadata()?;
        sum = sum.saturating_add(if about.is_file() { about.len() } else { 0 });
    }
    Ok(sum)
}

fn read_bounded(stream: impl Read, limit: u64, name: &str) -> Result<Vec<u8>, FormatError> {
    let mut bytes = Vec::new();
    stream
        .take(limit + 1)
        .read_to_end(&mut bytes)
        .map_err(|e| FormatError::Io {
            path: name.into(),
            message: e.to_string().into(),
        })?;
    if bytes.len() as u64 > limit {
        return Err(too_large(name, "a stream", limit));
    }
    Ok(bytes)
}

/// Frame after frame, as `zstd` itself reads a file.
pub(crate) fn unpack_zstd(
    mut source: impl BufRead,
    limit: u64,
    bytes: &mut Vec<u8>,
) -> io::Result<usize> {
    let before = bytes.len();
    while !source.fill_buf()?.is_empty() {
        let mut decoder = StreamingDecoder::new(&mut source).map_err(io::Error::other)?;
        let room = limit.saturating_sub((bytes.len() - before) as u64);
        (&mut decoder).take(room).read_to_end(bytes)?;
        if (bytes.len() - before) as u64 >= limit {
            break;
        }
    }
    Ok(bytes.len() - before)
}

/// As UTF-8, without the mark of the order of bytes; what is no letter becomes U+FFFD.
fn unpack_utf16(
    source: impl Read,
    little: bool,
    limit: u64,
    bytes: &mut Vec<u8>,
) -> io::Result<usize> {
    let mut raw = Vec::new();
    source.take(limit).read_to_end(&mut raw)?;
    let unit = match little {
        true => u16::from_le_bytes,
        false => u16::from_be_bytes,
    };
    let units = raw
        .chunks_exact(2)
        .skip(1)
        .filter_map(|pair| Some(unit(pair.try_into().ok()?)));
    let letters = char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER));
    let text: String = letters.collect();
    bytes.extend(text.as_bytes());
    Ok(text.len())
}

pub(crate) fn too_large(log: &str, what: &str, limit: u64) -> FormatError {
    FormatError::TooLarge {
        log: log.into(),
        what: what.into(),
        limit,
    }
}
