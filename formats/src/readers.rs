//! One reader for each format.

#[cfg(feature = "arrow")]
mod arrow;
#[cfg(feature = "hdf5")]
mod hdf5;
mod mat;
mod mcap;
mod numpy;
#[cfg(feature = "parquet")]
mod parquet;
mod rosbag;
#[cfg(feature = "sqlite")]
mod sqlite;
mod ulog;
mod wpilog;

use crate::detect::Format;
use crate::error::FormatError;
use crate::input::Input;
use crate::sink::Sink;

/// Reads an input, whatever its format, into a sink.
///
/// # Errors
///
/// [`FormatError`] says what is wrong and where. A file that ends too early is no error: what is
/// before the cut is read, and [`Sink::cut`] told.
pub fn read_into(mut input: Input, sink: &mut dyn Sink) -> Result<(), FormatError> {
    match input.format() {
        Format::Wpilog => wpilog::read(&mut input, sink),
        Format::Ulog => ulog::read(&mut input, sink),
        Format::Mcap => mcap::read(&mut input, sink),
        Format::RosBag => rosbag::read(&input, sink),
        Format::Mat5 => mat::read(&mut input, sink),
        Format::Npy => numpy::read_npy(&mut input, sink),
        Format::Npz => numpy::read_npz(&mut input, sink),
        #[cfg(feature = "sqlite")]
        Format::Sqlite => sqlite::read(input, sink),
        #[cfg(feature = "hdf5")]
        Format::Hdf5 => hdf5::read(input, sink),
        #[cfg(feature = "parquet")]
        Format::Parquet => parquet::read(input, sink),
        #[cfg(feature = "arrow")]
        Format::Arrow => arrow::read_file(input, sink),
        #[cfg(feature = "arrow")]
        Format::ArrowStream => arrow::read_stream(input, sink),
        Format::Text => Err(FormatError::NotRead {
            log: input.name().into(),
            what: "text".into(),
            remedy: "CSV and JSON are read elsewhere".into(),
        }),
        #[allow(
            unreachable_patterns,
            reason = "with all features every format is read"
        )]
        format => Err(not_built(&input, format)),
    }
}

/// A database within a bag.
fn sqlite(input: Input, reader: &mut mcap::Reader, sink: &mut dyn Sink) -> Result<(), FormatError> {
    #[cfg(feature = "sqlite")]
    return sqlite::read_into(input, reader, sink);
    #[cfg(not(feature = "sqlite"))]
    {
        let _ = (reader, sink);
        Err(not_built(&input, Format::Sqlite))
    }
}

#[allow(dead_code, reason = "with all features every format is read")]
fn not_built(input: &Input, format: Format) -> FormatError {
    FormatError::NotBuilt {
        log: input.name().into(),
        format,
        feature: match format {
            Format::Sqlite => "sqlite",
            Format::Hdf5 => "hdf5",
            Format::Parquet => "parquet",
            Format::Arrow | Format::ArrowStream => "arrow",
            _ => "all",
        },
    }
}
