//! Machine code: for single points here, for many in [`vector`] and [`wide`], for enclosures of one
//! box in [`bounds`].
//!
//! [`compile`] turns steps into functions with Cranelift; [`MachineCode::run`] calls them and
//! cannot be misused: it takes slices and checks their lengths. Everything that could go wrong
//! while compiling (a processor that Cranelift does not serve, a system that refuses executable
//! memory, a function beyond Cranelift's limits) is a [`Refusal`], upon which the caller
//! runs blocks.
//!
//! **Upper halves of vector registers.** On x86-64, code that leaves the upper halves of the
//! registers dirty makes every later SSE instruction of the C library wait for them: a call then
//! takes some 300 ns instead of 10. The code made here cannot: Cranelift knows vectors of 128 bits
//! only, its AVX instructions of that width set the upper halves to zero and its SSE instructions
//! leave them alone; and the host functions follow the platform's convention, by which compilers
//! end every function that used wider registers with `vzeroupper`. Tests look at the emitted code
//! and, where the processor tells, at the registers' state after a call.

#![allow(unsafe_code)]

pub(super) mod bounds;
mod chunk;
mod emit;
mod memory;
mod stages;
mod translate;
pub(super) mod vector;
mod wide;

use super::lower::{Lowered, Step};
use crate::graph::Op;
use chunk::Lengths;
use cranelift_codegen::Context;
use cranelift_codegen::ir::{ExtFuncData, ExternalName, Function, UserFuncName};
use cranelift_codegen::isa::{CallConv, OwnedTargetIsa};
use cranelift_codegen::settings::{self, Configurable};
use cranelift_frontend::FunctionBuilderContext;
use cranelift_jit::JITBuilder;
use cranelift_module::{FuncId, Linkage, Module, ModuleError};
use emit::Lanes;
use memory::FreeingModule;
use std::convert::Infallible;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};
use thiserror::Error;
use translate::Source;

/// The longest kernel that is compiled, in steps; it takes one or two seconds. Beyond it
/// blocks serve. Addresses below it also fit the 32 bits of a displacement.
const LARGEST_KERNEL: usize = 250_000;

/// Why there is no machine code.
#[derive(Debug, Error)]
pub(super) enum Refusal {
    /// Cranelift knows no code for this processor.
    #[error("Cranelift does not serve this processor")]
    Processor,
    /// Steps, uniforms or outputs beyond [`LARGEST_KERNEL`], or more than three coordinates.
    #[error("the kernel is larger than what is compiled")]
    TooLarge,
    /// The system gave no executable memory, or a limit of Cranelift was met.
    #[error("{0}")]
    Compiler(Box<ModuleError>),
}

impl From<ModuleError> for Refusal {
    fn from(error: ModuleError) -> Refusal {
        Refusal::Compiler(Box::new(error))
    }
}

/// The first reason why this process could not have machine code.
static REFUSAL: OnceLock<String> = OnceLock::new();

/// Why machine code could not be made, the first time that it could not, because of the machine:
/// another processor than Cranelift serves, or a system that gives no executable memory. Fields
/// are then evaluated in blocks, with the same results.
pub fn refusal() -> Option<&'static str> {
    REFUSAL.get().map(String::as_str)
}

/// How many functions this process has compiled.
static COMPILATIONS: AtomicU64 = AtomicU64::new(0);

/// How many machine-code functions this process has compiled so far. Long kernels consist of
/// several functions.
pub fn compilations() -> u64 {
    COMPILATIONS.load(Ordering::Relaxed)
}

/// Nanoseconds that this process has spent on compiling.
static COMPILING: AtomicU64 = AtomicU64::new(0);

/// How long this process has compiled so far, all threads together.
pub fn compiling() -> Duration {
    Duration::from_nanos(COMPILING.load(Ordering::Relaxed))
}

/// See [`translate`].
type ChunkFunction = unsafe extern "C" fn(
    begin: usize,
    end: usize,
    inputs: *const *const f64,
    uniforms: *const f64,
    outputs: *const *mut f64,
    slots: *mut f64,
);

/// The machine code of one kernel.
///
/// It has no state, so any number of threads may run it at a time; the compiler sees `Send` and
/// `Sync` in function pointers and in the module's lock.
pub(super) struct MachineCode {
    /// In the order of execution. They live in `_module`'s memory.
    chunks: Vec<ChunkFunction>,
    /// The lengths that `run` demands.
    inputs: usize,
    uniforms: usize,
    outputs: usize,
    slots: usize,
    /// How many points a call may have, if there are several chunks.
    block: usize,
    /// Owns the memory of `chunks`; it is freed with this value, when nobody can call them.
    _module: FreeingModule,
}

/// What was compiled. Where the machine is the reason that it could not be, [`refusal`] tells it
/// from then on.
fn remember<T>(compiled: Result<T, Refusal>) -> Result<T, Refusal> {
    compiled.inspect_err(|refusal| match refusal {
        Refusal::Processor | Refusal::Compiler(_) => {
            REFUSAL.get_or_init(|| refusal.to_string());
        }
        Refusal::TooLarge => {}
    })
}

/// Compiles a kernel. Takes 3 to 6 ms per 1,000 steps.
pub(super) fn compile(lowered: &Lowered) -> Result<MachineCode, Refusal> {
    remember(compile_with(lowered, chunk::LENGTHS))
}

/// Compiles a kernel in functions of these lengths.
fn compile_with(lowered: &Lowered, lengths: Lengths) -> Result<MachineCode, Refusal> {
    let target = target().ok_or(Refusal::Processor)?;
    check_size(lowered)?;
    let plan = chunk::plan(lowered, lengths);
    let mut owner = FreeingModule::new(builder(target.clone()));
    let module = owner.module().ok_or(Refusal::Processor)?;
    let source = Source {
        lowered,
        plan: &plan,
        lanes: Lanes::One,
    };
    let functions = define(module, source, 0..plan.chunks.len())?;
    module.finalize_definitions()?;
    let chunks = functions
        .into_iter()
        .map(|function| {
            let address = module.get_finalized_function(function);
            // SAFETY: the address is that of a finished function, which `translate` gave
            // exactly this signature and the calling convention of `extern "C"`.
            unsafe { std::mem::transmute::<*const u8, ChunkFunction>(address) }
        })
        .collect();
    Ok(MachineCode {
        chunks,
        inputs: lowered.dimension,
        uniforms: lowered.uniforms(),
        outputs: lowered.outputs.len(),
        slots: plan.slots,
        block: plan.block,
        _module: owner,
    })
}

/// How many steps are functions: no instruction computes them.
pub(super) fn functions(lowered: &Lowered) -> usize {
    let is_function = |step: &&Step| emit::native(step.operation).is_none();
    lowered.steps.iter().filter(is_function).count()
}

/// Refuses kernels beyond [`LARGEST_KERNEL`] or of more than three coordinates.
fn check_size(lowered: &Lowered) -> Result<(), Refusal> {
    let sizes = [
        lowered.steps.len(),
        lowered.uniforms(),
        lowered.outputs.len(),
    ];
    if sizes.iter().any(|&size| size > LARGEST_KERNEL) || lowered.dimension > 3 {
        return Err(Refusal::TooLarge);
    }
    Ok(())
}

impl MachineCode {
    /// Computes the outputs of `count` points. Returns whether it did: not if a column of the
    /// points or of the outputs is missing or shorter than `count`, or if uniforms are missing.
    pub(super) fn run(
        &self,
        count: usize,
        points: &[&[f64]],
        uniforms: &[f64],
        outputs: &mut [&mut [f64]],
    ) -> bool {
        let (Some(points), Some(outputs)) =
            (points.get(..self.inputs), outputs.get_mut(..self.outputs))
        else {
            return false;
        };
        if uniforms.len() < self.uniforms
            || points.iter().any(|column| column.len() < count)
            || outputs.iter().any(|column| column.len() < count)
        {
            return false;
        }
        let mut inputs = [std::ptr::null(); 3];
        for (input, column) in inputs.iter_mut().zip(points) {
            *input = column.as_ptr();
        }
        // Single points are evaluated often enough that an allocation would show: F, F_x and a
        // Hessian are ten outputs.
        let mut few = [std::ptr::null_mut(); 10];
        if self.outputs <= few.len() {
            for (pointer, column) in few.iter_mut().zip(outputs) {
                *pointer = column.as_mut_ptr();
            }
            self.call(count, &inputs, uniforms, &few);
        } else {
            let many: Vec<*mut f64> = outputs.iter_mut().map(|c| c.as_mut_ptr()).collect();
            self.call(count, &inputs, uniforms, &many);
        }
        true
    }

    /// Runs the chunks; the pointers are those of [`MachineCode::run`].
    fn call(&self, count: usize, inputs: &[*const f64], uniforms: &[f64], outputs: &[*mut f64]) {
        let block = match self.chunks.len() {
            1 => count.max(1),
            _ => self.block,
        };
        let mut slots: Vec<f64> = Vec::with_capacity(self.slots * self.block);
        for begin in (0..count).step_by(block) {
            let end = count.min(begin + block);
            for chunk in &self.chunks {
                // SAFETY: the code reads `inputs` columns and writes `outputs` columns at
                // positions below `end` only, and `run` has checked that there are so many
                // columns, each at least `count` long; the outputs come from exclusive
                // references, so they overlap nothing. It reads the uniforms that `run` has
                // counted. It uses of `self.slots` slots the lanes below `end - begin`, which is
                // at most `self.block`, and writes each before it reads it. The code is alive,
                // since `self` owns its memory.
                unsafe {
                    chunk(
                        begin,
                        end,
                        inputs.as_ptr(),
                        uniforms.as_ptr(),
                        outputs.as_ptr(),
                        slots.as_mut_ptr(),
                    );
                }
            }
        }
    }
}

/// The kernel as text in Cranelift's intermediate representation, before anything specific to a
/// processor: the same on every machine.
pub(super) fn text(name: &str, lowered: &Lowered) -> String {
    let plan = chunk::plan(lowered, chunk::LENGTHS);
    let functions = (0..plan.chunks.len()).map(|chunk| {
        let source = Source {
            lowered,
            plan: &plan,
            lanes: Lanes::One,
        };
        let mut function = named(source, chunk, CallConv::SystemV);
        let suffix = match chunk {
            0 => String::new(),
            _ => format!("_{chunk}"),
        };
        function.name = UserFuncName::testcase(format!("{name}{suffix}"));
        function.display().to_string()
    });
    functions.collect::<Vec<String>>().join("\n")
}

/// One chunk, in which host functions go by their names; to be looked at, not to be linked.
fn named(source: Source<'_>, chunk: usize, convention: CallConv) -> Function {
    let mut function = Function::new();
    function.signature = translate::signature(convention, source.lanes);
    let mut memory = FunctionBuilderContext::new();
    let import = &mut |function: &mut Function, op: Op| {
        let signature = function.import_signature(translate::host_signature(convention));
        Ok::<_, Infallible>(function.import_function(ExtFuncData {
            name: ExternalName::testcase(op.name()),
            signature,
            colocated: false,
            patchable: false,
        }))
    };
    let Ok(_) = translate::translate(&mut function, &mut memory, source, chunk, import);
    function
}

/// The processor and the settings; made once, it is the same for all kernels.
fn target() -> Option<&'static OwnedTargetIsa> {
    static TARGET: OnceLock<Option<OwnedTargetIsa>> = OnceLock::new();
    TARGET
        .get_or_init(|| {
            if !is_served() {
                return None;
            }
            let mut flags = settings::builder();
            for (name, value) in SETTINGS {
                flags.set(name, value).ok()?;
            }
            let isa = cranelift_native::builder().ok()?;
            isa.finish(settings::Flags::new(flags)).ok()
        })
        .as_ref()
}

/// Whether the processor has all that the code needs: vectors for the masks, which Cranelift's
/// other targets do not always have, and rounding to integers without a call of the C library.
fn is_served() -> bool {
    #[cfg(target_arch = "x86_64")]
    return std::arch::is_x86_feature_detected!("sse4.1");
    #[cfg(not(target_arch = "x86_64"))]
    return cfg!(target_arch = "aarch64");
}

/// Cranelift's settings and their reasons.
const SETTINGS: &[(&str, &str)] = &[
    // The optimiser finds little to do in hash-consed code, and what it hoists out of the loop is
    // spilled again: no faster, at 1.4 times the time of compilation.
    ("opt_level", "none"),
    ("regalloc_algorithm", "backtracking"),
    (
        "enable_verifier",
        if cfg!(debug_assertions) {
            "true"
        } else {
            "false"
        },
    ),
    ("is_pic", "false"),
    ("use_colocated_libcalls", "false"),
    // Nothing unwinds through a kernel, since host functions do not panic.
    ("unwind_info", "false"),
    // A frame larger than a page touches every page, so that it meets the stack's guard.
    ("enable_probestack", "true"),
    ("probestack_strategy", "inline"),
];

/// A module's builder that knows the host functions by the names of their operations.
fn builder(isa: OwnedTargetIsa) -> JITBuilder {
    let mut builder = JITBuilder::with_isa(isa, cranelift_module::default_libcall_names());
    builder.symbol_lookup_fn(Box::new(|name| {
        let op = Op::ALL.iter().find(|op| op.name() == name)?;
        Some(op.host_function() as *const u8)
    }));
    builder
}

/// Compiles these chunks of the plan into the module.
fn define(
    module: &mut impl Module,
    source: Source<'_>,
    chunks: impl IntoIterator<Item = usize>,
) -> Result<Vec<FuncId>, Refusal> {
    let mut context = Context::new();
    let mut memory = FunctionBuilderContext::new();
    let config = module.target_config();
    let convention = config.default_call_conv;
    let mut functions = Vec::new();
    for chunk in chunks {
        module.clear_context(&mut context);
        context.func.signature = translate::signature(convention, source.lanes);
        let builder = translate::translate(
            &mut context.func,
            &mut memory,
            source,
            chunk,
            &mut |function, op| {
                let signature = translate::host_signature(convention);
                let id = module.declare_function(op.name(), Linkage::Import, &signature)?;
                Ok::<_, Refusal>(module.declare_func_in_func(id, function))
            },
        )?;
        builder.finalize(config);
        functions.push(finish(module, &mut context)?);
    }
    Ok(functions)
}

/// Compiles one function into the module.
fn finish(module: &mut impl Module, context: &mut Context) -> Result<FuncId, Refusal> {
    let id = module.declare_anonymous_function(&context.func.signature)?;
    counted(|| module.define_function(id, context).map_err(Refusal::from))?;
    Ok(id)
}

/// Compiles one function, and adds it and its time to [`compilations`] and [`compiling`].
fn counted<T>(compile: impl FnOnce() -> T) -> T {
    let begun = Instant::now();
    let result = compile();
    let spent = u64::try_from(begun.elapsed().as_nanos()).unwrap_or(u64::MAX);
    COMPILING.fetch_add(spent, Ordering::Relaxed);
    COMPILATIONS.fetch_add(1, Ordering::Relaxed);
    result
}

#[cfg(test)]
mod tests;
