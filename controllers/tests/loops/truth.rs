//! The same on a machine that shares no equation with any model: friction that really sticks, currents
//! in windings, marks of encoders.

use loopsight_core::{Driver, DriverFault, Sample};
use loopsight_hidden::{Hidden, Live, Robot};
use loopsight_model::registry::HostDriverError;

use super::*;

/// The machine behind ±12 V.
struct Machine {
    live: Live,
    volts: [f64; 2],
    reads: u64,
}

impl Driver<f64> for Machine {
    type Error = HostDriverError;

    fn read(&mut self, measured: &mut [f64]) -> Result<Sample<f64>, HostDriverError> {
        if self.reads > 0 {
            self.live.drive(self.volts);
        }
        let time = self.reads as f64 * 0.01;
        self.reads += 1;
        measured.copy_from_slice(&self.live.sample());
        let fresh = true;
        Ok(Sample { time, fresh })
    }

    fn write(&mut self, command: &[f64], applied: &mut [f64]) -> Result<(), HostDriverError> {
        if command.iter().any(|v| !v.is_finite()) {
            let (fault, message) = (DriverFault::Rejected, "no number".to_owned());
            return Err(HostDriverError { fault, message });
        }
        self.volts = [0, 1].map(|i| command[i].clamp(-12.0, 12.0));
        applied.copy_from_slice(&self.volts);
        Ok(())
    }

    fn safe_stop(&mut self) -> Result<(), HostDriverError> {
        self.volts = [0.0; 2];
        Ok(())
    }
}

const HIDDEN: [(Hidden, f64); 2] = [(Hidden::CoulombFriction, 1.5), (Hidden::InputDelay, 1.5)];

/// Tracking errors of the machine under `controller` with the model `believed`, from 5 s on.
fn drive(controller: &str, believed: &Model) -> [f64; 2] {
    let text = format!(
        "period_s = 0.01
model = \"model.toml\"
[driver.simulated]
[controller.{controller}
limit = 12.0
[reference]
linear_velocity = {{ sum = [{{ sine = {{ amplitude = 0.08, frequency_hz = 0.13 }} }}, {{ sine = {{ amplitude = 0.04, frequency_hz = 0.31 }} }}] }}
angular_velocity = {{ sum = [{{ sine = {{ amplitude = 0.4, frequency_hz = 0.17 }} }}, {{ sine = {{ amplitude = 0.2, frequency_hz = 0.41 }} }}] }}
"
    );
    let mut composed = compose(&text, believed, believed);
    composed.host.driver = Box::new(Machine {
        live: Live::new(Robot::Twil, &HIDDEN, 4).unwrap(),
        volts: [0.0; 2],
        reads: 0,
    });
    let mut trace = Trace::default();
    for k in 0..3000 {
        let step = composed.tick(0.01 * f64::from(k)).unwrap();
        trace.reference.push(step.reference.to_vec());
        trace.measured.push(step.measured.to_vec());
    }
    [0, 1].map(|i| trace.rms(i, 500))
}

#[test]
fn an_improved_model_tracks_twice_as_well_on_the_machine() {
    let nominal = Robot::Twil.model_toml();
    let live = Live::new(Robot::Twil, &HIDDEN, 4).unwrap();
    // What is hidden, 5 % off, as a diagnosis may find it.
    let effects: Vec<String> = live
        .hidden()
        .iter()
        .map(|concealed| {
            let values = concealed.fitted.iter();
            let values: Vec<String> = values
                .map(|q| format!("{} = {}", q.name, 0.95 * q.value))
                .collect();
            effect(&format!(
                "[effect.{}]\nat = {:?}\n{}",
                concealed.effect.id(),
                concealed.at,
                values.join("\n")
            ))
        })
        .collect();
    println!("{}", effects.concat());
    let improved = model(&format!("{nominal}\n{}", effects.concat()));
    let nominal = model(&nominal);
    let law = "feedback_linearizing_pi]\nsettling_time_s = 0.45\nfeedforward = true";
    let (before, after) = (drive(law, &nominal), drive(law, &improved));
    let mut pid = [f64::INFINITY; 2];
    for time in [0.025, 0.03, 0.035, 0.045, 0.06] {
        let errors = drive(&format!("pid]\nclosed_loop_time_s = {time}"), &nominal);
        pid = [0, 1].map(|i| pid[i].min(errors[i]));
    }
    let mut mrac = [f64::INFINITY; 2];
    for (settling, adaptation) in [
        (0.1, 5.0),
        (0.1, 10.0),
        (0.15, 10.0),
        (0.2, 20.0),
        (0.3, 20.0),
    ] {
        let errors = drive(
            &format!("mrac]\nsettling_time_s = {settling}\nadaptation = {adaptation}"),
            &nominal,
        );
        mrac = [0, 1].map(|i| mrac[i].min(errors[i]));
    }
    println!(
        "nominal {before:.5?}, improved {after:.5?}, best PID {pid:.5?}, best MRAC {mrac:.5?}"
    );
    for i in 0..2 {
        assert!(after[i] < 0.5 * before[i]);
        assert!(after[i] < 0.8 * pid[i].min(mrac[i]));
    }
}
