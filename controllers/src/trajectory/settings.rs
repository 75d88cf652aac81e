//! `[controller.trajectory]`: what a file says, and the controller built from it.

use loopsight_core::{Controller, Role};
use loopsight_model::declare_part;
use loopsight_model::model::Model;
use loopsight_model::registry::{BuildError, ControllerPart, PartMeta, Setting};
use serde::{Deserialize, Serialize};

use super::{Path, Trajectory};

/// The table of `trajectory` in TOML.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrajectorySettings {
    /// The path.
    pub path: Path,
    /// The velocity loop.
    pub velocity: Box<dyn ControllerPart>,
    /// Time over which the speed grows from rest, s.
    #[serde(default = "ease")]
    pub ease_s: f64,
    /// `k_x`, 1/s.
    #[serde(default = "forward")]
    pub forward_gain: f64,
    /// `k_y`, 1/m².
    #[serde(default = "lateral")]
    pub lateral_gain: f64,
    /// `k_θ`, 1/m; `None`: `2 √k_y`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heading_gain: Option<f64>,
    /// Where the robot stands at the start: `x`, `y` (m), heading (rad).
    #[serde(default)]
    pub start: [f64; 3],
}

fn ease() -> f64 {
    1.0
}

fn forward() -> f64 {
    2.0
}

fn lateral() -> f64 {
    25.0
}

const META: PartMeta = PartMeta {
    id: "trajectory",
    role: "controller",
    summary: "makes a vehicle follow a path in time, from counted poses, around a velocity loop of any \
              kind; the loop's own references are not used",
    equation: "v = v_r cos e_θ + k_x e_x;  ω = ω_r + v_r (k_y e_y + k_θ sin e_θ);  \
               e = pose error as the robot sees it",
    reference: "Kanayama, Kimura, Miyazaki, Noguchi (1990), Proc. IEEE ICRA, 384-389, equations (5), \
                (8); Samson, Ait-Abderrahim (1991), Proc. IEEE ICRA, 1136-1141",
    example: "[controller.trajectory]\npath = { figure_eight = { length_m = 1.6, width_m = 0.8, lap_s = \
              40.0 } }\n[controller.trajectory.velocity.pid]\nclosed_loop_time_s = 0.1\nlimit = 12.0\n",
    settings: &[
        Setting::new(
            "path",
            "",
            "`figure_eight = { length_m, width_m, lap_s }` or `circle = { radius_m, lap_s }`; it begins \
             at the start, ahead; no default",
        ),
        Setting::new(
            "velocity",
            "",
            "the velocity loop: any controller's table, as `[controller.trajectory.velocity.pid]`; no \
             default",
        ),
        Setting::new(
            "ease_s",
            "s",
            "time over which the speed along the path grows from rest; default 1",
        ),
        Setting::new(
            "forward_gain",
            "1/s",
            "speed per metre that the robot is behind; default 2",
        ),
        Setting::new(
            "lateral_gain",
            "1/m^2",
            "curvature per metre that the robot is beside the path; default 25: errors decay within \
             0.2 m of way",
        ),
        Setting::new(
            "heading_gain",
            "1/m",
            "curvature per radian of wrong heading; default twice the root of the lateral gain",
        ),
        Setting::new(
            "start",
            "",
            "where the robot stands at the start beside the path's beginning: x, y in m, heading in rad; \
             default [0, 0, 0]",
        ),
    ],
};

/// The controlled states must be forward speed and yaw rate, in this order.
fn check_vehicle(model: &Model) -> Result<(), BuildError> {
    let plant = model.plant;
    let plays = |i: usize, role: Role| {
        let id = plant.controlled.get(i).map(|s| plant.states[*s].id);
        id.is_some() && plant.channels.iter().any(|c| c.read(role) == id)
    };
    if plant.controlled.len() == 2 && plays(0, Role::Forward) && plays(1, Role::Yaw) {
        return Ok(());
    }
    Err(BuildError::at(
        "",
        format!(
            "`{}` needs a vehicle whose controlled states are forward speed and yaw rate, `{}` is none",
            META.id, plant.id
        ),
    ))
}

#[typetag::serde(name = "trajectory")]
impl ControllerPart for TrajectorySettings {
    fn meta(&self) -> &'static PartMeta {
        &META
    }

    fn is_limited(&self) -> bool {
        self.velocity.is_limited()
    }

    fn build(&self, model: &Model, period: f64) -> Result<Box<dyn Controller<f64>>, BuildError> {
        check_vehicle(model)?;
        if let Some((key, found)) = self.path.mistake() {
            let message = format!("`{key}` is {found}, expected a number above 0");
            return Err(BuildError::at(&format!("path.{key}"), message));
        }
        let heading_gain = self.heading_gain.unwrap_or(2.0 * self.lateral_gain.sqrt());
        for (key, found) in [
            ("ease_s", self.ease_s),
            ("forward_gain", self.forward_gain),
            ("lateral_gain", self.lateral_gain),
            ("heading_gain", heading_gain),
        ] {
            if !(found > 0.0 && found.is_finite()) {
                let message = format!("`{key}` is {found}, expected a number above 0");
                return Err(BuildError::at(key, message));
            }
        }
        let inner = self.velocity.build(model, period).map_err(|mut error| {
            let at = format!("velocity.{}", self.velocity.meta().id);
            error.key = if error.key.is_empty() {
                at
            } else {
                format!("{at}.{}", error.key)
            };
            error
        })?;
        let gains = [self.forward_gain, self.lateral_gain, heading_gain];
        Trajectory::new(inner, self.path, self.ease_s, gains, self.start).map_or_else(
            || {
                let message = format!("`start` is {:?}, expected finite numbers", self.start);
                Err(BuildError::at("start", message))
            },
            |made| Ok(Box::new(made) as Box<dyn Controller<f64>>),
        )
    }

    fn inverts_model(&self) -> bool {
        self.velocity.inverts_model()
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = vec![
            "the references are those of the path: the pose is counted from the measured speeds"
                .to_owned(),
        ];
        notes.extend(self.velocity.notes());
        notes
    }
}
declare_part!(&META);
