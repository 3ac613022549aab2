//! The conversation: its beginning and end, the open texts, and who answers what.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use lsp_server::{ErrorCode, Message, Notification, Request, Response};
use lsp_types::notification::{self, Notification as _};
use lsp_types::request::{self, Request as _};
use lsp_types::{
    CodeActionKind, CodeActionOptions, CodeActionProviderCapability, CompletionOptions,
    FoldingRangeProviderCapability, HoverProviderCapability, InitializeParams, InitializeResult,
    OneOf, PublishDiagnosticsParams, RenameOptions, SemanticTokensFullOptions,
    SemanticTokensLegend, SemanticTokensOptions, ServerCapabilities, ServerInfo,
    SignatureHelpOptions, TextDocumentContentChangeEvent, TextDocumentSyncCapability,
    TextDocumentSyncKind, TextDocumentSyncOptions, TextDocumentSyncSaveOptions, Uri,
};
use rustc_hash::FxHashMap;
use serde_json::{Value as Json, json};

use super::address;
use super::answers;
use super::checker::{Checker, Findings, Job};
use super::frame;
use super::position::{Encoding, Lines};
use super::report;
use crate::assist::project::{Project, plain};
use crate::assist::{Known, Surroundings};
use crate::shell::output;

/// Something that the conversation has to deal with.
pub(super) enum Event {
    /// The client says or asks something.
    Message(Message),
    /// The client sent what is no message; this answers it.
    Malformed(Json),
    /// Nothing more can be read, possibly because of an error.
    End(Option<io::Error>),
    /// A text has been checked.
    Checked(Findings),
}

/// Why a request cannot be answered.
#[derive(Debug)]
pub(super) struct Failure {
    code: i32,
    message: String,
}

impl Failure {
    pub(super) fn new(code: ErrorCode, message: impl Into<String>) -> Failure {
        Failure {
            code: code as i32,
            message: message.into(),
        }
    }
}

/// A text that the client has open.
pub(super) struct Document {
    pub(super) uri: Uri,
    pub(super) text: Arc<str>,
    pub(super) lines: Lines,
    /// The names that had values when the text was checked last.
    pub(super) values: Vec<Known>,
    /// What was wrong then, with what could be written instead.
    pub(super) reports: Vec<report::Report>,
    /// Counts the texts of this session.
    serial: i64,
    /// The version that the client gave.
    version: i32,
    /// The files that it imported when it was checked last.
    reads: Vec<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Fresh,
    Running,
    ShutDown,
}

/// One conversation.
pub(super) struct Server<W> {
    phase: Phase,
    output: W,
    checker: Checker,
    pub(super) encoding: Encoding,
    pub(super) project: Project,
    pub(super) documents: FxHashMap<PathBuf, Document>,
    /// The paths of the open texts by the addresses under which they were opened: what a path leads
    /// to may change meanwhile.
    addresses: FxHashMap<String, PathBuf>,
    serial: i64,
}

type Ended = Result<(), u8>;

impl<W: Write> Server<W> {
    pub(super) fn new(checker: Checker, output: W) -> Server<W> {
        Server {
            phase: Phase::Fresh,
            output,
            checker,
            encoding: Encoding::default(),
            project: Project::default(),
            documents: FxHashMap::default(),
            addresses: FxHashMap::default(),
            serial: 0,
        }
    }

    /// Deals with an event; tells how the conversation ended if it did.
    pub(super) fn take(&mut self, event: Event) -> Option<Ended> {
        let written = match event {
            Event::Message(Message::Request(request)) => self.request(request),
            Event::Message(Message::Notification(said)) => {
                if said.method == notification::Exit::METHOD {
                    return Some(self.end());
                }
                self.notification(said)
            }
            // Nothing is asked of the client, so there is nothing that it could answer.
            Event::Message(Message::Response(_)) => Ok(()),
            Event::Malformed(answer) => self.write(&answer),
            Event::Checked(findings) => self.checked(&findings),
            Event::End(error) => {
                if let Some(error) = error {
                    output::error_text(&format!("error: cannot read a message: {error}"));
                }
                return Some(self.end());
            }
        };
        // A client that does not listen any more is gone.
        written.is_err().then(|| self.end())
    }

    /// It is well if the client has announced the end.
    fn end(&self) -> Ended {
        match self.phase {
            Phase::ShutDown => Ok(()),
            Phase::Fresh | Phase::Running => Err(1),
        }
    }

    fn write(&mut self, message: &Json) -> io::Result<()> {
        frame::write(&mut self.output, message)
    }

    fn request(&mut self, request: Request) -> io::Result<()> {
        let Request { id, method, params } = request;
        let answer = match (self.phase, &*method) {
            (Phase::Fresh, request::Initialize::METHOD) => {
                answer::<request::Initialize>(params, |params| Ok(self.initialize(&params)))
            }
            (Phase::Fresh, _) => Err(Failure::new(
                ErrorCode::ServerNotInitialized,
                "the first request must be `initialize`",
            )),
            (Phase::Running, request::Shutdown::METHOD) => {
                self.phase = Phase::ShutDown;
                Ok(Json::Null)
            }
            (Phase::Running, request::Initialize::METHOD) | (Phase::ShutDown, _) => {
                let message = format!("`{method}` cannot be asked any more");
                Err(Failure::new(ErrorCode::InvalidRequest, message))
            }
            (Phase::Running, _) => answers::answer(self, &method, params),
        };
        let response = match answer {
            Ok(result) => Response {
                id,
                response_result: Ok(result),
            },
            Err(failure) => Response::new_err(id, failure.code, failure.message),
        };
        let mut message = serde_json::to_value(&response)?;
        if let Some(object) = message.as_object_mut() {
            object.insert("jsonrpc".into(), "2.0".into());
        }
        self.write(&message)
    }

    fn initialize(&mut self, params: &InitializeParams) -> InitializeResult {
        self.phase = Phase::Running;
        let general = params.capabilities.general.as_ref();
        let offered = general.and_then(|general| general.position_encodings.as_deref());
        self.encoding = Encoding::agreed(offered);
        let folders = params.workspace_folders.iter().flatten();
        self.project.folders = folders.map(|folder| address::path(&folder.uri)).collect();
        #[allow(deprecated, reason = "older clients give nothing else")]
        let root = params.root_uri.as_ref();
        if let (true, Some(root)) = (self.project.folders.is_empty(), root) {
            self.project.folders.push(address::path(root));
        }
        // A path without a folder is the address of something else.
        self.project.folders.retain(|folder| folder.is_dir());
        InitializeResult {
            capabilities: capabilities(self.encoding),
            server_info: Some(ServerInfo {
                name: "imp".into(),
                version: Some(env!("CARGO_PKG_VERSION").into()),
            }),
        }
    }

    fn notification(&mut self, said: Notification) -> io::Result<()> {
        if self.phase != Phase::Running {
            return Ok(());
        }
        let Notification { method, params } = said;
        match &*method {
            notification::DidOpenTextDocument::METHOD => {
                let said = parsed::<notification::DidOpenTextDocument>(params);
                said.map(|said| {
                    let item = said.text_document;
                    self.open(item.uri, item.version, item.text.into());
                })
            }
            notification::DidChangeTextDocument::METHOD => {
                let said = parsed::<notification::DidChangeTextDocument>(params);
                said.and_then(|said| {
                    let document = said.text_document;
                    self.change(&document.uri, document.version, said.content_changes)
                })
            }
            notification::DidCloseTextDocument::METHOD => {
                match parsed::<notification::DidCloseTextDocument>(params) {
                    Ok(said) => return self.close(said.text_document.uri),
                    Err(problem) => Err(problem),
                }
            }
            notification::DidSaveTextDocument::METHOD
            | notification::DidChangeWatchedFiles::METHOD => {
                self.check_all();
                Ok(())
            }
            // What is not known may be ignored.
            _ => Ok(()),
        }
        .or_else(|problem| self.complain(&format!("`{method}`: {problem}")))
    }

    /// Tells the client about what cannot be answered, because nothing was asked.
    fn complain(&mut self, message: &str) -> io::Result<()> {
        let params = json!({ "type": 2, "message": message });
        let method = notification::LogMessage::METHOD;
        self.write(&json!({ "jsonrpc": "2.0", "method": method, "params": params }))
    }

    /// The path of a text that is being opened; one that is open under another address already
    /// keeps its path.
    fn new_path(&self, uri: &Uri) -> PathBuf {
        if let Some(path) = self.addresses.get(uri.as_str()) {
            return path.clone();
        }
        let paths = [address::path(uri), address::written_path(uri)];
        let mut paths = paths.into_iter();
        let free = paths.find(|path| !self.documents.contains_key(path));
        free.unwrap_or_else(|| PathBuf::from(uri.as_str()))
    }

    fn open(&mut self, uri: Uri, version: i32, text: Arc<str>) {
        let path = self.new_path(&uri);
        self.addresses.insert(uri.as_str().to_owned(), path.clone());
        let document = Document {
            uri,
            lines: Lines::new(&text, self.encoding),
            text: Arc::clone(&text),
            values: Vec::new(),
            reports: Vec::new(),
            serial: 0,
            version,
            reads: Vec::new(),
        };
        self.documents.insert(path.clone(), document);
        self.project.open(path, text);
        self.check_all();
    }

    fn change(
        &mut self,
        uri: &Uri,
        version: i32,
        changes: Vec<TextDocumentContentChangeEvent>,
    ) -> Result<(), String> {
        let path = self.addresses.get(uri.as_str()).cloned();
        let path = path.ok_or_else(|| format!("{} is not open", uri.as_str()))?;
        let Some(document) = self.documents.get_mut(&path) else {
            return Err(format!("{} is not open", uri.as_str()));
        };
        let mut text = String::from(&*document.text);
        for change in changes {
            match change.range {
                None => {
                    text = change.text;
                    document.lines = Lines::new(&text, self.encoding);
                }
                Some(range) => {
                    let bytes = document.lines.bytes(&text, range);
                    document.lines.replace(&mut text, bytes, &change.text);
                }
            }
        }
        document.text = text.into();
        document.version = version;
        let text = Arc::clone(&document.text);
        self.project.open(path.clone(), text);
        let users = self
            .documents
            .iter()
            .filter(|(_, user)| user.reads.contains(&path));
        let mut users: Vec<PathBuf> = users.map(|(user, _)| user.clone()).collect();
        users.sort();
        self.check(&path);
        users.iter().for_each(|user| self.check(user));
        Ok(())
    }

    fn close(&mut self, uri: Uri) -> io::Result<()> {
        let Some(path) = self.addresses.remove(uri.as_str()) else {
            return self.complain(&format!("{} is not open", uri.as_str()));
        };
        self.documents.remove(&path);
        self.project.close(&path);
        self.checker.forget(&path);
        self.check_all();
        self.publish(PublishDiagnosticsParams::new(uri, Vec::new(), None))
    }

    fn publish(&mut self, params: PublishDiagnosticsParams) -> io::Result<()> {
        let method = notification::PublishDiagnostics::METHOD;
        self.write(&json!({ "jsonrpc": "2.0", "method": method, "params": params }))
    }

    /// Has all open texts checked.
    fn check_all(&mut self) {
        let mut paths: Vec<PathBuf> = self.documents.keys().cloned().collect();
        paths.sort();
        paths.iter().for_each(|path| self.check(path));
    }

    /// Has the newest text of a file checked.
    fn check(&mut self, path: &Path) {
        self.serial += 1;
        let texts = self.project.texts();
        let Some(document) = self.documents.get_mut(path) else {
            return;
        };
        document.serial = self.serial;
        self.checker.ask(Job {
            path: path.to_owned(),
            version: self.serial,
            text: Arc::clone(&document.text),
            texts,
            folders: self.project.folders.clone(),
        });
    }

    /// Tells the client what was found in its newest text.
    fn checked(&mut self, findings: &Findings) -> io::Result<()> {
        let Some(document) = self.documents.get_mut(&findings.path) else {
            return Ok(());
        };
        if document.serial != findings.version || self.phase != Phase::Running {
            return Ok(());
        }
        document.reads = report::read_files(findings);
        document.reports = report::reports(document, findings, self.encoding);
        // While a text is broken, what was known of it before is better than nothing.
        if !findings.values.is_empty() {
            document.values.clone_from(&findings.values);
        }
        let diagnostics = document.reports.iter().map(|one| one.diagnostic.clone());
        let params = PublishDiagnosticsParams::new(
            document.uri.clone(),
            diagnostics.collect(),
            Some(document.version),
        );
        self.publish(params)
    }

    /// The text at an address, with its path.
    pub(super) fn document(&self, uri: &Uri) -> Result<(PathBuf, &Document), Failure> {
        let path = self.addresses.get(uri.as_str());
        let found = path.and_then(|path| Some((path, self.documents.get(path)?)));
        match found {
            Some((path, document)) => Ok((path.clone(), document)),
            None => Err(Failure::new(
                ErrorCode::InvalidParams,
                format!("{} is not open", uri.as_str()),
            )),
        }
    }

    /// What lies around a file.
    pub(super) fn surroundings(&self, path: &Path) -> Surroundings {
        Surroundings {
            names: Vec::new(),
            directory: path.parent().map(plain).unwrap_or_default(),
            texts: self.project.texts(),
        }
    }
}

/// Answers a request whose parameters are understood.
pub(super) fn answer<R: request::Request>(
    params: Json,
    answer: impl FnOnce(R::Params) -> Result<R::Result, Failure>,
) -> Result<Json, Failure> {
    let params = serde_json::from_value(params)
        .map_err(|error| Failure::new(ErrorCode::InvalidParams, error.to_string()))?;
    serde_json::to_value(answer(params)?)
        .map_err(|error| Failure::new(ErrorCode::InternalError, error.to_string()))
}

fn parsed<N: notification::Notification>(params: Json) -> Result<N::Params, String> {
    serde_json::from_value(params).map_err(|error| error.to_string())
}

/// What the server can do.
fn capabilities(encoding: Encoding) -> ServerCapabilities {
    let sync = TextDocumentSyncOptions {
        open_close: Some(true),
        change: Some(TextDocumentSyncKind::INCREMENTAL),
        save: Some(TextDocumentSyncSaveOptions::Supported(true)),
        ..TextDocumentSyncOptions::default()
    };
    let letters = |letters: &str| Some(letters.chars().map(String::from).collect());
    let tokens = SemanticTokensOptions {
        legend: SemanticTokensLegend {
            token_types: answers::token_types(),
            token_modifiers: Vec::new(),
        },
        full: Some(SemanticTokensFullOptions::Bool(true)),
        range: Some(true),
        ..SemanticTokensOptions::default()
    };
    ServerCapabilities {
        position_encoding: Some(encoding.kind()),
        text_document_sync: Some(TextDocumentSyncCapability::Options(sync)),
        hover_provider: Some(HoverProviderCapability::Simple(true)),
        completion_provider: Some(CompletionOptions {
            resolve_provider: Some(true),
            trigger_characters: letters(".\"/{("),
            ..CompletionOptions::default()
        }),
        signature_help_provider: Some(SignatureHelpOptions {
            trigger_characters: letters("(,"),
            ..SignatureHelpOptions::default()
        }),
        definition_provider: Some(OneOf::Left(true)),
        references_provider: Some(OneOf::Left(true)),
        document_highlight_provider: Some(OneOf::Left(true)),
        document_symbol_provider: Some(OneOf::Left(true)),
        rename_provider: Some(OneOf::Right(RenameOptions {
            prepare_provider: Some(true),
            work_done_progress_options: Default::default(),
        })),
        document_formatting_provider: Some(OneOf::Left(true)),
        folding_range_provider: Some(FoldingRangeProviderCapability::Simple(true)),
        semantic_tokens_provider: Some(tokens.into()),
        code_action_provider: Some(CodeActionProviderCapability::Options(CodeActionOptions {
            code_action_kinds: Some(vec![CodeActionKind::QUICKFIX]),
            ..CodeActionOptions::default()
        })),
        ..ServerCapabilities::default()
    }
}
