//! Answers to what is asked of a text: what is known of it, in the protocol's words.

use std::io::Write;
use std::path::Path;

use lsp_server::ErrorCode;
use lsp_types::request::{self, Request as _};
use lsp_types::{
    CompletionItem, CompletionItemKind, CompletionList, CompletionResponse, CompletionTextEdit,
    DocumentHighlight, DocumentSymbol, DocumentSymbolResponse, Documentation, FoldingRange,
    FoldingRangeKind, GotoDefinitionResponse, Hover, HoverContents, Location, MarkupContent,
    MarkupKind, ParameterInformation, ParameterLabel, SemanticToken, SemanticTokenType,
    SemanticTokens, SemanticTokensRangeResult, SemanticTokensResult, SignatureHelp,
    SignatureInformation, SymbolKind, TextDocumentPositionParams, TextEdit, Uri,
};
use serde_json::Value as Json;

use super::position::Lines;
use super::server::{Document, Failure, Server, answer as answered};
use super::{address, edits};
use crate::assist::index::{Binding, Target};
use crate::assist::project::{File, Place, Symbol};
use crate::assist::{
    Class, Kind, call_at, complete, folds, highlight, parameter_ranges, vocabulary,
};
use crate::language::reference;
use crate::syntax::walk::Role;

/// The most completions that are sent at once.
const MOST_COMPLETIONS: usize = 1_000;

/// Answers a request.
pub(super) fn answer<W: Write>(
    server: &mut Server<W>,
    method: &str,
    params: Json,
) -> Result<Json, Failure> {
    use request as r;
    match method {
        r::HoverRequest::METHOD => answered::<r::HoverRequest>(params, |params| {
            hover(server, &params.text_document_position_params)
        }),
        r::GotoDefinition::METHOD => answered::<r::GotoDefinition>(params, |params| {
            definition(server, &params.text_document_position_params)
        }),
        r::References::METHOD => answered::<r::References>(params, |params| {
            let with_binding = params.context.include_declaration;
            references(server, &params.text_document_position, with_binding)
        }),
        r::DocumentHighlightRequest::METHOD => {
            answered::<r::DocumentHighlightRequest>(params, |params| {
                same_names(server, &params.text_document_position_params)
            })
        }
        r::DocumentSymbolRequest::METHOD => {
            answered::<r::DocumentSymbolRequest>(params, |params| {
                symbols(server, &params.text_document.uri)
            })
        }
        r::Completion::METHOD => answered::<r::Completion>(params, |params| {
            completions(server, &params.text_document_position)
        }),
        r::ResolveCompletionItem::METHOD => {
            answered::<r::ResolveCompletionItem>(params, |item| Ok(resolved(item)))
        }
        r::SignatureHelpRequest::METHOD => answered::<r::SignatureHelpRequest>(params, |params| {
            signature(server, &params.text_document_position_params)
        }),
        r::FoldingRangeRequest::METHOD => answered::<r::FoldingRangeRequest>(params, |params| {
            let (_, document) = server.document(&params.text_document.uri)?;
            Ok(Some(foldings(document)))
        }),
        r::SemanticTokensFullRequest::METHOD => {
            answered::<r::SemanticTokensFullRequest>(params, |params| {
                let (_, document) = server.document(&params.text_document.uri)?;
                let tokens = tokens(server, document, 0..document.text.len());
                Ok(Some(SemanticTokensResult::Tokens(tokens)))
            })
        }
        r::SemanticTokensRangeRequest::METHOD => {
            answered::<r::SemanticTokensRangeRequest>(params, |params| {
                let (_, document) = server.document(&params.text_document.uri)?;
                let bytes = document.lines.bytes(&document.text, params.range);
                let tokens = tokens(server, document, bytes);
                Ok(Some(SemanticTokensRangeResult::Tokens(tokens)))
            })
        }
        _ => edits::answer(server, method, params).unwrap_or_else(|| {
            let message = format!("`{method}` is not known");
            Err(Failure::new(ErrorCode::MethodNotFound, message))
        }),
    }
}

/// A file of the project in which a place lies, with its lines.
pub(super) fn location<W: Write>(server: &mut Server<W>, place: &Place) -> Option<Location> {
    let range = place.start..place.end;
    if let Some(document) = server.documents.get(&place.path) {
        let range = document.lines.range(&document.text, &range);
        return Some(Location::new(document.uri.clone(), range));
    }
    let file = server.project.file(&place.path)?;
    let lines = Lines::new(&file.text, server.encoding);
    let uri = address::uri(&place.path)?;
    Some(Location::new(uri, lines.range(&file.text, &range)))
}

fn markdown(value: String) -> MarkupContent {
    MarkupContent {
        kind: MarkupKind::Markdown,
        value,
    }
}

fn hover<W: Write>(
    server: &mut Server<W>,
    at: &TextDocumentPositionParams,
) -> Result<Option<Hover>, Failure> {
    let (path, document) = server.document(&at.text_document.uri)?;
    let offset = document.lines.offset(&document.text, at.position);
    let Some((symbol, range)) = server.project.symbol(&path, offset) else {
        return Ok(None);
    };
    let value = value(server, &path, offset, &symbol);
    let text = match &symbol {
        Symbol::Language(name) => about(name),
        Symbol::Bound(home, place) => {
            let file = server.project.file(home);
            file.and_then(|file| {
                let binding = file.index().bindings.get(*place)?;
                Some(about_binding(&file, binding, value))
            })
        }
    };
    let (_, document) = server.document(&at.text_document.uri)?;
    Ok(text.map(|text| Hover {
        contents: HoverContents::Markup(markdown(text)),
        range: Some(document.lines.range(&document.text, &range)),
    }))
}

/// Kind and value of a name of the whole file or of a module, if the last check found them.
fn value<W: Write>(
    server: &mut Server<W>,
    path: &Path,
    offset: usize,
    symbol: &Symbol,
) -> Option<String> {
    let file = server.project.file(path)?;
    let index = file.index();
    let name = match (&index.at(offset)?.target, symbol) {
        (Target::Member(import, name), _) => {
            format!("{}.{name}", index.bindings.get(*import)?.name)
        }
        (Target::Own(place), Symbol::Bound(..)) => {
            let binding = index.bindings.get(*place)?;
            binding.is_global.then(|| binding.name.to_string())?
        }
        _ => return None,
    };
    let values = &server.documents.get(path)?.values;
    let known = values.iter().find(|known| *known.name == *name)?;
    // The signature of a function is shown anyway.
    (known.kind != Kind::Function).then(|| known.detail.clone())
}

/// What the reference says of a name of the language.
fn about(name: &str) -> Option<String> {
    let known = vocabulary::find(name)?;
    Some(match known.kind {
        Kind::Constant | Kind::Module => {
            let documentation = known.documentation.as_deref().unwrap_or_default();
            format!("### `{name}`\n\n{}\n\n{documentation}", known.detail)
        }
        _ => reference::about(name)?,
    })
}

fn about_binding(file: &File, binding: &Binding, value: Option<String>) -> String {
    const LONGEST: usize = 200;
    let statement = file.text.get(binding.statement.clone()).unwrap_or_default();
    let head = statement.lines().next().unwrap_or_default();
    let head: String = head
        .trim_end_matches('{')
        .trim_end()
        .chars()
        .take(LONGEST)
        .collect();
    let name = &binding.name;
    let mut text = match binding.role {
        Role::Argument => format!("`{name}`: a parameter of the function in\n\n"),
        Role::Coordinate => format!("`{name}`: the point, or a coordinate, of the field in\n\n"),
        Role::Loop => format!("`{name}`: what is gone through in\n\n"),
        _ => String::new(),
    };
    text += &format!("```imp\n{head}\n```\n");
    if let Some(value) = value {
        text += &format!("\n{value}\n");
    }
    if let Some(documentation) = &binding.documentation {
        text += &format!("\n{documentation}\n");
    }
    text
}

fn definition<W: Write>(
    server: &mut Server<W>,
    at: &TextDocumentPositionParams,
) -> Result<Option<GotoDefinitionResponse>, Failure> {
    let (path, document) = server.document(&at.text_document.uri)?;
    let offset = document.lines.offset(&document.text, at.position);
    let Some(place) = server.project.definition(&path, offset) else {
        return Ok(None);
    };
    let location = location(server, &place);
    Ok(location.map(GotoDefinitionResponse::Scalar))
}

fn references<W: Write>(
    server: &mut Server<W>,
    at: &TextDocumentPositionParams,
    with_binding: bool,
) -> Result<Option<Vec<Location>>, Failure> {
    let (path, document) = server.document(&at.text_document.uri)?;
    let offset = document.lines.offset(&document.text, at.position);
    let mut places = server.project.references(&path, offset);
    if !with_binding {
        let binding = server.project.definition(&path, offset);
        places.retain(|place| Some(place) != binding.as_ref());
    }
    let locations = places.iter().filter_map(|place| location(server, place));
    Ok(Some(locations.collect()))
}

fn same_names<W: Write>(
    server: &mut Server<W>,
    at: &TextDocumentPositionParams,
) -> Result<Option<Vec<DocumentHighlight>>, Failure> {
    let (path, document) = server.document(&at.text_document.uri)?;
    let offset = document.lines.offset(&document.text, at.position);
    let Some(file) = server.project.file(&path) else {
        return Ok(None);
    };
    let Some(found) = file.index().at(offset) else {
        return Ok(None);
    };
    let (_, document) = server.document(&at.text_document.uri)?;
    let places = file.index().places(&found.target);
    let highlights = places.map(|range| DocumentHighlight {
        range: document.lines.range(&document.text, &range),
        kind: None,
    });
    Ok(Some(highlights.collect()))
}

fn symbols<W: Write>(
    server: &mut Server<W>,
    uri: &Uri,
) -> Result<Option<DocumentSymbolResponse>, Failure> {
    let (path, _) = server.document(uri)?;
    let Some(file) = server.project.file(&path) else {
        return Ok(None);
    };
    let (_, document) = server.document(uri)?;
    let index = file.index();
    let definitions = index.bindings.iter().filter(|binding| binding.is_global);
    let definitions = definitions.map(|binding| {
        let kind = match binding.role {
            Role::Parameter | Role::Setting => SymbolKind::PROPERTY,
            Role::Module => SymbolKind::MODULE,
            Role::Function => SymbolKind::FUNCTION,
            Role::Field => SymbolKind::CLASS,
            Role::Value => SymbolKind::CONSTANT,
            _ => SymbolKind::VARIABLE,
        };
        let whole = binding.statement.start.min(binding.range.start)
            ..binding.statement.end.max(binding.range.end);
        symbol(document, &binding.name, kind, &whole, &binding.range)
    });
    let tests = index.tests.iter().map(|(name, whole)| {
        let own = name.span.start as usize..name.span.end as usize;
        symbol(document, &name.text, SymbolKind::METHOD, whole, &own)
    });
    let mut all: Vec<DocumentSymbol> = definitions.chain(tests).collect();
    all.sort_by_key(|symbol| (symbol.selection_range.start, symbol.selection_range.end));
    Ok(Some(DocumentSymbolResponse::Nested(all)))
}

#[allow(deprecated, reason = "the structure has no other way to be made")]
fn symbol(
    document: &Document,
    name: &str,
    kind: SymbolKind,
    whole: &std::ops::Range<usize>,
    own: &std::ops::Range<usize>,
) -> DocumentSymbol {
    DocumentSymbol {
        // The protocol forbids empty names.
        name: if name.trim().is_empty() {
            "(no name)"
        } else {
            name
        }
        .to_owned(),
        detail: None,
        kind,
        tags: None,
        deprecated: None,
        range: document.lines.range(&document.text, whole),
        selection_range: document.lines.range(&document.text, own),
        children: None,
    }
}

fn completions<W: Write>(
    server: &Server<W>,
    at: &TextDocumentPositionParams,
) -> Result<Option<CompletionResponse>, Failure> {
    let (path, document) = server.document(&at.text_document.uri)?;
    let offset = document.lines.offset(&document.text, at.position);
    let found = complete(&document.text, offset, &server.surroundings(&path));
    let is_incomplete = found.len() > MOST_COMPLETIONS;
    let items = found.into_iter().take(MOST_COMPLETIONS).enumerate();
    let items = items.map(|(place, one)| {
        // What the reference says of the language's own names is sent when it is asked for.
        let of_language = vocabulary::find(&one.label)
            .is_some_and(|known| known.kind == one.kind && known.detail == one.detail);
        let documentation = one.documentation.filter(|_| !of_language);
        CompletionItem {
            kind: Some(item_kind(one.kind)),
            detail: Some(one.detail),
            documentation: documentation
                .map(|text| Documentation::MarkupContent(markdown(text.to_string()))),
            sort_text: Some(format!("{place:05}")),
            text_edit: Some(CompletionTextEdit::Edit(TextEdit {
                range: document.lines.range(&document.text, &one.replace),
                new_text: one.label.clone(),
            })),
            data: of_language.then(|| Json::from(one.label.as_str())),
            label: one.label,
            ..CompletionItem::default()
        }
    });
    Ok(Some(CompletionResponse::List(CompletionList {
        is_incomplete,
        items: items.collect(),
    })))
}

fn item_kind(kind: Kind) -> CompletionItemKind {
    match kind {
        Kind::Keyword => CompletionItemKind::KEYWORD,
        Kind::Function => CompletionItemKind::FUNCTION,
        Kind::Field => CompletionItemKind::CLASS,
        Kind::Parameter | Kind::Setting | Kind::Property => CompletionItemKind::PROPERTY,
        Kind::Variable => CompletionItemKind::VARIABLE,
        Kind::Constant => CompletionItemKind::CONSTANT,
        Kind::Module => CompletionItemKind::MODULE,
        Kind::Argument => CompletionItemKind::FIELD,
        Kind::Choice => CompletionItemKind::VALUE,
        Kind::File => CompletionItemKind::FILE,
        Kind::Folder => CompletionItemKind::FOLDER,
    }
}

fn resolved(mut item: CompletionItem) -> CompletionItem {
    let name = item.data.as_ref().and_then(Json::as_str);
    if let Some(text) = name.and_then(about) {
        item.documentation = Some(Documentation::MarkupContent(markdown(text)));
    }
    item
}

fn signature<W: Write>(
    server: &Server<W>,
    at: &TextDocumentPositionParams,
) -> Result<Option<SignatureHelp>, Failure> {
    let (path, document) = server.document(&at.text_document.uri)?;
    let offset = document.lines.offset(&document.text, at.position);
    let call = call_at(&document.text, offset, &server.surroundings(&path));
    let Some(call) = call.filter(|call| !call.callee.parameters.is_empty()) else {
        return Ok(None);
    };
    let name = &call.callee.name;
    let label = format!("{name}({})", call.callee.parameters.join(", "));
    let units = |bytes: usize| server.encoding.length(&label[..bytes]) as u32;
    let parameters = parameter_ranges(&label).into_iter();
    let parameters = parameters.map(|range| ParameterInformation {
        label: ParameterLabel::LabelOffsets([units(range.start), units(range.end)]),
        documentation: None,
    });
    let parameters = parameters.collect();
    let active = call.parameter.map(|place| place as u32);
    let documentation = call.callee.documentation.map(|text| text.to_string());
    Ok(Some(SignatureHelp {
        signatures: vec![SignatureInformation {
            label,
            documentation: documentation.map(|text| Documentation::MarkupContent(markdown(text))),
            parameters: Some(parameters),
            active_parameter: active,
        }],
        active_signature: Some(0),
        active_parameter: active,
    }))
}

fn foldings(document: &Document) -> Vec<FoldingRange> {
    let all = folds(&document.text).into_iter();
    all.filter_map(|fold| {
        let range = document.lines.range(&document.text, &fold.range);
        // The line of a closing bracket stays visible.
        let end_line = match fold.is_comment {
            true => range.end.line,
            false => range.end.line.saturating_sub(1),
        };
        (end_line > range.start.line).then(|| FoldingRange {
            start_line: range.start.line,
            end_line,
            kind: fold.is_comment.then_some(FoldingRangeKind::Comment),
            ..FoldingRange::default()
        })
    })
    .collect()
}

/// The classes that colours are sent for, with their names in the protocol.
const TOKENS: &[(Class, SemanticTokenType)] = &[
    (Class::Keyword, SemanticTokenType::KEYWORD),
    (Class::Number, SemanticTokenType::NUMBER),
    (Class::String, SemanticTokenType::STRING),
    (Class::Interpolation, SemanticTokenType::MACRO),
    (Class::Comment, SemanticTokenType::COMMENT),
    (Class::Documentation, SemanticTokenType::COMMENT),
    (Class::Operator, SemanticTokenType::OPERATOR),
    (Class::Function, SemanticTokenType::FUNCTION),
    (Class::Field, SemanticTokenType::CLASS),
    (Class::Parameter, SemanticTokenType::PARAMETER),
    (Class::Variable, SemanticTokenType::VARIABLE),
    (Class::Property, SemanticTokenType::PROPERTY),
];

/// The names of the kinds of tokens, in the order of their numbers.
pub(super) fn token_types() -> Vec<SemanticTokenType> {
    TOKENS.iter().map(|(_, name)| name.clone()).collect()
}

fn tokens<W: Write>(
    server: &Server<W>,
    document: &Document,
    wanted: std::ops::Range<usize>,
) -> SemanticTokens {
    let text = &document.text;
    let (mut line, mut column) = (0, 0);
    let mut data = Vec::new();
    for one in highlight(text) {
        if one.range.end <= wanted.start || one.range.start >= wanted.end {
            continue;
        }
        let Some(number) = TOKENS.iter().position(|(class, _)| *class == one.class) else {
            continue;
        };
        let start = document.lines.position(text, one.range.start);
        if start.line != line {
            column = 0;
        }
        data.push(SemanticToken {
            delta_line: start.line - line,
            delta_start: start.character - column,
            length: server.encoding.length(&text[one.range]) as u32,
            token_type: number as u32,
            token_modifiers_bitset: 0,
        });
        (line, column) = (start.line, start.character);
    }
    SemanticTokens {
        result_id: None,
        data,
    }
}
