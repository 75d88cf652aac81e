//! Ctrl-C.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::watch::CancelToken;

/// The one token of the process: a second handler for the same signal would be refused.
static TOKEN: OnceLock<CancelToken> = OnceLock::new();

/// Whether Ctrl-C came while something was still being worked out.
static CUT: AtomicBool = AtomicBool::new(false);

/// A token that Ctrl-C cancels.
pub(crate) fn token() -> CancelToken {
    let made = TOKEN.get_or_init(|| {
        let token = CancelToken::new();
        let seen = token.clone();
        // Without a handler Ctrl-C ends the process, as it does everywhere.
        let _ = ctrlc::set_handler(move || seen.cancel());
        token
    });
    made.clone()
}

/// Long work ends here: remembers whether Ctrl-C ended it.
pub(crate) fn work_ends() {
    if token().is_cancelled() {
        CUT.store(true, Ordering::Relaxed);
    }
}

/// Whether Ctrl-C ended long work before it was done.
pub(crate) fn cut_work() -> bool {
    CUT.load(Ordering::Relaxed)
}
