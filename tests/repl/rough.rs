//! What goes wrong at a terminal: very long input, strange bytes, a terminal that goes away.

use std::io::Read;

use portable_pty::{CommandBuilder, PtySize, native_pty_system};

use crate::terminal::Terminal;

#[test]
fn a_megabyte_can_be_pasted_at_once() {
    let mut terminal = Terminal::new();
    let line = "1, ".repeat(333_333);
    terminal.send_much(format!("\x1b[200~[{line}1]\x1b[201~"));
    terminal.send("\r");
    terminal.wait_for("list of 333334");
    terminal.wait_for_prompt();
    terminal.enter("2 + 2");
    terminal.wait_for("4 : number");
}

#[test]
fn a_megabyte_that_is_typed_as_lines_is_run_as_lines() {
    let mut terminal = Terminal::new();
    let lines: String = (0..1_000)
        .map(|n| format!("let v{n} = [{n}, {n}]\r"))
        .collect();
    terminal.send_much(lines);
    terminal.wait_for("v999 = [999, 999] : list of 2");
    terminal.wait_for_prompt();
    terminal.enter("v500.x");
    terminal.wait_for("500 : number");
}

#[test]
fn a_line_that_is_typed_without_end_is_cut() {
    let mut terminal = Terminal::new();
    let line = "1 + ".repeat(250_000) + "1\r";
    terminal.send_much(line);
    terminal.wait_for("32768");
    terminal.wait_for_prompt();
    terminal.enter("2 + 2");
    terminal.wait_for("4 : number");
}

#[test]
fn control_characters_and_strange_letters_do_no_harm() {
    let mut terminal = Terminal::new();
    terminal.send("1 \x01\x02\x05\x06\x0b\x0e\x14\x17\x19\x1f+ 1\x15");
    terminal.wait_for_prompt();
    terminal.enter("let π2 = 2*π");
    terminal.wait_for("π2 = 6.28");
    terminal.send("\"\u{202e}\u{0}\u{7f}日本\"\r");
    terminal.wait_for("日本\" : string");
    terminal.wait_for_prompt();
    terminal.enter("2 + 2");
    terminal.wait_for("4 : number");
}

#[test]
fn the_end_of_input_ends_the_session() {
    let mut terminal = Terminal::new();
    terminal.enter("let a = 1");
    terminal.end_input();
    assert_eq!(terminal.exit_code(), 0);
}

#[test]
fn a_terminal_that_is_closed_ends_the_session() {
    let pair = native_pty_system().openpty(PtySize::default()).unwrap();
    let mut command = CommandBuilder::new(env!("CARGO_BIN_EXE_imp"));
    command.env("TERM", "xterm");
    command.env("IMP_HISTORY", "");
    let mut child = pair.slave.spawn_command(command).unwrap();
    drop(pair.slave);
    let mut reader = pair.master.try_clone_reader().unwrap();
    let mut heard = Vec::new();
    while !String::from_utf8_lossy(&heard).contains("imp> ") {
        let mut bytes = [0; 256];
        let count = reader.read(&mut bytes).unwrap();
        heard.extend_from_slice(&bytes[..count]);
    }
    // With the last descriptor of its side the terminal is gone.
    drop(reader);
    drop(pair.master);
    child.wait().unwrap();
}
