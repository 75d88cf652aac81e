//! Channels with times of their own give the parameters that a synchronous log gives.

use crate::{FitOptions, Log, Model, Session};

/// Truth: `ω' = K_A ω + K_C V`, 1/s and rad/s²/V.
const K_A: f64 = -4.0;
const K_C: f64 = 18.0;
/// Of a recording, s; between commands, between readings of the speed, of the angle.
const DURATION: f64 = 20.0;
const COMMAND: f64 = 0.1;
const SPEED: f64 = 0.004;
const ANGLE: f64 = 0.02;

/// Uniform numbers of zero mean and unit standard deviation (D. E. Knuth's multiplier, MMIX).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = (self.0)
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        12f64.sqrt() * ((self.0 >> 11) as f64 / (1u64 << 53) as f64 - 0.5)
    }
}

/// A motor under commands that change ten times a second: the exact solution from one to the next.
struct Motion {
    commands: Vec<f64>,
    states: Vec<[f64; 2]>,
}

impl Motion {
    fn new(noise: &mut Noise) -> Self {
        let count = (DURATION / COMMAND).round() as usize + 1;
        let commands: Vec<f64> = (0..count)
            .map(|_| (300.0 * noise.next()).round() / 100.0)
            .collect();
        let mut states = vec![[0.0; 2]];
        for (k, command) in commands.iter().enumerate() {
            states.push(after(states[k], *command, COMMAND));
        }
        Self { commands, states }
    }

    /// Speed, rad/s, and angle, rad.
    fn at(&self, time: f64) -> [f64; 2] {
        let k = (time / COMMAND + 1e-9).floor() as usize;
        after(self.states[k], self.commands[k], time - COMMAND * k as f64)
    }
}

fn after([speed, angle]: [f64; 2], command: f64, time: f64) -> [f64; 2] {
    let rest = -K_C * command / K_A;
    let decay = (K_A * time).exp();
    [
        rest + (speed - rest) * decay,
        angle + rest * time + (speed - rest) * (decay - 1.0) / K_A,
    ]
}

/// Readings of one channel: time, µs, and value.
type Readings = Vec<(u64, f64)>;

fn every(period: f64, first: f64, value: impl FnMut(f64) -> f64) -> Readings {
    let count = ((DURATION - first) / period).floor() as usize;
    let times = (0..count).map(|k| first + period * k as f64);
    let stamps = times.clone().map(|t| (1e6 * t).round() as u64);
    stamps.zip(times.map(value)).collect()
}

/// Command, speed and angle as their sensors measure them: each with its own times.
fn readings(motion: &Motion, noise: &mut Noise, phases: [f64; 2]) -> [Readings; 3] {
    let command = every(COMMAND, 0.0, |t| {
        motion.commands[(t / COMMAND).round() as usize]
    });
    let speed = every(SPEED, phases[0], |t| motion.at(t)[0] + 0.5 * noise.next());
    let angle = every(ANGLE, phases[1], |t| motion.at(t)[1] + 0.02 * noise.next());
    [command, speed, angle]
}

/// A table with a row for each stamp. With `hold` the command is in every row, else where it changed.
fn table(channels: &[Readings; 3], hold: bool) -> Vec<u8> {
    let mut rows = std::collections::BTreeMap::<u64, [Option<f64>; 3]>::new();
    for (column, readings) in channels.iter().enumerate() {
        for (stamp, value) in readings {
            rows.entry(*stamp).or_default()[column] = Some(*value);
        }
    }
    let mut text = "time_s,voltage_V,speed_rad_per_s,angle_rad\n".to_owned();
    let mut last = None;
    for (stamp, mut row) in rows {
        last = row[0].or(last);
        if hold {
            row[0] = last;
        }
        text.push_str(&format!("{}", stamp as f64 / 1e6));
        for value in row {
            text.push_str(&value.map_or_else(|| ",".to_owned(), |v| format!(",{v}")));
        }
        text.push('\n');
    }
    text.into_bytes()
}

/// The same as WPILib's data log (WPILOG, version 1.0), each channel an entry.
fn wpilog(channels: &[Readings; 3]) -> Vec<u8> {
    let mut out = b"WPILOG\x00\x01\x00\x00\x00\x00".to_vec();
    let mut record = |entry: u8, stamp: u64, payload: &[u8]| {
        // One byte for the entry, four for the size, eight for the time.
        out.extend([0x7c, entry]);
        out.extend((payload.len() as u32).to_le_bytes());
        out.extend(stamp.to_le_bytes());
        out.extend(payload);
    };
    for (entry, name) in (1u8..).zip(["voltage", "speed", "angle"]) {
        let mut start = vec![0, entry, 0, 0, 0];
        for text in [name, "double", ""] {
            start.extend((text.len() as u32).to_le_bytes());
            start.extend(text.as_bytes());
        }
        record(0, 0, &start);
    }
    for (entry, readings) in (1u8..).zip(channels) {
        for (stamp, value) in readings {
            record(entry, *stamp, &value.to_le_bytes());
        }
    }
    out
}

/// Value and interval of the two parameters.
fn fitted(log: &[u8]) -> [(f64, [f64; 2]); 2] {
    let model = Model::from_toml(
        "axis.toml",
        "[plant.dc_axis]\n[log.measured]\nspeed = {}\nangle = {}\n",
    );
    let log = Log::from_bytes("log", log).unwrap();
    let answer = Session::new(model.unwrap(), log)
        .unwrap()
        .fit(&FitOptions::default())
        .unwrap();
    ["K_A", "K_C"].map(|name| {
        let found = &answer.parameters[name];
        (found.value, found.interval95.unwrap())
    })
}

#[test]
fn ten_hz_commands_beside_250_hz_speeds_and_50_hz_angles() {
    let (mut truths, mut alike, mut all) = (0, 0, 0);
    for seed in 0..6 {
        let mut noise = Noise(seed);
        let motion = Motion::new(&mut noise);
        let together = fitted(&table(&readings(&motion, &mut noise, [0.0, 0.0]), true));
        let apart = readings(&motion, &mut noise, [0.0013, 0.0137]);
        let own = fitted(&wpilog(&apart));
        // The same numbers from a table with empty fields.
        for (a, b) in own.iter().zip(fitted(&table(&apart, false))) {
            assert!((a.0 - b.0).abs() <= 1e-9 * b.0.abs(), "{a:?} {b:?}");
        }
        for ((own, together), truth) in own.iter().zip(together).zip([K_A, K_C]) {
            let within = |value: f64, [low, high]: [f64; 2]| (low..=high).contains(&value);
            all += 1;
            truths += usize::from(within(truth, own.1));
            let width = |[low, high]: [f64; 2]| high - low;
            // Of two estimates with errors of their own.
            let both = 0.5 * width(own.1).hypot(width(together.1));
            alike += usize::from((own.0 - together.0).abs() <= both);
            let ratio = width(own.1) / width(together.1);
            assert!((0.6..1.7).contains(&ratio), "{own:?} {together:?}");
        }
    }
    // 95 % of the intervals have the truth, and 95 % of the differences are within theirs.
    assert!(
        truths + 1 >= all && alike + 1 >= all,
        "{truths}, {alike} of {all}"
    );
}
