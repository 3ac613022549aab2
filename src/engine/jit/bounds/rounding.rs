//! Calls of code that rounds upward.
//!
//! The rounding mode is set and restored within one block of assembly, between which nothing but
//! machine code made here runs: Rust's own code always finds the mode that it relies on. The code
//! in between calls nothing.

use super::BoxNumber;
use super::table::Vector;

/// A chunk of code by its address; see [`super::translate`].
#[derive(Clone, Copy)]
pub(super) struct BoxFunction(pub(super) usize);

/// What a chunk of code is called with.
pub(super) struct Arguments {
    pub(super) sides: *const BoxNumber,
    pub(super) uniforms: *const BoxNumber,
    pub(super) outputs: *mut BoxNumber,
    pub(super) slots: *mut BoxNumber,
    pub(super) constants: *const Vector,
}

/// Calls a function while sums, products, quotients and roots are rounded upward.
///
/// # Safety
/// At the address is a function of the convention `sysv64` that may be called with these
/// arguments, and calls no other.
pub(super) type CallUpward = unsafe fn(BoxFunction, &Arguments);

/// How to call upward on this kind of processor, if that is known.
#[cfg(target_arch = "x86_64")]
pub(super) const CALL_UPWARD: Option<CallUpward> = Some(call_upward);

/// Elsewhere it is not.
#[cfg(not(target_arch = "x86_64"))]
pub(super) const CALL_UPWARD: Option<CallUpward> = None;

/// The control register MXCSR as programs find it, but for the rounding mode, which is upward
/// (Intel SDM, volume 1, section 10.2.3).
#[cfg(target_arch = "x86_64")]
static UPWARD: u32 = 0x1f80 | 2 << 13;

#[cfg(target_arch = "x86_64")]
unsafe fn call_upward(function: BoxFunction, arguments: &Arguments) {
    let mut found: u32 = 0;
    // SAFETY: the instructions write to `found` and to registers that are declared (those that the
    // convention lets a function use), the stack is aligned for a call as everywhere, and the
    // rounding mode is as it was when they end; of the call the caller vouches.
    unsafe {
        std::arch::asm!(
            "stmxcsr [r12]",
            "ldmxcsr [r13]",
            "call {function}",
            "ldmxcsr [r12]",
            function = in(reg) function.0,
            in("r12") &raw mut found,
            in("r13") &raw const UPWARD,
            in("rdi") arguments.sides,
            in("rsi") arguments.uniforms,
            in("rdx") arguments.outputs,
            in("rcx") arguments.slots,
            in("r8") arguments.constants,
            clobber_abi("sysv64"),
        );
    }
}
