//! Programs with another layout and more comments, and the same meaning.

use imp::diagnostic::SourceId;
use imp::syntax::words;

use crate::programs::Random;

/// Words behind which a line may end.
const BEHIND: &[&str] = &[
    "+", "-", "*", "/", "%", "@", "^", "|", "&", "\\", "==", "!=", "<", "<=", ">", ">=", "=", "->",
    "|>", "..", ",", "and", "or", "not", "then", "else", "with", "over", "by", "in", "!",
];

/// Words before which a line may end.
const BEFORE: &[&str] = &[
    "+", "*", "/", "%", "@", "^", "|", "&", "\\", "==", "!=", "<", "<=", ">", ">=", "=", "->",
    "|>", "..", ".", "and", "or", "then", "else", "with", "over", "by", "in",
];

/// A text with random space, line ends and comments between its words, and separators between its
/// statements.
pub(crate) fn shaken(random: &mut Random, text: &str) -> String {
    let spans = words::spans(SourceId(0), text);
    let mut brackets = Vec::new();
    // From hardly any line ends to everywhere.
    let lines = [2, 10, 30][random.below(3)];
    let mut result = gap(random, true, false);
    for (index, span) in spans.iter().enumerate() {
        let word = &text[span.start as usize..span.end as usize];
        match word {
            "(" | "[" => brackets.push(true),
            "{" => brackets.push(false),
            ")" | "]" | "}" => drop(brackets.pop()),
            _ => {}
        }
        result += word;
        let Some(next) = spans.get(index + 1) else {
            break;
        };
        let old = &text[span.end as usize..next.start as usize];
        let next = &text[next.start as usize..next.end as usize];
        let was_line = old.contains('\n');
        let in_brackets = brackets.last() == Some(&true);
        // The words that only separate may have lines around them.
        let separates = matches!(word, ";" | "{") || matches!(next, ";" | "}");
        let free = in_brackets
            || (BEHIND.contains(&word) && !starts_definition(next))
            || BEFORE.contains(&next)
            || (separates && old.trim().is_empty());
        if (was_line && !free) || (free && random.chance(lines)) {
            result += &gap(random, true, was_line && !free);
        } else if !old.is_empty() || random.chance(30) {
            result += &gap(random, false, false);
        }
    }
    result + &gap(random, true, false)
}

fn starts_definition(word: &str) -> bool {
    [
        "let", "var", "param", "fn", "field", "while", "setting", "import", "test",
    ]
    .contains(&word)
}

/// Space between words, with the ends of lines or without.
fn gap(random: &mut Random, has_line: bool, ends_statement: bool) -> String {
    let mut gap = String::new();
    for _ in 0..random.below(3) {
        gap += random.of(&[" ", "\t", "  "]);
    }
    if !has_line {
        return gap + " ";
    }
    for _ in 0..1 + random.below(3) {
        if random.chance(25) {
            gap += random.of(&["# one", "## two", "#", "# π = 3", "#!x", "## "]);
        }
        gap += random.of(&["\n", "\n", "\r\n", "\n    "]);
    }
    if ends_statement && random.chance(10) {
        gap += ";";
    }
    gap
}
