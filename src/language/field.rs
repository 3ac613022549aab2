//! Fields as values: traced bodies over coordinates and parameters.
//!
//! A field's body is a value over the coordinates x, y, z and the parameters: a scalar for an
//! implicit object, a list for a gradient or a curve in space. Arithmetic on fields works on the
//! bodies; calls substitute the arguments, or evaluate the compiled body where they are plain.

use std::collections::BTreeMap;
use std::fmt;
use std::rc::Rc;
use std::sync::Arc;

use super::arithmetic::{interval_of, node_of, number_of, value_of_node};
use super::tracer::{Tracer, first_axis};
use super::value::{Outcome, Value, failure, wrong_kind};
use crate::diagnostic::Code;
use crate::engine::{CompiledField, Program};
use crate::geometry::Bounds;
use crate::graph::{Interval, Node, NodeId, derive};

/// A field, with changes that `with` made to its parameters.
#[derive(Clone)]
pub struct FieldValue {
    definition: Rc<FieldDefinition>,
    /// Components of q that differ from the session's, by their place in q.
    changes: Rc<BTreeMap<usize, f64>>,
}

struct FieldDefinition {
    name: Option<Arc<str>>,
    dimension: usize,
    /// The level whose coordinates the body is over: see [`Tracer::coordinates`].
    level: usize,
    body: Value,
    domain: Option<Bounds>,
    documentation: Option<Arc<str>>,
}

impl fmt::Debug for FieldValue {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.name().unwrap_or("a field");
        write!(formatter, "{name} in R{}", self.dimension())
    }
}

impl FieldValue {
    /// A field from its body, traced over the coordinates of `level`. `domain` is what `over`
    /// says.
    ///
    /// Fails where the body is not made of numbers.
    pub fn new(
        dimension: usize,
        level: usize,
        body: Value,
        domain: Option<Bounds>,
    ) -> Outcome<FieldValue> {
        if !is_numeric(&body) {
            let message = format!(
                "the value of a field is a number, but this is {}",
                body.kind()
            );
            return Err(failure(Code::NotAField, message));
        }
        Ok(FieldValue {
            definition: Rc::new(FieldDefinition {
                name: None,
                dimension,
                level,
                body,
                domain,
                documentation: None,
            }),
            changes: Rc::default(),
        })
    }

    /// The same field under a name.
    pub fn named(self, name: &Arc<str>, documentation: Option<Arc<str>>) -> FieldValue {
        FieldValue {
            definition: Rc::new(FieldDefinition {
                name: Some(Arc::clone(name)),
                dimension: self.definition.dimension,
                level: self.definition.level,
                body: self.definition.body.clone(),
                domain: self.definition.domain,
                documentation,
            }),
            changes: self.changes,
        }
    }

    /// The same field with another domain, without a name.
    pub fn with_domain(self, domain: Option<Bounds>) -> FieldValue {
        FieldValue {
            definition: Rc::new(FieldDefinition {
                name: None,
                dimension: self.definition.dimension,
                level: self.definition.level,
                body: self.definition.body.clone(),
                domain,
                documentation: None,
            }),
            changes: self.changes,
        }
    }

    /// Whether they differ in their parameters at most.
    pub fn is_same(&self, other: &FieldValue) -> bool {
        Rc::ptr_eq(&self.definition, &other.definition)
    }

    /// The number of coordinates.
    pub fn dimension(&self) -> usize {
        self.definition.dimension
    }

    /// How many components its value has: 1 for an implicit object, 2 for a curve in space.
    pub fn components(&self) -> usize {
        match &self.definition.body {
            Value::List(components) => components.len(),
            _ => 1,
        }
    }

    /// The name under which it was defined.
    pub fn name(&self) -> Option<&str> {
        self.definition.name.as_deref()
    }

    /// The doc comment of its definition.
    pub fn documentation(&self) -> Option<&str> {
        self.definition.documentation.as_deref()
    }

    /// The box that `over` gives.
    pub fn domain(&self) -> Option<Bounds> {
        self.definition.domain
    }

    /// The body, over coordinates and parameters.
    pub fn body(&self) -> &Value {
        &self.definition.body
    }

    /// The same field with other values for some components of q.
    pub fn with(&self, changes: impl IntoIterator<Item = (usize, f64)>) -> FieldValue {
        let mut all = (*self.changes).clone();
        all.extend(changes);
        FieldValue {
            definition: Rc::clone(&self.definition),
            changes: Rc::new(all),
        }
    }

    /// The same field with these values for those components of q that it does not change yet.
    pub fn with_defaults(&self, changes: &[(usize, f64)]) -> FieldValue {
        let new = changes
            .iter()
            .filter(|(index, _)| !self.changes.contains_key(index));
        self.with(new.copied())
    }

    /// The field's body as a graph that the engine can evaluate.
    pub fn program(&self, graph: &mut Tracer) -> Outcome<Arc<Program>> {
        let mut roots = Vec::new();
        flatten(graph, &self.definition.body, &mut roots)?;
        Ok(graph.program(&roots, self.dimension()))
    }

    /// The fields that vanish together on what this one stands for, with their present q: two for
    /// a curve in space, else the one that [`FieldValue::compiled`] gives.
    pub fn surfaces(&self, graph: &mut Tracer, q: &[f64]) -> Outcome<Vec<CompiledField>> {
        if self.dimension() != 3 || self.components() != 2 {
            return Ok(vec![self.compiled(graph, q)?]);
        }
        let mut roots = Vec::new();
        flatten(graph, &self.definition.body, &mut roots)?;
        let compiled = |root| {
            let program = graph.program(&[root], self.dimension());
            let q = self.present(&program, q);
            CompiledField::new(program, q)
        };
        Ok(roots.into_iter().map(compiled).collect())
    }

    /// The scalar field with its present q, for samplers and polygonizers.
    ///
    /// Fails where the body is not a scalar.
    pub fn compiled(&self, graph: &mut Tracer, q: &[f64]) -> Outcome<CompiledField> {
        if let Value::List(components) = &self.definition.body {
            let message = format!(
                "expected a field whose value is one number, but this one has {} components",
                components.len()
            );
            let mut error = failure(Code::NotAField, message);
            error.help = Some(match (self.dimension(), components.len()) {
                (3, 2) => "this is a curve in space, which can be evaluated, differentiated, \
                           sampled and polygonized; take one of its surfaces, `f[0]` or `f[1]`"
                    .into(),
                _ => "take one component, as in `f[0]`, or their length, `norm(f)`".into(),
            });
            return Err(error);
        }
        let program = self.program(graph)?;
        let q = self.present(&program, q);
        Ok(CompiledField::new(program, q))
    }

    /// The field at a point, given as one list or as coordinates.
    ///
    /// `plain` evaluates the compiled body where all arguments are numbers; otherwise, and where
    /// symbols are involved, the arguments are substituted, so that derivatives see through.
    pub fn call(
        &self,
        graph: &mut Tracer,
        arguments: &[Value],
        q: &[f64],
        plain: bool,
    ) -> Outcome<Value> {
        if arguments.iter().any(is_field) {
            return lift_settled(graph, arguments, &mut |graph, bodies| {
                self.call(graph, bodies, q, false)
            });
        }
        let coordinates = self.coordinates(arguments)?;
        if coordinates.iter().any(Value::is_unknown) {
            return Ok(Value::Unknown);
        }
        if coordinates.iter().any(is_field) {
            return lift_settled(graph, &coordinates, &mut |graph, bodies| {
                self.call(graph, bodies, q, false)
            });
        }
        if coordinates
            .iter()
            .any(|value| matches!(value, Value::Interval(_)))
        {
            return self.enclose(graph, &coordinates, q);
        }
        if plain
            && coordinates
                .iter()
                .all(|value| matches!(value, Value::Number(_)))
        {
            return self.evaluate(graph, &coordinates, q);
        }
        let replacements = coordinates
            .iter()
            .map(|value| node_of(graph, value))
            .collect::<Outcome<Vec<_>>>()?;
        self.substituted(graph, &replacements, true)
    }

    /// The body over the coordinates of the present level, with changed parameters written in as
    /// constants if asked for.
    fn body_here(&self, graph: &mut Tracer, settle: bool) -> Outcome<Value> {
        let here = self.definition.level == graph.level;
        if here && (!settle || self.changes.is_empty()) {
            return Ok(self.definition.body.clone());
        }
        let coordinates = graph.coordinates(self.dimension());
        self.substituted(graph, &coordinates, settle)
    }

    fn coordinates(&self, arguments: &[Value]) -> Outcome<Vec<Value>> {
        let coordinates = match arguments {
            [Value::List(point)] => point.to_vec(),
            [Value::Unknown] => vec![Value::Unknown; self.dimension()],
            scalars => scalars.to_vec(),
        };
        if coordinates.len() == self.dimension() {
            return Ok(coordinates);
        }
        let message = format!(
            "the field{} is defined in R{}, but the point has {} coordinate{}",
            self.name()
                .map(|name| format!(" `{name}`"))
                .unwrap_or_default(),
            self.dimension(),
            coordinates.len(),
            if coordinates.len() == 1 { "" } else { "s" },
        );
        Err(failure(Code::WrongDimension, message))
    }

    /// The program's q: the session's values, with the changes that `with` made.
    /// The field's q, in the order of a program's parameters; `q` is the session's.
    pub fn present(&self, program: &Program, q: &[f64]) -> Vec<f64> {
        program
            .parameters()
            .iter()
            .map(|&index| {
                let index = index as usize;
                self.changes.get(&index).copied().unwrap_or(q[index])
            })
            .collect()
    }

    fn evaluate(&self, graph: &mut Tracer, coordinates: &[Value], q: &[f64]) -> Outcome<Value> {
        let point: Vec<f64> = coordinates.iter().map(number_of).collect::<Outcome<_>>()?;
        let program = self.program(graph)?;
        let mut outputs = vec![0.0; program.outputs()];
        program.evaluate(&point, &self.present(&program, q), &mut outputs);
        let mut outputs = outputs.into_iter().map(Value::Number);
        Ok(rebuild(&self.definition.body, &mut outputs))
    }

    fn enclose(&self, graph: &mut Tracer, coordinates: &[Value], q: &[f64]) -> Outcome<Value> {
        let sides: Vec<Interval> = coordinates
            .iter()
            .map(interval_of)
            .collect::<Outcome<_>>()?;
        let program = self.program(graph)?;
        let mut outputs = vec![Interval::EMPTY; program.outputs()];
        program.enclose(&sides, &self.present(&program, q), &mut outputs);
        let mut outputs = outputs.into_iter().map(Value::Interval);
        Ok(rebuild(&self.definition.body, &mut outputs))
    }

    /// The body with its coordinates replaced, and changed parameters by constants if asked for.
    fn substituted(
        &self,
        graph: &mut Tracer,
        coordinates: &[NodeId],
        settle: bool,
    ) -> Outcome<Value> {
        let mut roots = Vec::new();
        flatten(graph, &self.definition.body, &mut roots)?;
        let constants: BTreeMap<usize, NodeId> = self
            .changes
            .iter()
            .filter(|_| settle)
            .map(|(&index, &value)| (index, graph.constant(value)))
            .collect();
        let first = first_axis(self.definition.level);
        let roots = graph.substitute(&roots, |leaf| match leaf {
            Node::Coordinate(axis) => usize::from(axis)
                .checked_sub(first)
                .and_then(|place| coordinates.get(place).copied()),
            Node::Parameter(index) => constants.get(&(index as usize)).copied(),
            _ => None,
        });
        let mut values = roots.into_iter().map(|node| value_of_node(graph, node));
        Ok(rebuild(&self.definition.body, &mut values))
    }
}

/// Applies `operation` to the bodies of the fields among the operands (other operands stay as
/// they are) and makes a field of the result: arithmetic on fields is pointwise.
///
/// The result's domain is the smallest box that holds those of the operands, if all have one.
/// What `with` changed stays changeable where all operands agree on it; else it is written in.
pub fn lift(
    graph: &mut Tracer,
    operands: &[Value],
    operation: &mut dyn FnMut(&mut Tracer, &[Value]) -> Outcome<Value>,
) -> Outcome<Value> {
    let fields = operands.iter().filter_map(as_field);
    let changes: Vec<&Rc<BTreeMap<usize, f64>>> = fields.map(|field| &field.changes).collect();
    let agree = changes.windows(2).all(|pair| pair[0] == pair[1])
        && !operands.iter().any(Value::is_symbolic);
    match changes.first() {
        Some(changes) if agree => {
            let result = lift_bodies(graph, operands, false, operation)?;
            Ok(match result {
                Value::Field(field) => Value::Field(FieldValue {
                    changes: Rc::clone(changes),
                    ..field
                }),
                other => other,
            })
        }
        _ => lift_settled(graph, operands, operation),
    }
}

/// [`lift`] with what `with` changed written into the bodies, for operations that bring in
/// parameters of their own.
fn lift_settled(
    graph: &mut Tracer,
    operands: &[Value],
    operation: &mut dyn FnMut(&mut Tracer, &[Value]) -> Outcome<Value>,
) -> Outcome<Value> {
    lift_bodies(graph, operands, true, operation)
}

fn lift_bodies(
    graph: &mut Tracer,
    operands: &[Value],
    settle: bool,
    operation: &mut dyn FnMut(&mut Tracer, &[Value]) -> Outcome<Value>,
) -> Outcome<Value> {
    let fields: Vec<&FieldValue> = operands.iter().filter_map(as_field).collect();
    let Some((first, rest)) = fields.split_first() else {
        return operation(graph, operands);
    };
    let dimension = first.dimension();
    if let Some(other) = rest.iter().find(|field| field.dimension() != dimension) {
        let message = format!(
            "a field in R{dimension} and a field in R{} in one expression",
            other.dimension()
        );
        return Err(failure(Code::WrongDimension, message));
    }
    let domain = rest.iter().fold(first.domain(), |domain, field| {
        Some(domain?.union(&field.domain()?))
    });
    let bodies = operands
        .iter()
        .map(|operand| match operand {
            Value::Field(field) => field.body_here(graph, settle),
            other => Ok(other.clone()),
        })
        .collect::<Outcome<Vec<_>>>()?;
    let body = operation(graph, &bodies)?;
    if body.is_unknown() {
        return Ok(Value::Unknown);
    }
    FieldValue::new(dimension, graph.level, body, domain).map(Value::Field)
}

fn as_field(value: &Value) -> Option<&FieldValue> {
    match value {
        Value::Field(field) => Some(field),
        _ => None,
    }
}

fn is_field(value: &Value) -> bool {
    as_field(value).is_some()
}

/// The derivative of a field's body with respect to nodes, one level of lists deeper than the
/// body: for a scalar body the gradient, for a list the Jacobian (a row for each component).
///
/// One reverse sweep for each component.
pub fn derivatives(graph: &mut Tracer, body: &Value, variables: &[NodeId]) -> Outcome<Value> {
    match body {
        Value::List(components) => components
            .iter()
            .map(|component| derivatives(graph, component, variables))
            .collect::<Outcome<_>>()
            .map(Value::list),
        scalar => {
            let root = node_of(graph, scalar)?;
            let partials = derive::reverse(graph, root, variables);
            Ok(Value::list(
                partials
                    .into_iter()
                    .map(|node| value_of_node(graph, node))
                    .collect(),
            ))
        }
    }
}

/// The value of a calculus operator that maps a field's body, with the coordinates as
/// variables, to another body: a field again.
pub fn differentiate(
    graph: &mut Tracer,
    field: &FieldValue,
    operator: impl Fn(&mut Tracer, &Value, &[NodeId]) -> Outcome<Value>,
) -> Outcome<Value> {
    let variables = graph.coordinates(field.dimension());
    lift(
        graph,
        &[Value::Field(field.clone())],
        &mut |graph, bodies| operator(graph, &bodies[0], &variables),
    )
}

/// The scalars of a value made of numbers, symbols and lists, as nodes, in order.
pub fn flatten(graph: &mut Tracer, value: &Value, nodes: &mut Vec<NodeId>) -> Outcome<()> {
    match value {
        Value::List(elements) => elements
            .iter()
            .try_for_each(|element| flatten(graph, element, nodes)),
        scalar => {
            nodes.push(node_of(graph, scalar)?);
            Ok(())
        }
    }
}

/// A value of the given shape, with `scalars` in order for its numbers.
pub fn rebuild(shape: &Value, scalars: &mut dyn Iterator<Item = Value>) -> Value {
    match shape {
        Value::List(elements) => Value::list(
            elements
                .iter()
                .map(|element| rebuild(element, scalars))
                .collect(),
        ),
        _ => scalars.next().unwrap_or(Value::Unknown),
    }
}

fn is_numeric(value: &Value) -> bool {
    match value {
        Value::Number(_) | Value::Symbol(_) => true,
        Value::List(elements) => !elements.is_empty() && elements.iter().all(is_numeric),
        _ => false,
    }
}

/// A box from one interval for all axes or a list of one per axis.
pub fn bounds_of(value: &Value, dimension: usize) -> Outcome<Bounds> {
    let sides: Vec<(f64, f64)> = match value {
        Value::Interval(side) => vec![(side.low, side.high); dimension],
        Value::List(sides) => sides
            .iter()
            .map(|side| match side {
                Value::Interval(side) => Ok((side.low, side.high)),
                other => Err(wrong_kind("an interval for each axis", other)),
            })
            .collect::<Outcome<_>>()?,
        other => return Err(wrong_kind("an interval, or one for each axis", other)),
    };
    if sides.len() != dimension {
        let message = format!(
            "the field is defined in R{dimension}, but the box has {} side{}",
            sides.len(),
            if sides.len() == 1 { "" } else { "s" }
        );
        return Err(failure(Code::WrongDimension, message));
    }
    Bounds::from_sides(&sides).ok_or_else(|| {
        failure(
            Code::BadValue,
            "each side of a box must be finite and longer than 0",
        )
    })
}
