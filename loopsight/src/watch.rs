//! Progress of long work and how to stop it: a part of every options struct.

use std::fmt;
use std::sync::Arc;

use loopsight_diagnosis::Work;
pub use loopsight_diagnosis::{CancelToken, Progress, Stage};

/// A callback that gets the progress of long work.
type Report = dyn Fn(&Progress) + Send + Sync;

/// Who gets the progress of long work, and what stops it.
#[derive(Clone, Default)]
pub struct Watch {
    report: Option<Arc<Report>>,
    cancel: CancelToken,
}

impl Watch {
    /// Calls `report` from time to time, from any of the threads that work.
    #[must_use]
    pub fn reporting(mut self, report: impl Fn(&Progress) + Send + Sync + 'static) -> Self {
        self.report = Some(Arc::new(report));
        self
    }

    /// Is stopped by `token`.
    #[must_use]
    pub fn stopped_by(mut self, token: &CancelToken) -> Self {
        self.cancel = token.clone();
        self
    }

    /// As the engine wants it.
    pub(crate) fn work(&self) -> Work<'_> {
        match &self.report {
            Some(report) => Work::reporting(report.as_ref()),
            None => Work::quiet(),
        }
        .stopped_by(&self.cancel)
    }

    pub(crate) fn is_cancelled(&self) -> bool {
        self.cancel.is_cancelled()
    }
}

impl fmt::Debug for Watch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Watch")
            .field("reports", &self.report.is_some())
            .field("cancelled", &self.is_cancelled())
            .finish()
    }
}

/// The setters that every options struct with a `watch` has.
macro_rules! watched {
    ($options:ident) => {
        impl $options {
            /// Who gets the progress and what stops the work, in one.
            #[must_use]
            pub fn watch(mut self, watch: $crate::Watch) -> Self {
                self.watch = watch;
                self
            }

            /// Calls `report` with stage, done and total from time to time, from any of the threads that
            /// work.
            #[must_use]
            pub fn progress(
                mut self,
                report: impl Fn(&$crate::Progress) + Send + Sync + 'static,
            ) -> Self {
                self.watch = self.watch.reporting(report);
                self
            }

            /// `token` stops the work within 0.2 s; what was found until then is the answer.
            #[must_use]
            pub fn cancel(mut self, token: &$crate::CancelToken) -> Self {
                self.watch = self.watch.stopped_by(token);
                self
            }
        }
    };
}
pub(crate) use watched;
