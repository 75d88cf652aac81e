//! Which format a file has, by its content.

use std::fmt;

use crate::foreign::{NOT_READ, by_text};

/// A format of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// Text: CSV, TSV, SysId JSON; not read by this crate.
    Text,
    /// WPILib data log.
    Wpilog,
    /// PX4 flight log.
    Ulog,
    /// MCAP container.
    Mcap,
    /// Folder that `ros2 bag record` wrote.
    RosBag,
    /// SQLite database of a ROS 2 bag.
    Sqlite,
    /// MATLAB level 5 (also v6 and v7).
    Mat5,
    /// HDF5; MATLAB v7.3 is one.
    Hdf5,
    /// NumPy array.
    Npy,
    /// Archive of NumPy arrays.
    Npz,
    /// Parquet table.
    Parquet,
    /// Arrow IPC file; Feather 2 is one.
    Arrow,
    /// Arrow IPC stream.
    ArrowStream,
}

impl Format {
    /// Name as people say it.
    pub fn name(self) -> &'static str {
        match self {
            Format::Text => "text",
            Format::Wpilog => "WPILOG",
            Format::Ulog => "ULog",
            Format::Mcap => "MCAP",
            Format::RosBag => "ROS 2 bag",
            Format::Sqlite => "SQLite",
            Format::Mat5 => "MATLAB MAT",
            Format::Hdf5 => "HDF5",
            Format::Npy => "NumPy npy",
            Format::Npz => "NumPy npz",
            Format::Parquet => "Parquet",
            Format::Arrow => "Arrow",
            Format::ArrowStream => "Arrow stream",
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What the first bytes of a file say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// A format that this crate reads, or text.
    Log(Format),
    /// A zip archive: NumPy, or something else by its entries.
    Zip,
    /// Packed by gzip.
    Gzip,
    /// Packed by zstd.
    Zstd,
    /// Text of two bytes a letter (UTF-16), the low byte first or last.
    Utf16 {
        /// The low byte is the first.
        little: bool,
    },
    /// Known and not read: what it is, and what helps.
    NotRead(&'static str, &'static str),
}

/// Bytes that [`detect`] looks at.
pub const HEAD: usize = 1024;

/// Formats that are read, by magic number.
const READ: [(&[u8], Format); 9] = [
    (b"WPILOG", Format::Wpilog),
    (b"ULog\x01\x12\x35", Format::Ulog),
    (b"\x89MCAP0\r\n", Format::Mcap),
    (b"SQLite format 3\0", Format::Sqlite),
    (b"\x89HDF\r\n\x1a\n", Format::Hdf5),
    (b"\x93NUMPY", Format::Npy),
    (b"PAR1", Format::Parquet),
    (b"ARROW1", Format::Arrow),
    // A stream begins with a continuation marker and the length of a schema.
    (b"\xff\xff\xff\xff", Format::ArrowStream),
];

/// What a file is, by its first [`HEAD`] bytes. Whatever has no magic number counts as text.
pub fn detect(head: &[u8]) -> Content {
    let starts = |magic: &[u8]| head.starts_with(magic);
    if starts(b"\x1f\x8b") {
        return Content::Gzip;
    }
    if starts(b"\x28\xb5\x2f\xfd") {
        return Content::Zstd;
    }
    match head {
        [0xff, 0xfe, ..] => return Content::Utf16 { little: true },
        [0xfe, 0xff, ..] => return Content::Utf16 { little: false },
        _ => {}
    }
    if starts(b"PK\x03\x04") || starts(b"PK\x05\x06") {
        return Content::Zip;
    }
    if let Some((_, format)) = READ.iter().find(|(magic, _)| starts(magic)) {
        return Content::Log(*format);
    }
    for (at, magic, what, remedy) in &NOT_READ {
        if head.get(*at..).is_some_and(|rest| rest.starts_with(magic)) {
            return Content::NotRead(what, remedy);
        }
    }
    // HDF5 may stand behind a block of the user's; MATLAB v7.3 has 512 bytes of it.
    if head.get(512..520) == Some(b"\x89HDF\r\n\x1a\n") {
        return Content::Log(Format::Hdf5);
    }
    if is_mat5(head) {
        return Content::Log(Format::Mat5);
    }
    if let Some((what, remedy)) = by_text(head) {
        return Content::NotRead(what, remedy);
    }
    Content::Log(Format::Text)
}

/// 124 bytes of text, a version, and two letters that tell the order of bytes.
fn is_mat5(head: &[u8]) -> bool {
    let Some(mark) = head.get(124..128) else {
        return false;
    };
    matches!(mark, [0, 1, b'I', b'M'] | [1, 0, b'M', b'I'])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn magic_numbers_decide() {
        assert_eq!(detect(b"WPILOG\x00\x01"), Content::Log(Format::Wpilog));
        assert_eq!(detect(b"time_s,u\n0,1\n"), Content::Log(Format::Text));
        assert_eq!(detect(b""), Content::Log(Format::Text));
        assert_eq!(detect(b"\x1f\x8b\x08"), Content::Gzip);
        let mut mat = vec![b' '; 128];
        mat[124..].copy_from_slice(&[0, 1, b'I', b'M']);
        assert_eq!(detect(&mat), Content::Log(Format::Mat5));
        let mut v73 = vec![b' '; 600];
        v73[124..128].copy_from_slice(&[0, 2, b'I', b'M']);
        v73[512..520].copy_from_slice(b"\x89HDF\r\n\x1a\n");
        assert_eq!(detect(&v73), Content::Log(Format::Hdf5));
    }

    #[test]
    fn what_is_not_read_is_named_with_a_converter() {
        for (bytes, name, with) in [
            (&b"#ROSBAG V2.0\n"[..], "ROS 1 bag", "rosbags-convert"),
            (b"TDSm\x0e", "TDMS", "nptdms"),
            (b"\xa3\x95\x80\x80\x59", "DataFlash", "mavlogdump"),
            (b"LOGG\x90", "BLF", "python-can"),
        ] {
            let Content::NotRead(what, remedy) = detect(bytes) else {
                panic!("{name}");
            };
            assert!(
                what.contains(name) && remedy.contains(with),
                "{what}: {remedy}"
            );
        }
    }
}
