//! Plain numbers that look like degrees where an angle in radians is expected.

use crate::diagnostic::{Code, Diagnostic};
use crate::syntax::tree::{Argument, Expression, ExpressionKind, Name, UnaryOperator};

/// Functions of an angle alone.
const OF_ANGLES: &[&str] = &["sin", "cos", "tan"];

/// Smaller numbers are taken for radians: a turn and a half is 9.4.
const LEAST: f64 = 10.0;

/// Degrees that people write by hand are multiples of this.
const STEP: f64 = 5.0;

/// The warning for a call of a function of the language by this name, if one of its angles is
/// written as a plain number that looks like degrees.
pub(super) fn warning(callee: &Name, arguments: &[Argument]) -> Option<Diagnostic> {
    let name = &*callee.text;
    let turns = name.starts_with("rotate") || name == "twist";
    if !turns && !OF_ANGLES.contains(&name) {
        return None;
    }
    let (value, argument) = arguments
        .iter()
        .find_map(|argument| Some((literal(&argument.value)?, argument)))
        .filter(|(value, _)| value.abs() >= LEAST && value % STEP == 0.0)?;
    let message = format!("`{name}` takes radians, but {value} looks like degrees");
    Some(
        Diagnostic::warning(Code::LooksLikeDegrees, message)
            .label(argument.value.span, "radians")
            .help(format!("write `{value}deg` if degrees are meant")),
    )
}

/// The value of a number as it is written, with or without a sign.
fn literal(expression: &Expression) -> Option<f64> {
    match &*expression.kind {
        ExpressionKind::Number(value) => Some(*value),
        ExpressionKind::Unary {
            operator: UnaryOperator::Negate,
            operand,
        } => match &*operand.kind {
            ExpressionKind::Number(value) => Some(-value),
            _ => None,
        },
        _ => None,
    }
}
