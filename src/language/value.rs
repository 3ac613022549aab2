//! The values that expressions have.
//!
//! Numbers, lists and the like are what they are everywhere. What depends on the point or on the
//! parameters is a [`Value::Symbol`]: a node of the session's graph. So a function written once
//! runs with numbers in a script and is traced with symbols in a field's body.

use std::rc::Rc;

use super::field::FieldValue;
use super::function::FunctionValue;
use super::list::List;
use super::module::Module;
use super::product::{
    CurveSet, FallSet, FitSet, ImageSet, MeshSet, ReportSet, SampleSet, SimulationSet, SolidSet,
};
use crate::diagnostic::{Code, Diagnostic};
use crate::graph::{Interval, NodeId};

/// The result of evaluating something: a value, or the one error that ends the evaluation.
pub type Outcome<T> = Result<T, Box<Diagnostic>>;

/// A value; cheap to clone.
#[derive(Clone, Debug)]
pub enum Value {
    /// A plain number.
    Number(f64),
    /// `true` or `false`.
    Bool(bool),
    /// A string.
    Text(Rc<str>),
    /// `lo..hi`
    Interval(Interval),
    /// A list, vector or matrix.
    List(List),
    /// A number that depends on the point or on parameters.
    Symbol(NodeId),
    /// A truth value that depends on the point or on parameters.
    Condition(Condition),
    /// A function: of the file, anonymous, or built in.
    Function(FunctionValue),
    /// A field.
    Field(FieldValue),
    /// Points on a zero set.
    Samples(Rc<SampleSet>),
    /// A triangle mesh.
    Mesh(Rc<MeshSet>),
    /// Curves in the plane.
    Curves(Rc<CurveSet>),
    /// A picture.
    Image(Rc<ImageSet>),
    /// A surface that moves.
    Simulation(Rc<SimulationSet>),
    /// A field that was fitted to points.
    Fit(Rc<FitSet>),
    /// A solid that fell.
    Fall(Rc<FallSet>),
    /// A solid as tetrahedra or triangles.
    Solid(Rc<SolidSet>),
    /// What was measured on a mesh.
    Report(Rc<ReportSet>),
    /// Definitions that are reached as `name.member`.
    Module(Rc<Module>),
    /// What a statement such as `print(…)` leaves: not usable as a value.
    Nothing,
    /// What a script's action would have made, where definitions are checked without running
    /// anything. Every use of it is unknown again.
    Unknown,
}

/// A relation between symbols, both as a truth value and as a solid.
#[derive(Clone, Copy, Debug)]
pub struct Condition {
    /// A node that is 1 where the relation holds and 0 elsewhere.
    pub truth: NodeId,
    /// A node that is negative inside the set where the relation holds and positive outside;
    /// `None` for `!=`, which has no such set.
    pub solid: Option<NodeId>,
}

impl Value {
    /// A list.
    pub fn list(elements: Vec<Value>) -> Value {
        Value::List(List::new(elements))
    }

    /// A list of numbers.
    pub fn numbers(numbers: impl IntoIterator<Item = f64>) -> Value {
        Value::list(numbers.into_iter().map(Value::Number).collect())
    }

    /// A string.
    pub fn text(text: impl Into<Rc<str>>) -> Value {
        Value::Text(text.into())
    }

    /// What kind of value it is, in the language's words, with an article.
    pub fn kind(&self) -> &'static str {
        match self {
            Value::Number(_) => "a number",
            Value::Bool(_) => "a bool",
            Value::Text(_) => "a string",
            Value::Interval(_) => "an interval",
            Value::List(_) => "a list",
            Value::Symbol(_) => "a number that depends on the point or on parameters",
            Value::Condition(_) => "a condition that depends on the point or on parameters",
            Value::Function(_) => "a function",
            Value::Field(_) => "a field",
            Value::Samples(_) => "samples",
            Value::Mesh(_) => "a mesh",
            Value::Curves(_) => "a curve set",
            Value::Image(_) => "an image",
            Value::Simulation(_) => "a simulation",
            Value::Fit(_) => "a fit",
            Value::Fall(_) => "a fall",
            Value::Solid(_) => "a solid",
            Value::Report(_) => "a report",
            Value::Module(_) => "a module",
            Value::Nothing => "no value",
            Value::Unknown => "an unknown value",
        }
    }

    /// Whether it is what a script makes: something with named properties.
    pub fn is_product(&self) -> bool {
        matches!(
            self,
            Value::Samples(_)
                | Value::Mesh(_)
                | Value::Curves(_)
                | Value::Image(_)
                | Value::Simulation(_)
                | Value::Fit(_)
                | Value::Fall(_)
                | Value::Solid(_)
                | Value::Report(_)
        )
    }

    /// Whether a symbol occurs in it, so that it has no plain value of its own.
    pub fn is_symbolic(&self) -> bool {
        match self {
            Value::Symbol(_) | Value::Condition(_) => true,
            Value::List(list) => list.is_symbolic(),
            _ => false,
        }
    }

    /// Whether it is a function, or contains one.
    pub fn has_function(&self) -> bool {
        match self {
            Value::Function(_) => true,
            Value::List(list) => list.has_function(),
            _ => false,
        }
    }

    /// Whether it is unknown, or contains something unknown.
    pub fn is_unknown(&self) -> bool {
        match self {
            Value::Unknown => true,
            Value::List(list) => list.is_unknown(),
            _ => false,
        }
    }
}

/// The error for a value of the wrong kind.
pub fn wrong_kind(expected: &str, found: &Value) -> Box<Diagnostic> {
    let message = format!("expected {expected}, found {}", found.kind());
    Box::new(Diagnostic::error(Code::WrongKind, message))
}

/// The error `code` with `message`, without a place; the caller knows the place.
pub fn failure(code: Code, message: impl Into<String>) -> Box<Diagnostic> {
    Box::new(Diagnostic::error(code, message))
}
