//! What is attacked: each with inputs that are right, and what takes them.

use crate::twins;
use loopsight::{CompareOptions, Experiment, Log, Session, SimulateOptions};
use loopsight_link::{
    Attachment, Configuration, ControllerGains, Decoder, Hello, LONGEST, Learning, Measured, Note,
    Reply, Request, Safety, VERSION, encode,
};
use loopsight_model::config::TomlSource;
use loopsight_model::loop_file::LoopFile;
use loopsight_model::model::Model;
use loopsight_model::registry::{BuildError, DriverContext, parts, plants};
use loopsight_onboard::{Session as Aboard, Twil};
use loopsight_tests::{Random, repository, twil, twil_path};
use serde::Serialize;
use serde::ser::SerializeTuple as _;

/// Takes an input; whether it was taken for right.
pub(crate) type Take = Box<dyn FnMut(&[u8]) -> bool>;

pub(crate) struct Target {
    pub(crate) name: &'static str,
    /// Of all executions.
    pub(crate) share: f64,
    pub(crate) inputs: fn() -> Vec<Vec<u8>>,
    /// Folder of `tests/corpus` whose files are damaged as well.
    pub(crate) corpus: Option<&'static str>,
    /// What is put around what was damaged.
    pub(crate) dress: fn(Vec<u8>, &mut Random) -> Vec<u8>,
    pub(crate) take: fn() -> Take,
}

pub(crate) fn all() -> Vec<Target> {
    let plain = |name, share, inputs, take| Target {
        name,
        share,
        inputs,
        corpus: None,
        dress: |bytes, _| bytes,
        take,
    };
    let text = |name, share, inputs, corpus, take| Target {
        corpus: Some(corpus),
        ..plain(name, share, inputs, take)
    };
    vec![
        Target {
            name: "frames of the line",
            share: 0.70,
            inputs: messages,
            corpus: None,
            dress: framed,
            take: decode,
        },
        Target {
            name: "a robot's session",
            share: 0.263,
            inputs: messages,
            corpus: None,
            dress: framed,
            take: session,
        },
        text("model files", 0.006, models, "models", model),
        text("expressions", 0.010, expressions, "models", model),
        text("loop files", 0.004, loops, "loops", looped),
        text(
            "experiment files",
            0.002,
            experiments,
            "experiments",
            experiment,
        ),
        text("CSV", 0.002, tables, "csv", log),
        text("SysId JSON", 0.001, sysid, "sysid", log),
        plain(
            "an expression beside Rust",
            0.010,
            twins::places,
            twins::expression_and_rust,
        ),
        plain(
            "single beside double precision",
            0.002,
            twins::drives,
            twins::robot_and_desk,
        ),
    ]
}

pub(crate) const SESSION: u32 = 0x5eed;

pub(crate) fn list<T: Clone, const N: usize>(values: &[T]) -> heapless::Vec<T, N> {
    heapless::Vec::from_slice(values).unwrap()
}

pub(crate) fn configuration() -> Configuration {
    let open = 1e3;
    Configuration {
        plant: "ddmr".try_into().unwrap(),
        parameters: list(&[-12.0, 0.0, 0.11, -8.0, -3.0, 0.55, 0.131, 0.05]),
        effects: list(&[Attachment {
            id: "coulomb_friction".try_into().unwrap(),
            channels: list(&[0, 1]),
            values: list(&[0.9, 0.3]),
        }]),
        bands: list(&[0.04, 0.3]),
        means: true,
        learning: Some(Learning {
            forgetting: 0.999,
            initial_covariance: 1e4,
            covariance_limit: 1e4,
            low: list(&[-open, -open, 0.02, -open, -open, 0.1, 0.0, 0.0]),
            high: list(&[0.0, open, open, 0.0, open, open, open, open]),
            scale: list(&[1.0, 0.1, 0.1, 1.0, 1.0, 0.1, 0.1, 0.1]),
            dead_zone: list(&[0.0, 0.0]),
            least_excitation: list(&[0.0125, 0.05]),
            window: 200.0,
            certainty_equivalence: true,
        }),
        controller: ControllerGains {
            proportional: list(&[17.78, 17.78]),
            integral: list(&[79.01, 79.01]),
            limit: list(&[12.0, 12.0]),
        },
        safety: Safety {
            watchdog_ticks: 10,
            stale_us: 5_000,
            stale_ticks: 20,
            least_supply: 9.6,
            encoder_ticks: 50,
            encoder_input: 2.5,
        },
    }
}

fn step(tick: u32) -> Request {
    Request::Step(Measured {
        session: SESSION,
        tick,
        age_us: 200,
        supply: 12.0,
        measured: list(&[0.05, -0.1]),
        reference: list(&[0.1, 0.2]),
    })
}

fn greeting() -> Request {
    Request::Hello(Hello {
        version: VERSION,
        session: SESSION,
    })
}

/// The same message without its frame: what stands between the sum and the zeros.
fn message<T: Serialize>(message: &T) -> Vec<u8> {
    let mut frame = [0; LONGEST];
    let length = encode(message, &mut frame).unwrap();
    let mut bytes = Vec::new();
    // COBS: each block begins with its length, and stands for a zero where it is not of full length.
    let mut rest = &frame[..length.saturating_sub(1)];
    while let [code, tail @ ..] = rest {
        let (block, after) = tail.split_at((usize::from(*code).saturating_sub(1)).min(tail.len()));
        bytes.extend_from_slice(block);
        if *code < 0xff && !after.is_empty() {
            bytes.push(0);
        }
        rest = after;
    }
    // Without its sum.
    bytes.truncate(bytes.len().saturating_sub(SUM));
    bytes
}

/// Bytes of the sum behind a message.
const SUM: usize = 4;

/// The files of a folder of `tests/corpus`, in the order of their names.
pub(crate) fn corpus(folder: &str) -> Vec<Vec<u8>> {
    let entries = std::fs::read_dir(repository().join("tests/corpus").join(folder)).unwrap();
    let mut paths: Vec<_> = entries.map(|e| e.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|p| std::fs::read(p).unwrap()).collect()
}

fn messages() -> Vec<Vec<u8>> {
    let configure = Request::Configure {
        session: SESSION,
        configuration: configuration(),
    };
    vec![
        message(&greeting()),
        message(&configure),
        message(&step(0)),
        message(&step(1)),
        message(&Request::Stop { session: SESSION }),
        message(&Reply::Configured { session: SESSION }),
        message(&Reply::Log(Note::Busy)),
    ]
}

/// Bytes as they are.
struct Raw<'b>(&'b [u8]);

impl Serialize for Raw<'_> {
    fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let mut bytes = to.serialize_tuple(self.0.len())?;
        for byte in self.0 {
            bytes.serialize_element(byte)?;
        }
        bytes.end()
    }
}

/// In a frame whose sum is right, seven times in eight; else with the bytes as they are.
fn framed(bytes: Vec<u8>, random: &mut Random) -> Vec<u8> {
    let mut frame = [0; LONGEST];
    match encode(&Raw(&bytes), &mut frame) {
        Ok(length) if random.below(8) > 0 => frame[..length].to_vec(),
        _ => {
            let mut bytes = bytes;
            bytes.push(0);
            bytes
        }
    }
}

fn decode() -> Take {
    let (mut requests, mut replies) = (Decoder::default(), Decoder::default());
    Box::new(move |bytes| {
        let mut taken = false;
        for byte in bytes {
            taken |= matches!(requests.take::<Request>(*byte), Some(Ok(_)));
            taken |= matches!(replies.take::<Reply>(*byte), Some(Ok(_)));
        }
        taken
    })
}

/// A robot that drives; what it commands is a number within the limits it was given.
fn session() -> Take {
    let driving = || {
        let mut robot: Aboard<Twil, ()> = Aboard::new(10_000, ());
        let configure = Request::Configure {
            session: SESSION,
            configuration: configuration(),
        };
        for request in [greeting(), configure, step(0), step(1), step(2)] {
            let mut frame = [0; LONGEST];
            let length = encode(&request, &mut frame).unwrap();
            for byte in &frame[..length] {
                robot.take(*byte, &mut |_| {});
            }
            robot.elapsed(&mut |_| {});
        }
        robot
    };
    let mut robot = driving();
    let mut since = 0;
    Box::new(move |bytes| {
        let mut answered = false;
        for byte in bytes {
            robot.take(*byte, &mut |_| answered = true);
        }
        robot.elapsed(&mut |_| {});
        let commands = robot.output().copied().unwrap_or_default();
        assert!(commands.iter().all(|u| u.is_finite()), "{commands:?}");
        since += 1;
        if since >= 64 {
            (robot, since) = (driving(), 0);
        }
        answered
    })
}

fn read(path: &str) -> Vec<u8> {
    std::fs::read(repository().join(path)).unwrap()
}

fn models() -> Vec<Vec<u8>> {
    let mut texts = vec![std::fs::read(twil_path()).unwrap()];
    texts.extend(plants().iter().map(|p| p.example.as_bytes().to_vec()));
    texts
}

/// Formulas, in the shortest files that hold them.
fn expressions() -> Vec<Vec<u8>> {
    let mut texts = vec![read("examples/expressions/pendulum.toml")];
    for force in [
        "-level * tanh(flow / width)",
        "-(level + (1 - level) * exp(-(flow / width)^2)) * tanh(flow / 0.01)",
        "if(flow > 0, -level, width * abs(flow)) + min(1, max(-1, sin(3 * time))) - sqrt(abs(flow))",
    ] {
        texts.push(
            format!(
                "[plant.dc_axis]\n[[effect]]\n[effect.expression]\nat = [\"shaft\"]\nforce = \"{force}\"\n\
                 [effect.expression.parameters]\nlevel = {{ value = 0.2, unit = \"V\" }}\nwidth = {{ value = 0.3 }}\n"
            )
            .into_bytes(),
        );
    }
    texts
}

fn model() -> Take {
    Box::new(|bytes| {
        let text = String::from_utf8_lossy(bytes);
        Model::from_toml("damaged.toml", &text).is_ok_and(|(model, _)| {
            let _ = model.affine();
            true
        })
    })
}

fn loops() -> Vec<Vec<u8>> {
    let whole = "model = \"model.toml\"\nperiod_s = 0.01\nduration_s = 1.0\nlog = \"run.csv\"\n\
         [driver.simulated]\nlimit = 12.0\nnoise = { linear_velocity = 0.01 }\n\
         [controller.feedback_linearizing_pi]\nsettling_time_s = [0.45, 0.5]\n\
         [estimator.rls]\nforgetting = 0.99\n\
         [reference]\nlinear_velocity = { sum = [{ constant = 0.1 }, { sine = { amplitude = 0.1, \
         frequency_hz = 1.0 } }] }\nangular_velocity = { prbs = { amplitude = 1.0, hold_s = 0.5 } }\n";
    let mut texts = vec![whole.to_owned()];
    // Every part that is linked takes its turn.
    for part in parts() {
        let table = part.example.lines().next().unwrap_or_default();
        let old = format!("[{}.", part.role);
        if let Some((before, rest)) = whole.split_once(&old).filter(|_| !whole.contains(table)) {
            let after = rest.split_once("\n[").map_or("", |(_, after)| after);
            texts.push(format!("{before}{}\n[{after}", part.example));
        }
    }
    texts.into_iter().map(String::into_bytes).collect()
}

fn looped() -> Take {
    let model = twil();
    Box::new(move |bytes| {
        let text = String::from_utf8_lossy(bytes);
        let Ok(source) = TomlSource::parse("damaged.toml", &text) else {
            return false;
        };
        let Ok(file) = LoopFile::parse(&source) else {
            return false;
        };
        let context = DriverContext {
            model: &model,
            period: file.period_s,
            load_model: &|_| Ok(twil()),
            load_runs: &|_, _| Ok(Vec::new()),
            read_column: &|path, _| Err(BuildError::at("path", format!("no {path}"))),
        };
        file.compose(&source, &model, &context).is_ok()
    })
}

fn experiments() -> Vec<Vec<u8>> {
    let small = "duration_s = 0.2\nperiod_s = 0.01\n[inputs]\n\
         voltage_right = { prbs = { amplitude = 9.0, hold_s = 0.05, seed = 3 } }\n\
         voltage_left = { sum = [{ constant = 1.0 }, { chirp = { amplitude = 2.0, from_hz = 0.1, to_hz = 5.0, \
         duration_s = 0.2 } }] }\n";
    vec![read("examples/twil/prbs.toml"), small.as_bytes().to_vec()]
}

/// A short one is driven as well.
fn experiment() -> Take {
    let robot = loopsight::Model::from_file(twil_path()).unwrap();
    let session = Session::of_model(robot);
    Box::new(move |bytes| {
        let text = String::from_utf8_lossy(bytes);
        let Ok(experiment) = Experiment::from_toml("damaged.toml", &text) else {
            return false;
        };
        // Its length is bounded elsewhere, and a campaign has no time for the longest that is allowed.
        if experiment.duration_s() <= 0.2 && experiment.period_s() >= 0.01 {
            let _ = session.simulate(&SimulateOptions::new(experiment));
        }
        true
    })
}

fn tables() -> Vec<Vec<u8>> {
    let whole = String::from_utf8(read("examples/twil/prbs.csv")).unwrap();
    let short: String = whole.lines().take(30).map(|l| format!("{l}\n")).collect();
    vec![
        short.clone().into_bytes(),
        short.replace(',', ";").into_bytes(),
    ]
}

fn log() -> Take {
    let model = loopsight::Model::from_file(twil_path()).unwrap();
    Box::new(move |bytes| {
        let Ok(log) = Log::from_bytes("damaged", bytes) else {
            return false;
        };
        let session = match log.model() {
            None => Session::new(model.clone(), log),
            Some(Ok(model)) => Session::new(model, log),
            Some(Err(error)) => Err(error),
        };
        session.is_ok_and(|session| {
            let _ = session.compare(&CompareOptions::default());
            true
        })
    })
}

fn sysid() -> Vec<Vec<u8>> {
    let run = |sign: f64| -> String {
        let rows = (0..20).map(|k| {
            let t = f64::from(k) * 0.005;
            let (u, v) = (sign * 10.0 * t, sign * 3.0 * t);
            format!("[{t},{u},{u},{x},{x},{v},{v},0.0,0.0]", x = 0.5 * v * t)
        });
        format!("[{}]", rows.collect::<Vec<_>>().join(","))
    };
    let text = format!(
        "{{\"sysid\":true,\"test\":\"Drivetrain\",\"units\":\"Meters\",\"unitsPerRotation\":0.48,\
         \"slow-forward\":{0},\"slow-backward\":{1},\"fast-forward\":{0},\"fast-backward\":{1}}}",
        run(1.0),
        run(-1.0)
    );
    vec![text.into_bytes()]
}
