//! The fields that are measured, for both programs.

use std::collections::HashMap;
use std::path::Path;

use fidget::context::{Context, Node};
use imp::graph::{self, Graph, NodeId, Op};

use crate::fields::{self, Example};

/// A field, as a graph of each program.
pub struct Subject {
    /// What it is called in the table.
    pub name: &'static str,
    /// Imp's graph.
    pub graph: Graph,
    /// The field in it.
    pub root: NodeId,
    /// The parameters: data for Imp, constants for fidget, to which that is an advantage.
    pub q: Vec<f64>,
    /// The number of coordinates.
    pub dimension: usize,
    /// fidget's graph.
    pub context: Context,
    /// The field in it.
    pub node: Node,
    /// The ratio that F in f32 should reach.
    pub goal: Option<f64>,
}

impl Subject {
    /// The plane field as a solid between −`half` and `half`.
    pub fn extruded(&self, half: f64) -> Result<Subject, String> {
        let (mut graph, mut context) = (self.graph.clone(), Context::new());
        let z = graph.coordinate(2);
        let thickness = graph.constant(half);
        let distance = graph.apply(Op::Abs, &[z]);
        let slab = graph.apply(Op::Subtract, &[distance, thickness]);
        let root = graph.apply(Op::Max, &[self.root, slab]);
        let tree = self
            .context
            .export(self.node)
            .map_err(|error| error.to_string())?;
        let plane = context.import(&tree);
        let z = context.z();
        let solid = context.abs(z).and_then(|z| context.sub(z, half as f32));
        let node = solid.and_then(|slab| context.max(plane, slab));
        Ok(Subject {
            name: "prospero, extruded",
            graph,
            root,
            q: self.q.clone(),
            dimension: 3,
            context,
            node: node.map_err(|error| error.to_string())?,
            goal: None,
        })
    }
}

/// The fields without files, then the one of the `.vm` file if there is one.
pub fn subjects(prospero: Option<&Path>) -> Result<Vec<Subject>, String> {
    let mut subjects = vec![
        subject("sphere", sphere(), None)?,
        subject("torus", fields::torus(), Some(6.0))?,
        subject("CSG of 100 spheres", fields::spheres(100), Some(1.75))?,
    ];
    if let Some(path) = prospero {
        subjects.push(read_prospero(path)?);
    }
    subjects.push(subject("14 Gaussians", fields::blobs(14), Some(20.0))?);
    subjects.push(subject("gyroid", gyroid(), Some(8.0))?);
    Ok(subjects)
}

/// √(x² + y² + z²) − 1
fn sphere() -> Example {
    let mut graph = Graph::new();
    let squares = [0, 1, 2].map(|axis| {
        let coordinate = graph.coordinate(axis);
        graph.apply(Op::Square, &[coordinate])
    });
    let sum = graph.apply(Op::Add, &[squares[0], squares[1]]);
    let sum = graph.apply(Op::Add, &[sum, squares[2]]);
    let distance = graph.apply(Op::SquareRoot, &[sum]);
    let radius = graph.constant(1.0);
    let root = graph.apply(Op::Subtract, &[distance, radius]);
    Example {
        name: "sphere",
        graph,
        root,
        q: Vec::new(),
    }
}

/// sin ωx cos ωy + sin ωy cos ωz + sin ωz cos ωx, with ω as parameter.
fn gyroid() -> Example {
    let mut graph = Graph::new();
    let frequency = graph.parameter(0);
    let angles = [0, 1, 2].map(|axis| {
        let coordinate = graph.coordinate(axis);
        graph.apply(Op::Multiply, &[frequency, coordinate])
    });
    let terms = [0, 1, 2].map(|axis: usize| {
        let sine = graph.apply(Op::Sin, &[angles[axis]]);
        let cosine = graph.apply(Op::Cos, &[angles[(axis + 1) % 3]]);
        graph.apply(Op::Multiply, &[sine, cosine])
    });
    let sum = graph.apply(Op::Add, &[terms[0], terms[1]]);
    let root = graph.apply(Op::Add, &[sum, terms[2]]);
    Example {
        name: "gyroid",
        graph,
        root,
        q: vec![4.0],
    }
}

fn subject(name: &'static str, example: Example, goal: Option<f64>) -> Result<Subject, String> {
    let mut context = Context::new();
    let node = translate(&example, &mut context)?;
    Ok(Subject {
        name,
        graph: example.graph,
        root: example.root,
        q: example.q,
        dimension: 3,
        context,
        node,
        goal,
    })
}

/// Each program reads the file by itself.
fn read_prospero(path: &Path) -> Result<Subject, String> {
    let mut graph = Graph::new();
    let coordinates = [0, 1, 2].map(|axis| graph.coordinate(axis));
    let allowed = imp::file::Allowed {
        lines: u64::MAX,
        bytes: u64::MAX,
    };
    let loaded = imp::file::load(path, &mut graph, coordinates, allowed);
    let imp::file::Loaded::Field(field) = loaded.map_err(|error| error.to_string())? else {
        return Err(format!("{} does not hold a field", path.display()));
    };
    let text = std::fs::read(path).map_err(|error| error.to_string())?;
    let (context, node) = Context::from_text(&text[..]).map_err(|error| error.to_string())?;
    Ok(Subject {
        name: "prospero",
        graph,
        root: field.root,
        q: Vec::new(),
        dimension: field.dimension,
        context,
        node,
        goal: Some(1.9),
    })
}

/// The example as fidget's graph, operation by operation.
fn translate(example: &Example, context: &mut Context) -> Result<Node, String> {
    let mut nodes: HashMap<NodeId, Node> = HashMap::new();
    for id in example.graph.reachable(&[example.root]) {
        let node = example.graph.node(id);
        let operand = |place: usize| nodes[&node.operands()[place]];
        let translated = match node {
            graph::Node::Constant(bits) => Ok(context.constant(f64::from_bits(bits) as f32)),
            graph::Node::Coordinate(axis) => Ok(context.axes()[usize::from(axis)]),
            graph::Node::Parameter(index) => Ok(context.constant(example.q[index as usize] as f32)),
            graph::Node::Apply(op, _) => match op {
                Op::Add => context.add(operand(0), operand(1)),
                Op::Subtract => context.sub(operand(0), operand(1)),
                Op::Multiply => context.mul(operand(0), operand(1)),
                Op::Divide => context.div(operand(0), operand(1)),
                Op::Negate => context.neg(operand(0)),
                Op::Square => context.square(operand(0)),
                Op::SquareRoot => context.sqrt(operand(0)),
                Op::Exp => context.exp(operand(0)),
                Op::Sin => context.sin(operand(0)),
                Op::Cos => context.cos(operand(0)),
                Op::Min => context.min(operand(0), operand(1)),
                Op::Max => context.max(operand(0), operand(1)),
                other => return Err(format!("no translation of {}", other.name())),
            },
        };
        nodes.insert(id, translated.map_err(|error| error.to_string())?);
    }
    Ok(nodes[&example.root])
}
