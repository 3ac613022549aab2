//! A whole session, as the guide shows it, and the picture in it.

use vt100::Color;

use crate::terminal::Terminal;

/// The cells of a picture on the screen: each with what is seen in its upper and lower half, from
/// the first row with half blocks to the last.
fn picture(terminal: &Terminal) -> Vec<Vec<[Option<Color>; 2]>> {
    let row = |row: u16| -> Vec<[Option<Color>; 2]> {
        (0..terminal.columns())
            .map(|column| match terminal.cell(row, column) {
                (letter, upper, Color::Default) if letter == "▀" => [Some(upper), None],
                (letter, upper, lower) if letter == "▀" => [Some(upper), Some(lower)],
                (letter, lower, _) if letter == "▄" => [None, Some(lower)],
                _ => [None, None],
            })
            .collect()
    };
    let rows: Vec<_> = (0..terminal.rows()).map(row).collect();
    let is_drawn = |row: &Vec<[Option<Color>; 2]>| row.iter().any(|cell| *cell != [None, None]);
    let first = rows.iter().position(is_drawn).expect("a picture");
    let last = rows.iter().rposition(is_drawn).unwrap();
    rows[first..=last].to_vec()
}

/// How light a colour is.
fn light(color: Color) -> u32 {
    match color {
        Color::Rgb(red, green, blue) => [red, green, blue].into_iter().map(u32::from).sum(),
        other => panic!("not a colour of 24 bits: {other:?}"),
    }
}

#[test]
fn a_torus_is_defined_evaluated_changed_plotted_and_a_mistake_made() {
    let mut terminal = Terminal::new();
    terminal.enter("param r = 0.3 in 0.1..0.6");
    terminal.wait_for("r = 0.3 : param in 0.1..0.6");
    terminal.enter("field torus(x, y, z) over -1.5..1.5 = (sqrt(x^2 + y^2) - 1)^2 + z^2 - r^2");
    terminal.wait_for("torus : field in R3 over -1.5..1.5, depends on r");
    // On the circle of radius 1 the field is -r².
    terminal.enter("torus(1, 0, 0)");
    terminal.wait_for("-0.09 : number");
    // 2(ρ - 1)x/ρ, 2(ρ - 1)y/ρ, 2z at ρ = 2
    terminal.enter("grad(torus)(2, 0, 0.25)");
    terminal.wait_for("[2, 0, 0.5] : list of 3");
    terminal.enter(":set r=0.5");
    terminal.wait_for("r = 0.5 : param in 0.1..0.6");
    terminal.enter("torus(1, 0, 0)");
    terminal.wait_for("-0.25 : number");
    terminal.enter("torsu(1, 0, 0)");
    terminal.wait_for("did you mean `torus`?");
    terminal.wait_for("torsu(1, 0, 0)");
    terminal.enter("torus(0, 0, 0)");
    terminal.wait_for("0.75 : number");
    terminal.enter(":plot torus, view = \"top\"");
    let rows = picture(&terminal);
    let middle = &rows[rows.len() / 2];
    let left = middle
        .iter()
        .position(|cell| *cell != [None, None])
        .unwrap();
    let right = middle
        .iter()
        .rposition(|cell| *cell != [None, None])
        .unwrap();
    // From above it is a ring from radius 0.5 to 1.5: the hole is the middle third.
    let width = (right - left + 1) as f64;
    for share in [0.4, 0.5, 0.6] {
        let cell = middle[left + (share * width) as usize];
        assert_eq!(cell, [None, None], "the hole at {share}");
    }
    for share in [0.1, 0.2, 0.8, 0.9] {
        let cell = middle[left + (share * width) as usize];
        assert!(
            cell[0].is_some() && cell[1].is_some(),
            "the ring at {share}"
        );
    }
    // Twice as many columns as rows, since a cell is two pixels high.
    let ratio = width / rows.len() as f64;
    assert!((1.8..2.2).contains(&ratio), "{ratio}");
    // The slopes are lit from one side.
    let lights = rows
        .iter()
        .flatten()
        .flatten()
        .flatten()
        .map(|color| light(*color));
    let lights: Vec<u32> = lights.collect();
    let [darkest, lightest] = [lights.iter().min().unwrap(), lights.iter().max().unwrap()];
    assert!(lightest > &(darkest + 150), "from {darkest} to {lightest}");
    terminal.send(":quit\r");
    assert_eq!(terminal.exit_code(), 0);
}

#[test]
fn a_field_that_is_the_last_value_is_shown_unless_that_is_turned_off() {
    let mut terminal = Terminal::new();
    terminal.enter("field ball(p in R3) over -1..1 = norm(p) - 0.9");
    assert!(!terminal.contents().contains(['▀', '▄']));
    terminal.enter(":set pictures off");
    terminal.enter("ball");
    assert!(!terminal.contents().contains(['▀', '▄']));
    terminal.enter(":set pictures on");
    terminal.enter("ball + 0.1");
    let rows = picture(&terminal);
    assert!((10..=16).contains(&rows.len()), "{}", rows.len());
    let middle = rows[rows.len() / 2].clone();
    let drawn = middle.iter().filter(|cell| **cell != [None, None]).count();
    assert!((20..=32).contains(&drawn), "{drawn}");
}

#[test]
fn maps_and_graphs_are_shown() {
    let mut terminal = Terminal::new();
    terminal.enter("field disc(p in R2) over -1..1 = norm(p) - 0.5");
    terminal.enter(":plot disc, style = \"fill\"");
    let rows = picture(&terminal);
    let [corner, middle] = [rows[1][1], rows[rows.len() / 2][rows.len()]];
    assert_ne!(corner[0], middle[0]);
    terminal.send("\x0c");
    terminal.wait_for_prompt();
    terminal.enter("field wave(x) over 0..7 = sin(x)");
    terminal.enter("wave");
    assert!(picture(&terminal).len() > 8);
}

/// The session in the guide gives what is written there.
#[test]
fn the_session_of_the_guide_is_true() {
    let text = include_str!("../../docs/repl.md");
    let session = text.split("```").nth(1).unwrap();
    let mut terminal = Terminal::new();
    let mut inputs = 0;
    for line in session.lines().skip(1) {
        if let Some(input) = line.strip_prefix("imp> ") {
            terminal.enter(input);
            inputs += 1;
        } else if !line.contains('│') && !line.contains('─') {
            terminal.wait_for(line);
        }
    }
    assert!(inputs >= 8, "{inputs}");
    // The picture of the guide is the one that a pipe gets.
    let folder = tempfile::tempdir().unwrap();
    let inputs: String = session
        .lines()
        .filter_map(|line| line.strip_prefix("imp> "))
        .filter(|line| !line.starts_with("torsu"))
        .map(|line| format!("{line}\n"))
        .collect();
    let run = crate::common::imp_with(folder.path(), &["repl"], inputs.as_bytes()).well();
    let picture = text.split("```").nth(3).unwrap().lines().skip(1);
    for line in picture {
        assert!(
            run.stdout.contains(line),
            "{line:?} is not in\n{}",
            run.stdout
        );
    }
}
