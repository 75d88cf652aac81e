//! Times of effects, for machines that are faster than a robot.

use super::{Model, Origin};

impl Model {
    /// The model of a machine that takes `scale` s for what takes a robot a second.
    ///
    /// The declarations of effects have the times of robots: a delay begins with 10 ms, a shaft swings with 10 rad/s to 270 rad/s. Here
    /// such sizes and starting values are `scale` times as long, for the effects that the model has and for those that are added to it. Of the latter, times that no fit finds are so, too,
    /// where a file does not give them. Parameters of the plant are as they are. The usual integration step is `scale` times as long, where the
    /// file does not give it.
    pub fn at_time_scale(&self, scale: f64) -> Model {
        let mut model = self.clone();
        let longer = scale / self.time_scale;
        for parameter in &mut model.parameters[self.n_plant_parameters..] {
            parameter.scale_time(longer);
        }
        model.time_scale = scale;
        // Where dry friction sticks, a step is a share of the usual one.
        if !model.step_given {
            model.max_step *= longer;
        }
        model
    }

    /// Takes the times of the parameters from `first` on, which were just added, at the scale of the model.
    pub(super) fn scale_times_from(&mut self, first: usize) {
        for parameter in &mut self.parameters[first..] {
            let before = parameter.size;
            if !parameter.scale_time(self.time_scale) {
                continue;
            }
            let longer = parameter.size / before;
            match (parameter.origin, parameter.value) {
                (Origin::Declaration, Some(value)) if !parameter.free && value != 0.0 => {
                    parameter.value = Some(parameter.declaration.nearest(value * longer));
                    parameter.origin = Origin::Log;
                }
                _ => {}
            }
        }
    }
}
