//! The errors of the syntax stage as people see them, one snapshot for each mistake.

use imp::diagnostic::{Code, Sources, render::render};
use imp::syntax::parse;

/// The reports on a text, without colours and trailing spaces, below the text itself.
fn report(text: &str) -> String {
    let mut sources = Sources::default();
    let source = sources.add("scene.imp", text);
    let drawn = render(&parse(source, text).diagnostics, &sources, false);
    let lines: Vec<&str> = drawn.lines().map(str::trim_end).collect();
    format!("\n{}\n", lines.join("\n"))
}

macro_rules! reports {
    ($($name:ident $code:ident $text:literal,)*) => {
        $(
            #[test]
            fn $name() {
                let report = report($text);
                assert!(report.contains(Code::$code.as_str()), "{report}");
                insta::assert_snapshot!(report);
            }
        )*

        /// The codes that have a snapshot here.
        const SHOWN: &[Code] = &[$(Code::$code,)*];
    };
}

reports! {
    operand_missing UnexpectedToken "let a = 2 * (3 + )\n",
    operand_missing_at_the_end_of_a_line UnexpectedToken "let a = 2 +\nlet b = 1\n",
    equals_missing UnexpectedToken "let x 3\n",
    equals_missing_in_a_function UnexpectedToken "fn f(x) x^2\n",
    equals_missing_in_a_field UnexpectedToken "field ball(x, y, z) x^2 + y^2 + z^2 - 1\n",
    equals_for_a_comparison UnexpectedToken "if a + 1 = b { print(a) }\n",
    other_languages_and UnexpectedToken "let a = b && c\n",
    a_word_for_a_name UnexpectedToken "let over = 3\n",
    import_without_a_name UnexpectedToken "import \"parts.imp\"\nlet a = 1\n",
    a_call_as_a_target UnexpectedToken "f(x) = x^2\n",
    else_missing UnexpectedToken "let a = if b then c\n",
    two_statements_on_a_line UnexpectedToken "let a = 1 let b = 2\n",
    bracket_never_closed UnclosedBracket "let a = f(1, [2, 3)\n",
    bracket_never_closed_before_a_definition UnclosedBracket "print(max(1, 2)\nlet a = 3\n",
    brace_never_closed UnclosedBracket "fn f(x) {\n    let y = x\n    y\n",
    bracket_of_another_kind UnclosedBracket "let a = (1, 2]\n",
    bracket_that_closes_nothing UnclosedBracket "let a = 1 + 2)\n",
    string_without_its_quote UnclosedText "print(\"area {m.area})\nlet a = 1\n",
    string_without_its_brace UnclosedText "print(\"area {m.area\")\n",
    unknown_character UnknownCharacter "let a = b × c\n",
    unknown_letter UnknownCharacter "let größe = 3\n",
    product_of_number_and_name ImplicitMultiplication "let a = 3 + 2x\n",
    product_of_number_and_parenthesis ImplicitMultiplication "let a = 2(x + 1)\n",
    product_of_parenthesis_and_name ImplicitMultiplication "let a = (x + 1)y\n",
    double_star DoubleStar "let a = x**2\n",
    point_without_a_digit BadNumber "let a = .5\n",
    point_without_a_digit_behind UnexpectedToken "let a = 1. + 2\n",
    number_too_large BadNumber "let a = 1e999\n",
    unknown_unit BadNumber "let a = 45degrees\n",
    brackets_too_deep TooDeep "let a = (((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((((1\n",
    unknown_escape BadFormat "print(\"C:\\data\")\n",
    unknown_format BadFormat "print(\"{area:3}\")\n",
    brace_in_a_string BadFormat "print(\"a}\")\n",
    empty_interpolation UnexpectedToken "print(\"{}\")\n",
}

#[test]
fn every_code_of_the_syntax_stage_has_a_snapshot() {
    let missing: Vec<&str> = Code::ALL
        .iter()
        .filter(|code| code.as_str().starts_with("E01") && !SHOWN.contains(code))
        .map(|code| code.as_str())
        .collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn several_mistakes_are_reported_in_one_run() {
    insta::assert_snapshot!(report(
        "param r = 1 in 0.1..3\n\
         field ball(p in R3) = norm(p - r\n\
         let a = 2r\n\
         let skin = polygonize(ball, cell = )\n\
         fn area(m) m.area\n\
         print(\"{skin.area}\")\n"
    ));
}

#[test]
fn a_line_of_ten_megabytes_is_reported_briefly() {
    let report = report(&("x + ".repeat(1_000_000) + "\n"));
    assert!(report.len() < 3_000);
    insta::assert_snapshot!(report);
}
