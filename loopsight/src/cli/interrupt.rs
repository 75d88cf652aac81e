//! Ctrl-C.

use crate::watch::CancelToken;

/// A token that Ctrl-C cancels.
///
/// A second handler (another command in the same process) is refused: the first one still stops it, as
/// the process ends.
pub(crate) fn token() -> CancelToken {
    let token = CancelToken::new();
    let seen = token.clone();
    let _ = ctrlc::set_handler(move || seen.cancel());
    token
}
