//! Quadrature counters of the kernel.

use std::path::Path;

use super::file::{FileError, KernelFile, number, put};
use crate::twil_motor::Quadrature;

/// A count of `/sys/bus/counter`.
///
/// It is set to count all four edges (`quadrature x4`) and enabled where it can be; its `ceiling` says
/// where it starts over, 32 bits where it has none.
///
/// Reference: the kernel's documentation, driver-api/generic-counter and ABI/testing/sysfs-bus-counter.
#[derive(Debug)]
pub(crate) struct KernelCounter {
    count: KernelFile,
    range: u64,
}

impl KernelCounter {
    /// Count `count` of device `device`.
    pub(crate) fn open(sysfs: &Path, device: u32, count: u32) -> Result<Self, FileError> {
        let folder = sysfs.join(format!("bus/counter/devices/counter{device}/count{count}"));
        if !folder.exists() {
            let why = "there is no such counter; is its overlay or driver loaded?";
            return Err(FileError::new(&folder, why));
        }
        let ceiling = folder.join("ceiling");
        let range = match number(ceiling.clone())? {
            None => 1 << 32,
            Some(highest) if highest < 1 << 32 => highest + 1,
            // Of a wider counter the lower 32 bits are a counter, too, if it wraps with them.
            Some(highest) if highest.wrapping_add(1).is_multiple_of(1 << 32) => 1 << 32,
            Some(highest) => {
                let why = format!("found {highest}, expected less than 2^32 or full words");
                return Err(FileError::new(&ceiling, why));
            }
        };
        if range < 4 {
            let why = format!("found {}, which is no range to count in", range - 1);
            return Err(FileError::new(&ceiling, why));
        }
        for (name, text) in [("function", "quadrature x4\n"), ("enable", "1\n")] {
            let path = folder.join(name);
            if path.exists() {
                put(&path, text)?;
            }
        }
        Ok(Self {
            count: KernelFile::open(folder.join("count"), false)?,
            range,
        })
    }
}

impl Quadrature for KernelCounter {
    type Error = FileError;
    fn position(&mut self) -> Result<u32, FileError> {
        let count: u64 = self.count.read()?;
        // The lower 32 bits are what `range` speaks of.
        Ok((count & u64::from(u32::MAX)) as u32)
    }
    fn range(&self) -> u64 {
        self.range
    }
}
