//! `imp info`

use serde_json::{Map, Value as Json};

use super::arguments::Info;
use super::output;
use super::workspace::Workspace;
use crate::language::json::{json, json_number};
use crate::language::product::sides;
use crate::language::settings::{SettingRange, quoted};
use crate::language::show::show;
use crate::language::{FieldValue, Mode, Value};

/// Lists fields, parameters and settings; fails with an exit code.
pub(super) fn info(command: &Info) -> Result<(), u8> {
    let mut workspace = Workspace::open(Some(&command.file), &command.common, Mode::Define)?;
    workspace.run()?;
    if command.common.json {
        let mut object = Map::new();
        object.insert("fields".into(), fields_json(&mut workspace)?);
        object.insert("parameters".into(), parameters_json(&workspace));
        object.insert("settings".into(), settings_json(&workspace));
        workspace.finish_json(&mut object);
        output::data(&Json::Object(object).to_string());
    } else {
        output::data(&text(&mut workspace)?);
    }
    Ok(())
}

/// The names of the components of q that a field depends on.
pub(super) fn parameter_names(
    workspace: &mut Workspace,
    field: &FieldValue,
) -> Result<Vec<String>, u8> {
    let program = field.program(workspace.session.graph());
    let program = program.map_err(|error| workspace.fail(&[*error]))?;
    let parameters = workspace.session.parameters();
    Ok(program
        .parameters()
        .iter()
        .map(|&index| parameters.component_name(index as usize))
        .collect())
}

fn fields_json(workspace: &mut Workspace) -> Result<Json, u8> {
    let mut list = Vec::new();
    for (name, field) in workspace.session.fields().clone() {
        let mut object = Map::new();
        object.insert("name".into(), name.to_string().into());
        object.insert("dimension".into(), field.dimension().into());
        object.insert("components".into(), field.components().into());
        if let Some(domain) = field.domain() {
            let sides: Vec<Json> = domain
                .sides()
                .map(|(low, high)| Json::from(vec![json_number(low), json_number(high)]))
                .collect();
            object.insert("domain".into(), sides.into());
        }
        if let Some(text) = field.documentation() {
            object.insert("documentation".into(), text.into());
        }
        let names = parameter_names(workspace, &field)?;
        object.insert("parameters".into(), names.into());
        list.push(Json::Object(object));
    }
    Ok(Json::Array(list))
}

fn parameters_json(workspace: &Workspace) -> Json {
    workspace
        .session
        .parameters()
        .iter()
        .map(|(name, parameter)| {
            let mut object = Map::new();
            object.insert("name".into(), name.to_string().into());
            object.insert("value".into(), json(&parameter.value));
            if let Some((low, high)) = parameter.range {
                let mut ends = Map::new();
                ends.insert("lo".into(), json_number(low));
                ends.insert("hi".into(), json_number(high));
                object.insert("range".into(), ends.into());
            }
            if let Some(text) = &parameter.documentation {
                object.insert("documentation".into(), text.to_string().into());
            }
            Json::Object(object)
        })
        .collect()
}

fn settings_json(workspace: &Workspace) -> Json {
    workspace
        .session
        .settings()
        .iter()
        .map(|(name, setting)| {
            let mut object = Map::new();
            object.insert("name".into(), name.to_string().into());
            object.insert("value".into(), json(&setting.value));
            if let Some(range) = &setting.range {
                let (key, range) = match range {
                    SettingRange::Between(ends) => ("range", json(&Value::Interval(*ends))),
                    SettingRange::OneOf(values) => ("values", json(&Value::List(values.clone()))),
                };
                object.insert(key.into(), range);
            }
            if let Some(text) = &setting.documentation {
                object.insert("documentation".into(), text.to_string().into());
            }
            Json::Object(object)
        })
        .collect()
}

fn text(workspace: &mut Workspace) -> Result<String, u8> {
    let mut lines = field_lines(workspace)?;
    lines.extend(parameter_lines(workspace));
    lines.extend(setting_lines(workspace));
    if lines.is_empty() {
        lines.push("no fields, no parameters and no settings".into());
    }
    Ok(lines.join("\n"))
}

fn field_lines(workspace: &mut Workspace) -> Result<Vec<String>, u8> {
    let mut lines = Vec::new();
    for (name, field) in workspace.session.fields().clone() {
        let domain = match field.domain() {
            Some(domain) => format!(" over {}", show(&sides(domain), None)),
            None => String::new(),
        };
        lines.push(format!("field {name} in R{}{domain}", field.dimension()));
        lines.extend(documentation_lines(field.documentation()));
        let names = parameter_names(workspace, &field)?;
        if !names.is_empty() {
            lines.push(format!("    depends on {}", names.join(", ")));
        }
    }
    Ok(lines)
}

/// The parameters, a line for each and its documentation below.
pub(super) fn parameter_lines(workspace: &Workspace) -> Vec<String> {
    let mut lines = Vec::new();
    for (name, parameter) in workspace.session.parameters().iter() {
        let range = match parameter.range {
            Some((low, high)) => format!(" in {low}..{high}"),
            None => String::new(),
        };
        let value = show(&parameter.value, None);
        lines.push(format!("param {name} = {value}{range}"));
        lines.extend(documentation_lines(parameter.documentation.as_deref()));
    }
    lines
}

/// The settings, a line for each and its documentation below.
pub(super) fn setting_lines(workspace: &Workspace) -> Vec<String> {
    let mut lines = Vec::new();
    for (name, setting) in workspace.session.settings().iter() {
        let range = match &setting.range {
            Some(range) => format!(" in {}", range.shown()),
            None => String::new(),
        };
        let value = quoted(&setting.value);
        lines.push(format!("setting {name} = {value}{range}"));
        lines.extend(documentation_lines(setting.documentation.as_deref()));
    }
    lines
}

fn documentation_lines(text: Option<&str>) -> impl Iterator<Item = String> {
    let lines = text.unwrap_or_default().lines();
    lines.map(|line| format!("    {line}"))
}
