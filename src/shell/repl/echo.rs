//! What is said of a value or definition: its value and kind on a line.

use super::super::info::parameter_names;
use super::super::output;
use super::session::Repl;
use crate::diagnostic::shorten;
use crate::geometry::Bounds;
use crate::language::function::FunctionValue;
use crate::language::product::sides;
use crate::language::settings::quoted;
use crate::language::show::{show, show_number};
use crate::language::{Entered, FieldValue, Value};
use crate::syntax::tree::{Pattern, Statement, StatementKind};

/// Of longer lists only the beginning and the end are shown.
const LONGEST_LIST: usize = 8;

/// So many elements of a longer list are shown before its last.
const SHOWN: usize = 5;

/// Says what came of a statement: to a pipe only the values of expressions, whole.
pub(super) fn entered(repl: &mut Repl, entered: &Entered) {
    if !repl.is_typed {
        if !matches!(entered.value, Value::Nothing) {
            repl.data(&entered.value);
        }
        return;
    }
    let lines = match &entered.statement.kind {
        StatementKind::Expression(_) => match &entered.value {
            Value::Nothing => Vec::new(),
            value => vec![of_value(repl, "", value)],
        },
        _ => of_definition(repl, &entered.statement),
    };
    for line in lines {
        output::data(&line);
    }
    if !entered.renewed.is_empty() {
        let names: Vec<&str> = entered.renewed.iter().map(|name| &**name).collect();
        output::data(
            &repl
                .screen
                .dim(&format!("made again: {}", names.join(", "))),
        );
    }
}

/// What a statement has defined.
pub(super) fn of_definition(repl: &mut Repl, statement: &Statement) -> Vec<String> {
    match &statement.kind {
        StatementKind::Parameter { name, .. } => repl
            .workspace
            .session
            .parameters()
            .get(&name.text)
            .map(|parameter| {
                let range = match parameter.range {
                    Some((low, high)) => {
                        format!(
                            " in {}..{}",
                            show_number(low, None),
                            show_number(high, None)
                        )
                    }
                    None => String::new(),
                };
                let value = short(&parameter.value);
                repl.screen.with_kind(
                    &format!("{} = {value}", name.text),
                    &format!("param{range}"),
                )
            })
            .into_iter()
            .collect(),
        StatementKind::Setting { name, .. } => {
            let setting = repl.workspace.session.settings().get(&name.text);
            let line = setting.map(|setting| {
                let range = setting
                    .range
                    .as_ref()
                    .map(|range| format!(" in {}", range.shown()));
                let value = quoted(&setting.value);
                let kind = format!("setting{}", range.unwrap_or_default());
                repl.screen
                    .with_kind(&format!("{} = {value}", name.text), &kind)
            });
            line.into_iter().collect()
        }
        StatementKind::Let { pattern, .. } => pattern_names(pattern)
            .into_iter()
            .filter_map(|name| of_name(repl, &name))
            .collect(),
        StatementKind::Variable { name, .. }
        | StatementKind::Function { name, .. }
        | StatementKind::Field { name, .. }
        | StatementKind::Import { name, .. } => of_name(repl, &name.text).into_iter().collect(),
        StatementKind::Test { name, .. } => {
            let name = format!("\"{}\"", shorten(&name.text));
            vec![repl.screen.with_kind(&name, "test, run by `imp test`")]
        }
        _ => Vec::new(),
    }
}

fn pattern_names(pattern: &Pattern) -> Vec<String> {
    match pattern {
        Pattern::Name(name) => vec![name.text.to_string()],
        Pattern::List(patterns, _) => patterns.iter().flat_map(pattern_names).collect(),
    }
}

/// What a name of the session stands for.
fn of_name(repl: &mut Repl, name: &str) -> Option<String> {
    let value = repl.workspace.session.bound(name)?;
    Some(match &value {
        Value::Unknown => repl.screen.with_kind(name, "made when it is asked for"),
        value => of_value(repl, name, value),
    })
}

/// A value and its kind, with the name that it is bound to, if there is one.
pub(super) fn of_value(repl: &mut Repl, name: &str, value: &Value) -> String {
    let (text, kind) = match value {
        Value::Field(field) => (
            field.name().unwrap_or("field").to_string(),
            field_kind(repl, field),
        ),
        Value::Function(function) => (signature(function), "function".into()),
        Value::Module(module) => (module.name.to_string(), "module".into()),
        Value::Report(_) => {
            // A table of its own, below its name.
            let table = show(value, None);
            let begin = if name.is_empty() { "" } else { "\n" };
            (format!("{begin}{table}"), "report".into())
        }
        product if product.is_product() => {
            let shown = show(value, None);
            let (kind, properties) = shown.split_once(": ").unwrap_or((&shown, ""));
            (properties.to_string(), kind.to_string())
        }
        Value::List(elements) => (short(value), format!("list of {}", elements.len())),
        value => (
            short(value),
            value
                .kind()
                .trim_start_matches("a ")
                .trim_start_matches("an ")
                .to_string(),
        ),
    };
    let says_name = matches!(
        value,
        Value::Function(FunctionValue::Closure(_)) | Value::Module(_)
    );
    let text = match (name, value) {
        ("", _) => text,
        (name, Value::Field(_)) => name.to_string(),
        (name, _) if says_name && text.starts_with(name) => text,
        (name, Value::Symbol(_) | Value::Condition(_)) => name.to_string(),
        (name, _) => format!("{name} = {text}"),
    };
    repl.screen.with_kind(&text, &kind)
}

/// `field in R3 over -2..2, depends on r`
fn field_kind(repl: &mut Repl, field: &FieldValue) -> String {
    let mut kind = format!("field in R{}", field.dimension());
    if field.components() != 1 {
        kind += &format!(" of {} components", field.components());
    }
    if let Some(domain) = field.domain() {
        kind += &format!(" over {}", box_text(&domain));
    }
    // A field that cannot be compiled says so when it is used.
    if let Ok(names) = parameter_names(&mut repl.workspace, field)
        && !names.is_empty()
    {
        kind += &format!(", depends on {}", shorten(&names.join(", ")));
    }
    kind
}

/// A box: one interval where all sides are the same.
pub(super) fn box_text(bounds: &Bounds) -> String {
    let mut all = bounds.sides();
    match all.next() {
        Some((low, high)) if all.all(|side| side == (low, high)) => {
            format!("{}..{}", show_number(low, None), show_number(high, None))
        }
        _ => show(&sides(*bounds), None),
    }
}

fn signature(function: &FunctionValue) -> String {
    match function {
        FunctionValue::Builtin(builtin) => builtin.signature(),
        FunctionValue::Closure(closure) if closure.name.is_some() => closure.signature(),
        other => show(&Value::Function(other.clone()), None),
    }
}

/// A value on a line: of long lists and texts the beginning and the end.
pub(super) fn short(value: &Value) -> String {
    match value {
        Value::Text(text) => format!("\"{}\"", output::escaped(&shorten(text))),
        Value::List(elements) if elements.len() > LONGEST_LIST => {
            let first: Vec<String> = elements.iter().take(SHOWN).map(short).collect();
            let last = elements.last().map(short).unwrap_or_default();
            format!("[{}, …, {last}]", first.join(", "))
        }
        Value::List(elements) => {
            let elements: Vec<String> = elements.iter().map(short).collect();
            format!("[{}]", elements.join(", "))
        }
        other => show(other, None),
    }
}
