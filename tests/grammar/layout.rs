//! From the tokens of a sentence to a text: what stands between tokens.
//!
//! Blanks are put where they are needed or at random, and line ends and comments wherever the
//! grammar's rules for line ends say that they mean nothing.

use crate::generator::Piece;
use crate::random::Random;

/// After these a line may end: "after an operator, …".
const WANTS_MORE: &str = "+ - * / % @ ^ | & \\ ! == != < <= > >= = , -> |> .. . \
                          and or not with by in over then else";

/// Before these a line may end: "before a line that begins with …".
const CONTINUES: &str = "+ * / % @ ^ | & \\ == != < <= > >= = -> |> .. . \
                         and or then else with over by in";

/// Two characters that would be read as one token, or as a mistake.
const PAIRS: [&str; 12] = [
    "**", "&&", "||", "|>", "->", "==", "!=", "<=", ">=", "..", "{{", "}}",
];

/// What a comment may say: nothing of it is read.
const COMMENTS: [&str; 5] = [
    "#",
    "# note",
    "## `let x = {`",
    "# \"open",
    "#!/usr/bin/env imp",
];

/// The text of a sentence.
pub(crate) fn lay_out(pieces: &[Piece], random: &mut Random) -> String {
    let mut text = String::new();
    let mut brackets: Vec<char> = Vec::new();
    let mut strings = 0;
    let mut before = String::new();
    let mut goes_on = false;
    for piece in pieces {
        match piece {
            Piece::Enters => strings += 1,
            Piece::Leaves => {
                strings -= 1;
                goes_on = true;
                before.clear();
            }
            Piece::Glued(more) => {
                text += more;
                before += more;
            }
            Piece::Token(token) => {
                let place = if strings > 0 || goes_on {
                    Place::String
                } else if matches!(brackets.last(), Some('(' | '['))
                    || is_among(WANTS_MORE, &before)
                    || is_among(CONTINUES, token)
                {
                    Place::Free
                } else {
                    Place::Line
                };
                text += &between(&before, token, place, random);
                text += token;
                // The `}` behind an interpolation is part of the string.
                if !std::mem::take(&mut goes_on) {
                    match token.as_str() {
                        "(" | "[" | "{" => brackets.extend(token.chars()),
                        ")" | "]" | "}" => drop(brackets.pop()),
                        _ => {}
                    }
                }
                before.clone_from(token);
            }
        }
    }
    if random.chance(10) {
        text += COMMENTS[random.below(COMMENTS.len())];
    }
    text
}

/// What may stand at a place between tokens.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    /// Blanks: a string ends on its line.
    String,
    /// Blanks, and a comment before a line end that is there.
    Line,
    /// Line ends, too: they mean nothing here.
    Free,
}

fn is_among(list: &str, token: &str) -> bool {
    list.split(' ').any(|one| one == token)
}

fn between(before: &str, next: &str, place: Place, random: &mut Random) -> String {
    let mut text = String::new();
    if must_part(before, next) || random.chance(50) {
        text.push(blank(random));
    }
    if place == Place::Free && random.chance(12) {
        for _ in 0..=random.below(2) {
            if random.chance(40) {
                text += COMMENTS[random.below(COMMENTS.len())];
            }
            text.push('\n');
        }
        text += &" ".repeat(random.below(5));
    }
    let at_line_end = next.starts_with('\n') || before.starts_with('\n');
    if place != Place::String && at_line_end && random.chance(20) {
        text += COMMENTS[random.below(COMMENTS.len())];
        text.push('\n');
    }
    text
}

fn blank(random: &mut Random) -> char {
    const RARE: [char; 4] = ['\t', '\r', '\u{a0}', '\u{feff}'];
    match random.below(20) {
        0 => RARE[random.below(RARE.len())],
        _ => ' ',
    }
}

/// Whether two tokens would be read as other ones if nothing stood between them.
fn must_part(before: &str, next: &str) -> bool {
    let (Some(last), Some(first)) = (before.chars().last(), next.chars().next()) else {
        return false;
    };
    let is_wordish = |character: char| character == '_' || character.is_alphanumeric();
    is_wordish(last) && is_wordish(first) || PAIRS.contains(&format!("{last}{first}").as_str())
}
