//! The model to start from: what one would write down of the machine without suspecting anything.

use crate::driven::Driven;
use crate::odometry::COUNTS;

impl Driven {
    /// A model file for `loopsight`: the true lumped parameters, rounded, as a first guess, and the
    /// true sensor.
    pub fn model_toml(self) -> String {
        let k = self.lumped();
        let body = self.parts().1;
        let (r, b) = (body.wheel_radius, body.half_track);
        match self {
            Driven::Twil => format!(
                "# A robot like the Twil. Its recordings may hide an effect that this model lacks.\n\
                 name = \"Twil with a secret\"\n\
                 \n\
                 # v' = K_A v + K_B ω² + K_C (V_r + V_l)      ω' = K_D ω + K_E v ω + K_F (V_r - V_l)\n\
                 [plant.ddmr]\n\
                 K_A = {}       # 1/s\n\
                 K_B = 0.0           # m/rad²\n\
                 K_C = {}         # m/s²/V\n\
                 K_D = {}        # 1/s\n\
                 K_E = 0.0           # 1/m\n\
                 K_F = {}         # rad/s²/V\n\
                 half_track = {b:?}   # m\n\
                 wheel_radius = {r:?}   # m\n\
                 \n\
                 # The centre of mass is believed to be above the axle; that it is not is the effect\n\
                 # `centrifugal_offset`.\n\
                 [fit]\n\
                 fixed = [\"K_B\", \"K_E\"]\n\
                 \n\
                 # Velocities from odometry, differences of encoder counts over 10 ms:\n\
                 # v = r/2 (φ'_r + φ'_l)      ω = r/(2b) (φ'_r - φ'_l)\n\
                 [log.measured.linear_velocity.sensor.encoder_counts]\n\
                 counts_per_revolution = {COUNTS}\n\
                 of = {{ shaft_angle_right = {half:?}, shaft_angle_left = {half:?} }}\n\
                 \n\
                 [log.measured.angular_velocity.sensor.encoder_counts]\n\
                 counts_per_revolution = {COUNTS}\n\
                 of = {{ shaft_angle_right = {yaw:?}, shaft_angle_left = -{yaw:?} }}\n",
                k.k_a,
                k.k_c,
                k.k_d,
                k.k_f,
                half = r / 2.0,
                yaw = r / (2.0 * b),
            ),
            Driven::Axis => format!(
                "# An axis with one motor. Its recordings may hide an effect that this model lacks.\n\
                 name = \"Axis with a secret\"\n\
                 \n\
                 # ω' = K_A ω + K_C V\n\
                 [plant.dc_axis]\n\
                 K_A = {:?}      # 1/s\n\
                 K_C = {:?}       # rad/s²/V\n\
                 \n\
                 # The speed is the difference of encoder counts over 10 ms.\n\
                 [log.measured.speed.sensor.encoder_counts]\n\
                 counts_per_revolution = {COUNTS}\n\
                 of = {{ angle = 1.0 }}\n",
                k.k_a, k.k_c,
            ),
        }
    }
}
