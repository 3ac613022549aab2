//! How long work tells how far it is, and learns that it should stop.

/// Someone who watches: a progress bar, or nobody ([`Silent`]).
pub trait Monitor: Sync {
    /// The work is in `phase` and `fraction` (0 to 1) of it is done. Called at most a few
    /// thousand times.
    fn progress(&self, phase: &str, fraction: f64);

    /// Whether the work should end as soon as it can.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Nobody watches.
pub struct Silent;

impl Monitor for Silent {
    fn progress(&self, _phase: &str, _fraction: f64) {}
}
