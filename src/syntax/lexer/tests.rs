use super::*;

fn lexed(text: &str) -> Lexed {
    lex(SourceId(0), text)
}

fn kinds(text: &str) -> Vec<Token> {
    lexed(text).tokens.iter().map(|&(token, _)| token).collect()
}

/// The tokens as they are written, with `·` between them.
fn pieces(text: &str) -> String {
    let pieces: Vec<&str> = lexed(text)
        .tokens
        .iter()
        .map(|(_, span)| &text[span.start as usize..span.end as usize])
        .collect();
    pieces.join("·")
}

fn codes(text: &str) -> Vec<Code> {
    let diagnostics = lexed(text).diagnostics;
    diagnostics
        .iter()
        .map(|diagnostic| diagnostic.code)
        .collect()
}

#[test]
fn every_fixed_token_is_lexed_from_its_text() {
    for &token in Token::ALL.iter().filter(|token| token.is_fixed()) {
        assert_eq!(kinds(token.text()), [token]);
    }
}

#[test]
fn names_are_ascii_or_greek_and_longer_than_words() {
    for name in ["x", "_a1", "letter", "inner", "π", "φ_2", "Δx", "R3", "ifs"] {
        assert_eq!(kinds(name), [Token::Name], "{name}");
        assert!(codes(name).is_empty(), "{name}");
    }
    assert_eq!(codes("größe"), [Code::UnknownCharacter]);
    assert_eq!(kinds("größe"), [Token::Name]);
}

#[test]
fn a_number_has_digits_on_both_sides_of_its_point() {
    assert_eq!(
        pieces("1 0.5 1e-3 1_000 45deg 0.25turn"),
        "1·0.5·1e-3·1_000·45deg·0.25turn"
    );
    assert_eq!(pieces("0..1"), "0·..·1");
    assert_eq!(pieces("0.5..1.5"), "0.5·..·1.5");
    assert_eq!(pieces("a..5"), "a·..·5");
    assert_eq!(pieces("v.x"), "v·.·x");
    assert_eq!(pieces("1-2"), "1·-·2");
    assert_eq!(codes("let a = .5"), [Code::BadNumber]);
}

#[test]
fn the_longest_operator_is_taken() {
    assert_eq!(pieces("a<=b|>c->d"), "a·<=·b·|>·c·->·d");
    assert_eq!(pieces("a|b\\c"), "a·|·b·\\·c");
}

#[test]
fn a_string_is_lexed_into_its_parts_with_their_places() {
    use Token::*;
    assert_eq!(
        kinds(r#""a{{b\n{x:.3}""#),
        [
            StringStart,
            TextRun,
            TextEscape,
            TextRun,
            TextEscape,
            InterpolationStart,
            Name,
            Format,
            InterpolationEnd,
            StringEnd
        ]
    );
    assert_eq!(pieces(r#""a{{b\n{x:.3}""#), "\"·a·{{·b·\\n·{·x·:.3·}·\"");
}

#[test]
fn strings_nest_in_interpolations() {
    assert_eq!(
        pieces(r#""a{f("b{c}", {d})}e""#),
        "\"·a·{·f·(·\"·b·{·c·}·\"·,·{·d·}·)·}·e·\""
    );
    assert!(codes(r#""a{f("b{c}", {d})}e""#).is_empty());
}

#[test]
fn a_string_ends_with_its_line_whatever_is_open_in_it() {
    for text in ["\"abc\nx", "\"a{b\nx", "\"a{f(\"c\nx", "\"a{\"b{\"c\nx"] {
        assert_eq!(codes(text), [Code::UnclosedText], "{text}");
        assert_eq!(
            kinds(text),
            [
                Token::StringStart,
                Token::StringEnd,
                Token::Newline,
                Token::Name
            ],
            "{text}"
        );
    }
    assert_eq!(codes("\""), [Code::UnclosedText]);
}

#[test]
fn wrong_escapes_formats_and_braces_are_reported() {
    assert_eq!(codes(r#""\q""#), [Code::BadFormat]);
    assert_eq!(codes(r#""\u{110000}""#), [Code::BadFormat]);
    assert_eq!(codes(r#""\u{3c0}""#), []);
    assert_eq!(codes(r#""{x:3}""#), [Code::BadFormat]);
    assert_eq!(codes(r#""{x:.3f}""#), [Code::BadFormat]);
    assert_eq!(codes(r#""a}b""#), [Code::BadFormat]);
    assert_eq!(codes("\"a}}b\""), []);
}

#[test]
fn what_other_languages_write_is_understood_and_corrected() {
    assert_eq!(kinds("a**b"), [Token::Name, Token::Caret, Token::Name]);
    assert_eq!(codes("a**b"), [Code::DoubleStar]);
    assert_eq!(
        kinds("a && b || c"),
        [Token::Name, Token::And, Token::Name, Token::Or, Token::Name]
    );
    assert_eq!(codes("a && b || c").len(), 2);
}

#[test]
fn a_run_of_unknown_characters_is_one_error() {
    assert_eq!(codes("a $$$ b"), [Code::UnknownCharacter]);
    assert_eq!(codes("a $ b ?"), [Code::UnknownCharacter; 2]);
    assert_eq!(kinds("a $$$ b"), [Token::Name, Token::Name]);
    assert_eq!(codes("x:"), [Code::UnknownCharacter]);
}

#[test]
fn comments_are_kept_as_places_and_doc_comments_are_attached() {
    let text = "#!/usr/bin/env imp\n## Far.\n\n## Near,\n##  two lines.\nparam a = 1 # one\n# no\nlet b = 2";
    let lexed = lexed(text);
    let comments: Vec<&str> = lexed
        .comments
        .iter()
        .map(|span| &text[span.start as usize..span.end as usize])
        .collect();
    assert_eq!(
        comments,
        [
            "#!/usr/bin/env imp",
            "## Far.",
            "## Near,",
            "##  two lines.",
            "# one",
            "# no"
        ]
    );
    let start = text.find("param").map(|at| at as u32);
    let [(place, documentation)] = &lexed.documentation[..] else {
        panic!("one doc comment: {:?}", lexed.documentation);
    };
    assert_eq!(Some(*place), start);
    assert_eq!(&**documentation, "Near,\n two lines.");
}

#[test]
fn line_ends_of_every_system_are_line_ends() {
    assert_eq!(kinds("a\r\nb\n\n\r\nc"), kinds("a\nb\nc"));
}
