//! A Cranelift module that gives its executable memory back.
//!
//! Cranelift keeps the memory of a dropped module for ever, so that function pointers stay
//! valid. Here the pointers live no longer than the module, so dropping frees it.

use cranelift_jit::{JITBuilder, JITModule};
use std::sync::{Mutex, PoisonError};

/// A module that frees its code and data when it is dropped, also half-built after an error.
///
/// Whoever takes a function pointer out of it must keep it together with this value and not
/// call it afterwards; [`super::MachineCode`] is the only place that does.
pub(super) struct FreeingModule {
    /// `JITModule` is `Send` but not `Sync` (it has a cache of symbols); after compilation only
    /// `drop` touches it, so the lock is never contended and makes the whole thing `Sync`.
    module: Mutex<Option<JITModule>>,
}

impl FreeingModule {
    /// An empty module.
    pub(super) fn new(builder: JITBuilder) -> FreeingModule {
        FreeingModule {
            module: Mutex::new(Some(JITModule::new(builder))),
        }
    }

    /// The module, to compile into; `None` never happens outside `drop`.
    pub(super) fn module(&mut self) -> Option<&mut JITModule> {
        self.module
            .get_mut()
            .unwrap_or_else(PoisonError::into_inner)
            .as_mut()
    }
}

impl Drop for FreeingModule {
    fn drop(&mut self) {
        if let Some(module) = self
            .module
            .get_mut()
            .unwrap_or_else(PoisonError::into_inner)
            .take()
        {
            // SAFETY: nothing of this module runs, since running borrows the owner of this
            // value, which is being dropped; and its function pointers are private to that
            // owner, so none can be called later.
            unsafe { module.free_memory() };
        }
    }
}
