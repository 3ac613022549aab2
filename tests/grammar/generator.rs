//! Sentences of a grammar, at random.
//!
//! The rules of the grammar say what may stand where. What they cannot say stands in the tables
//! here, each with the comment of the grammar that says it.

use std::collections::HashMap;

use crate::layout::lay_out;
use crate::notation::{Grammar, Node};
use crate::random::Random;

/// Whether the text of a token is one.
type Condition = fn(&Grammar, &str) -> bool;

/// A token is derived again until this holds of its text.
const CONDITIONS: &[(&str, Condition)] = &[
    // "and none of the words"
    ("name", |grammar, text| !grammar.words().contains(&text)),
    // "and not beyond the floats"
    ("number", |_, text| {
        let digits = text.trim_end_matches("deg").trim_end_matches("turn");
        let value: f64 = digits.replace('_', "").parse().expect("a number");
        value.is_finite()
    }),
    // "a Unicode scalar value"
    ("escape", |_, text| match text.strip_prefix("\\u{") {
        Some(digits) => u32::from_str_radix(digits.trim_end_matches('}'), 16)
            .is_ok_and(|code| char::from_u32(code).is_some()),
        None => true,
    }),
];

/// Inside the first rule the second one is not taken: "there is no line end in it".
const NOT_INSIDE: (&str, &str) = ("string", "newline");

/// What belongs to a function or a `not` before it.
const OPERATORS: &str = "|> with or and == != < <= > >= .. by | & \\ + - * / % @ ^";

/// How a part ends, as far as it matters for what may follow.
#[derive(Clone, Copy, Debug, Default)]
struct Ending {
    /// "So what stands before `..` does not end in one of them."
    reaches: bool,
    /// "An `else` belongs to the nearest `if`."
    lacks_else: bool,
}

impl Ending {
    fn allows(self, next: &str) -> bool {
        !(self.reaches && next == ".." || self.lacks_else && next == "else")
    }
}

/// A piece of a sentence.
#[derive(Clone, Debug)]
pub(crate) enum Piece {
    /// A token, or the beginning of one.
    Token(String),
    /// What follows in the same token.
    Glued(String),
    /// An expression in a string begins and ends.
    Enters,
    Leaves,
}

/// A part of a sentence.
#[derive(Debug, Default)]
struct Part {
    pieces: Vec<Piece>,
    ending: Ending,
    marks: Vec<usize>,
}

impl Part {
    fn first(&self) -> Option<&str> {
        self.pieces.iter().find_map(|piece| match piece {
            Piece::Token(text) => Some(text.as_str()),
            _ => None,
        })
    }

    fn append(&mut self, mut next: Part) {
        let goes_on = self.ending.reaches
            && (next.first()).is_some_and(|first| OPERATORS.split(' ').any(|one| one == first));
        if !next.pieces.is_empty() {
            self.ending = next.ending;
        }
        self.ending.reaches |= goes_on;
        self.pieces.append(&mut next.pieces);
        self.marks.append(&mut next.marks);
    }
}

/// Makes sentences.
pub(crate) struct Generator<'grammar> {
    grammar: &'grammar Grammar,
    /// How deep the shallowest derivation of each rule is.
    heights: HashMap<&'grammar str, usize>,
    random: Random,
    /// How often what each mark stands for is part of a sentence.
    pub(crate) used: Vec<usize>,
    /// How often it was chosen freely.
    tried: Vec<usize>,
    budget: usize,
    depth: usize,
    strings: usize,
    /// For each rule that is being derived: whether its `else` was.
    alternatives: Vec<bool>,
    begins_token: bool,
}

/// How deep rules are nested before only the shortest derivations are taken.
const DEPTH: usize = 140;

impl<'grammar> Generator<'grammar> {
    pub(crate) fn new(grammar: &'grammar Grammar, seed: u64) -> Self {
        Generator {
            grammar,
            heights: heights(grammar),
            random: Random(seed),
            used: vec![0; grammar.marks.len()],
            tried: vec![0; grammar.marks.len()],
            budget: 0,
            depth: 0,
            strings: 0,
            alternatives: Vec::new(),
            begins_token: true,
        }
    }

    /// A sentence of a rule, as text.
    pub(crate) fn sentence(&mut self, rule: &'grammar str) -> String {
        self.budget = 1 + self.random.below(400);
        let part = self.rule(rule);
        for mark in part.marks {
            self.used[mark] += 1;
        }
        lay_out(&part.pieces, &mut self.random)
    }

    fn is_short(&self) -> bool {
        self.budget == 0 || self.depth > DEPTH
    }

    fn rule(&mut self, name: &'grammar str) -> Part {
        let rule = &self.grammar.rules[name];
        let condition = CONDITIONS.iter().find(|(rule, _)| *rule == name);
        self.depth += 1;
        self.alternatives.push(false);
        let mut part = loop {
            let begins = self.begins_token;
            let part = self.node(&rule.node, rule.is_token);
            let fits = condition.is_none_or(|(_, fits)| fits(self.grammar, &text(&part.pieces)));
            if fits {
                break part;
            }
            self.begins_token = begins;
        };
        let has_alternative = self.alternatives.pop() == Some(true);
        self.depth -= 1;
        part.ending.reaches |= matches!(name, "open" | "not");
        part.ending.lacks_else |= name == "branches" && !has_alternative;
        part
    }

    fn node(&mut self, node: &'grammar Node, in_token: bool) -> Part {
        match node {
            Node::Literal(text) => {
                if text == "else" {
                    *self.alternatives.last_mut().expect("a rule") = true;
                }
                self.piece(text.clone(), in_token)
            }
            Node::Class { negated, ranges } => {
                let character = if *negated {
                    loop {
                        let character = self.any_character();
                        if !ranges.iter().any(|range| range.contains(&character)) {
                            break character;
                        }
                    }
                } else {
                    self.character(ranges)
                };
                self.piece(character.into(), in_token)
            }
            Node::Rule(name) => self.reference(name, in_token),
            Node::Sequence(nodes) => self.sequence(nodes, in_token),
            Node::Choice { mark, branches } => {
                let index = self.choose(*mark, branches);
                let mut part = self.node(&branches[index], in_token);
                part.marks.push(mark + index);
                part
            }
            Node::Repeat { .. } => {
                let count = self.count(node);
                self.repeat(node, count, in_token)
            }
        }
    }

    fn piece(&mut self, text: String, in_token: bool) -> Part {
        self.budget = self.budget.saturating_sub(1);
        let piece = if in_token && !self.begins_token {
            Piece::Glued(text)
        } else {
            Piece::Token(text)
        };
        self.begins_token = false;
        Part {
            pieces: vec![piece],
            ..Part::default()
        }
    }

    fn reference(&mut self, name: &'grammar str, in_token: bool) -> Part {
        let is_token = self.grammar.rules[name].is_token;
        if in_token && !is_token {
            self.strings += 1;
            let mut part = self.rule(name);
            self.strings -= 1;
            part.pieces.insert(0, Piece::Enters);
            part.pieces.push(Piece::Leaves);
            self.begins_token = true;
            return part;
        }
        if !in_token {
            self.begins_token = true;
        }
        self.rule(name)
    }

    /// Parts one after the other; all again where one does not fit behind the one before it.
    fn sequence(&mut self, nodes: &'grammar [Node], in_token: bool) -> Part {
        let mut attempts = 0;
        'again: loop {
            let counts: Vec<usize> = nodes.iter().map(|node| self.count(node)).collect();
            let mut shares: usize = counts.iter().sum();
            let mut part = Part::default();
            for (node, count) in nodes.iter().zip(counts) {
                let next = if matches!(node, Node::Literal(_) | Node::Class { .. }) {
                    self.node(node, in_token)
                } else {
                    self.share(shares, count, |this| this.repeat(node, count, in_token))
                };
                shares -= count;
                if next.first().is_some_and(|first| !part.ending.allows(first)) {
                    attempts += 1;
                    if attempts > 3 {
                        self.budget = 0;
                    }
                    assert!(attempts < 100, "no way to derive {nodes:?}");
                    continue 'again;
                }
                part.append(next);
            }
            return part;
        }
    }

    /// What has been decided to stand there so many times.
    fn repeat(&mut self, node: &'grammar Node, count: usize, in_token: bool) -> Part {
        let Node::Repeat {
            mark, node, least, ..
        } = node
        else {
            return self.node(node, in_token);
        };
        let mut part = Part::default();
        for index in 0..count {
            part.append(self.share(count - index, 1, |this| this.node(node, in_token)));
        }
        part.marks.push(mark + count.min(2) - least);
        part
    }

    /// Derives with a part of the budget: otherwise what comes first would take it all.
    fn share(&mut self, shares: usize, own: usize, derive: impl FnOnce(&mut Self) -> Part) -> Part {
        let whole = self.budget;
        self.budget = (whole * own).checked_div(shares).unwrap_or(0);
        let rest = whole - self.budget;
        let part = derive(self);
        self.budget += rest;
        part
    }

    /// A branch: the ones that were taken seldom are likely.
    fn choose(&mut self, mark: usize, branches: &[Node]) -> usize {
        let is_open = |node: &Node| {
            self.strings == 0 || !matches!(node, Node::Rule(name) if name == NOT_INSIDE.1)
        };
        let open: Vec<usize> = (0..branches.len())
            .filter(|&index| is_open(&branches[index]))
            .collect();
        let heights = |index: usize| height(&branches[index], &self.heights).unwrap_or(usize::MAX);
        if self.is_short() {
            let least = open.iter().map(|&index| heights(index)).min();
            let lowest: Vec<usize> = (open.into_iter())
                .filter(|&index| Some(heights(index)) == least)
                .collect();
            return lowest[self.random.below(lowest.len())];
        }
        let weight = |index: &usize| 1 + 1_000_000 / (1 + self.tried[mark + index]);
        let mut place = self.random.below(open.iter().map(weight).sum());
        let chosen = *open
            .iter()
            .find(|index| match place.checked_sub(weight(index)) {
                Some(rest) => {
                    place = rest;
                    false
                }
                None => true,
            })
            .expect("the weights add up");
        self.tried[mark + chosen] += 1;
        chosen
    }

    /// How often a part is to stand there; what needs no part of the budget counts as none.
    fn count(&mut self, node: &Node) -> usize {
        let (mark, least, several) = match node {
            Node::Repeat {
                mark,
                least,
                several,
                ..
            } => (*mark, *least, *several),
            Node::Literal(_) | Node::Class { .. } => return 0,
            _ => return 1,
        };
        if self.is_short() {
            return least;
        }
        let mut count = least;
        let most = if several { least + 3 } else { 1 };
        // What was taken seldom, as deep rules are, is more likely.
        let seldom = self.tried[mark + 1 - least] < 100;
        let percent = if seldom { 50 } else { 20 };
        while count < most && self.random.chance(percent) {
            count += 1;
        }
        self.tried[mark + count.min(2) - least] += 1;
        count
    }

    fn character(&mut self, ranges: &[std::ops::RangeInclusive<char>]) -> char {
        let range = &ranges[self.random.below(ranges.len())];
        let (first, last) = (u32::from(*range.start()), u32::from(*range.end()));
        let code = first + self.random.below((last - first + 1) as usize) as u32;
        char::from_u32(code).expect("no surrogate in a range")
    }

    fn any_character(&mut self) -> char {
        const OTHERS: [char; 8] = ['\t', '\r', '\0', 'é', 'π', '\u{2028}', '\u{feff}', '🙂'];
        match self.random.below(10) {
            0 => OTHERS[self.random.below(OTHERS.len())],
            _ => self.character(&[' '..='~']),
        }
    }
}

fn text(pieces: &[Piece]) -> String {
    let written = pieces.iter().map(|piece| match piece {
        Piece::Token(text) | Piece::Glued(text) => text.as_str(),
        Piece::Enters | Piece::Leaves => "",
    });
    written.collect()
}

/// How deep the shallowest derivation of each rule is, by going over the rules until nothing
/// changes.
fn heights(grammar: &Grammar) -> HashMap<&str, usize> {
    let mut heights = HashMap::new();
    loop {
        let mut changed = false;
        for (name, rule) in &grammar.rules {
            let Some(found) = height(&rule.node, &heights) else {
                continue;
            };
            let found = found + 1;
            if heights
                .get(name.as_str())
                .is_none_or(|&known| found < known)
            {
                heights.insert(name.as_str(), found);
                changed = true;
            }
        }
        if !changed {
            assert_eq!(heights.len(), grammar.rules.len(), "a rule without an end");
            return heights;
        }
    }
}

fn height(node: &Node, heights: &HashMap<&str, usize>) -> Option<usize> {
    match node {
        Node::Literal(_) | Node::Class { .. } => Some(0),
        Node::Rule(name) => heights.get(name.as_str()).copied(),
        Node::Sequence(nodes) => nodes
            .iter()
            .map(|node| height(node, heights))
            .try_fold(0, |most, next| Some(most.max(next?))),
        Node::Choice { branches, .. } => branches
            .iter()
            .filter_map(|node| height(node, heights))
            .min(),
        Node::Repeat { least: 0, .. } => Some(0),
        Node::Repeat { node, .. } => height(node, heights),
    }
}
