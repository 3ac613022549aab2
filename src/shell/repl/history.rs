//! Where what was typed is kept from one session to the next.

use std::env;
use std::path::PathBuf;

/// So many inputs are kept.
pub(super) const LONGEST: usize = 10_000;

/// A file with more bytes is no history of this program.
pub(super) const LARGEST: u64 = 32_000_000;

/// The file of the history: `IMP_HISTORY`, or `imp/history` in the folder for data of programs.
/// Nothing where `IMP_HISTORY` is empty or there is no such folder.
pub(super) fn file() -> Option<PathBuf> {
    if let Some(chosen) = env::var_os("IMP_HISTORY") {
        return (!chosen.is_empty()).then(|| PathBuf::from(chosen));
    }
    let folder = |name| {
        env::var_os(name)
            .filter(|value| !value.is_empty())
            .map(PathBuf::from)
    };
    let data = folder("XDG_DATA_HOME")
        .filter(|path| path.is_absolute())
        .or_else(|| folder("APPDATA"))
        .or_else(|| folder("HOME").map(|home| home.join(".local").join("share")))?;
    Some(data.join("imp").join("history"))
}
