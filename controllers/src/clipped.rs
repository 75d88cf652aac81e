//! Commands within their limits, and the last one of them.

use loopsight_core::{Command, Real};
use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, OVector};

/// Clips the command of a law, each input by itself, as an amplifier does. It keeps the last command for ticks at
/// which none can be computed.
#[derive(Clone, Debug)]
pub(crate) struct Clipped<S: Real, D: Dim>
where
    DefaultAllocator: Allocator<D>,
{
    limit: OVector<S, D>,
    /// The last command that could be computed; zero at the start.
    last: OVector<S, D>,
}

impl<S: Real, D: Dim> Clipped<S, D>
where
    DefaultAllocator: Allocator<D>,
{
    /// Limits, one per input, in its unit; infinity for none.
    pub(crate) fn within(limit: OVector<S, D>) -> Self {
        let (dim, one) = limit.shape_generic();
        Self {
            limit,
            last: OVector::zeros_generic(dim, one),
        }
    }

    /// Number of inputs.
    pub(crate) fn len(&self) -> usize {
        self.limit.len()
    }

    /// Clips `command` and keeps it; true where it was beyond a limit.
    pub(crate) fn clip(&mut self, command: &mut [S]) -> bool {
        let mut saturated = false;
        for (value, limit) in command.iter_mut().zip(self.limit.iter()) {
            if value.abs() > *limit {
                *value = value.clamp(-*limit, *limit);
                saturated = true;
            }
        }
        self.last.as_mut_slice().copy_from_slice(command);
        saturated
    }

    /// The last command again.
    pub(crate) fn hold(&self, command: &mut [S]) -> Command {
        command.copy_from_slice(self.last.as_slice());
        Command {
            saturated: false,
            held: true,
        }
    }

    /// Forgets the last command.
    pub(crate) fn reset(&mut self) {
        self.last.fill(S::zero());
    }
}
