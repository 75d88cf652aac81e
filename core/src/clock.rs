//! Time as a parameter of the loop: simulated or real.

/// Paces a loop.
pub trait Clock {
    /// Seconds since the clock started.
    fn now(&mut self) -> f64;
    /// Returns when `deadline` (s since the clock started) has come. A deadline that has passed
    /// returns at once.
    fn wait_until(&mut self, deadline: f64);
}

/// Jumps to each deadline: a simulation runs as fast as it can.
#[derive(Clone, Copy, Debug, Default)]
pub struct SimulatedClock {
    now: f64,
}

impl Clock for SimulatedClock {
    fn now(&mut self) -> f64 {
        self.now
    }
    fn wait_until(&mut self, deadline: f64) {
        if deadline > self.now {
            self.now = deadline;
        }
    }
}

/// The host's monotonic clock.
#[cfg(feature = "std")]
#[derive(Clone, Copy, Debug)]
pub struct SystemClock {
    start: std::time::Instant,
}

#[cfg(feature = "std")]
impl Default for SystemClock {
    fn default() -> Self {
        Self {
            start: std::time::Instant::now(),
        }
    }
}

#[cfg(feature = "std")]
impl Clock for SystemClock {
    fn now(&mut self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }
    fn wait_until(&mut self, deadline: f64) {
        let now = self.now();
        if deadline > now && deadline.is_finite() {
            std::thread::sleep(std::time::Duration::from_secs_f64(
                (deadline - now).min(3600.0),
            ));
        }
    }
}

#[cfg(feature = "std")]
impl<C: Clock + ?Sized> Clock for Box<C> {
    fn now(&mut self) -> f64 {
        (**self).now()
    }
    fn wait_until(&mut self, deadline: f64) {
        (**self).wait_until(deadline);
    }
}
