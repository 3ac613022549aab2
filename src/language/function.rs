//! Functions as values, and how arguments find their parameters.

use std::rc::Rc;
use std::sync::Arc;

use super::builtin::Builtin;
use super::scope::Scope;
use super::show::show_number;
use super::value::{Outcome, Value, failure, wrong_kind};
use crate::diagnostic::suggest;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::syntax::tree::{
    BinaryOperator, ComparisonOperator, Expression, ExpressionKind, Function, Name, Pattern,
    TextPart, UnaryOperator,
};

/// Something that can be called.
#[derive(Clone, Debug)]
pub enum FunctionValue {
    /// A `fn` or `x -> …` with the scope in which it was made.
    Closure(Rc<Closure>),
    /// A function of the program itself.
    Builtin(&'static Builtin),
    /// A derivative operator applied to a function, waiting for the point that tells in how
    /// many dimensions the function lives.
    Derivative {
        /// `grad` and its like.
        operator: &'static Builtin,
        /// What is differentiated.
        function: Rc<FunctionValue>,
        /// The operator's other arguments.
        others: Rc<[Argument]>,
    },
    /// An operation on the values of functions.
    Pointwise(Rc<Pointwise>),
}

/// An operation on the values that functions have at the same arguments: `f | g`.
#[derive(Debug)]
pub struct Pointwise {
    /// What is done with the values.
    pub rule: Rule,
    /// Functions, and what is not a function and stays as it is.
    pub operands: Vec<Argument>,
}

/// What a [`Pointwise`] function does with its operands.
#[derive(Clone, Debug)]
pub enum Rule {
    /// `-f`, `!f`, `not f`
    Unary(UnaryOperator),
    /// `f + g` and the like.
    Binary(BinaryOperator),
    /// `f < g` and the like.
    Comparison(ComparisonOperator),
    /// `norm(f)`
    Builtin(&'static Builtin),
    /// `f.x`
    Property(Name),
    /// `f[0]`
    Element(i64),
}

/// A function of a file.
#[derive(Debug)]
pub struct Closure {
    /// Its name, if it has one.
    pub name: Option<Arc<str>>,
    /// Parameters and body.
    pub function: Arc<Function>,
    /// Where free names of the body are looked up.
    pub scope: Rc<Scope>,
    /// The doc comment.
    pub documentation: Option<Arc<str>>,
}

impl Closure {
    /// The name for messages.
    pub fn shown_name(&self) -> &str {
        self.name.as_deref().unwrap_or("this function")
    }

    /// How the function is called: `name(parameters)`.
    pub fn signature(&self) -> String {
        let parameters = self.function.parameters.iter().map(|parameter| {
            let name = match &parameter.pattern {
                Pattern::Name(name) => &*name.text,
                Pattern::List(..) => "[…]",
            };
            match &parameter.default {
                _ if parameter.rest => format!("{name}.."),
                None => name.to_string(),
                Some(default) => format!("{name} = {}", short(default)),
            }
        });
        let parameters: Vec<String> = parameters.collect();
        format!("{}({})", self.shown_name(), parameters.join(", "))
    }
}

/// A default as text, if it is made of literals and names only; else `…`.
fn short(expression: &Expression) -> String {
    match &*expression.kind {
        ExpressionKind::Number(number) => show_number(*number, None),
        ExpressionKind::Bool(value) => value.to_string(),
        ExpressionKind::Name(name) => name.text.to_string(),
        ExpressionKind::Text(parts) => match parts.as_slice() {
            [TextPart::Literal(text)] => format!("\"{text}\""),
            _ => "…".into(),
        },
        ExpressionKind::Unary {
            operator: UnaryOperator::Negate,
            operand,
        } => format!("-{}", short(operand)),
        ExpressionKind::List(elements) => {
            let elements: Vec<String> = elements.iter().map(short).collect();
            format!("[{}]", elements.join(", "))
        }
        _ => "…".into(),
    }
}

impl FunctionValue {
    /// The name for messages.
    pub fn name(&self) -> &str {
        match self {
            FunctionValue::Closure(closure) => closure.shown_name(),
            FunctionValue::Builtin(builtin) => builtin.name,
            FunctionValue::Derivative { operator, .. } => operator.name,
            FunctionValue::Pointwise(_) => "this function",
        }
    }
}

impl FunctionValue {
    /// How many arguments it needs; where it needs none, how many it can take.
    pub fn parameter_count(&self) -> usize {
        match self {
            FunctionValue::Closure(closure) => {
                let parameters = &closure.function.parameters;
                let needed = parameters
                    .iter()
                    .filter(|one| one.default.is_none() && !one.rest);
                match needed.count() {
                    0 => parameters.len(),
                    count => count,
                }
            }
            FunctionValue::Builtin(builtin) => builtin.parameters.len(),
            FunctionValue::Derivative { function, .. } => function.parameter_count(),
            FunctionValue::Pointwise(pointwise) => {
                let operands = pointwise.operands.iter();
                let counts = operands.map(|operand| match &operand.value {
                    Value::Function(function) => function.parameter_count(),
                    _ => 0,
                });
                counts.max().unwrap_or(0)
            }
        }
    }
}

/// An evaluated argument.
#[derive(Clone, Debug)]
pub struct Argument {
    /// The name it was given, if any.
    pub name: Option<Arc<str>>,
    /// Its value.
    pub value: Value,
    /// Where it is written.
    pub span: Span,
}

/// Puts arguments in the order of the parameters called `names`: those without a name first
/// fill the places from the left, then named ones their own. `None` where no argument was given.
pub fn match_arguments(
    function: &str,
    names: &[Option<&str>],
    arguments: Vec<Argument>,
) -> Outcome<Vec<Option<Argument>>> {
    let mut places: Vec<Option<Argument>> = vec![None; names.len()];
    let mut next = 0;
    for argument in arguments {
        let place = match &argument.name {
            None if next < names.len() => {
                next += 1;
                next - 1
            }
            None => {
                let message = format!(
                    "`{function}` takes {} argument{}, but here is one more",
                    names.len(),
                    if names.len() == 1 { "" } else { "s" }
                );
                return Err(
                    failure(Code::TooManyArguments, message).at(argument.span, "one too many")
                );
            }
            Some(name) => match names.iter().position(|known| *known == Some(&**name)) {
                Some(place) => place,
                None => return Err(unknown_argument(function, names, name, argument.span)),
            },
        };
        if places[place].is_some() {
            let name = names[place].unwrap_or("it");
            let message = format!("`{function}` is given the argument `{name}` twice");
            return Err(
                failure(Code::TooManyArguments, message).at(argument.span, "the second time")
            );
        }
        places[place] = Some(argument);
    }
    Ok(places)
}

fn unknown_argument(
    function: &str,
    names: &[Option<&str>],
    name: &str,
    span: Span,
) -> Box<Diagnostic> {
    let known: Vec<&str> = names.iter().flatten().copied().collect();
    let message = format!("`{function}` has no argument `{name}`");
    let mut error = failure(Code::UnknownArgument, message).at(span, "not an argument of it");
    error.help = Some(match suggest::nearest(name, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None if known.is_empty() => format!("`{function}` takes no named arguments"),
        None => format!("its arguments are {}", known.join(", ")),
    });
    error
}

/// The names of a function's parameters, for [`match_arguments`]; patterns have none, and
/// neither has `name..`.
pub fn parameter_names(function: &Function) -> Vec<Option<&str>> {
    function
        .parameters
        .iter()
        .map(|parameter| match &parameter.pattern {
            Pattern::Name(name) if !parameter.rest => Some(&*name.text),
            _ => None,
        })
        .collect()
}

/// The value as a function, for builtins that take one.
pub fn function_of(value: &Value) -> Outcome<&FunctionValue> {
    match value {
        Value::Function(function) => Ok(function),
        other => Err(wrong_kind("a function", other)),
    }
}

/// Giving an error its place.
pub trait At {
    /// Labels the place, unless the error already knows a more precise one.
    fn at(self, span: Span, label: &str) -> Self;
}

impl At for Box<Diagnostic> {
    fn at(mut self, span: Span, label: &str) -> Self {
        if self.labels.is_empty() {
            *self = (*self).label(span, label);
        }
        self
    }
}

impl<T> At for Outcome<T> {
    fn at(self, span: Span, label: &str) -> Self {
        self.map_err(|error| error.at(span, label))
    }
}
