//! What a program may use up. Every limit has a name, which its error gives and by which a flag
//! raises it.

use super::value::{Outcome, failure};
use crate::diagnostic::Code;

macro_rules! limits {
    ($($(#[doc = $documentation:literal])* $name:ident: $default:expr,)*) => {
        /// The limits of one session.
        #[derive(Clone, Debug)]
        pub struct Limits {
            $($(#[doc = $documentation])* pub $name: u64,)*
        }

        impl Default for Limits {
            fn default() -> Self {
                Limits { $($name: $default,)* }
            }
        }

        impl Limits {
            /// The names of all limits.
            pub const NAMES: &[&str] = &[$(stringify!($name),)*];

            /// Sets the limit of that name; false if there is none.
            pub fn set(&mut self, name: &str, value: u64) -> bool {
                match name {
                    $(stringify!($name) => self.$name = value,)*
                    _ => return false,
                }
                true
            }
        }
    };
}

limits! {
    /// Calls within calls.
    recursion: 5_000,
    /// Nodes in the expression graph.
    nodes: 10_000_000,
    /// Elements of one list, sublists included; all lists together may have four times as many.
    elements: 5_000_000,
    /// Bytes of one string.
    characters: 10_000_000,
    /// Calls and loop rounds of the whole program.
    steps: 200_000_000,
    /// Cells of one polygonization.
    cells: 2_000_000_000,
    /// Particles of one sampling.
    particles: 20_000_000,
}

/// The error for a limit that was hit.
pub fn exceeded<T>(code: Code, what: &str, name: &str, limit: u64) -> Outcome<T> {
    let mut error = failure(code, format!("{what} (the limit is {limit})"));
    error.help = Some(format!("raise it with `--limit {name}=N` if this is meant"));
    Err(error)
}
