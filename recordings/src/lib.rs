//! Logs in and out: reading CSV, MCAP and WPILib SysId JSON, mapping columns to the signals of a model,
//! cutting a log into runs, and finding its faults before anything is fitted to it.
//!
//! # Workflow
//!
//! 1. [`read`] a file as it is: a [`Source`], a table or a SysId log.
//! 2. [`map`] its columns to the signals of a model, in SI units: a [`Recording`] of uninterrupted runs.
//! 3. Look at [`Recording::faults`] and their [`Severity`] before a fit.
//!
//! ```
//! use loopsight_core::Signal;
//! use loopsight_model::log_map::LogMap;
//! use loopsight_recordings::{Source, map, read_csv_from};
//!
//! let text = "time_s,voltage_V,speed_rpm\n0.0,0,0\n0.5,6,30\n1.0,6,60\n1.5,3,30\n";
//! let table = read_csv_from(text.as_bytes(), "motor.csv").unwrap();
//! let inputs = [Signal::new("voltage", "u", "V", "Voltage of the motor.")];
//! let outputs = [Signal::new("speed", "w", "rad/s", "Speed of the shaft.")];
//! let log = map(&Source::Table(table), &inputs, &outputs, &LogMap::default()).unwrap();
//! assert_eq!(log.runs[0].time(), [0.0, 0.5, 1.0, 1.5]);
//! assert!((log.runs[0].sample(2)[0] - std::f64::consts::TAU).abs() < 1e-12); // 60 rpm
//! ```
//!
//! [`write_csv`] and [`LogWriter`] write logs that read back to the same numbers; [`output`] writes every file.

mod channels;
mod csv_read;
mod csv_write;
mod derive;
mod dialect;
mod error;
mod fault;
mod faults;
mod inventory;
mod map;
mod mcap_log;
mod median;
mod model_file;
mod names;
mod naming;
pub mod output;
mod parquet_write;
mod plan;
mod segment;
mod source;
mod stamp;
mod sync;
mod sysid;
mod table;

pub use csv_read::read_csv_from;
pub use csv_write::{LogWriter, column, header, write_csv};
pub use error::{Location, RecordingError};
pub use fault::{Fault, FaultKind, Severity};
pub use inventory::{ChannelFacts, ClockFacts, Inventory, Picture, UnitFact, survey};
pub use loopsight_formats::Kind;
pub use map::{MappedSignal, Recording, map};
pub use parquet_write::write_parquet;
pub use source::{Source, read, read_bytes};
pub use sysid::{SysIdLog, SysIdRun, TestKind, read_sysid};
pub use table::{ColumnName, Table, TableRun};
