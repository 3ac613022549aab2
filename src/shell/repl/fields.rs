//! Commands about fields: what is known of them, pictures, meshes, samples.

use std::time::Instant;

use super::super::output;
use super::commands::documented_names;
use super::echo;
use super::pictures::Room;
use super::session::Repl;
use crate::diagnostic::suggest::nearest;
use crate::diagnostic::{Code, Diagnostic, shorten};
use crate::engine::compilations;
use crate::language::function::FunctionValue;
use crate::language::reference;
use crate::language::show::{show, show_number};
use crate::language::{FieldValue, Value};
use crate::syntax::tree::{Argument, Expression, ExpressionKind, StatementKind, TextPart, Tree};

/// The box around a point is so large in each direction, as a share of the field's domain or of 1.
const NEIGHBOURHOOD: f64 = 0.01;

/// What is said of a name.
pub(super) fn document(repl: &mut Repl, name: &str) -> Result<(), u8> {
    if name.is_empty() {
        return Err(repl.refuse(Code::Usage, "a name is needed", "as in `:doc sphere`"));
    }
    let own = repl.workspace.session.defines(name);
    if let Some(value) = repl.workspace.session.bound(name).filter(|_| own) {
        output::data(&echo::of_value(repl, name, &value));
        let documentation = match &value {
            Value::Field(field) => field.documentation().map(str::to_string),
            Value::Function(FunctionValue::Closure(closure)) => {
                closure.documentation.as_deref().map(str::to_string)
            }
            _ => None,
        };
        let statements = repl.workspace.session.statements();
        let of_definition = statements
            .iter()
            .find_map(|statement| match &statement.kind {
                StatementKind::Parameter { name: own, .. }
                | StatementKind::Setting { name: own, .. }
                    if *own.text == *name =>
                {
                    statement.documentation.as_deref().map(str::to_string)
                }
                _ => None,
            });
        if let Some(text) = documentation.or(of_definition) {
            output::data(&text);
        }
        return Ok(());
    }
    if let Some(text) = reference::about(name) {
        output::data(text.trim_end());
        return Ok(());
    }
    let mut names = documented_names();
    let own = repl.workspace.session.names();
    names.extend(own.iter().map(|name| name.to_string()));
    let help = match nearest(name, names.iter().map(String::as_str)) {
        Some(near) => format!("did you mean `{near}`?"),
        None => String::new(),
    };
    let message = format!("nothing is known of `{}`", shorten(name));
    Err(repl.refuse(Code::UnknownName, message, &help))
}

/// The field that a text gives; the only field of the session where there is no text.
fn field(repl: &mut Repl, text: &str) -> Result<FieldValue, u8> {
    if text.is_empty() {
        let only = repl.workspace.session.only_field();
        return only.map_err(|error| repl.workspace.fail(&[*error]));
    }
    match repl.value(text)? {
        Value::Field(field) => Ok(field),
        other => {
            let message = format!(
                "expected a field, but `{}` is {}",
                shorten(text),
                other.kind()
            );
            Err(repl.refuse(Code::WrongKind, message, ""))
        }
    }
}

/// `:bounds F`
pub(super) fn bounds(repl: &mut Repl, text: &str) -> Result<(), u8> {
    let field = field(repl, text)?;
    if let Some(domain) = field.domain() {
        output::data(&format!("over    {}", echo::box_text(&domain)));
    }
    let found = repl
        .workspace
        .session
        .call("bounds", vec![Value::Field(field)], &[]);
    let found = found.map_err(|errors| repl.workspace.fail(&errors))?;
    output::data(&format!("proven  {}", show(&found, None)));
    Ok(())
}

/// `:check [F]`
pub(super) fn check(repl: &mut Repl, text: &str) -> Result<(), u8> {
    let mut statements = repl.workspace.session.statements();
    statements.retain(|statement| match &statement.kind {
        StatementKind::Field { name, .. } => text.is_empty() || *name.text == *text,
        _ => false,
    });
    if statements.is_empty() {
        let message = match text {
            "" => "the session has no field".to_string(),
            name => format!("the session has no field `{}`", shorten(name)),
        };
        let names: Vec<String> = repl
            .workspace
            .session
            .fields()
            .keys()
            .map(|name| name.to_string())
            .collect();
        let help = match nearest(text, names.iter().map(String::as_str)) {
            Some(near) => format!("did you mean `{near}`?"),
            None => "define one, as in `field ball(p in R3) over -2..2 = norm(p) - 1`".into(),
        };
        return Err(repl.refuse(Code::WhichField, message, &help));
    }
    let before = repl.workspace.heard.warnings.take();
    let tree = Tree {
        statements,
        comments: Vec::new(),
    };
    let inspected = repl.workspace.session.inspect_fields(&tree);
    let found = repl.workspace.heard.warnings.replace(before).len();
    inspected.map_err(|error| repl.workspace.fail(&[*error]))?;
    let without_domain = tree.statements.iter().filter(|statement| {
        matches!(&statement.kind, StatementKind::Field { domain, .. } if domain.is_empty())
    });
    let checked = tree.statements.len() - without_domain.count();
    output::data(&format!(
        "{checked} field{} checked, {found} warning{}",
        if checked == 1 { "" } else { "s" },
        if found == 1 { "" } else { "s" }
    ));
    if checked < tree.statements.len() {
        output::data("fields without `over` are not checked: say where, as in `over -2..2`");
    }
    Ok(())
}

/// `:at F POINT`
pub(super) fn at(repl: &mut Repl, text: &str) -> Result<(), u8> {
    let Some((of, point)) = field_and_point(text) else {
        let help = "write the field and the point, as in `:at torus [1, 0, 0.2]`";
        return Err(repl.refuse(Code::Usage, "a field and a point are needed", help));
    };
    let field = field(repl, of)?;
    let point = repl.value(&point)?;
    let coordinates: Vec<f64> = match &point {
        Value::List(elements) => elements
            .iter()
            .filter_map(|element| match element {
                Value::Number(number) => Some(*number),
                _ => None,
            })
            .collect(),
        _ => Vec::new(),
    };
    if coordinates.len() != field.dimension() {
        let message = format!(
            "the field is defined in R{}, but the point is {}",
            field.dimension(),
            echo::short(&point)
        );
        return Err(repl.refuse(Code::WrongDimension, message, ""));
    }
    let reach = field.domain().map_or(1.0, |domain| domain.diagonal()) * NEIGHBOURHOOD;
    let numbers: Vec<String> = coordinates.iter().map(|x| show_number(*x, None)).collect();
    let sides: Vec<String> = coordinates
        .iter()
        .map(|x| {
            format!(
                "{}..{}",
                show_number(x - reach, None),
                show_number(x + reach, None)
            )
        })
        .collect();
    let numbers = numbers.join(", ");
    for (name, text) in [
        ("value", format!("({of})({numbers})")),
        ("gradient", format!("grad({of})({numbers})")),
        ("Hessian", format!("hessian({of})({numbers})")),
        ("bounds", format!("({of})({})", sides.join(", "))),
    ] {
        let value = repl.value(&text)?;
        let behind = match name {
            "bounds" => format!(
                "   within {} in each direction",
                show_number(reach, Some(4))
            ),
            _ => String::new(),
        };
        output::data(&format!("{name:9} {}{behind}", show(&value, None)));
    }
    Ok(())
}

/// `F [1, 2]`, `F, 1, 2` or `F(1, 2)` taken apart; the point as a list.
fn field_and_point(text: &str) -> Option<(&str, String)> {
    let text = text.trim();
    let (open, close) = match text.chars().next_back()? {
        ']' => ('[', ']'),
        ')' => ('(', ')'),
        _ => {
            let (field, point) = text.split_once(',')?;
            return Some((field.trim(), format!("[{point}]")));
        }
    };
    let mut depth = 0;
    let begin = text.char_indices().rev().find_map(|(at, letter)| {
        depth += usize::from(letter == close);
        depth -= usize::from(letter == open);
        (depth == 0).then_some(at)
    })?;
    let field = text[..begin].trim().trim_end_matches(',').trim_end();
    let inside = &text[begin + 1..text.len() - 1];
    (!field.is_empty()).then(|| (field, format!("[{inside}]")))
}

/// The arguments behind a command as those of a function of the language.
struct Call {
    expression: Expression,
    arguments: Vec<Argument>,
    /// The file that is named by a string behind the field.
    file: Option<Expression>,
}

/// Reads what stands behind a command as the arguments of `function`.
fn call(repl: &mut Repl, function: &str, text: &str) -> Result<Call, u8> {
    let text = match text {
        "" => only_name(repl)?,
        text => text.to_string(),
    };
    let expression = repl.expression(&format!("{function}({text})"))?;
    let ExpressionKind::Call { callee, arguments } = &*expression.kind else {
        let help = format!("write the field and arguments of `{function}`");
        return Err(repl.refuse(Code::Usage, "these are no arguments", &help));
    };
    let mut arguments = arguments.clone();
    let is_file = |argument: &Argument| {
        argument.name.is_none()
            && matches!(&*argument.value.kind, ExpressionKind::Text(parts)
                if parts.iter().all(|part| matches!(part, TextPart::Literal(_))))
    };
    let place = arguments.iter().skip(1).position(is_file);
    let file = place.map(|place| arguments.remove(place + 1).value);
    let kind = ExpressionKind::Call {
        callee: callee.clone(),
        arguments: arguments.clone(),
    };
    Ok(Call {
        expression: Expression {
            kind: kind.into(),
            ..expression.clone()
        },
        arguments,
        file,
    })
}

/// The name of the only field of the session.
fn only_name(repl: &mut Repl) -> Result<String, u8> {
    let field = field(repl, "")?;
    Ok(field.name().unwrap_or_default().to_string())
}

fn evaluated(repl: &mut Repl, expression: &Expression) -> Result<Value, u8> {
    let value = repl.workspace.session.evaluate(expression);
    value.map_err(|errors| repl.workspace.fail(&errors))
}

/// `:plot F, …`
pub(super) fn plot(repl: &mut Repl, text: &str) -> Result<(), u8> {
    let call = call(repl, "plot", text)?;
    let has = |name: &str| {
        let names = call
            .arguments
            .iter()
            .filter_map(|argument| argument.name.as_ref());
        names.into_iter().any(|known| *known.text == *name)
    };
    let mut expression = call.expression.clone();
    if let (false, Some(first)) = (has("path"), call.arguments.first()) {
        let dimension = match evaluated(repl, &first.value)? {
            Value::Field(field) => field.dimension(),
            _ => 3,
        };
        let mut options = String::new();
        if !has("size") {
            options += &format!(", size = {}", repl.size(dimension, Room::Full));
        }
        if !has("transparent") && repl.leaves_background(dimension) {
            options += ", transparent = true";
        }
        let mut arguments = call.arguments.clone();
        let more = repl.expression(&format!("plot(0{options})"))?;
        if let ExpressionKind::Call {
            arguments: more, ..
        } = &*more.kind
        {
            arguments.extend(more.iter().skip(1).cloned());
        }
        if let ExpressionKind::Call { callee, .. } = &*call.expression.kind {
            let callee = callee.clone();
            expression.kind = ExpressionKind::Call { callee, arguments }.into();
        }
    }
    match evaluated(repl, &expression)? {
        Value::Image(set) => repl.show_image(&set.picture.image, Room::Full),
        other => repl.data(&other),
    }
    Ok(())
}

/// `:mesh F, …`
pub(super) fn mesh(repl: &mut Repl, text: &str) -> Result<(), u8> {
    make(repl, "polygonize", text)
}

/// `:sample F, …`
pub(super) fn sample(repl: &mut Repl, text: &str) -> Result<(), u8> {
    make(repl, "sample", text)
}

fn make(repl: &mut Repl, function: &str, text: &str) -> Result<(), u8> {
    let call = call(repl, function, text)?;
    let value = evaluated(repl, &call.expression)?;
    repl.data(&value);
    if let Some(file) = call.file {
        let written = repl
            .workspace
            .session
            .call("export", vec![value], &[("path", file)]);
        written.map_err(|errors| repl.workspace.fail(&errors))?;
    }
    Ok(())
}

/// `:time EXPR`
pub(super) fn time(repl: &mut Repl, text: &str) -> Result<(), u8> {
    let expression = repl.expression(text)?;
    let compiled = compilations();
    let begun = Instant::now();
    let value = evaluated(repl, &expression)?;
    let seconds = begun.elapsed().as_secs_f64();
    let compiled = compilations() - compiled;
    if !matches!(value, Value::Nothing) {
        match repl.is_typed {
            true => output::data(&echo::of_value(repl, "", &value)),
            false => repl.data(&value),
        }
    }
    let evaluations = match crate::language::product::property(&value, "evaluations") {
        Some(Value::Number(count)) => format!(", {count} evaluations"),
        _ => String::new(),
    };
    let s = if compiled == 1 { "" } else { "s" };
    output::data(&format!(
        "{seconds:.3} s{evaluations}, {compiled} compilation{s}"
    ));
    Ok(())
}

/// `:graph F`
pub(super) fn graph(repl: &mut Repl, text: &str) -> Result<(), u8> {
    let field = field(repl, text)?;
    let program = field.program(repl.workspace.session.graph());
    let program = program.map_err(|error: Box<Diagnostic>| repl.workspace.fail(&[*error]))?;
    output::data(program.graph_text().trim_end());
    Ok(())
}

/// `:clif F`
pub(super) fn clif(repl: &mut Repl, text: &str) -> Result<(), u8> {
    let field = field(repl, text)?;
    let program = field.program(repl.workspace.session.graph());
    let program = program.map_err(|error| repl.workspace.fail(&[*error]))?;
    output::data(program.clif().trim_end());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn field_and_point_are_told_apart() {
        let expected = |field, point: &str| Some((field, point.to_string()));
        assert_eq!(field_and_point("f [1, 2]"), expected("f", "[1, 2]"));
        assert_eq!(field_and_point("f, [1, g(2)]"), expected("f", "[1, g(2)]"));
        assert_eq!(field_and_point("f(1, (2))"), expected("f", "[1, (2)]"));
        assert_eq!(field_and_point("f | g, 1, 2"), expected("f | g", "[ 1, 2]"));
        assert_eq!(field_and_point("a[0] [1, 2]"), expected("a[0]", "[1, 2]"));
        for wrong in ["", "f", "[1]", "f]", ")"] {
            assert_eq!(field_and_point(wrong), None, "{wrong}");
        }
    }
}
