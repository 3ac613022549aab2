//! What goes wrong at a terminal: very long input, strange bytes, a terminal that goes away.

use crate::terminal::Terminal;

#[test]
fn a_megabyte_can_be_pasted_at_once() {
    let mut terminal = Terminal::new();
    let line = "1 + ".repeat(250_000) + "1";
    terminal.send_much(format!("\x1b[200~{line}\x1b[201~"));
    terminal.send("\r");
    terminal.wait_for("250001 : number");
    terminal.wait_for_prompt();
    terminal.enter("2 + 2");
    terminal.wait_for("4 : number");
}

#[test]
fn a_megabyte_that_is_typed_as_lines_is_run_as_lines() {
    let mut terminal = Terminal::new();
    let lines: String = (0..1_000).map(|n| format!("let v{n} = [{n}, {n}]\r")).collect();
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
    terminal.wait_for_prompt();
    terminal.enter("2 + 2");
    terminal.wait_for("4 : number");
}

#[test]
fn a_terminal_that_is_closed_ends_the_session() {
    let mut terminal = Terminal::new();
    terminal.enter("let a = 1");
    terminal.close();
    // By the signal of the terminal, or because nothing more can be read.
    terminal.exit_code();
}
