//! A reader of the notation of `grammar/imp.ebnf`: the EBNF of the W3C's XML recommendation
//! (section 6), without its `-` for exceptions.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

/// What the right side of a rule is made of.
#[derive(Debug)]
pub(crate) enum Node {
    /// `'word'`
    Literal(String),
    /// `[a-z#x370-#x3FF]`, `[^a]` or `#xA`
    Class {
        negated: bool,
        ranges: Vec<RangeInclusive<char>>,
    },
    /// The name of a rule.
    Rule(String),
    /// One after the other.
    Sequence(Vec<Node>),
    /// One of several; the first of their marks.
    Choice { mark: usize, branches: Vec<Node> },
    /// `?`, `*` or `+`; the first of the marks for none (if allowed), one and several (if allowed).
    Repeat {
        mark: usize,
        node: Box<Node>,
        least: usize,
        several: bool,
    },
}

/// One rule of the grammar.
#[derive(Debug)]
pub(crate) struct Rule {
    /// Its right side.
    pub(crate) node: Node,
    /// Whether it is a token: nothing stands between its parts.
    pub(crate) is_token: bool,
}

/// A grammar. Every alternative in it, and every number of repetitions, has a mark, so that one can
/// count what was used.
#[derive(Debug)]
pub(crate) struct Grammar {
    /// The rules by name.
    pub(crate) rules: BTreeMap<String, Rule>,
    /// What each mark stands for.
    pub(crate) marks: Vec<String>,
}

impl Grammar {
    /// Reads a grammar. The rules behind a comment that begins with `Tokens` are tokens.
    pub(crate) fn read(text: &str) -> Grammar {
        let mut reader = Reader {
            words: words(text),
            at: 0,
            rule: String::new(),
            marks: Vec::new(),
        };
        let mut rules = BTreeMap::new();
        let mut is_token = false;
        while let Some(word) = reader.next() {
            match word {
                Word::Tokens => is_token = true,
                Word::Name(name) => {
                    assert_eq!(reader.next(), Some(Word::Sign("::=")), "after {name}");
                    reader.rule = name.clone();
                    let node = reader.choice();
                    let earlier = rules.insert(name.clone(), Rule { node, is_token });
                    assert!(earlier.is_none(), "two rules {name}");
                }
                other => panic!("a rule does not begin with {other:?}"),
            }
        }
        let grammar = Grammar {
            rules,
            marks: reader.marks,
        };
        for rule in grammar.rules.values() {
            rule.node.visit(&mut |node| {
                if let Node::Rule(name) = node {
                    assert!(grammar.rules.contains_key(name), "no rule {name}");
                }
            });
        }
        grammar
    }

    /// The words of the language: all literals outside of tokens that are letters.
    pub(crate) fn words(&self) -> Vec<&str> {
        let mut words = Vec::new();
        for rule in self.rules.values().filter(|rule| !rule.is_token) {
            rule.node.visit(&mut |node| match node {
                Node::Literal(text) if text.starts_with(char::is_alphabetic) => {
                    words.push(text.as_str());
                }
                _ => {}
            });
        }
        words.sort_unstable();
        words.dedup();
        words
    }
}

impl Node {
    pub(crate) fn visit<'node>(&'node self, look: &mut impl FnMut(&'node Node)) {
        look(self);
        match self {
            Node::Literal(_) | Node::Class { .. } | Node::Rule(_) => {}
            Node::Sequence(nodes)
            | Node::Choice {
                branches: nodes, ..
            } => nodes.iter().for_each(|node| node.visit(look)),
            Node::Repeat { node, .. } => node.visit(look),
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
enum Word {
    Tokens,
    Name(String),
    Literal(String),
    Class(String),
    Character(char),
    Sign(&'static str),
}

fn words(text: &str) -> Vec<Word> {
    let mut words = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        let length = if let Some(comment) = rest.strip_prefix("(*") {
            let end = comment.find("*)").expect("a comment has an end");
            if comment.trim_start().starts_with("Tokens") {
                words.push(Word::Tokens);
            }
            end + 4
        } else if first == '\'' {
            let end = rest[1..].find('\'').expect("a literal has an end");
            words.push(Word::Literal(rest[1..=end].to_owned()));
            end + 2
        } else if first == '[' {
            let end = rest.find(']').expect("a class has an end");
            words.push(Word::Class(rest[1..end].to_owned()));
            end + 1
        } else if rest.starts_with("#x") {
            let (character, length) = character(rest);
            words.push(Word::Character(character));
            length
        } else if first.is_ascii_alphabetic() {
            let length = rest
                .find(|character: char| !character.is_ascii_alphanumeric())
                .unwrap_or(rest.len());
            words.push(Word::Name(rest[..length].to_owned()));
            length
        } else {
            let sign = ["::=", "(", ")", "|", "?", "*", "+"]
                .into_iter()
                .find(|sign| rest.starts_with(sign));
            let sign = sign.unwrap_or_else(|| panic!("{first} is not part of the notation"));
            words.push(Word::Sign(sign));
            sign.len()
        };
        rest = rest[length..].trim_start();
    }
    words
}

/// The character that a text begins with, perhaps as `#x3C0`, and the length of its notation.
fn character(text: &str) -> (char, usize) {
    let Some(digits) = text.strip_prefix("#x") else {
        let first = text.chars().next().expect("a character");
        return (first, first.len_utf8());
    };
    let length = digits
        .find(|digit: char| !digit.is_ascii_hexdigit())
        .unwrap_or(digits.len());
    let code = u32::from_str_radix(&digits[..length], 16).expect("hexadecimal digits");
    (char::from_u32(code).expect("a character"), length + 2)
}

fn class(text: &str) -> Node {
    let (negated, mut rest) = match text.strip_prefix('^') {
        Some(rest) => (true, rest),
        None => (false, text),
    };
    let mut ranges = Vec::new();
    while !rest.is_empty() {
        let (first, length) = character(rest);
        rest = &rest[length..];
        let mut last = first;
        if let Some(end) = rest.strip_prefix('-').filter(|end| !end.is_empty()) {
            let length;
            (last, length) = character(end);
            rest = &end[length..];
        }
        assert!(first <= last);
        ranges.push(first..=last);
    }
    Node::Class { negated, ranges }
}

struct Reader {
    words: Vec<Word>,
    at: usize,
    rule: String,
    marks: Vec<String>,
}

impl Reader {
    fn next(&mut self) -> Option<Word> {
        let word = self.words.get(self.at).cloned();
        self.at += 1;
        word
    }

    fn next_is(&mut self, sign: &'static str) -> bool {
        let found = self.words.get(self.at) == Some(&Word::Sign(sign));
        self.at += usize::from(found);
        found
    }

    fn mark(&mut self, what: String) {
        self.marks.push(format!("{}: {what}", self.rule));
    }

    fn choice(&mut self) -> Node {
        let mut branches = vec![self.sequence()];
        while self.next_is("|") {
            branches.push(self.sequence());
        }
        if branches.len() == 1 {
            return branches.remove(0);
        }
        let mark = self.marks.len();
        for branch in &branches {
            self.mark(format!("{branch:?}"));
        }
        Node::Choice { mark, branches }
    }

    fn sequence(&mut self) -> Node {
        let mut nodes = Vec::new();
        while let Some(node) = self.repeated() {
            nodes.push(node);
        }
        assert!(!nodes.is_empty(), "an empty part in {}", self.rule);
        match nodes.len() {
            1 => nodes.remove(0),
            _ => Node::Sequence(nodes),
        }
    }

    fn repeated(&mut self) -> Option<Node> {
        let node = self.primary()?;
        let (least, several) = if self.next_is("?") {
            (0, false)
        } else if self.next_is("*") {
            (0, true)
        } else if self.next_is("+") {
            (1, true)
        } else {
            return Some(node);
        };
        let mark = self.marks.len();
        for count in ["none", "one", "several"]
            .into_iter()
            .skip(least)
            .take(if several { 3 - least } else { 2 })
        {
            self.mark(format!("{count} of {node:?}"));
        }
        Some(Node::Repeat {
            mark,
            node: Box::new(node),
            least,
            several,
        })
    }

    fn primary(&mut self) -> Option<Node> {
        let node = match self.words.get(self.at)? {
            Word::Literal(text) => Node::Literal(text.clone()),
            Word::Class(text) => class(text),
            Word::Character(character) => Node::Class {
                negated: false,
                ranges: vec![*character..=*character],
            },
            Word::Name(_) if self.words.get(self.at + 1) == Some(&Word::Sign("::=")) => {
                return None;
            }
            Word::Name(name) => Node::Rule(name.clone()),
            Word::Sign("(") => {
                self.at += 1;
                let inside = self.choice();
                assert!(self.next_is(")"), "an open parenthesis in {}", self.rule);
                return Some(inside);
            }
            Word::Sign(_) | Word::Tokens => return None,
        };
        self.at += 1;
        Some(node)
    }
}

#[test]
fn the_notation_is_read() {
    let grammar =
        Grammar::read("a ::= ( 'x' | b )+ (* note *) 'y'? (* Tokens *) b ::= [^a-c#x41-]");
    let Node::Sequence(parts) = &grammar.rules["a"].node else {
        panic!("{grammar:?}");
    };
    assert!(matches!(
        &parts[0],
        Node::Repeat { least: 1, several: true, node, .. } if matches!(&**node, Node::Choice { branches, .. } if branches.len() == 2)
    ));
    assert!(matches!(
        &parts[1],
        Node::Repeat { least: 0, several: false, node, .. } if matches!(&**node, Node::Literal(text) if text == "y")
    ));
    assert_eq!(grammar.marks.len(), 2 + 2 + 2);
    assert_eq!(grammar.words(), ["x", "y"]);
    assert!(!grammar.rules["a"].is_token && grammar.rules["b"].is_token);
    let Node::Class { negated, ranges } = &grammar.rules["b"].node else {
        panic!("{grammar:?}");
    };
    assert!(*negated);
    assert_eq!(ranges, &['a'..='c', 'A'..='A', '-'..='-']);
}
