//! Traces of a vehicle with friction against a model without, shared by the tests.

use loopsight_diagnosis::{Comparison, RunTrace, SignalScore, SignalTrace, Statement};

use crate::packed::tests::unpacked;
use crate::page::Context;
use crate::{ControlledTrace, InnovationTrace, InputTrace, LoopRecord, ParameterTrace};

const PERIOD: f64 = 0.01;

pub(crate) fn context() -> Context {
    Context {
        title: "Twil: model against measurements".into(),
        model_name: "Twil".into(),
        model_file: Some("examples/twil/model.toml".into()),
        log_file: "examples/twil/data/prbs_9V_25s.csv".into(),
        notes: vec![],
        command: "loopsight compare model.toml prbs_9V_25s.csv --html twil.html".into(),
    }
}

pub(crate) fn without_library(page: &str) -> String {
    page.replace(crate::packed::library(), "")
}

/// `page` without the charts' library and with the charts' data as they were before they were packed.
pub(crate) fn opened(page: &str) -> String {
    const OPENING: &str = "<script type=\"application/gzip\">";
    let page = without_library(page);
    let mut parts = page.split(OPENING);
    let mut out = parts.next().unwrap().to_owned();
    for part in parts {
        let (packed, rest) = part.split_once("</script>").unwrap();
        out += &format!("{OPENING}{}</script>{rest}", unpacked(packed));
    }
    out
}

/// Deterministic noise in ±1.
pub(crate) struct Noise(u64);

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1)
    }

    pub(crate) fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
    }
}

/// `n_runs` runs of `n` samples of the paper's robot under PRBS, with friction that the free run
/// does not know.
pub(crate) fn friction_runs(n_runs: usize, n: usize) -> Vec<RunTrace> {
    (0..n_runs)
        .map(|at| {
            let mut noise = Noise::new(at as u64 + 1);
            let mut input = [9.0, 9.0];
            let (mut truth, mut model) = ([0.0; 2], [0.0; 2]);
            let mut columns = vec![Vec::new(); 9];
            for k in 0..n {
                if k % 50 == 0 {
                    input = [0, 1].map(|_| if noise.next() > 0.0 { 9.0 } else { -9.0 });
                }
                let drive = [0.136 * (input[0] + input[1]), 0.656 * (input[0] - input[1])];
                let measured = [0, 1].map(|i| truth[i] + [0.002, 0.01][i] * noise.next());
                for i in [0, 1] {
                    let pole = [-15.146, -9.573][i];
                    columns[i].push(measured[i]);
                    columns[2 + i].push(model[i]);
                    columns[4 + i].push(truth[i] + [0.003, 0.02][i] * noise.next());
                    columns[6 + i].push(input[i]);
                    for _ in 0..20 {
                        let friction = [0.45, 1.0][i] * (truth[i] * 500.0_f64).tanh();
                        truth[i] += PERIOD / 20.0 * (pole * truth[i] + drive[i] - friction);
                    }
                    model[i] += PERIOD * (pole * model[i] + drive[i]);
                }
                columns[8].push(PERIOD * k as f64);
            }
            let signal = |i: usize, id: &str, unit: &str| SignalTrace {
                id: id.into(),
                unit: unit.into(),
                measured: columns[i].clone(),
                free_run: columns[2 + i].clone(),
                one_step: columns[4 + i].clone(),
            };
            RunTrace {
                name: format!("run-{}", at + 1),
                time: columns[8].clone(),
                inputs: vec![
                    ("voltage_right".into(), "V".into(), columns[6].clone()),
                    ("voltage_left".into(), "V".into(), columns[7].clone()),
                ],
                signals: vec![
                    signal(0, "linear_velocity", "m/s"),
                    signal(1, "angular_velocity", "rad/s"),
                ],
                initial_state: vec![0.0, 0.0],
            }
        })
        .collect()
}

pub(crate) fn scores() -> Vec<SignalScore> {
    let score = |id: &str, unit: &str, rmse, nrmse| SignalScore {
        id: id.into(),
        unit: unit.into(),
        rmse,
        nrmse,
        fit_percent: 100.0 * (1.0 - nrmse),
        one_step_nrmse: nrmse / 9.0,
    };
    vec![
        score("linear_velocity", "m/s", 0.013, 0.101),
        score("angular_velocity", "rad/s", 0.041, 0.048),
    ]
}

pub(crate) fn comparison(runs: Vec<RunTrace>) -> Comparison {
    Comparison {
        nrmse: 0.079,
        fit_percent: 92.1,
        signals: scores(),
        faults: vec![],
        observer: None,
        where_it_fails: vec![Statement {
            statement: "the mean residual of linear_velocity is -0.030 m/s forwards and +0.031 m/s backwards".into(),
            share_of_squared_error: 0.6,
            signal: "linear_velocity".into(),
        }],
        runs,
    }
}

/// Steps of two velocities under control, as in the paper's figures 10 and 11.
pub(crate) fn loop_record(n: usize) -> LoopRecord {
    let mut noise = Noise::new(7);
    let time: Vec<f64> = (0..n).map(|k| PERIOD * k as f64).collect();
    let reference = |i: usize, t: f64| {
        let level = [0.2, 1.3][i];
        [0.0, level, -level, level / 2.0][((t + i as f64) / 2.5) as usize % 4]
    };
    let mut controlled = Vec::new();
    for (i, (id, unit)) in [("linear_velocity", "m/s"), ("angular_velocity", "rad/s")]
        .iter()
        .enumerate()
    {
        let r: Vec<f64> = time.iter().map(|t| reference(i, *t)).collect();
        let mut ideal = Vec::new();
        let mut y = 0.0;
        for r in &r {
            ideal.push(y);
            y += PERIOD * 8.9 * (r - y);
        }
        let measured = ideal
            .iter()
            .map(|y| 0.96 * y + 0.004 * noise.next())
            .collect();
        controlled.push(ControlledTrace {
            id: (*id).into(),
            unit: (*unit).into(),
            reference: r,
            measured,
            ideal: Some(ideal),
        });
    }
    let input = |id: &str, sign: f64| {
        let commanded: Vec<f64> = controlled[0]
            .reference
            .iter()
            .zip(&controlled[0].measured)
            .zip(controlled[1].reference.iter().zip(&controlled[1].measured))
            .map(|((r, y), (s, z))| 12.0 * y + 60.0 * (r - y) + sign * (3.0 * z + 8.0 * (s - z)))
            .collect();
        let applied = commanded
            .iter()
            .map(|u: &f64| u.clamp(-12.0, 12.0))
            .collect();
        InputTrace {
            id: id.into(),
            unit: "V".into(),
            commanded,
            applied,
        }
    };
    let inputs = vec![input("voltage_right", 1.0), input("voltage_left", -1.0)];
    let saturated = (0..n)
        .map(|k| inputs.iter().any(|u| u.commanded[k] != u.applied[k]))
        .collect();
    let parameter = |name: &str, unit: &str, value: f64| ParameterTrace {
        name: name.into(),
        unit: unit.into(),
        values: time
            .iter()
            .map(|t| value * (1.0 - (-t / 2.0).exp()))
            .collect(),
        std: Some(
            time.iter()
                .map(|t| 0.3 * value.abs() * (-t / 3.0).exp())
                .collect(),
        ),
    };
    LoopRecord {
        period_s: PERIOD,
        parameters: vec![
            parameter("K_A", "1/s", -15.1),
            parameter("K_C", "m/(s²·V)", 0.136),
        ],
        innovations: vec![InnovationTrace {
            id: "linear_velocity".into(),
            unit: "m/s²".into(),
            values: time
                .iter()
                .map(|t| 0.2 * (-t).exp() + 0.02 * noise.next())
                .collect(),
        }],
        time,
        controlled,
        inputs,
        saturated,
        events: vec![
            (3.2, "estimator reset: covariance lost".into()),
            (7.7, "sample lost".into()),
        ],
        notes: vec!["Settling time asked for 0.45 s, reached 0.607 s.".into()],
        end: "the reference ended".into(),
        ..LoopRecord::default()
    }
}
