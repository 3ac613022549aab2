//! A system that gives no executable memory: blocks serve, with the same results, and it is
//! said once. Alone in its process, which cannot get such memory any more.
#![cfg(target_os = "linux")]
#![allow(unsafe_code)]

#[path = "engine_common/fields.rs"]
mod fields;

use imp::engine::{Kernels, Program, Tier, refusal};
use std::process::Command;

unsafe extern "C" {
    fn prctl(option: i32, flags: u64, unused: u64, unused: u64, unused: u64) -> i32;
}

/// Linux 6.3: memory cannot become executable any more (prctl(2), PR_SET_MDWE).
fn forbid_machine_code() -> bool {
    const SET_MEMORY_DENY_WRITE_EXECUTE: i32 = 65;
    const REFUSE_EXEC_GAIN: u64 = 1;
    // SAFETY: the call takes numbers only and changes nothing but what it is for.
    unsafe { prctl(SET_MEMORY_DENY_WRITE_EXECUTE, REFUSE_EXEC_GAIN, 0, 0, 0) == 0 }
}

#[test]
fn without_executable_memory_blocks_serve() {
    let example = fields::blobs(3);
    let mut expected = [0.0];
    let point = [0.1, 0.2, 0.3];
    let tier = Tier::Interpreter;
    let reference = Program::with_tier(&example.graph, &[example.root], 3, tier);
    reference.evaluate(&point, &example.q, &mut expected);
    assert_eq!(refusal(), None);
    if !forbid_machine_code() {
        // An older kernel: there is nothing to be seen here.
        return;
    }
    let program = Program::new(&example.graph, &[example.root], 3);
    assert_eq!(program.tier(1), Tier::Block(Kernels::widest()));
    let mut found = [0.0];
    program.evaluate(&point, &example.q, &mut found);
    assert_eq!(found, expected);
    assert!(refusal().is_some());

    // The program inherits the prohibition.
    let mut command = Command::new(env!("CARGO_BIN_EXE_imp"));
    let output = command
        .args([
            "eval",
            "examples/torus.imp",
            "torus(1.3, 0, 0.1)",
            "grad(torus)(1.3, 0, 0.1)",
        ])
        .output()
        .unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{text}");
    assert_eq!(text.matches("W0805").count(), 1, "{text}");

    // Vectors are refused as well, and that is said, too.
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_imp"));
    command.args(["render", "examples/torus.imp", "torus", "--size", "64x48"]);
    command.args(["--tier", "vector-baseline", "-o"]);
    let render = command.arg(folder.path().join("torus.png")).output();
    let render = render.unwrap();
    let text = String::from_utf8(render.stderr).unwrap();
    assert!(render.status.success(), "{text}");
    assert_eq!(text.matches("W0805").count(), 1, "{text}");

    // So does the example of the warning's page.
    let page = imp::diagnostic::Code::NoMachineCode.page();
    let (_, example) = page.split_once("```refused\n").unwrap();
    let (example, _) = example.split_once("```").unwrap();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("example.imp"), example).unwrap();
    let run = Command::new(env!("CARGO_BIN_EXE_imp"))
        .args(["run", "example.imp"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    let warned = String::from_utf8(run.stderr).unwrap();
    assert!(
        run.status.success() && warned.contains("[W0805]"),
        "{warned}"
    );

    assert!(String::from_utf8(output.stdout).unwrap().contains("0.6"));
}
