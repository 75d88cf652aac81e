//! Frames of REV motor controllers (SPARK MAX, SPARK Flex), as URCL records them in a data log.
//!
//! Revision 1 (`URCL`) holds persistent frames of 8 bytes (device, value) and periodic ones of 14
//! bytes (time in ms, device, 8 bytes of a CAN status frame) in one entry; revision 2 has an entry
//! for each. Status frames are those of firmware before 25. `AppliedOutputVoltage` is the applied
//! output (a duty) times the bus voltage that was reported last.
//!
//! Reference: REV Robotics, "SPARK MAX Periodic Status Frames"; URCL by Littleton Robotics.

use std::collections::BTreeMap;

use super::Reader;
use crate::bytes::{Bytes, little};
use crate::error::FormatError;
use crate::sink::{ChannelInfo, Kind, Sink};

/// What an entry of URCL holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// Revision 1: everything.
    All,
    /// Revision 2: periodic frames.
    Periodic,
    /// Revision 2: names that the user gave to devices, as JSON.
    Aliases,
    /// Nothing that is decoded.
    Other,
}

impl Part {
    pub(super) fn of(declared: &str) -> Option<Self> {
        Some(match declared {
            "URCL" => Part::All,
            "URCLr2_periodic" => Part::Periodic,
            "URCLr2_aliases" => Part::Aliases,
            other if other.starts_with("URCLr") => Part::Other,
            _ => return None,
        })
    }
}

/// A quantity of a status frame.
type Signal = (&'static str, Option<&'static str>, fn(u64) -> f64);

fn int16(raw: u64) -> f64 {
    f64::from(raw as u16 as i16)
}

fn low(raw: u64) -> f64 {
    f64::from(f32::from_bits(raw as u32))
}

fn high(raw: u64) -> f64 {
    low(raw >> 32)
}

fn bits(raw: u64, first: u32, count: u32) -> f64 {
    ((raw >> first) & ((1 << count) - 1)) as f64
}

/// Status frames 0 to 6: name, unit, value of the eight bytes.
const FRAMES: [&[Signal]; 7] = [
    &[
        ("AppliedOutput", None, |raw| int16(raw) / 32767.0),
        ("Faults", None, |raw| bits(raw, 16, 16)),
        ("StickyFaults", None, |raw| bits(raw, 32, 16)),
        ("SensorInvert", None, |raw| bits(raw, 48, 1)),
        ("MotorInvert", None, |raw| bits(raw, 49, 1)),
        ("IsFollower", None, |raw| bits(raw, 53, 1)),
    ],
    &[
        ("MotorVelocityRPM", Some("rpm"), low),
        ("MotorTemperatureC", Some("°C"), |raw| bits(raw, 32, 8)),
        ("BusVoltage", Some("V"), |raw| bits(raw, 40, 12) / 128.0),
        ("MotorCurrentAmps", Some("A"), |raw| {
            bits(raw, 52, 12) / 32.0
        }),
    ],
    &[("MotorPositionRotations", Some("rot"), low)],
    &[
        ("AnalogSensor/Voltage", Some("V"), |raw| {
            bits(raw, 0, 10) / 256.0
        }),
        ("AnalogSensor/Position", None, high),
    ],
    &[
        ("AlternateEncoder/VelocityRPM", Some("rpm"), low),
        ("AlternateEncoder/PositionRotations", Some("rot"), high),
    ],
    &[("AbsoluteEncoder/PositionRotations", Some("rot"), low)],
    &[("AbsoluteEncoder/VelocityRPM", Some("rpm"), low)],
];

/// Class of the periodic status frames of firmware before 25.
const PERIODIC: u16 = 6;
/// Parameter access to the device's model.
const MODEL: u16 = 0x300 | 155;
const FLEX: u64 = 0x2159;

/// The devices of an entry and their channels.
#[derive(Debug, Default)]
pub(super) struct Frames {
    /// Clock and channels of a device's frame.
    open: BTreeMap<(u16, usize), (usize, Vec<usize>)>,
    flex: BTreeMap<u16, bool>,
    voltage: BTreeMap<u16, f64>,
    /// Publishers hand the same record on twice.
    last: Vec<u8>,
}

impl Reader {
    pub(super) fn urcl(
        &mut self,
        id: u32,
        part: Part,
        name: &str,
        payload: &[u8],
        sink: &mut dyn Sink,
    ) -> Result<(), FormatError> {
        let Some(entry) = self.entries.get_mut(&id) else {
            return Ok(());
        };
        let mut frames = entry.urcl.take().unwrap_or_default();
        let done = match part {
            Part::Other if name.ends_with("Periodic") => {
                sink.note(format!(
                    "{name}: frames of SPARK firmware 25 and later are not decoded; export the log with AdvantageScope"
                ));
                Ok(())
            }
            Part::Other => Ok(()),
            Part::Aliases => {
                self.aliases = serde_json::from_slice(payload).unwrap_or_default();
                Ok(())
            }
            Part::All | Part::Periodic if frames.last == payload => Ok(()),
            Part::All => {
                frames.last = payload.to_vec();
                let mut bytes = Bytes::new(payload);
                let counts = (bytes.u32(), bytes.u32());
                let (Some(persistent), Some(_)) = counts else {
                    return Ok(());
                };
                for _ in 0..persistent {
                    let Some(frame) = bytes.take(8) else { break };
                    frames.persistent(frame);
                }
                self.periodic(&mut frames, name, bytes.rest(), sink)
            }
            Part::Periodic => {
                frames.last = payload.to_vec();
                let root = name.trim_end_matches("Raw/Periodic").trim_end_matches('/');
                self.periodic(&mut frames, root, payload, sink)
            }
        };
        if let Some(entry) = self.entries.get_mut(&id) {
            entry.urcl = Some(frames);
        }
        done
    }

    fn periodic(
        &mut self,
        frames: &mut Frames,
        root: &str,
        payload: &[u8],
        sink: &mut dyn Sink,
    ) -> Result<(), FormatError> {
        for frame in payload.chunks_exact(14) {
            let mut bytes = Bytes::new(frame);
            let (Some(millis), Some(id)) = (bytes.u32(), bytes.u16()) else {
                break;
            };
            let raw = little(bytes.rest());
            let (device, index) = (id & 0x3f, usize::from(id >> 6 & 0xf));
            let signals = FRAMES.get(index).filter(|_| id >> 10 == PERIODIC);
            let Some(signals) = signals else {
                continue;
            };
            let micros = i128::from(millis) * 1000;
            let time = self.stamps.seconds_of_micros(micros, sink);
            if !frames.open.contains_key(&(device, index)) {
                let name = self.device(frames, device);
                let made = announce(&format!("{root}/{name}"), index, signals, sink)?;
                frames.open.insert((device, index), made);
            }
            let Some((clock, channels)) = frames.open.get(&(device, index)) else {
                continue;
            };
            sink.tick(*clock, time)?;
            for ((_, _, value), channel) in signals.iter().zip(channels) {
                sink.number(*channel, value(raw))?;
            }
            if index == 1 {
                frames.voltage.insert(device, bits(raw, 40, 12) / 128.0);
            }
            let volts = frames.voltage.get(&device).copied().unwrap_or(0.0);
            if let (0, Some(channel), true) = (index, channels.last(), volts > 0.0) {
                sink.number(*channel, int16(raw) / 32767.0 * volts)?;
            }
        }
        Ok(())
    }

    fn device(&self, frames: &Frames, device: u16) -> String {
        if let Some(name) = self.aliases.get(&device.to_string()) {
            return name.clone();
        }
        let flex = frames.flex.get(&device).copied().unwrap_or(false);
        let model = if flex { "SparkFlex" } else { "SparkMax" };
        format!("{model}-{device}")
    }
}

impl Frames {
    fn persistent(&mut self, frame: &[u8]) {
        let id = little(frame.get(..2).unwrap_or_default()) as u16;
        if id >> 6 == MODEL {
            let model = little(frame.get(2..6).unwrap_or_default());
            self.flex.insert(id & 0x3f, model == FLEX);
        }
    }
}

fn announce(
    device: &str,
    index: usize,
    signals: &[Signal],
    sink: &mut dyn Sink,
) -> Result<(usize, Vec<usize>), FormatError> {
    let clock = sink.clock(device);
    let mut channels = Vec::new();
    let volts = [("AppliedOutputVoltage", Some("V"), low as fn(u64) -> f64)];
    let derived = if index == 0 { &volts[..] } else { &[] };
    for (name, unit, _) in signals.iter().chain(derived) {
        let declared = "SPARK status frame";
        let info = ChannelInfo::new(format!("{device}/{name}"), Kind::Number, declared);
        channels.push(sink.channel(info.at(clock).in_unit(*unit))?);
    }
    Ok((clock, channels))
}
