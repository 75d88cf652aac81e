//! Logs that are broken in every way: no panic, no hang, memory within bounds.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test may panic"
)]

mod common;

use common::mcap::Packed;
use loopsight_formats::{FormatError, Input, Log, read};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Bytes that reading any small input may take at once, over 64 times its size.
const LEAST: u64 = 64 << 20;

/// Small logs of every format that is built.
fn inputs() -> Vec<(&'static str, Vec<u8>)> {
    #[allow(unused_mut, reason = "some formats are features")]
    let mut inputs = vec![
        ("wpilog", common::wpilog()),
        ("ulog", common::ulog()),
        ("mcap json", common::mcap::json(Packed::No, false)),
        ("mcap lz4", common::mcap::json(Packed::Lz4, false)),
        ("mcap zstd", common::mcap::json(Packed::Zstd, true)),
        ("mcap ros2", common::mcap::ros2(Packed::No)),
        ("mcap protobuf", common::mcap::protobuf()),
        ("mat", common::mat()),
        ("npy table", common::npy_table()),
        ("npy matrix", common::npy_matrix()),
        ("npz", common::npz()),
        ("gzip", common::gzip(&common::wpilog())),
        ("zstd", common::zstd(&common::wpilog())),
    ];
    #[cfg(feature = "parquet")]
    inputs.push(("parquet", common::tables::parquet()));
    #[cfg(feature = "arrow")]
    {
        inputs.push(("arrow", common::tables::arrow_file(false)));
        inputs.push(("arrow zstd", common::tables::arrow_file(true)));
        inputs.push(("arrow stream", common::tables::arrow_stream()));
    }
    #[cfg(feature = "hdf5")]
    inputs.push(("hdf5", include_bytes!("fixtures/small.h5").to_vec()));
    #[cfg(feature = "sqlite")]
    inputs.push(("sqlite", common::tables::sqlite()));
    inputs
}

/// One to six changes: bits, numbers at their limits, pieces cut out, repeated or emptied.
fn mutate(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    for _ in 0..rng.random_range(1..=6) {
        if bytes.is_empty() {
            return;
        }
        let at = rng.random_range(0..bytes.len());
        let n = rng.random_range(1..=16).min(bytes.len() - at);
        match rng.random_range(0..9) {
            0 | 1 => bytes[at] ^= 1 << rng.random_range(0..8),
            2 => bytes[at] = rng.random(),
            3 => {
                let limits = [
                    0,
                    1,
                    0x7f,
                    0x80,
                    0xff,
                    0x7fff_ffff,
                    0x8000_0000,
                    0xffff_ffff,
                    u64::MAX,
                ];
                let value = limits[rng.random_range(0..limits.len())].to_le_bytes();
                let width = [1, 2, 4, 8][rng.random_range(0..4)].min(bytes.len() - at);
                bytes[at..at + width].copy_from_slice(&value[..width]);
            }
            4 => bytes.truncate(at),
            5 => {
                bytes.drain(at..at + n);
            }
            6 => {
                let piece = bytes[at..at + n].to_vec();
                bytes.splice(at..at, piece);
            }
            7 => bytes[at..at + n].fill(0),
            _ => {
                let from = rng.random_range(0..bytes.len());
                let n = n.min(bytes.len() - from);
                let to = at.min(bytes.len() - n);
                bytes.copy_within(from..from + n, to);
            }
        }
    }
}

fn attempt(bytes: Vec<u8>) -> Result<Log, FormatError> {
    read(Input::from_bytes(bytes, "log")?)
}

/// Reads so many broken versions of every input.
fn campaign(count: usize) {
    for (number, (name, whole)) in inputs().into_iter().enumerate() {
        let before = attempt(whole.clone());
        assert!(before.is_ok(), "{name}: {before:?}");
        let mut rng = ChaCha8Rng::seed_from_u64(number as u64);
        let (mut read, mut most) = (0, 0);
        for round in 0..count {
            let mut bytes = whole.clone();
            mutate(&mut bytes, &mut rng);
            let limit = LEAST + 64 * bytes.len() as u64;
            let kept = bytes.clone();
            let mut done = false;
            let used = allocation_counter::measure(|| done = attempt(bytes).is_ok());
            read += usize::from(done);
            most = most.max(used.bytes_max);
            if used.bytes_max > limit {
                let path = std::env::temp_dir().join(format!("{name}-{round}.bin"));
                std::fs::write(&path, kept).unwrap();
                panic!(
                    "{name}, round {round}: {} bytes; {}",
                    used.bytes_max,
                    path.display()
                );
            }
        }
        println!("{name}: {count} broken, {read} of them still read, {most} bytes at most");
    }
}

#[test]
fn broken_logs_are_refused_without_harm() {
    campaign(400);
}

/// A file of Arrow with any one bit turned: buffers of a wrong length made the keys of a dictionary panic.
#[cfg(feature = "arrow")]
#[test]
fn any_bit_of_an_arrow_file_may_be_wrong() {
    for whole in [
        common::tables::arrow_file(false),
        common::tables::arrow_stream(),
    ] {
        let mut refused = 0;
        for bit in 0..8 * whole.len() {
            let mut bytes = whole.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            refused += usize::from(attempt(bytes).is_err());
        }
        assert!(
            refused > whole.len() / 8,
            "{refused} of {}",
            8 * whole.len()
        );
    }
}

#[test]
#[ignore = "200 000 broken logs of each format: minutes, in release mode"]
fn a_campaign_of_broken_logs() {
    campaign(200_000);
}

/// Random bytes behind each magic number.
#[test]
fn nothing_but_a_magic_number() {
    let mut rng = ChaCha8Rng::seed_from_u64(99);
    for (name, whole) in inputs() {
        for n in 0..100 {
            let mut bytes = whole[..16.min(whole.len())].to_vec();
            let mut rest = vec![0; n];
            rng.fill_bytes(&mut rest);
            bytes.extend(rest);
            let result = attempt(bytes);
            assert!(
                result.is_err() || result.is_ok_and(|l| l.channels.len() < 10),
                "{name}"
            );
        }
    }
}
