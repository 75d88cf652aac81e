//! An effect of one's own, plugged in: an equation and a declaration, and it is explained, simulated, and
//! named by a diagnosis like any other.

use loopsight::parts::{
    Effect, EffectMeta, Parameter, PlaceKind, Reading, Real, Role, declare_effect,
};
use loopsight::{DiagnoseOptions, Experiment, Model, Session, SimulateOptions, explain};

/// A damper that hardens: `w = -cubic · flow³`.
#[derive(Clone, Copy, Debug)]
struct CubicDamper;

impl Effect for CubicDamper {
    const META: EffectMeta = EffectMeta {
        id: "cubic_damper",
        summary: "damping that grows with the cube of the speed",
        symptom: "fast motion dies sooner than the model's",
        remedy: "feed the damping forward",
        equation: "w = -cubic flow^3",
        reference: "this example",
        example: "[[effect]]\n[effect.cubic_damper]\nat = [\"mass\"]\ncubic = 4.0\n",
        places: &[PlaceKind::Effort],
        reads: &[Role::Flow],
        parameters: &[
            Parameter::new("cubic", "c", "channel/flow^3", "damping per cubed speed")
                .within(0.0, f64::INFINITY)
                .or(0.0)
                .scaled(0.1),
        ],
        rarity: 2,
        ..EffectMeta::PLAIN
    };

    fn contribution<S: Real>(at: &Reading<'_, S>, _z: &[S; 0], p: &[S; 1]) -> S {
        let flow = at.get(Role::Flow);
        -p[0] * flow * flow * flow
    }
}

declare_effect!(CubicDamper, "cubic_damper");

const PLAIN: &str = "[plant.oscillator]\nstiffness_per_mass = 40.0\ndamping_per_mass = 0.5\n\
    inverse_mass = 1.0\n[log.measured.position]\n";
const DRIVE: &str = "duration_s = 30.0\nperiod_s = 0.01\n[inputs]\n\
    force = { multi_level = { amplitude = 20.0, hold_s = 0.7, levels = 7, seed = 3 } }\n\
    [robot]\nnoise = { position = 1e-4 }\nseed = 1\n";

fn main() -> loopsight::Result<()> {
    println!("{}", explain("cubic_damper")?.parts[0].equation);
    let text = format!("{PLAIN}[[effect]]\n[effect.cubic_damper]\nat = [\"mass\"]\ncubic = 0.05\n");
    let robot = Session::of_model(Model::from_toml("robot.toml", &text)?);
    let drive = Experiment::from_toml("drive.toml", DRIVE)?;
    let made = robot.simulate(&SimulateOptions::new(drive))?;
    let believed = Model::from_toml("believed.toml", PLAIN)?;
    let session = Session::new(believed, made.log().clone())?;
    println!("{}", session.diagnose(&DiagnoseOptions::default())?.summary);
    Ok(())
}
