//! Fields as straight-line programs, one operation a line: the `.vm` format of the Prospero
//! benchmark (<https://www.mattkeeter.com/projects/prospero/>).
//!
//! A line is `name operation operands`, with white space between them. Operands are names from
//! lines above; those of `const` are a number. Empty lines and lines that begin with `#` say
//! nothing. The last operation is the field, in R3 if `var-z` occurs and otherwise in R2.
//!
//! Operations mean what they mean in Imp. Programs that define the format through their own
//! arithmetic differ from it in this:
//!
//! * `min` and `max` are NaN if an operand is;
//! * `mod` is the remainder that is not negative whatever the divisor's sign, as a − |b|·⌊a/|b|⌋
//!   with each step rounded;
//! * `atan2` takes −0 for 0;
//! * `compare` is −1, 0 or 1, and NaN if an operand is; `not` is 1 where its operand is 0 and
//!   elsewhere 0; `and` is its first operand where that is 0, else the second; `or` is its first
//!   operand unless that is 0, else the second. All four are told apart by IEEE comparisons.

use std::io::{self, BufRead, Read};

use rustc_hash::FxHashMap;

use super::reading::{Place, ReadError, Wrong, quoted};
use crate::graph::{Graph, NodeId, Op};

/// A field as nodes of a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FieldRoot {
    /// The number of coordinates.
    pub dimension: usize,
    /// The node of the field's value.
    pub root: NodeId,
}

/// Bytes of the longest line: far more than an operation needs, so that a file that is something
/// else altogether is not read into memory.
const LONGEST_LINE: u64 = 1000;

/// How an operation of the format becomes nodes.
#[derive(Clone, Copy)]
enum Meaning {
    Constant,
    Coordinate(usize),
    One(fn(&mut Graph, NodeId) -> NodeId),
    Two(fn(&mut Graph, NodeId, NodeId) -> NodeId),
}

use Meaning::{Constant, Coordinate, One, Two};

/// The operations of the format.
const OPERATIONS: &[(&str, Meaning)] = &[
    ("const", Constant),
    ("var-x", Coordinate(0)),
    ("var-y", Coordinate(1)),
    ("var-z", Coordinate(2)),
    ("neg", One(|graph, a| graph.apply(Op::Negate, &[a]))),
    ("abs", One(|graph, a| graph.apply(Op::Abs, &[a]))),
    ("recip", One(reciprocal)),
    ("sqrt", One(|graph, a| graph.apply(Op::SquareRoot, &[a]))),
    ("square", One(|graph, a| graph.apply(Op::Square, &[a]))),
    ("floor", One(|graph, a| graph.apply(Op::Floor, &[a]))),
    ("ceil", One(|graph, a| graph.apply(Op::Ceil, &[a]))),
    ("round", One(|graph, a| graph.apply(Op::Round, &[a]))),
    ("sin", One(|graph, a| graph.apply(Op::Sin, &[a]))),
    ("cos", One(|graph, a| graph.apply(Op::Cos, &[a]))),
    ("tan", One(|graph, a| graph.apply(Op::Tan, &[a]))),
    ("asin", One(|graph, a| graph.apply(Op::Asin, &[a]))),
    ("acos", One(|graph, a| graph.apply(Op::Acos, &[a]))),
    ("atan", One(|graph, a| graph.apply(Op::Atan, &[a]))),
    ("exp", One(|graph, a| graph.apply(Op::Exp, &[a]))),
    ("ln", One(|graph, a| graph.apply(Op::Log, &[a]))),
    ("not", One(not)),
    ("add", Two(|graph, a, b| graph.apply(Op::Add, &[a, b]))),
    ("sub", Two(|graph, a, b| graph.apply(Op::Subtract, &[a, b]))),
    ("mul", Two(|graph, a, b| graph.apply(Op::Multiply, &[a, b]))),
    ("div", Two(|graph, a, b| graph.apply(Op::Divide, &[a, b]))),
    ("atan2", Two(|graph, a, b| graph.apply(Op::Atan2, &[a, b]))),
    ("min", Two(|graph, a, b| graph.apply(Op::Min, &[a, b]))),
    ("max", Two(|graph, a, b| graph.apply(Op::Max, &[a, b]))),
    ("compare", Two(compare)),
    ("mod", Two(remainder)),
    (
        "and",
        Two(|graph, a, b| graph.apply(Op::Select, &[a, b, a])),
    ),
    ("or", Two(|graph, a, b| graph.apply(Op::Select, &[a, a, b]))),
];

fn reciprocal(graph: &mut Graph, a: NodeId) -> NodeId {
    let one = graph.constant(1.0);
    graph.apply(Op::Divide, &[one, a])
}

fn not(graph: &mut Graph, a: NodeId) -> NodeId {
    let zero = graph.constant(0.0);
    graph.apply(Op::Equal, &[a, zero])
}

fn compare(graph: &mut Graph, a: NodeId, b: NodeId) -> NodeId {
    let [less, equal, greater, unordered] =
        [-1.0, 0.0, 1.0, f64::NAN].map(|value| graph.constant(value));
    let is_greater = graph.apply(Op::Less, &[b, a]);
    let is_less = graph.apply(Op::Less, &[a, b]);
    let is_equal = graph.apply(Op::Equal, &[a, b]);
    let otherwise = graph.apply(Op::Select, &[is_equal, equal, unordered]);
    let otherwise = graph.apply(Op::Select, &[is_greater, greater, otherwise]);
    graph.apply(Op::Select, &[is_less, less, otherwise])
}

fn remainder(graph: &mut Graph, a: NodeId, b: NodeId) -> NodeId {
    let divisor = graph.apply(Op::Abs, &[b]);
    graph.apply(Op::Modulo, &[a, divisor])
}

/// Reads a program and puts its operations into the graph, over the nodes that stand for x, y
/// and z.
///
/// At most `line_limit` lines are read. Cost and memory are proportional to their number.
pub(super) fn read_field(
    input: &mut dyn BufRead,
    graph: &mut Graph,
    coordinates: [NodeId; 3],
    line_limit: u64,
) -> Result<FieldRoot, ReadError> {
    let mut reader = Reader {
        operations: OPERATIONS.iter().copied().collect(),
        graph,
        coordinates,
        known: FxHashMap::default(),
        result: FieldRoot {
            dimension: 2,
            root: coordinates[0],
        },
    };
    let mut bytes = Vec::new();
    let mut line = 0;
    while next_line(input, &mut bytes).map_err(ReadError::Failed)? {
        line += 1;
        if line > line_limit {
            return Err(ReadError::TooLong);
        }
        let bad_line = |message| wrong_line(line, message);
        if bytes.len() as u64 > LONGEST_LINE {
            let message =
                format!("longer than {LONGEST_LINE} bytes, the most that a line may have");
            return Err(bad_line(message));
        }
        let text = std::str::from_utf8(&bytes)
            .map_err(|_| bad_line("not UTF-8 text; expected `name operation operands`".into()))?;
        // Some editors begin a file with a byte-order mark.
        let text = match line {
            1 => text.trim_start_matches('\u{feff}'),
            _ => text,
        };
        reader.read_line(text, line).map_err(bad_line)?;
    }
    if reader.known.is_empty() {
        let message = "the file ends without an operation; expected `name operation operands`";
        return Err(wrong_line(line.max(1), message.into()));
    }
    Ok(reader.result)
}

/// The error for a line.
fn wrong_line(line: u64, message: String) -> ReadError {
    let place = Place::Line(line);
    Wrong { place, message }.into()
}

/// The next line, or as much of it as shows that it is too long; false at the end.
fn next_line(input: &mut dyn BufRead, line: &mut Vec<u8>) -> io::Result<bool> {
    line.clear();
    input.take(LONGEST_LINE + 2).read_until(b'\n', line)?;
    let is_there = !line.is_empty();
    while line.last().is_some_and(u8::is_ascii_whitespace) {
        line.pop();
    }
    Ok(is_there)
}

/// What has been read so far.
struct Reader<'a> {
    operations: FxHashMap<&'static str, Meaning>,
    graph: &'a mut Graph,
    coordinates: [NodeId; 3],
    /// Every name with its node and the line that defines it.
    known: FxHashMap<Box<str>, (NodeId, u64)>,
    result: FieldRoot,
}

impl Reader<'_> {
    /// Takes in one line. The error says what is wrong and what was expected.
    fn read_line(&mut self, text: &str, line: u64) -> Result<(), String> {
        let mut words = text.split_whitespace();
        let Some(name) = words.next().filter(|name| !name.starts_with('#')) else {
            return Ok(());
        };
        let Some(operation) = words.next() else {
            let expected = "expected `name operation operands`";
            return Err(format!("no operation after {}; {expected}", quoted(name)));
        };
        let Some(&meaning) = self.operations.get(operation) else {
            let known: Vec<&str> = OPERATIONS.iter().map(|(name, _)| *name).collect();
            return Err(format!(
                "there is no operation {}; expected one of {}",
                quoted(operation),
                known.join(", ")
            ));
        };
        let operands: Vec<&str> = words.collect();
        let root = self.node(operation, meaning, &operands)?;
        if let Some((_, first)) = self.known.insert(name.into(), (root, line)) {
            let expected = "expected a new name";
            return Err(format!(
                "the name {} is taken by line {first}; {expected}",
                quoted(name)
            ));
        }
        self.result.root = root;
        Ok(())
    }

    /// The node of an operation on operands as they are written.
    fn node(
        &mut self,
        operation: &str,
        meaning: Meaning,
        operands: &[&str],
    ) -> Result<NodeId, String> {
        match (meaning, operands) {
            (Constant, [number]) => match number.parse() {
                Ok(number) => Ok(self.graph.constant(number)),
                Err(_) => Err(format!("{} is not a number", quoted(number))
                    + "; expected one after `const`, such as 0.5 or -1e-3"),
            },
            (Coordinate(axis), []) => {
                self.result.dimension = self.result.dimension.max(axis + 1);
                Ok(self.coordinates[axis])
            }
            (One(build), [a]) => {
                let a = self.operand(a)?;
                Ok(build(self.graph, a))
            }
            (Two(build), [a, b]) => {
                let (a, b) = (self.operand(a)?, self.operand(b)?);
                Ok(build(self.graph, a, b))
            }
            _ => Err(format!(
                "`{operation}` with {} operand{}; expected {}",
                operands.len(),
                if operands.len() == 1 { "" } else { "s" },
                match meaning {
                    Constant => "one number",
                    Coordinate(_) => "none",
                    One(_) => "one name",
                    Two(_) => "two names",
                }
            )),
        }
    }

    fn operand(&self, name: &str) -> Result<NodeId, String> {
        let known = self.known.get(name).map(|(node, _)| *node);
        known.ok_or_else(|| {
            let expected = "expected a name from a line above";
            format!("the name {} is not known; {expected}", quoted(name))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &[u8], line_limit: u64) -> (Graph, Result<FieldRoot, ReadError>) {
        let mut graph = Graph::new();
        let coordinates = [0, 1, 2].map(|axis| graph.coordinate(axis));
        let result = read_field(&mut &text[..], &mut graph, coordinates, line_limit);
        (graph, result)
    }

    #[track_caller]
    fn refuses(text: &[u8], line: u64, words: &str) {
        match read(text, 10).1 {
            Err(ReadError::Wrong(Wrong { place, message })) => {
                assert_eq!(place, Place::Line(line), "{message}");
                assert!(message.contains(words), "{message}");
                assert!(message.contains("expected") || message.contains("the most"));
            }
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_last_operation_is_the_field_and_z_makes_it_spatial() {
        let (mut graph, field) = read(b"# a comment\r\n\r\na var-x\r\n  b\tneg  a \r\nc neg a", 9);
        let x = graph.coordinate(0);
        let root = graph.apply(Op::Negate, &[x]);
        let field = field.unwrap();
        assert_eq!(field, FieldRoot { dimension: 2, root });
        assert_eq!(read(b"a var-z\nb const 1\n", 9).1.unwrap().dimension, 3);
    }

    #[test]
    fn every_operation_is_known_once() {
        for (name, meaning) in OPERATIONS {
            let text = match meaning {
                Constant => "r const 1".to_owned(),
                Coordinate(_) => format!("r {name}"),
                One(_) => format!("a var-x\nr {name} a"),
                Two(_) => format!("a var-x\nb var-y\nr {name} a b"),
            };
            read(text.as_bytes(), 9).1.unwrap();
        }
        let names: std::collections::BTreeSet<_> =
            OPERATIONS.iter().map(|(name, _)| name).collect();
        assert_eq!(names.len(), OPERATIONS.len());
    }

    #[test]
    fn wrong_lines_are_named() {
        refuses(b"", 1, "without an operation");
        refuses(b"# nothing\n\n", 2, "without an operation");
        refuses(b"a var-x\nb\n", 2, "no operation after `b`");
        refuses(b"a var-w\n", 1, "no operation `var-w`");
        refuses(
            b"a const\n",
            1,
            "`const` with 0 operands; expected one number",
        );
        refuses(b"a const x\n", 1, "`x` is not a number");
        refuses(b"a var-x 1\n", 1, "`var-x` with 1 operand; expected none");
        refuses(
            b"a var-x\nb sqrt a a\n",
            2,
            "`sqrt` with 2 operands; expected one name",
        );
        refuses(
            b"a var-x\nb add a\n",
            2,
            "`add` with 1 operand; expected two names",
        );
        refuses(b"b neg a\na var-x\n", 1, "`a` is not known");
        refuses(b"a neg a\n", 1, "`a` is not known");
        refuses(b"a var-x\nb var-y\na neg b\n", 3, "`a` is taken by line 1");
        refuses(b"\xff var-x\n", 1, "not UTF-8");
        refuses(&[b'a'; 2000], 1, "longer than 1000 bytes");
        let message = format!("`{}…`", "é".repeat(40));
        refuses(format!("a {}", "é".repeat(90)).as_bytes(), 1, &message);
    }

    #[test]
    fn the_number_of_lines_is_limited() {
        assert!(read(b"a var-x\nb neg a\n", 2).1.is_ok());
        let error = read(b"a var-x\nb neg a\n", 1).1.unwrap_err();
        assert!(matches!(error, ReadError::TooLong));
    }
}
