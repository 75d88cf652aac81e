//! An exact delay by whole steps.

/// Gives back what was pushed `steps` pushes ago.
#[derive(Clone, Debug)]
pub(crate) struct Delay<T> {
    ring: Vec<T>,
    next: usize,
}

impl<T: Copy> Delay<T> {
    /// A line that was filled with `before`.
    pub(crate) fn new(steps: usize, before: T) -> Self {
        Self {
            ring: vec![before; steps],
            next: 0,
        }
    }

    /// Puts `value` in, takes what was put in `steps` pushes ago out.
    pub(crate) fn push(&mut self, value: T) -> T {
        match self.ring.get_mut(self.next) {
            None => value,
            Some(place) => {
                let old = std::mem::replace(place, value);
                self.next = (self.next + 1) % self.ring.len();
                old
            }
        }
    }
}
