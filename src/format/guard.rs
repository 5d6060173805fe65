//! Third-party decoders behind a wall: a panic of theirs becomes an error of ours.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use super::Error;

/// Runs a decoder; a panic inside becomes [`Error::Decoder`].
///
/// The decoders check their input, but not every path of theirs has met hostile bytes. Whatever
/// they were building is dropped, so no half-made state is seen.
pub(super) fn guarded<T>(
    path: &Path,
    container: &'static str,
    decode: impl FnOnce() -> Result<T, Error>,
) -> Result<T, Error> {
    quiet(|| catch_unwind(AssertUnwindSafe(decode))).unwrap_or_else(|panic| {
        let detail = panic
            .downcast_ref::<&str>()
            .map(|text| (*text).to_owned())
            .or_else(|| panic.downcast_ref::<String>().cloned())
            .unwrap_or_else(|| "no message".to_owned());
        Err(Error::Decoder { path: path.to_owned(), container, detail })
    })
}

thread_local! {
    static GUARDED: std::cell::Cell<bool> = const { std::cell::Cell::new(false) };
}

/// Keeps the panic's message off standard error while a decoder runs on this thread.
fn quiet<T>(run: impl FnOnce() -> T) -> T {
    static HOOK: std::sync::Once = std::sync::Once::new();
    HOOK.call_once(|| {
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if !GUARDED.get() {
                usual(info);
            }
        }));
    });
    let before = GUARDED.replace(true);
    let result = run();
    GUARDED.set(before);
    result
}
