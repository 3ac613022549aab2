//! What a proof consists of, as a file: the field, the box, the cells and what each of them is, and
//! what follows. A checker needs nothing else ([`super::verify`]).
//!
//! The file is JSON with its members in this order, without spaces; numbers whose digits matter are
//! strings, with all digits that tell them apart. Every text that says the same in another way is refused, and so
//! is one whose digest differs.
//!
//! The tree lists for each cell of the coarsest level, the first axis fastest, what it is: `(` for a
//! divided cell, followed by its parts, `+` and `-` where F − iso has no zero and this sign, `c` the same
//! as `-` where a cap is made, `n` where the normals of all simplices were tested, `?` where nothing is
//! proven.

use std::fmt::Write;

use serde_json::{Value as Json, json};

use super::cells::Frame;
use super::forest::{Forest, State};
use super::topology::Component;
use crate::engine::{CompiledField, Field};
use crate::geometry::Bounds;
use crate::graph::print;
use rustc_hash::FxHashMap;

/// The name of the format.
const FORMAT: &str = "imp certificate";

/// The version that is written and read.
const VERSION: u64 = 1;

/// A proof in the form in which it is written and checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    /// The graph of F as text, one line a node; see [`crate::graph::print`].
    pub field: String,
    /// The values of the parameters that the graph names.
    pub parameters: Vec<f64>,
    /// The level.
    pub iso: f64,
    /// The sides of the box: as many as F has coordinates.
    pub sides: Vec<(f64, f64)>,
    /// The number of cells of the coarsest level along each axis.
    pub coarse: Vec<u32>,
    /// What each cell is.
    pub tree: String,
    /// Whether the topology is claimed to be proven.
    pub proven: bool,
    /// The components of the interpolant's zero set.
    pub components: Vec<Component>,
}

impl Certificate {
    /// The certificate of a subdivision.
    pub(super) fn of(
        forest: &Forest,
        (bounds, iso): (&Bounds, f64),
        (proven, components): (bool, &[Component]),
    ) -> Certificate {
        let field: &CompiledField = forest.analysed.field;
        let graph = field.program().first_root();
        let text = graph.map(|(graph, root)| print::text(graph, &[root]));
        Certificate {
            field: text.unwrap_or_default(),
            parameters: field.parameters().to_vec(),
            iso,
            sides: bounds.sides().collect(),
            coarse: forest.frame.coarse[..forest.frame.dimension].to_vec(),
            tree: tree(forest),
            proven,
            components: components.to_vec(),
        }
    }

    /// The text of the file.
    pub fn text(&self) -> String {
        let content = self.content();
        format!(
            "{{\"format\":{},\"version\":{VERSION},\"content\":{content},\"digest\":\"{:016x}\"}}\n",
            json!(FORMAT),
            digest(content.as_bytes())
        )
    }

    /// The part that the digest is of.
    fn content(&self) -> String {
        let list = |parts: &mut dyn Iterator<Item = String>| parts.collect::<Vec<_>>().join(",");
        let number = |value: f64| format!("\"{value:?}\"");
        let lines = list(&mut self.field.lines().map(|line| json!(line).to_string()));
        let parameters = list(&mut self.parameters.iter().map(|&value| number(value)));
        let sides = self.sides.iter();
        let sides =
            list(&mut sides.map(|&(low, high)| format!("[{},{}]", number(low), number(high))));
        let coarse = list(&mut self.coarse.iter().map(u32::to_string));
        let components = list(&mut self.components.iter().map(|component| {
            let Component { euler, boundaries } = component;
            format!("{{\"euler\":{euler},\"boundaries\":{boundaries}}}")
        }));
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "{{\"field\":[{lines}],\"parameters\":[{parameters}],\"iso\":{},\"box\":[{sides}],\
             \"coarse\":[{coarse}],\"tree\":{},\"proven\":{},\"components\":[{components}]}}",
            number(self.iso),
            json!(self.tree),
            self.proven,
        );
        text
    }

    /// Reads a file; `None` if it is not exactly what [`Certificate::text`] would write.
    pub fn read(text: &str) -> Option<Certificate> {
        let whole: Json = serde_json::from_str(text).ok()?;
        let content = whole.get("content")?;
        let number = |value: &Json| value.as_str()?.parse::<f64>().ok();
        let each = |name: &str| content.get(name)?.as_array();
        let lines: Option<Vec<&str>> = each("field")?.iter().map(Json::as_str).collect();
        let certificate = Certificate {
            field: lines?
                .iter()
                .fold(String::new(), |text, line| text + line + "\n"),
            parameters: each("parameters")?
                .iter()
                .map(number)
                .collect::<Option<_>>()?,
            iso: number(content.get("iso")?)?,
            sides: each("box")?
                .iter()
                .map(|side| Some((number(side.get(0)?)?, number(side.get(1)?)?)))
                .collect::<Option<_>>()?,
            coarse: each("coarse")?
                .iter()
                .map(|count| u32::try_from(count.as_u64()?).ok())
                .collect::<Option<_>>()?,
            tree: content.get("tree")?.as_str()?.to_owned(),
            proven: content.get("proven")?.as_bool()?,
            components: each("components")?
                .iter()
                .map(|part| {
                    Some(Component {
                        euler: part.get("euler")?.as_i64()?,
                        boundaries: usize::try_from(part.get("boundaries")?.as_u64()?).ok()?,
                    })
                })
                .collect::<Option<_>>()?,
        };
        (certificate.text() == text).then_some(certificate)
    }
}

/// The tree as text.
fn tree(forest: &Forest) -> String {
    let leaves: FxHashMap<_, char> = forest
        .leaves
        .iter()
        .map(|leaf| {
            let letter = match leaf.state {
                State::Proven(_) => 'n',
                State::Capped => 'c',
                State::Open(_) | State::Doubtful(_) => '?',
            };
            (super::cells::key(&leaf.node), letter)
        })
        .collect();
    let frame: &Frame = forest.frame;
    let mut text = String::new();
    let mut stack = frame.roots();
    stack.reverse();
    while let Some(node) = stack.pop() {
        let key = super::cells::key(&node);
        if forest.divided.contains(&key) {
            text.push('(');
            let children: Vec<_> = frame.children(&node).collect();
            stack.extend(children.into_iter().rev());
        } else if let Some(&is_inside) = forest.decided.get(&key) {
            text.push(if is_inside { '-' } else { '+' });
        } else {
            text.push(leaves.get(&key).copied().unwrap_or('?'));
        }
    }
    text
}

/// The 64-bit digest of Fowler, Noll and Vo (FNV-1a).
fn digest(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    })
}
