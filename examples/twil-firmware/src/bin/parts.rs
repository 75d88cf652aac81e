//! What the parts of a tick cost by themselves, in counts of the board's timer: the same types as aboard, without
//! what guards and connects them. `what_the_parts_cost` of `onboard/tests/lockstep.rs` runs it and reads what it
//! says.

#![no_std]
#![no_main]

#[allow(dead_code, reason = "there is no conversation here")]
#[path = "../mps2.rs"]
mod mps2;

use core::fmt::{self, Write};
use core::hint::black_box;
use core::panic::PanicInfo;

use cortex_m_rt::entry;
use heapless::Vec;
use loopsight_controllers::FeedbackLinearizingPi;
use loopsight_core::{AffineModel, Controller, Estimator, Tick};
use loopsight_estimators::{Rls, RlsSettings};
use loopsight_link::Attachment;
use loopsight_onboard::{AffinePlant, Efforts, Meter, Twil};
use nalgebra::{Const, SVector};

/// Period of the loop, µs.
const PERIOD_US: u32 = 10_000;
/// Samples that each part is measured with.
const SAMPLES: u32 = 1000;

const PARAMETERS: [f32; 8] = [-15.146, 0.005, 0.136, -9.573, -3.945, 0.656, 0.131, 0.05];

type Pair = [Rls<f32, Const<3>>; 2];
type Control = FeedbackLinearizingPi<f32, Const<2>>;

/// Two updates of recursive least squares.
#[inline(never)]
fn learn(pair: &mut Pair, regressors: &[[f32; 3]; 2], y: &[f32; 2]) -> [f32; 2] {
    let mut innovations = [0.0; 2];
    for (i, innovation) in innovations.iter_mut().enumerate() {
        *innovation = pair[i].update(&regressors[i], y[i]).innovation;
    }
    innovations
}

/// Linearisation, two PI laws and limits.
#[inline(never)]
fn control(
    law: &mut Control,
    model: &mut dyn AffineModel<f32>,
    reference: &[f32; 2],
    measured: &[f32; 2],
) -> [f32; 2] {
    let mut command = [0.0; 2];
    let tick = Tick {
        index: 0,
        time: 0.0,
        period: 0.01,
    };
    let outcome = law.step(&tick, reference, measured, model, &mut command);
    let _ = black_box(outcome);
    command
}

/// Numbers from -1 to 1 without structure.
struct Random(u32);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 = (self.0.wrapping_mul(1_664_525)).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / (1u32 << 23) as f32 - 1.0
    }
}

/// Everything, or what is missing.
fn run(line: &mut mps2::Line, watch: &mut impl Meter) -> Option<()> {
    let mut random = Random(1);
    let settings = RlsSettings {
        forgetting: 0.999,
        initial_covariance: 1e4,
        ..RlsSettings::default()
    };
    let rls = Rls::new(SVector::zeros(), &settings).ok()?;
    let mut pair: Pair = [rls.clone(), rls];
    let mut counts = 0;
    for _ in 0..SAMPLES {
        let [v, omega] = [0.2 * random.next(), random.next()];
        let [right, left] = [10.0 * random.next(), 10.0 * random.next()];
        let k = &PARAMETERS;
        let regressors = [
            [v, omega * omega, right + left],
            [omega, v * omega, right - left],
        ];
        let y = [0, 1].map(|i| {
            let products = regressors[i].iter().zip(&k[3 * i..]);
            products.fold(0.01 * random.next(), |sum, (phi, k)| sum + phi * k)
        });
        watch.start();
        black_box(learn(&mut pair, &regressors, &y));
        counts += watch.stop();
    }
    said(line, "two recursive least squares", counts);
    let friction = Attachment {
        id: "coulomb_friction".try_into().ok()?,
        channels: Vec::from_slice(&[0, 1]).ok()?,
        values: Vec::from_slice(&[0.9, 0.3]).ok()?,
    };
    for (name, effects) in [
        ("linearisation, two PI laws, limits", &[][..]),
        ("the same, friction compensated", &[friction]),
    ] {
        let efforts = Efforts::new(effects, &PARAMETERS).ok()?;
        let mut model = AffinePlant::<Twil>::new(PARAMETERS, efforts, [0.04, 0.3]);
        let gains = |value: f64| SVector::from([value; 2]);
        let mut law = Control::new(
            &gains(17.78),
            &gains(79.01),
            &gains(12.0),
            f64::from(PERIOD_US) * 1e-6,
        )
        .ok()?;
        let mut counts = 0;
        for _ in 0..SAMPLES {
            let measured = [0.05 * random.next(), 0.3 * random.next()];
            let reference = measured.map(|y| y + 0.01 * random.next());
            watch.start();
            black_box(control(&mut law, &mut model, &reference, &measured));
            counts += watch.stop();
        }
        said(line, name, counts);
    }
    Some(())
}

fn said(line: &mut mps2::Line, name: &str, counts: u32) {
    // A line that takes all there is cannot fail.
    let _ = writeln!(Text(line), "{name}: {counts} in {SAMPLES}");
}

/// Text on the line.
struct Text<'a>(&'a mut mps2::Line);

impl Write for Text<'_> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.write(text.as_bytes());
        Ok(())
    }
}

#[entry]
fn main() -> ! {
    if let Some((mut line, mut watch)) = mps2::start(PERIOD_US)
        && run(&mut line, &mut watch).is_some()
    {
        line.write(b"end\n");
    }
    halt()
}

fn halt() -> ! {
    loop {
        cortex_m::asm::wfi();
    }
}

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    halt()
}
