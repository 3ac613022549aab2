//! The parts of a text that can be folded away: brackets over several lines, and comments.

use std::ops::Range;

use crate::syntax::words::words;

/// A part of a text that can be folded away.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fold {
    /// From its first byte to the last line's.
    pub range: Range<usize>,
    /// Whether it is a comment of several lines.
    pub is_comment: bool,
}

/// The parts that can be folded away, by their beginnings. Takes time proportional to n log n.
pub fn folds(text: &str) -> Vec<Fold> {
    let mut folds = Vec::new();
    let mut open: Vec<usize> = Vec::new();
    let mut comment: Option<Range<usize>> = None;
    for word in words(text) {
        if word.kind.is_comment() {
            // Only one line end, and no word, lies between the lines of one comment.
            comment = match comment.take() {
                Some(before) if is_next_line(&text[before.end..word.range.start]) => {
                    Some(before.start..word.range.end)
                }
                before => {
                    push(text, &mut folds, before, true);
                    Some(word.range)
                }
            };
            continue;
        }
        if word.kind.opens() {
            open.push(word.range.start);
        } else if word.kind.closes()
            && let Some(start) = open.pop()
        {
            push(text, &mut folds, Some(start..word.range.end), false);
        }
    }
    push(text, &mut folds, comment, true);
    folds.sort_by_key(|fold| (fold.range.start, fold.range.end));
    folds
}

fn is_next_line(between: &str) -> bool {
    between.trim().is_empty() && between.bytes().filter(|&byte| byte == b'\n').count() == 1
}

fn push(text: &str, folds: &mut Vec<Fold>, range: Option<Range<usize>>, is_comment: bool) {
    if let Some(range) = range.filter(|range| text[range.clone()].contains('\n')) {
        folds.push(Fold { range, is_comment });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brackets_and_comments_fold() {
        let text = "# one\n# two\n\n# other\nfn f(a) {\n    [a,\n     a]\n}\nlet b = (1)\n";
        let shown: Vec<(&str, bool)> = folds(text)
            .into_iter()
            .map(|fold| (&text[fold.range], fold.is_comment))
            .collect();
        let body = "{\n    [a,\n     a]\n}";
        assert_eq!(
            shown,
            [
                ("# one\n# two", true),
                (body, false),
                ("[a,\n     a]", false)
            ]
        );
        assert!(folds("fn f(a) {\n").len() <= 1);
    }
}
