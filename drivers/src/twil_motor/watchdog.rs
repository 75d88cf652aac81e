//! The watchdog: it stops the motors when no commands come.

/// How far a watchdog has gone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Guard {
    /// Commands come in time.
    #[default]
    Awake,
    /// None came for too long: the bridges are open, the motors coast.
    Coasting,
    /// None came for longer: the motors are shorted, and brake.
    Braking,
    /// The motors were stopped, and brake: at the end of a loop, or for a command or a supply that
    /// cannot be.
    Stopped,
}

/// Counts the ticks since the last command.
///
/// ```text
/// n ticks without a command:   n < N  go on     N ≤ n < N + M  coast     n ≥ N + M  brake
/// ```
///
/// It coasts first so that a motor at speed is not shorted at once. After a trip it stays where it
/// is until [`Watchdog::rearm`]: a link that comes back for a moment must not move a robot by jerks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Watchdog {
    coast_after: u32,
    brake_after: u32,
    missed: u32,
    guard: Guard,
}

impl Watchdog {
    /// Coasts after `coast_after` ticks without a command (at least 1), brakes `then_brake` ticks later.
    pub fn new(coast_after: u32, then_brake: u32) -> Self {
        let coast_after = coast_after.max(1);
        Self {
            coast_after,
            brake_after: coast_after.saturating_add(then_brake),
            missed: 0,
            guard: Guard::Awake,
        }
    }

    /// How far it has gone.
    pub fn guard(&self) -> Guard {
        self.guard
    }

    /// A command came; without effect after a trip.
    pub fn fed(&mut self) {
        if self.guard == Guard::Awake {
            self.missed = 0;
        }
    }

    /// One more tick; returns the new state where it changes.
    pub fn tick(&mut self) -> Option<Guard> {
        if self.guard == Guard::Stopped {
            return None;
        }
        self.missed = self.missed.saturating_add(1);
        let now = if self.missed >= self.brake_after {
            Guard::Braking
        } else if self.missed >= self.coast_after {
            Guard::Coasting
        } else {
            Guard::Awake
        };
        let changed = now != self.guard;
        self.guard = now;
        changed.then_some(now)
    }

    /// The motors were stopped: nothing more happens until [`Watchdog::rearm`].
    pub fn stop(&mut self) {
        self.guard = Guard::Stopped;
    }

    /// Starts over after a trip or a stop.
    pub fn rearm(&mut self) {
        self.missed = 0;
        self.guard = Guard::Awake;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_coasts_and_then_brakes_and_stays_there() {
        let mut dog = Watchdog::new(3, 2);
        assert_eq!([dog.tick(), dog.tick()], [None, None]);
        dog.fed();
        let seen = [(); 6].map(|()| dog.tick());
        assert_eq!(
            seen,
            [
                None,
                None,
                Some(Guard::Coasting),
                None,
                Some(Guard::Braking),
                None
            ]
        );
        dog.fed();
        assert_eq!((dog.tick(), dog.guard()), (None, Guard::Braking));
        dog.rearm();
        assert_eq!((dog.tick(), dog.guard()), (None, Guard::Awake));
        dog.stop();
        let seen = [(); 9].map(|()| dog.tick());
        assert_eq!((seen, dog.guard()), ([None; 9], Guard::Stopped));
    }

    #[test]
    fn none_of_its_numbers_lets_it_sleep_for_ever() {
        // It may brake at once, and waits for one tick at least.
        let mut dog = Watchdog::new(0, 0);
        assert_eq!(dog.tick(), Some(Guard::Braking));
        let mut dog = Watchdog::new(1, u32::MAX);
        assert_eq!(dog.tick(), Some(Guard::Coasting));
    }
}
