//! Answers that change texts: other names, and what was probably meant.

use std::collections::HashMap;
use std::io::Write;

use lsp_server::ErrorCode;
use lsp_types::request::{self, Request as _};
use lsp_types::{
    CodeAction, CodeActionKind, CodeActionOrCommand, CodeActionParams, PrepareRenameResponse,
    RenameParams, TextDocumentPositionParams, TextEdit, Uri, WorkspaceEdit,
};
use serde_json::Value as Json;

use super::answers::location;
use super::server::{Failure, Server, answer as answered};
use crate::diagnostic::SourceId;
use crate::formatter;
use crate::syntax::words::is_name;

/// Answers a request that asks for changes; nothing if it is none of these.
pub(super) fn answer<W: Write>(
    server: &mut Server<W>,
    method: &str,
    params: Json,
) -> Option<Result<Json, Failure>> {
    use request as r;
    Some(match method {
        r::PrepareRenameRequest::METHOD => {
            answered::<r::PrepareRenameRequest>(params, |params| prepare_rename(server, &params))
        }
        r::Rename::METHOD => answered::<r::Rename>(params, |params| rename(server, &params)),
        r::Formatting::METHOD => {
            answered::<r::Formatting>(params, |params| format(server, &params.text_document.uri))
        }
        r::CodeActionRequest::METHOD => {
            answered::<r::CodeActionRequest>(params, |params| actions(server, &params))
        }
        _ => return None,
    })
}

/// One edit of the whole text, or none where it has mistakes, which are reported anyway, or the
/// style already.
fn format<W: Write>(
    server: &mut Server<W>,
    address: &Uri,
) -> Result<Option<Vec<TextEdit>>, Failure> {
    let (_, document) = server.document(address)?;
    let Ok(formatted) = formatter::format(SourceId(0), &document.text) else {
        return Ok(None);
    };
    if formatted == *document.text {
        return Ok(Some(Vec::new()));
    }
    let whole = 0..document.text.len();
    let range = document.lines.range(&document.text, &whole);
    Ok(Some(vec![TextEdit::new(range, formatted)]))
}

fn refused(reason: String) -> Failure {
    Failure::new(ErrorCode::RequestFailed, reason)
}

fn prepare_rename<W: Write>(
    server: &mut Server<W>,
    at: &TextDocumentPositionParams,
) -> Result<Option<PrepareRenameResponse>, Failure> {
    let (path, document) = server.document(&at.text_document.uri)?;
    let offset = document.lines.offset(&document.text, at.position);
    let range = server.project.renamed(&path, offset).map_err(refused)?;
    let (_, document) = server.document(&at.text_document.uri)?;
    let range = document.lines.range(&document.text, &range);
    Ok(Some(PrepareRenameResponse::Range(range)))
}

#[allow(
    clippy::mutable_key_type,
    reason = "the protocol's structure has addresses as keys, and they are not changed"
)]
fn rename<W: Write>(
    server: &mut Server<W>,
    params: &RenameParams,
) -> Result<Option<WorkspaceEdit>, Failure> {
    let at = &params.text_document_position;
    let (path, document) = server.document(&at.text_document.uri)?;
    let offset = document.lines.offset(&document.text, at.position);
    let places = server.project.rename(&path, offset, &params.new_name);
    let mut changes: HashMap<Uri, Vec<TextEdit>> = HashMap::new();
    for place in places.map_err(refused)? {
        let location = location(server, &place).ok_or_else(|| {
            let name = place.path.display();
            refused(format!("{name} cannot be read any more"))
        })?;
        let edits = changes.entry(location.uri).or_default();
        edits.push(TextEdit::new(location.range, params.new_name.clone()));
    }
    Ok(Some(WorkspaceEdit::new(changes)))
}

/// For each diagnostic that knows what was meant: writing that.
#[allow(
    clippy::mutable_key_type,
    reason = "the protocol's structure has addresses as keys, and they are not changed"
)]
fn actions<W: Write>(
    server: &Server<W>,
    params: &CodeActionParams,
) -> Result<Option<Vec<CodeActionOrCommand>>, Failure> {
    let (_, document) = server.document(&params.text_document.uri)?;
    let wanted = params.context.only.as_ref();
    if wanted.is_some_and(|kinds| !kinds.contains(&CodeActionKind::QUICKFIX)) {
        return Ok(Some(Vec::new()));
    }
    let near = document.reports.iter().filter(|report| {
        let range = report.diagnostic.range;
        range.start <= params.range.end && params.range.start <= range.end
    });
    let actions = near.filter_map(|report| {
        let replacement = report.replacement.clone()?;
        let range = report.diagnostic.range;
        let written = &document.text[document.lines.bytes(&document.text, range)];
        // The text may have been changed since it was checked.
        if !is_name(written) || !is_name(&replacement) {
            return None;
        }
        let edit = TextEdit::new(range, replacement.clone());
        let changes = HashMap::from([(document.uri.clone(), vec![edit])]);
        Some(CodeActionOrCommand::CodeAction(CodeAction {
            title: format!("write `{replacement}` instead of `{written}`"),
            kind: Some(CodeActionKind::QUICKFIX),
            diagnostics: Some(vec![report.diagnostic.clone()]),
            edit: Some(WorkspaceEdit::new(changes)),
            is_preferred: Some(true),
            ..CodeAction::default()
        }))
    });
    Ok(Some(actions.collect()))
}
