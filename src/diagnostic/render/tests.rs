use super::super::Code;
use super::*;

fn rendered(text: &str, build: impl FnOnce(SourceId) -> Diagnostic) -> String {
    let mut sources = Sources::default();
    let id = sources.add("scene.imp", text);
    let drawn = render(&[build(id)], &sources, false);
    // Trailing spaces carry nothing and do not survive editors.
    let lines: Vec<&str> = drawn.lines().map(str::trim_end).collect();
    lines.join("\n")
}

#[test]
fn a_report_has_code_place_text_label_and_help() {
    let report = rendered("let a = 1\nlet b = nrom(a)\n", |id| {
        Diagnostic::error(Code::UnknownName, "no name `nrom`")
            .label(Span::new(id, 18, 22), "not known here")
            .help("did you mean `norm`?")
    });
    insta::assert_snapshot!(report);
}

#[test]
fn two_places_are_shown_in_the_order_of_the_text() {
    let report = rendered("let a = 1\nlet b = 2\nlet a = 3\n", |id| {
        Diagnostic::error(Code::BoundTwice, "`a` is bound twice")
            .label(Span::new(id, 24, 25), "bound again here")
            .label(Span::new(id, 4, 5), "first bound here")
    });
    insta::assert_snapshot!(report);
}

#[test]
fn the_end_of_the_file_can_be_pointed_at() {
    for text in ["let a = ", "let a =\n", ""] {
        let report = rendered(text, |id| {
            Diagnostic::error(Code::UnexpectedToken, "expected an expression")
                .label(Span::new(id, text.len(), text.len()), "here")
        });
        assert!(report.contains("scene.imp:"), "{report}");
        assert!(report.contains("here"), "{report}");
    }
}

#[test]
fn a_long_line_is_shown_in_part_with_its_true_column() {
    let text = "x".repeat(3_000_000) + "?" + &"y".repeat(3_000_000);
    let report = rendered(&text, |id| {
        Diagnostic::error(Code::UnknownCharacter, "`?` is not part of the language")
            .label(Span::new(id, 3_000_000, 3_000_001), "not understood")
    });
    assert!(report.contains("scene.imp:1:3000001"), "{report}");
    assert!(report.len() < 2_000);
    insta::assert_snapshot!(report);
}

#[test]
fn long_names_and_control_characters_are_not_printed() {
    let name = "n".repeat(500);
    let report = rendered("\u{1b}[2J a", |id| {
        Diagnostic::error(Code::UnknownName, format!("no name `{name}`\u{7}"))
            .label(Span::new(id, 5, 6), "\u{1b}here")
    });
    assert!(!report.contains(&"n".repeat(61)), "{report}");
    assert!(!report.contains(['\u{1b}', '\u{7}']), "{report}");
}

#[test]
fn what_has_no_place_has_one_line() {
    let sources = Sources::default();
    let diagnostic =
        Diagnostic::error(Code::CannotRead, "cannot read `a.imp`").help("is it there?");
    let report = render(std::slice::from_ref(&diagnostic), &sources, false);
    assert_eq!(
        report,
        "[E0701] Error: cannot read `a.imp`\n  Help: is it there?\n"
    );
    assert!(render(&[diagnostic], &sources, true).contains("\u{1b}[31m"));
}

#[test]
fn labels_may_be_in_several_sources_and_over_several_lines() {
    let mut sources = Sources::default();
    let scene = sources.add("scene.imp", "fn f(x) {\n    let a = x\n    a\n}\nf(1, 2)\n");
    let argument = sources.add("<command line>", "r = f(ü, 2)");
    let diagnostic = Diagnostic::error(Code::TooManyArguments, "`f` takes one argument")
        .label(Span::new(argument, 10, 11), "one too many")
        .label(Span::new(scene, 0, 31), "defined here");
    let report = render(&[diagnostic], &sources, false);
    let lines: Vec<&str> = report.lines().map(str::trim_end).collect();
    insta::assert_snapshot!(lines.join("\n"));
}

#[test]
fn spans_that_fit_nothing_do_not_panic() {
    for text in ["", "ä", "ab\r\ncd", "a\u{2028}b\u{85}c\n\n"] {
        for start in 0..12 {
            for end in 0..12 {
                let report = rendered(text, |id| {
                    Diagnostic::warning(Code::NanRegion, "somewhere").label(
                        Span {
                            source: id,
                            start,
                            end,
                        },
                        "here",
                    )
                });
                assert!(report.contains("scene.imp"), "{report}");
            }
        }
    }
}
