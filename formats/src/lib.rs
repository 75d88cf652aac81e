//! Logs of other programs: whatever the format, channels with their own time stamps.
//!
//! ```no_run
//! use loopsight_formats::{Input, read};
//!
//! let log = read(Input::open("flight.ulg".as_ref())?)?;
//! for channel in &log.channels {
//!     println!("{} {:?}", channel.info.path, channel.info.unit);
//! }
//! let attitude = log.find("vehicle_attitude.q[0]");
//! # Ok::<(), loopsight_formats::FormatError>(())
//! ```
//!
//! | format | feature | clocks |
//! |---|---|---|
//! | WPILOG (WPILib, AdvantageKit, URCL) | | one for each entry |
//! | ULog (PX4) | | one for each topic |
//! | MCAP with JSON, CDR (ROS 2), ROS 1, protobuf | | one for each topic |
//! | ROS 2 bags, in MCAP | | one for each topic |
//! | ROS 2 bags, in SQLite | `sqlite` | one for each topic |
//! | MATLAB MAT, v6 and v7 | | none |
//! | HDF5, MATLAB v7.3 | `hdf5` | none |
//! | NumPy npy and npz | | none |
//! | Parquet | `parquet` | none |
//! | Arrow IPC, Feather 2 | `arrow` | none |
//!
//! The content decides, not the name. Whatever is packed by gzip or zstd is unpacked. A file that
//! was cut is read up to the cut ([`Log::cut`]); a file that contradicts itself is refused with the
//! place. No reader takes more memory than [`MEMORY_FACTOR`] times the size of its input.

mod bytes;
mod columns;
mod detect;
mod error;
mod foreign;
mod input;
mod log;
#[cfg(feature = "parquet")]
mod parquet_write;
mod readers;
mod ros;
mod sink;
mod tree;

pub use detect::{Content, Format, HEAD, detect};
pub use error::FormatError;
pub use input::{Input, PIPE_MOST, UNPACK_FACTOR, UNPACK_LEAST};
pub use log::{Channel, Clock, Cut, Log, LogBuilder, MEMORY_FACTOR, MEMORY_LEAST, Texts, Values};
#[cfg(feature = "parquet")]
pub use parquet_write::{OutColumn, write_parquet};
pub use readers::read_into;
pub use sink::{ARRAY_MOST, ChannelInfo, Kind, Sink};

/// Reads a whole log into memory.
///
/// # Errors
///
/// [`FormatError`] says what is wrong and where.
pub fn read(input: Input) -> Result<Log, FormatError> {
    let mut builder = LogBuilder::new(input.name(), input.format(), input.size());
    for wrapper in input.packed() {
        builder.note(format!("unpacked: {wrapper}"));
    }
    read_into(input, &mut builder)?;
    builder.finish()
}
