//! The tree of a program: what was written, with the place of every part.
//!
//! Subtrees are shared ([`Arc`]) so that closures can keep their bodies. Depth is limited by the
//! parser, so recursion over a tree is safe with a bounded stack.

use std::sync::Arc;

use crate::diagnostic::Span;

/// A whole file.
#[derive(Clone, Debug, Default)]
pub struct Tree {
    /// Its statements, in order.
    pub statements: Vec<Statement>,
    /// Its comments, in order, for tools that print the program again.
    pub comments: Vec<Span>,
}

/// A name where it is written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Name {
    /// The name.
    pub text: Arc<str>,
    /// Its place.
    pub span: Span,
}

/// A string without interpolations, with its escapes resolved.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Literal {
    /// The characters.
    pub text: Arc<str>,
    /// Its place, with the quotes.
    pub span: Span,
}

/// A definition or something to do.
#[derive(Clone, Debug)]
pub struct Statement {
    /// What it is.
    pub kind: StatementKind,
    /// Where it stands, without its doc comment.
    pub span: Span,
    /// The text of the `##` lines right above it.
    pub documentation: Option<Arc<str>>,
}

/// The kinds of statements.
#[derive(Clone, Debug)]
pub enum StatementKind {
    /// `param name = value in range`
    Parameter {
        /// The name.
        name: Name,
        /// Number, vector or list of either.
        value: Expression,
        /// Where every component must lie.
        range: Option<Expression>,
    },
    /// `setting name = value in range`
    Setting {
        /// The name.
        name: Name,
        /// Number, bool or string.
        value: Expression,
        /// An interval, or the list of values that it may have.
        range: Option<Expression>,
    },
    /// `import "path" as name`
    Import {
        /// Relative to the file that imports.
        path: Literal,
        /// What the module is called here.
        name: Name,
    },
    /// `test "name" { … }`
    Test {
        /// What is tested, in words.
        name: Literal,
        /// What must succeed.
        body: Block,
    },
    /// `let pattern = value`
    Let {
        /// What is bound.
        pattern: Pattern,
        /// To what.
        value: Expression,
    },
    /// `var name = value`
    Variable {
        /// The name.
        name: Name,
        /// Its first value.
        value: Expression,
    },
    /// `target = value`, where the target is a name, or an element or property of one.
    Assignment {
        /// A name, index or property expression.
        target: Expression,
        /// The new value.
        value: Expression,
    },
    /// `fn name(parameters) = body` or `fn name(parameters) { … }`
    Function {
        /// The name.
        name: Name,
        /// The function itself; its body is a [`ExpressionKind::Block`] in the second form.
        function: Arc<Function>,
    },
    /// `field name(coordinates) over domain = body`
    Field {
        /// The name.
        name: Name,
        /// How the body speaks of the point.
        coordinates: Coordinates,
        /// One interval for all axes or one per axis; empty where there is no `over`.
        domain: Vec<Expression>,
        /// The value.
        body: Expression,
    },
    /// `for pattern in iterable { … }`
    For {
        /// What is bound each time.
        pattern: Pattern,
        /// A list.
        iterable: Expression,
        /// The loop's body.
        body: Block,
    },
    /// `while condition { … }`
    While {
        /// Asked before each round.
        condition: Expression,
        /// The loop's body.
        body: Block,
    },
    /// An expression on its own: a call, an `if`, or a block's last value.
    Expression(Expression),
    /// What could not be understood; already reported.
    Error,
}

/// How a field's body speaks of the point.
#[derive(Clone, Debug)]
pub enum Coordinates {
    /// `(x)`, `(x, y)`, `(x, y, z)`: a name for each coordinate.
    Named(Vec<Name>),
    /// `(p in R3)`: one name for the point.
    Point {
        /// The point's name.
        name: Name,
        /// 1, 2 or 3.
        dimension: usize,
    },
}

/// What `let`, `for` and parameters bind.
#[derive(Clone, Debug)]
pub enum Pattern {
    /// One name.
    Name(Name),
    /// `[a, b]`: the elements of a list, in order; the lengths must agree.
    List(Vec<Pattern>, Span),
}

/// Parameters and body of a `fn` or of `x -> …`.
#[derive(Clone, Debug)]
pub struct Function {
    /// The parameters, in order.
    pub parameters: Vec<FunctionParameter>,
    /// The value.
    pub body: Expression,
}

/// One parameter of a function.
#[derive(Clone, Debug)]
pub struct FunctionParameter {
    /// What the argument is bound to.
    pub pattern: Pattern,
    /// Used where the call gives none; evaluated in the function's own scope.
    pub default: Option<Expression>,
    /// `name..`: the list of all arguments without a name from here on.
    pub rest: bool,
}

/// `{ statements }`; its value is that of the last statement if that is an expression.
#[derive(Clone, Debug)]
pub struct Block {
    /// In order.
    pub statements: Vec<Statement>,
    /// With the braces.
    pub span: Span,
}

/// An expression: cheap to clone.
#[derive(Clone, Debug)]
pub struct Expression {
    /// What it is.
    pub kind: Arc<ExpressionKind>,
    /// Where it stands.
    pub span: Span,
}

/// The kinds of expressions.
#[derive(Clone, Debug)]
pub enum ExpressionKind {
    /// `1.5`, `1e-3`, `45deg`: the value, angles in radians.
    Number(f64),
    /// `true`, `false`
    Bool(bool),
    /// `"…{expr:.3}…"`
    Text(Vec<TextPart>),
    /// A name that is looked up.
    Name(Name),
    /// `[a, b, c]`
    List(Vec<Expression>),
    /// `[e for x in xs if c]`; also a bare one as the only argument of a call.
    Comprehension {
        /// The element.
        element: Expression,
        /// `for` and `if`, in order; the first is a `for`.
        clauses: Vec<Clause>,
    },
    /// `(e)`: kept, because `a < b < c` and `(a < b) < c` differ and for the printer.
    Group(Expression),
    /// `-e`, `!e`, `not e`
    Unary {
        /// Which.
        operator: UnaryOperator,
        /// Its operand.
        operand: Expression,
    },
    /// `a + b` and the like.
    Binary {
        /// Which.
        operator: BinaryOperator,
        /// Left operand.
        left: Expression,
        /// Right operand.
        right: Expression,
    },
    /// `a < b <= c`: every neighbouring pair must hold.
    Comparison {
        /// The leftmost operand.
        first: Expression,
        /// At least one operator with its right operand.
        rest: Vec<(ComparisonOperator, Expression)>,
    },
    /// `lo..hi`
    Interval {
        /// Lower end.
        low: Expression,
        /// Upper end.
        high: Expression,
    },
    /// `lo..hi by step`: a list.
    Steps {
        /// The interval.
        interval: Expression,
        /// The distance of two elements.
        step: Expression,
    },
    /// `e with {name = value, …}`
    With {
        /// A field.
        subject: Expression,
        /// New values of parameters and settings; those of a module have dots in their names.
        bindings: Vec<(Name, Expression)>,
    },
    /// `left |> right`: `right` called with `left` as its first argument.
    Pipe {
        /// The argument.
        left: Expression,
        /// A call, which gets one argument more, or a function.
        right: Expression,
    },
    /// `callee(arguments)`; `a.f(b)` is a call whose callee is a [`ExpressionKind::Property`].
    Call {
        /// What is called.
        callee: Expression,
        /// With what, in order.
        arguments: Vec<Argument>,
    },
    /// `e[index]`
    Index {
        /// A list.
        subject: Expression,
        /// A whole number; negative ones count from the end.
        index: Expression,
    },
    /// `e.name`
    Property {
        /// Whose.
        subject: Expression,
        /// Which.
        name: Name,
    },
    /// `x -> e`, `(x, y) -> e`
    Lambda(Arc<Function>),
    /// `if c then a else b`, `if c { … } else { … }`
    If {
        /// The condition.
        condition: Expression,
        /// Where it holds.
        consequence: Expression,
        /// Where it does not; only the form with braces may leave it out.
        alternative: Option<Expression>,
    },
    /// `{ let t = x^2; t + 1 }`
    Block(Block),
    /// What could not be understood; already reported.
    Error,
}

/// One part of a string.
#[derive(Clone, Debug)]
pub enum TextPart {
    /// Characters, with escapes resolved.
    Literal(Arc<str>),
    /// `{value:.precision}`
    Interpolation {
        /// What is shown.
        value: Expression,
        /// Digits after the point, if given.
        precision: Option<usize>,
    },
}

/// A part of a comprehension.
#[derive(Clone, Debug)]
pub enum Clause {
    /// `for pattern in iterable`
    For {
        /// What is bound each time.
        pattern: Pattern,
        /// A list.
        iterable: Expression,
    },
    /// `if condition`
    If(Expression),
}

/// One argument of a call.
#[derive(Clone, Debug)]
pub struct Argument {
    /// `name = value`
    pub name: Option<Name>,
    /// The value.
    pub value: Expression,
}

/// Operators with one operand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnaryOperator {
    /// `-a`
    Negate,
    /// `!a`: complement of a field, or `not`.
    Complement,
    /// `not a`
    Not,
}

/// Operators with two operands that are not comparisons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BinaryOperator {
    /// `a + b`
    Add,
    /// `a - b`
    Subtract,
    /// `a * b`
    Multiply,
    /// `a / b`
    Divide,
    /// `a % b`, floored
    Modulo,
    /// `a @ b`, the matrix product
    MatrixMultiply,
    /// `a ^ b`
    Power,
    /// `a | b`, union
    Union,
    /// `a & b`, intersection
    Intersection,
    /// `a \ b`, difference
    Difference,
    /// `a and b`
    And,
    /// `a or b`
    Or,
}

/// Comparisons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ComparisonOperator {
    /// `==`
    Equal,
    /// `!=`
    NotEqual,
    /// `<`
    Less,
    /// `<=`
    LessEqual,
    /// `>`
    Greater,
    /// `>=`
    GreaterEqual,
}
