//! Diagnostics in the protocol's words.

use std::path::{Path, PathBuf};

use lsp_types::{
    Diagnostic as LspDiagnostic, DiagnosticRelatedInformation, DiagnosticSeverity, DiagnosticTag,
    Location, NumberOrString, Range as LspRange,
};

use super::address;
use super::checker::Findings;
use super::position::{Encoding, Lines};
use super::server::Document;
use crate::assist::project::plain;
use crate::diagnostic::{Code, Diagnostic, Label, Severity, SourceId};

/// One thing that is wrong.
pub(super) struct Report {
    pub(super) diagnostic: LspDiagnostic,
    /// What is probably meant instead of the text in the diagnostic's range.
    pub(super) replacement: Option<String>,
}

/// The text that was checked is the first one that was read.
const OWN: SourceId = SourceId(0);

/// The files that a text imports, directly or not.
pub(super) fn read_files(findings: &Findings) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for number in 1..findings.sources.len() {
        let source = findings.sources.get(SourceId(number as u32));
        files.push(plain(Path::new(&source.name)));
    }
    files
}

/// What was found in a text.
pub(super) fn reports(document: &Document, findings: &Findings, encoding: Encoding) -> Vec<Report> {
    let places = Places {
        document,
        findings,
        encoding,
    };
    let diagnostics = findings.diagnostics.iter();
    diagnostics.map(|one| places.report(one)).collect()
}

struct Places<'a> {
    document: &'a Document,
    findings: &'a Findings,
    encoding: Encoding,
}

impl Places<'_> {
    fn report(&self, diagnostic: &Diagnostic) -> Report {
        // What is wrong in an imported file is shown where it is imported.
        let labels = &diagnostic.labels;
        let own = labels.iter().find(|label| label.span.source == OWN);
        let is_elsewhere = own.is_none_or(|own| Some(own) != labels.first());
        let others = labels.iter().filter(|label| Some(*label) != own);
        let related: Vec<_> = others.filter_map(|label| self.related(label)).collect();
        let mut message = diagnostic.message.clone();
        if let Some(first) = labels.first().filter(|_| is_elsewhere) {
            let name = &self.findings.sources.get(first.span.source).name;
            message = format!("in {name}: {message}");
        } else if let Some(own) = own.filter(|own| !own.message.is_empty()) {
            message = format!("{message}: {}", own.message);
        }
        message = format!("{message}\nhelp: {}", diagnostic.advice());
        let (severity, tags) = severity(diagnostic);
        let code = diagnostic.code.as_str().to_owned();
        Report {
            diagnostic: LspDiagnostic {
                range: own.map_or_else(LspRange::default, |own| self.range(own)),
                severity: Some(severity),
                code: Some(NumberOrString::String(code)),
                source: Some("imp".into()),
                message,
                related_information: (!related.is_empty()).then_some(related),
                tags,
                ..LspDiagnostic::default()
            },
            replacement: match is_elsewhere {
                true => None,
                false => replacement(diagnostic),
            },
        }
    }

    fn range(&self, label: &Label) -> LspRange {
        let bytes = label.span.start as usize..label.span.end as usize;
        self.document.lines.range(&self.document.text, &bytes)
    }

    fn related(&self, label: &Label) -> Option<DiagnosticRelatedInformation> {
        let location = if label.span.source == OWN {
            Location::new(self.document.uri.clone(), self.range(label))
        } else {
            let source = self.findings.sources.get(label.span.source);
            let lines = Lines::new(&source.text, self.encoding);
            let bytes = label.span.start as usize..label.span.end as usize;
            let uri = address::uri(&plain(Path::new(&source.name)))?;
            Location::new(uri, lines.range(&source.text, &bytes))
        };
        Some(DiagnosticRelatedInformation {
            location,
            message: label.message.clone(),
        })
    }
}

/// How grave it is. The limits while a text is being written are tighter than those of a run, so
/// reaching one is no mistake of the text.
fn severity(diagnostic: &Diagnostic) -> (DiagnosticSeverity, Option<Vec<DiagnosticTag>>) {
    match (diagnostic.code, diagnostic.severity) {
        (
            Code::NodeLimit
            | Code::LengthLimit
            | Code::StepLimit
            | Code::TimeLimit
            | Code::InputLimit,
            _,
        ) => (DiagnosticSeverity::INFORMATION, None),
        (Code::UnusedParameter, _) => {
            let tags = vec![DiagnosticTag::UNNECESSARY];
            (DiagnosticSeverity::WARNING, Some(tags))
        }
        (_, Severity::Error) => (DiagnosticSeverity::ERROR, None),
        (_, Severity::Warning) => (DiagnosticSeverity::WARNING, None),
    }
}

/// The name in “did you mean `name`?”.
fn replacement(diagnostic: &Diagnostic) -> Option<String> {
    let rest = diagnostic.help.as_ref()?.strip_prefix("did you mean `")?;
    rest.strip_suffix("`?").map(str::to_owned)
}
