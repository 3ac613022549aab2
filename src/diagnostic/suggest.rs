//! “Did you mean …?”: the name nearest to one that is not known.

/// Names longer than this are compared with nothing: they are no slip of the hand.
const LONGEST: usize = 60;

/// The candidate with the fewest slips (a character too many, missing, wrong, or two neighbours
/// swapped) between it and `name`; none if even the nearest has more than a third of the name's
/// characters wrong, where one slip is always forgiven.
///
/// Of equally near candidates the one that begins like the name wins, then the first in
/// alphabetical order, so the answer does not depend on the order of the candidates. Case does not
/// count as a slip when nothing else is wrong.
pub fn nearest<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let characters: Vec<char> = name.chars().take(LONGEST + 1).collect();
    if characters.is_empty() || characters.len() > LONGEST {
        return None;
    }
    let allowed = (characters.len() / 3).max(1);
    candidates
        .filter(|candidate| *candidate != name)
        .filter_map(|candidate| {
            let other: Vec<char> = candidate.chars().take(LONGEST + 1).collect();
            if other.len() > LONGEST || other.len().abs_diff(characters.len()) > allowed {
                return None;
            }
            let slips = if candidate.eq_ignore_ascii_case(name) {
                0
            } else {
                distance(&characters, &other)
            };
            let strange_start = other.first() != characters.first();
            // Replacing everything is not a slip: `x` is not meant by `y`.
            let kept = slips < characters.len().max(other.len());
            (slips <= allowed && kept).then_some((slips, strange_start, candidate))
        })
        .min()
        .map(|(_, _, candidate)| candidate)
}

/// The Damerau–Levenshtein distance in its restricted form (optimal string alignment: no part is
/// changed twice); F. J. Damerau, "A technique for computer detection and correction of spelling
/// errors", CACM 7(3), 1964. Takes time proportional to the product of the lengths.
fn distance(left: &[char], right: &[char]) -> usize {
    let mut before_last: Vec<usize> = vec![0; right.len() + 1];
    let mut last: Vec<usize> = (0..=right.len()).collect();
    for i in 1..=left.len() {
        let mut row = vec![i; right.len() + 1];
        for j in 1..=right.len() {
            let same = left[i - 1] == right[j - 1];
            row[j] = (last[j] + 1)
                .min(row[j - 1] + 1)
                .min(last[j - 1] + usize::from(!same));
            if i > 1 && j > 1 && left[i - 1] == right[j - 2] && left[i - 2] == right[j - 1] {
                row[j] = row[j].min(before_last[j - 2] + 1);
            }
        }
        before_last = std::mem::replace(&mut last, row);
    }
    last[right.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slips(left: &str, right: &str) -> usize {
        let left: Vec<char> = left.chars().collect();
        let right: Vec<char> = right.chars().collect();
        distance(&left, &right)
    }

    #[test]
    fn slips_are_counted() {
        assert_eq!(slips("", "abc"), 3);
        assert_eq!(slips("norm", "norm"), 0);
        assert_eq!(slips("nrom", "norm"), 1);
        assert_eq!(slips("nom", "norm"), 1);
        assert_eq!(slips("kitten", "sitting"), 3);
        assert_eq!(slips("ca", "abc"), 3);
    }

    #[test]
    fn the_nearest_name_is_found() {
        let names = [
            "polygonize",
            "sample",
            "norm",
            "norm2",
            "sqrt",
            "sin",
            "cos",
        ];
        let nearest = |name| nearest(name, names.iter().copied());
        assert_eq!(nearest("polygonise"), Some("polygonize"));
        assert_eq!(nearest("smaple"), Some("sample"));
        assert_eq!(nearest("Norm"), Some("norm"));
        assert_eq!(nearest("sqr"), Some("sqrt"));
        assert_eq!(nearest("sen"), Some("sin"));
        assert_eq!(nearest("tangent"), None);
    }

    #[test]
    fn ties_are_broken_by_the_first_letter_and_the_alphabet() {
        assert_eq!(
            nearest("bat", ["cat", "bar", "bad"].into_iter()),
            Some("bad")
        );
        assert_eq!(
            nearest("bat", ["bad", "bar", "cat"].into_iter()),
            Some("bad")
        );
        assert_eq!(nearest("bat", ["cat", "hat"].into_iter()), Some("cat"));
    }

    #[test]
    fn short_and_long_names_are_not_guessed() {
        assert_eq!(nearest("x", ["y", "z"].into_iter()), None);
        assert_eq!(nearest("", ["y"].into_iter()), None);
        let long = "a".repeat(10_000);
        let longer = "a".repeat(10_001);
        assert_eq!(nearest(&long, [longer.as_str()].into_iter()), None);
    }
}
