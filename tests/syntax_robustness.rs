//! Whatever the text, parsing ends with a tree or with mistakes that can be shown.

use imp::diagnostic::{SourceId, Sources, render::render};
use imp::syntax::{parse, parse_expression};
use proptest::prelude::*;

/// Parses and renders; every place must lie in the text, and there is a mistake wherever the tree
/// has an error.
fn survives(text: &str) {
    let mut sources = Sources::default();
    let source = sources.add("soup.imp", text);
    let parsed = parse(source, text);
    let drawn = render(&parsed.diagnostics, &sources, false);
    assert_eq!(drawn.is_empty(), parsed.diagnostics.is_empty());
    for diagnostic in &parsed.diagnostics {
        for label in &diagnostic.labels {
            let (start, end) = (label.span.start as usize, label.span.end as usize);
            assert!(start <= end && end <= text.len(), "{diagnostic:?}");
            assert!(text.is_char_boundary(start) && text.is_char_boundary(end));
        }
    }
    for statement in &parsed.tree.statements {
        assert!(statement.span.start <= statement.span.end);
    }
    let written = format!("{:?}", parsed.tree);
    assert!(
        !written.contains("Error") || !parsed.diagnostics.is_empty(),
        "{text}"
    );
    let _ = parse_expression(SourceId(0), text);
}

/// Words that make up programs, so that soups of them get far into the grammar.
const WORDS: &[&str] = &[
    "let ",
    "var ",
    "param ",
    "fn ",
    "field ",
    " over ",
    "for ",
    " in ",
    "while ",
    "if ",
    " then ",
    " else ",
    " and ",
    " or ",
    "not ",
    " with ",
    " by ",
    "true",
    "false",
    "setting ",
    "import ",
    "test ",
    "as ",
    "+",
    "-",
    "*",
    "/",
    "%",
    "@",
    "^",
    "|",
    "&",
    "\\",
    "!",
    "==",
    "!=",
    "<",
    "<=",
    ">",
    ">=",
    "=",
    "->",
    "|>",
    "..",
    ".",
    ",",
    ";",
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    "\n",
    "\"",
    "x",
    "f(",
    "p in R3",
    "1",
    "2.5",
    "45deg",
    " y ",
    "\"{",
    "}\"",
    ":.3",
    "\"a\"",
    "# c\n",
    "## d\n",
    "**",
    "&&",
    ".5",
    "1.",
    "{{",
    "$",
    "ü",
    " ",
    "for x in xs",
    "(x, y) -> ",
    "x = ",
    "R3",
];

fn soup(longest: usize) -> impl Strategy<Value = String> {
    prop::collection::vec(prop::sample::select(WORDS), 0..longest).prop_map(|words| words.concat())
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 600,
        failure_persistence: None,
        rng_algorithm: prop::test_runner::RngAlgorithm::ChaCha,
        rng_seed: prop::test_runner::RngSeed::Fixed(1994),
        ..ProptestConfig::default()
    })]

    #[test]
    fn token_soup_never_panics(text in soup(60)) {
        survives(&text);
    }

    #[test]
    fn random_characters_never_panic(text in "\\PC{0,80}") {
        survives(&text);
    }

    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..120)) {
        survives(&String::from_utf8_lossy(&bytes));
    }

    #[test]
    fn a_broken_program_never_panics(cut in 0..PROGRAM.len(), word in prop::sample::select(WORDS)) {
        let cut = (0..=cut).rev().find(|&at| PROGRAM.is_char_boundary(at)).unwrap_or(0);
        survives(&format!("{}{word}{}", &PROGRAM[..cut], &PROGRAM[cut..]));
        survives(&PROGRAM[..cut]);
        survives(&PROGRAM[cut..]);
    }
}

/// A program with something of everything.
const PROGRAM: &str = r#"## A gear on a torus.
param r = 1 in 0.1..3; param c = [[0, 1], [-1, 0]]
fn gear(n, depth = 0.1) {
    let teeth = p -> cos(n * atan2(p.y, p.x))
    p -> norm(p.xy) - 1 - depth * teeth(p)   # ω = n
}
field heart(x, y, z) over -1.5..1.5, -1..1, 0..2 = (x^2 + 9/4*y^2 - 1)^3 <= x^2*z^3 and not z < 0
field ball(p in R3) = r - sum(exp(-norm2(p - ci)) for ci in c if ci[0] >= 0)
for [i, v] in zip(range(2), [x^2 for x in 0..1 by 0.5]) {
    let m = ball with {r = v, c = [[0, 0], [1, 1]]}
        |> polygonize(cell = 0.05)
    print("at {v:.2}: {if m.watertight then "closed" else "open"} {{{m.area}}}")
    if m.genus == 0 { n = n + 1 } else if m.genus > 2 { n = 0 } else { }
}
while n < 3 { n = { let k = n; k + 1 } }
let π2 = (a, [b, k = 2]) -> a | b & !c \ d
"#;
