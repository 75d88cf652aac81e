//! Following a path in time, around a velocity loop.

use loopsight_core::{
    AffineModel, Command, ControlError, Controller, Quantity, Real, Sample, Tick,
};

mod path;
#[cfg(feature = "std")]
mod settings;
pub use path::{Goal, Path};
#[cfg(feature = "std")]
pub use settings::TrajectorySettings;

/// Pose tracking for a vehicle that steers by its yaw rate, around a velocity loop of any kind.
///
/// ```text
/// e_x = cos θ (x_r - x) + sin θ (y_r - y)      e_y = cos θ (y_r - y) - sin θ (x_r - x)
/// e_θ = θ_r - θ, folded
/// v = v_r cos e_θ + k_x e_x                    ω = ω_r + v_r (k_y e_y + k_θ sin e_θ)
/// x' = v cos θ   y' = v sin θ   θ' = ω         from the speeds measured (odometry)
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `x, y, θ` | pose, from where the robot stood when the loop began | m, m, rad |
/// | `x_r, y_r, θ_r`, `v_r, ω_r` | pose and speeds of the [`Path`] | m, m, rad, m/s, rad/s |
/// | `e_x, e_y, e_θ` | error ahead, to the left, of heading, as the robot sees it | m, m, rad |
/// | `v, ω` | what the velocity loop is asked for | m/s, rad/s |
/// | `k_x` | forward gain | 1/s |
/// | `k_y`, `k_θ` | lateral gain, heading gain | 1/m², 1/m |
///
/// With an ideal velocity loop, `½(e_x² + e_y²) + (1 - cos e_θ)/k_y` never grows
/// (`-k_x e_x² - v_r k_θ sin² e_θ/k_y` is its rate). On a straight line lateral errors obey
/// `s² + k_θ s + k_y` by the way driven: `k_θ = 2 √k_y` is critical damping, and `1/√k_y` the way in which
/// an error decays.
///
/// Between two samples the speeds are taken at their mean, on an arc. Where a predictor stands before
/// the controller the pose is the predicted one, too.
///
/// Assumptions: rolling without slip; the pose is counted, so what the wheels do not see (slip, a wrong
/// radius) adds up; `v_r` does not vanish for long.
///
/// Reference: Y. Kanayama, Y. Kimura, F. Miyazaki, T. Noguchi (1990), "A stable tracking control method
/// for an autonomous mobile robot", Proc. IEEE International Conference on Robotics and Automation,
/// 384–389, equations (5), (8) and proposition 1; C. Samson, K. Ait-Abderrahim (1991), "Feedback control
/// of a nonholonomic wheeled cart in Cartesian space", Proc. IEEE ICRA, 1136–1141.
#[derive(Clone, Debug)]
pub struct Trajectory<S, C> {
    /// The velocity loop; its controlled states are `v` and `ω`.
    pub velocity: C,
    path: Path,
    ease: f64,
    gains: [S; 3],
    start: [S; 3],
    pose: [S; 3],
    /// Speeds at the last sample that was finite.
    before: Option<[S; 2]>,
    demand: [S; 2],
    error: [S; 3],
}

impl<S: Real, C> Trajectory<S, C> {
    /// Follows `path`, its speed growing from rest over `ease` s, with the gains `k_x, k_y, k_θ`, from
    /// the pose `start` beside the path's beginning.
    ///
    /// `None` where a gain or `ease` is not above 0, or a number of the path or of `start` cannot be.
    pub fn new(
        velocity: C,
        path: Path,
        ease: f64,
        gains: [f64; 3],
        start: [f64; 3],
    ) -> Option<Self> {
        let above = |v: &f64| *v > 0.0 && v.is_finite();
        let fine = gains.iter().all(above)
            && above(&ease)
            && path.mistake().is_none()
            && start.iter().all(|v| v.is_finite());
        fine.then(|| Self {
            velocity,
            path,
            ease,
            gains: gains.map(S::of),
            start: start.map(S::of),
            pose: start.map(S::of),
            before: None,
            demand: [S::zero(); 2],
            error: [S::zero(); 3],
        })
    }

    /// `x, y, θ` now.
    pub fn pose(&self) -> [S; 3] {
        self.pose
    }

    /// `e_x, e_y, e_θ` at the last step.
    pub fn error(&self) -> [S; 3] {
        self.error
    }

    /// Moves the pose by the speeds measured at both ends of a period.
    fn count(&mut self, measured: &[S], period: S) {
        let &[v, omega] = measured else {
            return;
        };
        if !(v.is_finite() && omega.is_finite()) {
            return;
        }
        let half = S::of(0.5);
        if let Some([v0, omega0]) = self.before {
            let turn = half * (omega0 + omega) * period;
            let way = half * (v0 + v) * period;
            let (sin, cos) = (self.pose[2] + half * turn).sin_cos();
            self.pose[0] += way * cos;
            self.pose[1] += way * sin;
            // Folded, so that single precision does not lose it over hours.
            let (sin, cos) = (self.pose[2] + turn).sin_cos();
            self.pose[2] = sin.atan2(cos);
        }
        self.before = Some([v, omega]);
    }

    fn ask(&mut self, time: S) {
        let goal = self.path.at(time, self.ease);
        let (sin, cos) = self.pose[2].sin_cos();
        let way = [
            goal.position[0] - self.pose[0],
            goal.position[1] - self.pose[1],
        ];
        let (turn_sin, turn_cos) = (goal.heading - self.pose[2]).sin_cos();
        self.error = [
            cos * way[0] + sin * way[1],
            cos * way[1] - sin * way[0],
            turn_sin.atan2(turn_cos),
        ];
        let [k_x, k_y, k_theta] = self.gains;
        self.demand = [
            goal.speed * turn_cos + k_x * self.error[0],
            goal.turning + goal.speed * (k_y * self.error[1] + k_theta * turn_sin),
        ];
    }
}

impl<S: Real, C: Controller<S>> Controller<S> for Trajectory<S, C> {
    fn step(
        &mut self,
        tick: &Tick<S>,
        reference: &[S],
        measured: &[S],
        model: &mut dyn AffineModel<S>,
        command: &mut [S],
    ) -> Result<Command, ControlError> {
        if reference.len() != 2 || measured.len() != 2 {
            return Err(ControlError::Sizes);
        }
        self.count(measured, tick.period);
        self.ask(tick.time + model.ahead());
        self.velocity
            .step(tick, &self.demand, measured, model, command)
    }

    fn demand(&self, reference: &mut [S]) {
        for (to, from) in reference.iter_mut().zip(self.demand) {
            *to = from;
        }
    }

    fn sampled(&mut self, sample: &Sample<S>) {
        self.velocity.sampled(sample);
    }

    fn quantities(&self) -> &[Quantity<S>] {
        self.velocity.quantities()
    }

    fn told(&self) -> &[S] {
        self.velocity.told()
    }

    fn remark(&self) -> Option<&str> {
        self.velocity.remark()
    }

    fn reset(&mut self) {
        self.pose = self.start;
        self.before = None;
        self.demand = [S::zero(); 2];
        self.velocity.reset();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A velocity loop that does at once what it is asked: the demand is the command.
    struct Perfect;
    impl Controller<f32> for Perfect {
        fn step(
            &mut self,
            _tick: &Tick<f32>,
            reference: &[f32],
            _measured: &[f32],
            _model: &mut dyn AffineModel<f32>,
            command: &mut [f32],
        ) -> Result<Command, ControlError> {
            command.copy_from_slice(reference);
            Ok(Command::default())
        }
        fn reset(&mut self) {}
    }
    struct Unseen;
    impl AffineModel<f32> for Unseen {
        fn size(&self) -> usize {
            2
        }
        fn evaluate(&mut self, _y: &[f32], _drift: &mut [f32], _input_matrix: &mut [f32]) {}
    }

    const EIGHT: Path = Path::FigureEight {
        length_m: 1.6,
        width_m: 0.8,
        lap_s: 20.0,
    };

    /// Distance from the goal after `time` s, from a start beside the path, in single precision.
    fn off(start: [f64; 3], time: f32) -> f32 {
        let gains = [2.0, 25.0, 10.0];
        let mut tracker = Trajectory::new(Perfect, EIGHT, 1.0, gains, start).unwrap();
        let (mut y, mut asked) = ([0.0f32; 2], [0.0f32; 2]);
        let ticks = (time / 0.01).round() as u64;
        for index in 0..ticks {
            let tick = Tick {
                index,
                time: index as f32 * 0.01,
                period: 0.01,
            };
            tracker
                .step(&tick, &[0.0; 2], &y, &mut Unseen, &mut asked)
                .unwrap();
            y = asked;
        }
        let [x, y, _] = tracker.error();
        (x * x + y * y).sqrt()
    }

    #[test]
    fn a_start_beside_the_path_is_made_up_for() {
        for start in [[0.0; 3], [-0.1, 0.15, 0.5], [0.2, -0.2, -1.0]] {
            let left = off(start, 30.0);
            // A hundredth of a second behind, at most 0.4 m/s.
            assert!(left < 4e-3, "{start:?}: {left}");
        }
        assert!(off([0.0, 0.3, 0.0], 0.1) > 0.2);
    }

    #[test]
    fn the_demand_is_told_and_a_reset_begins_anew() {
        let mut tracker =
            Trajectory::new(Perfect, EIGHT, 1.0, [2.0, 25.0, 10.0], [0.1, 0.0, 0.0]).unwrap();
        let tick = Tick {
            index: 0,
            time: 5.0f32,
            period: 0.01,
        };
        let (mut asked, mut told) = ([0.0f32; 2], [7.0f32; 2]);
        for _ in 0..2 {
            tracker
                .step(&tick, &[0.0; 2], &[1.0, 0.0], &mut Unseen, &mut asked)
                .unwrap();
        }
        tracker.demand(&mut told);
        assert_eq!(asked, told);
        assert!((tracker.pose()[0] - 0.11).abs() < 1e-6);
        // A speed that is not a number moves nothing.
        let gap = [f32::NAN, 0.0];
        tracker
            .step(&tick, &[0.0; 2], &gap, &mut Unseen, &mut asked)
            .unwrap();
        assert!((tracker.pose()[0] - 0.11).abs() < 1e-6);
        tracker.reset();
        assert_eq!(tracker.pose(), [0.1, 0.0, 0.0]);
        assert!(Trajectory::<f32, _>::new(Perfect, EIGHT, 0.0, [1.0; 3], [0.0; 3]).is_none());
    }
}
