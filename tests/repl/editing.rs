//! Typing: completion, history, lines that go on, interrupts, narrow and plain terminals.

use std::sync::Arc;

use crate::terminal::{Setup, Terminal};

#[test]
fn names_methods_commands_parameters_and_files_are_completed() {
    let mut terminal = Terminal::new();
    terminal.enter("param roundness = 1 in 0..2");
    terminal.enter("field smoothtorus(p in R3) over -2..2 = norm(p) - roundness");
    for (begun, expected) in [
        (":he\t", "imp> :help"),
        (":set rou\t", "imp> :set roundness="),
        ("smootht\t", "imp> smoothtorus"),
        ("let k = smooth_un\t", "imp> let k = smooth_union"),
        (":mesh smootht\t", "imp> :mesh smoothtorus"),
    ] {
        terminal.send(begun);
        terminal.wait(expected, |seen| seen.line == expected);
        terminal.send("\x03");
        terminal.wait_for_prompt();
    }
    std::fs::write(terminal.folder.path().join("gasket.imp"), "let a = 1\n").unwrap();
    terminal.send(":load gas\t");
    terminal.wait("the file", |seen| seen.line == "imp> :load gasket.imp");
    terminal.send("\r");
    terminal.wait_for("loaded gasket.imp: 1 statement");
    terminal.wait_for_prompt();
    // Several that begin so are listed.
    terminal.send(":\t\t");
    terminal.wait_for(":reload");
}

#[test]
fn the_history_lasts_from_one_session_to_the_next() {
    let folder = Arc::new(tempfile::tempdir().unwrap());
    let mut first = Terminal::start(Setup::default(), Arc::clone(&folder));
    first.enter("let first = 41 + 1");
    first.enter("first / 2");
    first.send("\x04");
    assert_eq!(first.exit_code(), 0);
    assert!(folder.path().join(".local/share/imp/history").exists());
    let mut second = Terminal::start(Setup::default(), Arc::clone(&folder));
    second.send("\x1b[A");
    second.wait("the last line", |seen| seen.line == "imp> first / 2");
    second.send("\x1b[A");
    second.wait("the line before", |seen| {
        seen.line == "imp> let first = 41 + 1"
    });
    second.send("\x03");
    second.wait_for_prompt();
    // Ctrl-R searches.
    second.send("\x1241 +");
    second.wait_for("let first = 41 + 1");
    second.send("\r");
    second.wait_for("first = 42 : number");
    // Another file, and a line that begins with a space is not kept.
    let file = folder.path().join("other");
    let setup = Setup::default().with("IMP_HISTORY", file.to_str().unwrap());
    let mut third = Terminal::start(setup, Arc::clone(&folder));
    third.enter("1 + 1");
    third.enter(" 2 + 2");
    third.send("\x04");
    assert_eq!(third.exit_code(), 0);
    let kept = std::fs::read_to_string(file).unwrap();
    assert!(kept.contains("1 + 1") && !kept.contains("2 + 2"), "{kept}");
}

#[test]
fn a_history_that_cannot_be_written_is_noted_once() {
    let folder = Arc::new(tempfile::tempdir().unwrap());
    std::fs::write(folder.path().join("file"), "").unwrap();
    let history = folder.path().join("file/history");
    let setup = Setup::default().with("IMP_HISTORY", history.to_str().unwrap());
    let mut terminal = Terminal::start(setup, folder);
    terminal.enter("1 + 1");
    terminal.enter("2 + 2");
    terminal.wait_for("4 : number");
    assert_eq!(terminal.raw().matches("the history is not kept").count(), 1);
}

#[test]
fn a_line_goes_on_while_a_bracket_is_open() {
    let mut terminal = Terminal::new();
    terminal.send("fn f(x) {\r");
    terminal.send("    x + 1\r");
    terminal.send("}\r");
    terminal.wait_for("f(x) : function");
    terminal.wait_for_prompt();
    terminal.send("1 +\r2\r");
    terminal.wait_for("3 : number");
    terminal.wait_for_prompt();
    // Ctrl-C leaves what is unfinished, and the session stays.
    terminal.send("let g = [1,\r");
    terminal.wait("the next line", |seen| seen.line.is_empty());
    terminal.send("\x03");
    terminal.wait_for_prompt();
    terminal.enter("f(2) + 4");
    terminal.wait_for("7 : number");
    // Ctrl-D ends a session only where nothing is typed.
    terminal.type_text("f(1)");
    terminal.send("\x04");
    terminal.send("\r");
    terminal.wait_for("2 : number");
    terminal.wait_for_prompt();
    terminal.send("[1,\r");
    terminal.wait("the next line", |seen| seen.line.is_empty());
    terminal.send("\x04");
    terminal.wait_for("was not whole");
    terminal.wait_for_prompt();
    terminal.send("\x04");
    assert_eq!(terminal.exit_code(), 0);
}

#[test]
fn an_interrupt_stops_what_is_computed_and_keeps_the_session() {
    let mut terminal = Terminal::new();
    terminal.enter("let kept = 12");
    terminal.enter("field b(p in R3) over -1..1 = sin(30*p.x) * cos(31*p.y) + sin(29*p.z)");
    for long in [
        "var n = 0; print(\"busy {n}\"); while true { n = n + 1 }",
        "print(\"busy {1 + 1}\"); polygonize(b, cell = 0.002)",
        "print(\"busy {2 + 2}\"); sample(b, spacing = 0.004)",
        "print(\"busy {3 + 3}\"); let total = { var t = 0; while true { t = t + 1 }; t }",
        "print(\"busy {4 + 4}\"); plot(b, size = 4000, samples = 2)",
    ] {
        let number = match long.contains("{n}") {
            true => 0,
            false => long.as_bytes()[13] - b'0',
        };
        let number = if number == 0 { 0 } else { 2 * number };
        terminal.type_text(long);
        terminal.send("\r");
        terminal.wait_for(&format!("\nbusy {number}"));
        let stops = |raw: &str| raw.matches("stopped").count() + raw.matches("cancelled").count();
        let before = stops(&terminal.raw());
        terminal.send("\x03");
        terminal.wait_for_prompt();
        assert!(
            stops(&terminal.raw()) > before,
            "{long}:\n{}",
            terminal.contents()
        );
    }
    terminal.enter("kept + 1");
    terminal.wait_for("13 : number");
    // What failed has bound nothing.
    terminal.enter("total");
    terminal.wait_for("there is no `total` here");
}

#[test]
fn twenty_columns_and_no_colours_are_enough() {
    let setup = Setup::default().sized(20, 40).with("NO_COLOR", "1");
    let mut terminal = Terminal::start(setup, Arc::new(tempfile::tempdir().unwrap()));
    terminal.send("field b(p in R3) over -1..1 = norm(p) - 0.8\r");
    terminal.wait_for("b : field in R3");
    terminal.wait_for_prompt();
    terminal.enter("b");
    let raw = terminal.raw();
    assert!(
        !raw.contains("\x1b[3") && !raw.contains("\x1b[2m"),
        "{raw:?}"
    );
    let shades = ['-', '=', '+', '*', '#', '%', '@'];
    let lines = terminal.contents();
    let drawn = lines
        .lines()
        .filter(|line| line.matches(shades).count() >= 6)
        .count();
    assert!(drawn >= 5, "{lines}");
    terminal.enter("bb");
    terminal.wait_for("E0201");
    terminal.enter("1 + 1");
    terminal.wait_for("2 : number");
}

#[test]
fn a_plain_terminal_gets_no_escape_sequences() {
    let setup = Setup {
        environment: vec![("TERM".into(), "dumb".into())],
        ..Setup::default()
    };
    let mut terminal = Terminal::start(setup, Arc::new(tempfile::tempdir().unwrap()));
    terminal.send("1 + 1\r");
    terminal.wait_for("2 : number");
    terminal.wait_for_prompt();
    terminal.send("fn f(x) {\rx + 1 }\r");
    terminal.wait_for("f(x) : function");
    terminal.wait_for_prompt();
    assert!(!terminal.raw().contains('\x1b'), "{:?}", terminal.raw());
    terminal.send("\x04");
    assert_eq!(terminal.exit_code(), 0);
}

#[test]
fn words_are_coloured_while_they_are_typed() {
    let mut terminal = Terminal::new();
    terminal.type_text("let a = 12");
    let (letter, color, _) = terminal.cell(row_of(&terminal, "imp> let a = 12"), 5);
    assert_eq!((letter.as_str(), color), ("l", vt100::Color::Idx(5)));
    let (letter, color, _) = terminal.cell(row_of(&terminal, "imp> let a = 12"), 13);
    assert_eq!((letter.as_str(), color), ("1", vt100::Color::Idx(6)));
}

fn row_of(terminal: &Terminal, line: &str) -> u16 {
    let contents = terminal.contents();
    let row = contents.lines().position(|one| one.trim_end() == line);
    row.unwrap_or_else(|| panic!("{line:?} is not in\n{contents}")) as u16
}

#[test]
fn graphics_are_those_that_are_chosen_or_that_the_terminal_has() {
    let ball = "field b(p in R3) over -1..1 = norm(p) - 0.8";
    for (name, value, begins) in [
        ("IMP_GRAPHICS", "kitty", "\x1b_Ga=T,f=100"),
        ("IMP_GRAPHICS", "sixel", "\x1bP"),
        ("KITTY_WINDOW_ID", "1", "\x1b_Ga=T,f=100"),
        ("TERM_PROGRAM", "WezTerm", "\x1b_Ga=T,f=100"),
    ] {
        let setup = Setup::default().with(name, value);
        let mut terminal = Terminal::start(setup, Arc::new(tempfile::tempdir().unwrap()));
        terminal.enter(ball);
        terminal.enter("b");
        assert!(terminal.raw().contains(begins), "{name}={value}");
    }
    let setup = Setup::default().with("IMP_GRAPHICS", "none");
    let mut terminal = Terminal::start(setup, Arc::new(tempfile::tempdir().unwrap()));
    terminal.enter(ball);
    terminal.enter("b");
    assert!(!terminal.contents().contains(['▀', '▄']));
}

#[test]
fn an_input_that_is_not_whole_is_left_at_the_end_of_input() {
    let mut terminal = Terminal::new();
    terminal.send("[1,\r\x04");
    terminal.wait_for("not whole");
    terminal.wait_for_prompt();
    terminal.enter("2 + 2");
    terminal.wait_for("4 : number");
}

#[test]
fn a_field_whose_box_is_hard_to_find_is_shown_without_a_picture() {
    let mut terminal = Terminal::new();
    let field = "field b(p in R3) = sum(exp(-norm2(p - [cos(i), sin(i*i), i/200])) for i in range(3000)) - 1";
    terminal.send(&format!("{field}\r"));
    terminal.wait_for("b : field in R3");
    terminal.wait_for_prompt();
    terminal.enter("b");
    assert!(!terminal.contents().contains("no picture"));
    terminal.enter("field ball(p in R3) = norm(p) - 1");
    terminal.enter("ball");
    terminal.wait_for("\u{2580}");
}

#[test]
fn at_a_typewriter_an_interrupt_drops_the_line_and_nothing_has_colours() {
    let setup = Setup {
        environment: vec![("TERM".into(), "dumb".into())],
        ..Setup::default()
    };
    let mut terminal = Terminal::start(setup, Arc::new(tempfile::tempdir().unwrap()));
    terminal.send("nosuch\x03");
    terminal.wait_for("^C");
    terminal.send("2 + 2\r");
    terminal.wait_for("4 : number");
    terminal.wait_for_prompt();
    terminal.send("nosuch + 1\r");
    terminal.wait_for("there is no `nosuch` here");
    assert!(!terminal.raw().contains('\u{1b}'), "{:?}", terminal.raw());
}

#[test]
fn a_history_with_strange_bytes_is_kept_and_one_that_is_no_file_is_not() {
    let folder = Arc::new(tempfile::tempdir().unwrap());
    let file = folder.path().join("history");
    std::fs::write(&file, b"#V2\n1 + 11\n\xff\n").unwrap();
    let setup = Setup::default().with("IMP_HISTORY", &file.display().to_string());
    let mut terminal = Terminal::start(setup, Arc::clone(&folder));
    terminal.enter("2 + 2");
    assert!(
        !terminal.contents().contains("history"),
        "{}",
        terminal.contents()
    );
    assert!(std::fs::read_to_string(&file).unwrap().contains("2 + 2"));
    for (name, is_told) in [("/dev/null", false), ("/dev/zero", true)] {
        let setup = Setup::default().with("IMP_HISTORY", name);
        let mut terminal = Terminal::start(setup, Arc::clone(&folder));
        terminal.enter("2 + 2");
        assert_eq!(terminal.contents().contains("history"), is_told, "{name}");
    }
}
