//! What an interrupt (Ctrl-C) does: it ends the program, or, where a session is typed, only what is
//! being computed.

use std::sync::atomic::{AtomicBool, Ordering};

/// Whether an interrupt is left to whoever computes.
static CAUGHT: AtomicBool = AtomicBool::new(false);

/// Whether there has been one.
static PENDING: AtomicBool = AtomicBool::new(false);

/// Whether what is being computed is wanted no more, whatever an interrupt does.
static UNWANTED: AtomicBool = AtomicBool::new(false);

/// Says that what is being computed is wanted no more; the program goes on.
pub(super) fn stop() {
    UNWANTED.store(true, Ordering::SeqCst);
}

/// Takes back what [`stop`] said; true if it was said.
pub(super) fn forget_stop() -> bool {
    UNWANTED.swap(false, Ordering::SeqCst)
}

/// Notes an interrupt; false if it is to end the program.
pub(super) fn note() -> bool {
    PENDING.store(true, Ordering::SeqCst);
    CAUGHT.load(Ordering::SeqCst)
}

/// Whether the computation that is going on is to stop.
pub(super) fn is_pending() -> bool {
    UNWANTED.load(Ordering::Relaxed)
        || (PENDING.load(Ordering::Relaxed) && CAUGHT.load(Ordering::Relaxed))
}

/// Does work that an interrupt stops without ending the program.
pub(super) fn caught<T>(work: impl FnOnce() -> T) -> T {
    PENDING.store(false, Ordering::SeqCst);
    let before = CAUGHT.swap(true, Ordering::SeqCst);
    let result = work();
    CAUGHT.store(before, Ordering::SeqCst);
    result
}
