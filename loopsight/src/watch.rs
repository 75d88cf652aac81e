//! Progress of long work, what is known before it ends, and how to stop it: a part of every options struct.

use std::fmt;
use std::sync::Arc;

use loopsight_diagnosis::Work;
pub use loopsight_diagnosis::{CancelToken, Early, Finding, Fitted, Progress, Promised, Stage};

/// A callback that gets the progress of long work.
type Report = dyn Fn(&Progress) + Send + Sync;

/// A callback that gets what is known before long work ends.
type Hear = dyn Fn(&Early) + Send + Sync;

/// Who gets the progress of long work and what is known before it ends, and what stops it.
#[derive(Clone, Default)]
pub struct Watch {
    report: Option<Arc<Report>>,
    hear: Option<Arc<Hear>>,
    cancel: CancelToken,
}

impl Watch {
    /// Calls `report` from time to time, from any of the threads that work.
    #[must_use]
    pub fn reporting(mut self, report: impl Fn(&Progress) + Send + Sync + 'static) -> Self {
        self.report = Some(Arc::new(report));
        self
    }

    /// Calls `hear` with what is known before the work ends, from any of the threads that work.
    #[must_use]
    pub fn telling(mut self, hear: impl Fn(&Early) + Send + Sync + 'static) -> Self {
        self.hear = Some(Arc::new(hear));
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
        let work = match &self.report {
            Some(report) => Work::reporting(report.as_ref()),
            None => Work::quiet(),
        };
        match &self.hear {
            Some(hear) => work.telling(hear.as_ref()),
            None => work,
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
            .field("tells", &self.hear.is_some())
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

/// The setter that an options struct has whose work knows something before it ends.
macro_rules! heard {
    ($options:ident) => {
        impl $options {
            /// Calls `hear` with what is known before the work ends, from any of the threads that work: what the model
            /// leaves, then what promises most, then each finalist.
            #[must_use]
            pub fn early(mut self, hear: impl Fn(&$crate::Early) + Send + Sync + 'static) -> Self {
                self.watch = self.watch.telling(hear);
                self
            }
        }
    };
}
pub(crate) use heard;
