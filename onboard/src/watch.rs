//! What a robot checks by itself, with or without messages.

use heapless::Vec;
use loopsight_core::{Array, Place, Plant, Role};
use loopsight_link::{Reason, SIGNALS, Safety, Unusable};

/// Speed of a shaft, in its unit, below which its encoder counts nothing.
const STILL: f32 = 1e-6;

/// Counts, in periods, what must not last.
pub(crate) struct Watch {
    safety: Safety,
    quiet: u16,
    stale: u16,
    still: [u16; SIGNALS],
    shafts: Vec<Shaft, SIGNALS>,
}

/// A motor and its encoder: which input drives which of the plant's outputs.
#[derive(Clone, Copy)]
struct Shaft {
    input: usize,
    output: usize,
}

impl Watch {
    pub(crate) fn new<P: Plant>(safety: &Safety) -> Result<Self, Unusable> {
        let usable = safety.watchdog_ticks > 0
            && safety.stale_ticks > 0
            && safety.encoder_ticks > 0
            && safety.least_supply.is_finite()
            && safety.encoder_input > 0.0;
        if !usable {
            return Err(Unusable::Safety);
        }
        let mut shafts = Vec::new();
        for channel in P::META.channels {
            let (Place::Effort(_), Some(drive), Some(flow)) = (
                channel.place,
                channel.read(Role::Drive),
                channel.read(Role::Flow),
            ) else {
                continue;
            };
            let input = P::META.inputs.iter().position(|s| s.id == drive);
            let output = P::META.outputs.iter().position(|s| s.id == flow);
            if let (Some(input), Some(output)) = (input, output) {
                let shaft = Shaft { input, output };
                shafts.push(shaft).map_err(|_| Unusable::Plant)?;
            }
        }
        Ok(Self {
            safety: *safety,
            quiet: 0,
            stale: 0,
            still: [0; SIGNALS],
            shafts,
        })
    }

    /// A period has gone by.
    pub(crate) fn elapsed(&mut self) -> Result<(), Reason> {
        self.quiet = self.quiet.saturating_add(1);
        if self.quiet > self.safety.watchdog_ticks {
            return Err(Reason::LinkLost);
        }
        Ok(())
    }

    /// A valid step has come.
    pub(crate) fn heard(&mut self) {
        self.quiet = 0;
    }

    /// Checks the age of a measurement (µs) and the supply (V). True if it is fresh enough to learn from.
    pub(crate) fn measured(&mut self, age_us: u32, supply: f32) -> Result<bool, Reason> {
        if supply.is_nan() || supply < self.safety.least_supply {
            return Err(Reason::SupplyLow);
        }
        let fresh = age_us <= self.safety.stale_us;
        self.stale = if fresh {
            0
        } else {
            self.stale.saturating_add(1)
        };
        if self.stale > self.safety.stale_ticks {
            return Err(Reason::Stale);
        }
        Ok(fresh)
    }

    /// Checks that the encoder of each driven motor moves.
    pub(crate) fn turned<P: Plant>(
        &mut self,
        applied: &P::Input<f32>,
        y: &P::Input<f32>,
        p: &P::Parameters<f32>,
    ) -> Result<(), Reason> {
        let mut x = P::State::<f32>::filled(0.0);
        for (state, value) in P::META.controlled.iter().zip(y.as_ref()) {
            x[*state] = *value;
        }
        for (shaft, still) in self.shafts.iter().zip(&mut self.still) {
            let driven = applied[shaft.input].abs() > self.safety.encoder_input;
            let turns = P::output(shaft.output, &x, applied, p).abs() > STILL;
            *still = if driven && !turns { *still + 1 } else { 0 };
            if *still >= self.safety.encoder_ticks {
                return Err(Reason::EncoderLost(shaft.input as u8));
            }
        }
        Ok(())
    }
}
