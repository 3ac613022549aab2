//! What could be written at a place.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use rustc_hash::FxHashSet;

use super::highlight::Class;
use super::outline;
use super::scan::{Bound, Scan, Sort};
use super::surroundings::{Known, Surroundings, parameter_name};
use super::vocabulary;
use crate::syntax::words::{Word, WordKind, keywords, words};

/// Something that could be written.
#[derive(Clone, Debug)]
pub struct Completion {
    /// What would be written.
    pub label: String,
    /// What it is.
    pub kind: Kind,
    /// In a few words: a signature, or a kind and a value.
    pub detail: String,
    /// What its author says of it.
    pub documentation: Option<Arc<str>>,
    /// The bytes that it would replace.
    pub replace: Range<usize>,
}

/// What a name or another completion is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// A reserved word.
    Keyword,
    /// A function.
    Function,
    /// A field.
    Field,
    /// A parameter of the file.
    Parameter,
    /// A setting of the file.
    Setting,
    /// A name bound by `let`, `var`, a loop or as a function's parameter.
    Variable,
    /// A constant of the language.
    Constant,
    /// A module or a namespace of the library.
    Module,
    /// What is written behind a point.
    Property,
    /// The name of an argument.
    Argument,
    /// A string that a function understands, or a space.
    Choice,
    /// A file.
    File,
    /// A folder.
    Folder,
}

impl Kind {
    /// The colour of such a name.
    pub(super) fn class(self) -> Class {
        match self {
            Kind::Keyword => Class::Keyword,
            Kind::Function => Class::Function,
            Kind::Field => Class::Field,
            Kind::Parameter | Kind::Setting => Class::Parameter,
            Kind::Variable | Kind::Constant | Kind::Module => Class::Variable,
            Kind::Property | Kind::Argument => Class::Property,
            Kind::Choice | Kind::File | Kind::Folder => Class::String,
        }
    }
}

/// What could be written at `offset` and begins, whatever the case, like what stands there; the
/// nearest first: arguments, then names from the inside out, the language's own names, reserved
/// words. Takes time linear in the text.
pub fn complete(text: &str, offset: usize, surroundings: &Surroundings) -> Vec<Completion> {
    let offset = (0..=offset.min(text.len()))
        .rev()
        .find(|&place| text.is_char_boundary(place))
        .unwrap_or(0);
    let mut words = words(text);
    let in_comment = |word: &Word| {
        word.kind.is_comment() && word.range.start < offset && offset <= word.range.end
    };
    if words.iter().any(in_comment) {
        return Vec::new();
    }
    words.retain(|word| !word.kind.is_comment());
    let scan = Scan::new(text, &words, offset);
    Completer::new(scan, offset, surroundings).run()
}

/// A call that is being written.
#[derive(Clone, Debug)]
pub struct Call {
    /// What is called.
    pub callee: Known,
    /// Which of its parameters is being given, if it has so many.
    pub parameter: Option<usize>,
}

/// The innermost call of something known in whose parentheses `offset` lies. Takes time linear in
/// the text.
pub fn call_at(text: &str, offset: usize, surroundings: &Surroundings) -> Option<Call> {
    let mut words = words(text);
    words.retain(|word| !word.kind.is_comment());
    let scan = Scan::new(text, &words, offset);
    let mut completer = Completer::new(scan, offset, surroundings);
    // Lists and other brackets in an argument belong to the call.
    while let Some(frame) = completer.scan.frames.last() {
        if let Some(callee) = completer.callee() {
            let parameter = completer.parameter(frame.start, &callee);
            return Some(Call { callee, parameter });
        }
        completer.scan.frames.pop();
    }
    None
}

struct Completer<'text> {
    scan: Scan<'text>,
    offset: usize,
    surroundings: &'text Surroundings,
    /// The bytes of what is being written.
    replace: Range<usize>,
    found: Vec<Completion>,
    seen: FxHashSet<String>,
}

impl<'text> Completer<'text> {
    fn new(scan: Scan<'text>, offset: usize, surroundings: &'text Surroundings) -> Self {
        let written = scan.words.get(scan.before).filter(|word| {
            let is_name = matches!(
                word.kind,
                WordKind::Name | WordKind::LambdaName | WordKind::Keyword
            );
            is_name && word.range.start < offset && offset <= word.range.end
        });
        let replace = written.map_or(offset..offset, |word| word.range.clone());
        Completer {
            scan,
            offset,
            surroundings,
            replace,
            found: Vec::new(),
            seen: FxHashSet::default(),
        }
    }

    fn run(mut self) -> Vec<Completion> {
        let before = self.scan.before;
        if let Some(word) = self.scan.words.get(before)
            && word.kind == WordKind::Text
            && word.range.start < self.offset
        {
            self.in_string(word.range.clone());
            return self.found;
        }
        if self.is_in_number() {
            return self.found;
        }
        match before.checked_sub(1).map(|last| self.scan.shown(last)) {
            Some(".") => self.members(before - 1),
            Some("let" | "var" | "param" | "setting" | "fn" | "field" | "as") => {}
            Some("in") if self.is_in_field_head() => {
                for space in ["R1", "R2", "R3"] {
                    self.offer(&Known::new(space, Kind::Choice, "a space"));
                }
            }
            _ if self.is_in_declaration() => {}
            _ if self.wants_parameter() => self.parameters(),
            _ => self.anything(),
        }
        self.found
    }

    /// Whether what stands before the place is a number that could go on.
    fn is_in_number(&self) -> bool {
        let word = self
            .scan
            .before
            .checked_sub(1)
            .and_then(|last| self.scan.words.get(last));
        word.is_some_and(|word| word.kind == WordKind::Number && word.range.end == self.offset)
    }

    fn offer(&mut self, known: &Known) {
        self.offer_text(&known.name, known);
    }

    fn offer_text(&mut self, label: &str, known: &Known) {
        let prefix = &self.scan.text[self.replace.start..self.offset];
        if !begins_like(label, prefix) || !self.seen.insert(label.to_owned()) {
            return;
        }
        self.found.push(Completion {
            label: label.to_owned(),
            kind: known.kind,
            detail: known.detail.clone(),
            documentation: known.documentation.clone(),
            replace: self.replace.clone(),
        });
    }

    /// The place of the innermost open bracket.
    fn opener(&self) -> Option<usize> {
        self.scan.frames.last().and_then(|frame| frame.opener)
    }

    fn is_in_field_head(&self) -> bool {
        let opener = self.opener().filter(|&opener| opener >= 2);
        opener.is_some_and(|opener| self.scan.shown(opener - 2) == "field")
    }

    /// Whether names are being bound here: the parameters of a function, or coordinates.
    fn is_in_declaration(&self) -> bool {
        let Some(opener) = self.opener() else {
            return false;
        };
        let begins = matches!(self.last(), "(" | ",");
        let declares = opener >= 2 && matches!(self.scan.shown(opener - 2), "fn" | "field");
        begins && self.scan.shown(opener) == "(" && declares
    }

    /// The word before the place.
    fn last(&self) -> &'text str {
        let last = self.scan.before.checked_sub(1);
        last.map_or("", |last| self.scan.shown(last))
    }

    /// Whether the name of a parameter is expected, as in `with {`.
    fn wants_parameter(&self) -> bool {
        let begins = matches!(self.last(), "{" | ",");
        let opener = self.opener();
        begins && opener.is_some_and(|opener| self.scan.follows_with(opener))
    }

    fn parameters(&mut self) {
        let definitions: Vec<Bound> = self.scan.definitions().cloned().collect();
        for bound in &definitions {
            match bound.sort {
                Sort::Parameter | Sort::Setting => {
                    let known = outline::known(&self.scan, bound);
                    self.offer(&known);
                }
                Sort::Module => {
                    let name = &self.scan.text[bound.range.clone()];
                    for member in self.module_members(bound) {
                        if matches!(member.kind, Kind::Parameter | Kind::Setting) {
                            self.offer_text(&format!("{name}.{}", member.name), &member);
                        }
                    }
                }
                _ => {}
            }
        }
        let names = &self.surroundings.names;
        for known in names {
            if matches!(known.kind, Kind::Parameter | Kind::Setting) {
                self.offer(known);
            }
        }
    }

    fn anything(&mut self) {
        let last = self
            .scan
            .before
            .checked_sub(1)
            .and_then(|last| self.scan.words.get(last));
        let after_operand = last.is_some_and(|word| {
            word.kind == WordKind::Close
                || matches!(
                    word.kind,
                    WordKind::Name | WordKind::Number | WordKind::Text
                )
                || matches!(self.last(), "true" | "false")
        });
        // A `}` also ends statements.
        let is_start = self.is_at_statement();
        if after_operand && !is_start {
            return self.keywords(&[
                "and", "or", "with", "by", "then", "else", "for", "in", "if", "over", "as",
            ]);
        }
        self.arguments();
        self.names();
        if is_start {
            self.keywords(&["let", "var", "fn", "field", "for", "while"]);
            if self.scan.frames.len() == 1 {
                self.keywords(&["param", "setting", "import", "test"]);
            }
        }
        self.keywords(&["if", "not", "true", "false"]);
    }

    fn is_at_statement(&self) -> bool {
        let is_in_statements = match self.opener() {
            None => true,
            Some(opener) => {
                self.scan.shown(opener) == "{"
                    && self.scan.words[opener].kind == WordKind::Open
                    && !self.scan.follows_with(opener)
            }
        };
        let start = self.scan.frames.last().map_or(0, |frame| frame.start);
        is_in_statements && start == self.scan.before
    }

    fn keywords(&mut self, wanted: &[&str]) {
        for word in keywords().filter(|word| wanted.contains(word)) {
            self.offer(&Known::new(word, Kind::Keyword, "a word of the language"));
        }
    }

    /// The names of the arguments of the function that is being called.
    fn arguments(&mut self) {
        if !matches!(self.last(), "(" | ",") {
            return;
        }
        let Some(callee) = self.callee() else {
            return;
        };
        // The `=` may stand there already.
        let next = self.scan.before + usize::from(!self.replace.is_empty());
        let is_named = next < self.scan.words.len() && self.scan.shown(next) == "=";
        for parameter in &callee.parameters {
            let name = parameter_name(parameter);
            let is_plain = name
                .chars()
                .all(|letter| letter.is_alphanumeric() || letter == '_');
            if !is_plain || parameter.ends_with("..") || parameter.ends_with('…') {
                continue;
            }
            let known = Known::new(
                name,
                Kind::Argument,
                format!("{parameter} of {}", callee.name),
            );
            match is_named {
                true => self.offer(&known),
                false => self.offer_text(&format!("{name} ="), &known),
            }
        }
    }

    /// The place of the parameter that the argument which begins at this word is for.
    fn parameter(&self, start: usize, callee: &Known) -> Option<usize> {
        let opener = self.opener()?;
        let names = callee.parameters.iter().map(|one| parameter_name(one));
        if self.scan.shown(start + 1) == "=" {
            let name = self.scan.shown(start);
            return names.into_iter().position(|known| known == name);
        }
        let mut depth = 0;
        let mut before = 0;
        for place in opener + 1..start {
            match self.scan.words[place].kind {
                kind if kind.opens() => depth += 1,
                kind if kind.closes() => depth -= 1,
                WordKind::Punctuation if depth == 0 && self.scan.shown(place) == "," => before += 1,
                _ => {}
            }
        }
        // `a.f(b)` is `f(a, b)`, but not where a is a module.
        let point = opener >= 3 && self.scan.shown(opener - 2) == ".";
        if point && self.members_of(opener - 3).is_none() {
            before += 1;
        }
        // So is `a |> f(b)`.
        let mut first = opener.checked_sub(1)?;
        while first >= 2 && self.scan.shown(first - 1) == "." {
            first -= 2;
        }
        before += usize::from(first > 0 && self.scan.shown(first - 1) == "|>");
        let last = callee.parameters.len().checked_sub(1)?;
        let goes_on = callee.parameters[last].ends_with(['.', '…']);
        (before <= last || goes_on).then_some(before.min(last))
    }

    /// The function in whose call the place is.
    fn callee(&self) -> Option<Known> {
        let opener = self.opener().filter(|&opener| {
            opener > 0
                && self.scan.shown(opener) == "("
                && self.scan.words[opener].kind == WordKind::Open
                && self.scan.words[opener - 1].kind == WordKind::Name
        })?;
        self.called(opener)
    }

    /// What is called by the parenthesis at this place.
    fn called(&self, opener: usize) -> Option<Known> {
        let name = self.scan.shown(opener.checked_sub(1)?);
        if opener >= 3 && self.scan.shown(opener - 2) == "." {
            let members = self.members_of(opener - 3);
            let member = members
                .into_iter()
                .flatten()
                .find(|known| &*known.name == name);
            return member.or_else(|| self.lookup(name));
        }
        self.lookup(name)
    }

    /// What a name means at the place.
    fn lookup(&self, name: &str) -> Option<Known> {
        let shown = |bound: &&Bound| &self.scan.text[bound.range.clone()] == name;
        if let Some(bound) = self.scan.visible().find(shown) {
            return Some(outline::known(&self.scan, bound));
        }
        let session = self
            .surroundings
            .names
            .iter()
            .find(|known| &*known.name == name);
        session.or_else(|| vocabulary::find(name)).cloned()
    }

    fn names(&mut self) {
        let visible: Vec<Bound> = self.scan.visible().cloned().collect();
        for bound in &visible {
            let known = outline::known(&self.scan, bound);
            self.offer(&known);
        }
        let surroundings = self.surroundings;
        surroundings
            .names
            .iter()
            .for_each(|known| self.offer(known));
        vocabulary::all().iter().for_each(|known| self.offer(known));
    }

    /// What can be written behind the point at this place.
    fn members(&mut self, point: usize) {
        match point
            .checked_sub(1)
            .and_then(|subject| self.members_of(subject))
        {
            Some(members) => members.iter().for_each(|known| self.offer(known)),
            None => {
                vocabulary::properties()
                    .iter()
                    .for_each(|known| self.offer(known));
                // `a.f(b)` is `f(a, b)`.
                self.methods();
            }
        }
    }

    fn methods(&mut self) {
        let visible: Vec<Bound> = self.scan.visible().cloned().collect();
        for bound in visible.iter().filter(|bound| bound.sort == Sort::Function) {
            let known = outline::known(&self.scan, bound);
            self.offer(&known);
        }
        let session = self.surroundings.names.iter();
        let functions = session
            .chain(vocabulary::all())
            .filter(|known| known.kind == Kind::Function && !known.parameters.is_empty());
        let functions: Vec<&Known> = functions.collect();
        functions.into_iter().for_each(|known| self.offer(known));
    }

    /// The members of what stands at this place, if it is known to be a module, or its value is.
    fn members_of(&self, subject: usize) -> Option<Vec<Known>> {
        let word = self.scan.words.get(subject)?;
        let is_member = subject > 0 && self.scan.shown(subject - 1) == ".";
        if word.kind != WordKind::Name || is_member {
            return None;
        }
        let name = self.scan.shown(subject);
        let shown = |bound: &&Bound| &self.scan.text[bound.range.clone()] == name;
        if let Some(bound) = self.scan.visible().find(shown) {
            return (bound.sort == Sort::Module).then(|| self.module_members(bound));
        }
        let session = self
            .surroundings
            .names
            .iter()
            .find(|known| &*known.name == name);
        let known = session.or_else(|| vocabulary::find(name))?;
        (known.kind == Kind::Module).then(|| known.members.clone())
    }

    /// The definitions of the file that is imported there.
    fn module_members(&self, bound: &Bound) -> Vec<Known> {
        let path = self.scan.words.get(bound.statement + 1);
        let path = path.filter(|word| word.kind == WordKind::Text);
        let path = path.map_or("", |word| {
            self.scan.text[word.range.clone()].trim_matches('"')
        });
        let path = self.surroundings.directory.join(path);
        let text = self.surroundings.text(&path);
        text.map_or_else(Vec::new, |text| outline::definitions(&text))
    }

    /// Inside of a string: paths behind `import`, or the strings that a function understands.
    fn in_string(&mut self, range: Range<usize>) {
        let text = self.scan.text;
        if !text[range.clone()].starts_with('"') {
            return;
        }
        let is_closed = range.len() > 1 && text[range.clone()].ends_with('"');
        let end = range.end - usize::from(is_closed);
        if self.offset > end {
            return;
        }
        let inside = range.start + 1..end;
        if self.last() == "import" {
            return self.paths(inside, is_closed);
        }
        // A string that was never closed reaches to the end of the line.
        let known = |letter: char| letter.is_alphanumeric();
        let length = text[self.offset..inside.end].find(|letter| !known(letter));
        let end = length.map_or(inside.end, |length| self.offset + length);
        self.replace = inside.start..if is_closed { inside.end } else { end };
        let before = self.scan.before;
        let is_argument =
            self.last() == "=" && before >= 2 && self.scan.words[before - 2].kind == WordKind::Name;
        if let Some(callee) = self.callee().filter(|_| is_argument) {
            let parameter = self.scan.shown(before - 2);
            for choice in vocabulary::choices(&callee.name, parameter) {
                let detail = format!("{parameter} of {}", callee.name);
                self.offer(&Known::new(choice, Kind::Choice, detail));
            }
        }
    }

    fn paths(&mut self, inside: Range<usize>, is_closed: bool) {
        let written = &self.scan.text[inside.start..self.offset];
        let (folder, _) = written
            .rsplit_once('/')
            .map_or(("", written), |(folder, rest)| (folder, rest));
        let start = match folder {
            "" if !written.starts_with('/') => inside.start,
            _ => inside.start + folder.len() + 1,
        };
        self.replace = start..if is_closed { inside.end } else { self.offset };
        let directory = self.surroundings.directory.join(match folder {
            "" if written.starts_with('/') => "/",
            folder => folder,
        });
        for (name, is_folder) in entries(&directory) {
            match is_folder {
                true => self.offer_text(
                    &format!("{name}/"),
                    &Known::new(&*name, Kind::Folder, "a folder"),
                ),
                false => self.offer(&Known::new(&*name, Kind::File, "an Imp file")),
            }
        }
    }
}

/// The folders and Imp files in a folder, sorted, hidden ones left out; at most a thousand.
fn entries(directory: &Path) -> Vec<(String, bool)> {
    const MOST: usize = 1_000;
    let directory = match directory.as_os_str().is_empty() {
        true => Path::new("."),
        false => directory,
    };
    let Ok(entries) = std::fs::read_dir(directory) else {
        return Vec::new();
    };
    let mut names: Vec<(String, bool)> = entries
        .filter_map(|entry| {
            let entry = entry.ok()?;
            let name = entry.file_name().into_string().ok()?;
            let is_folder = entry.path().is_dir();
            let is_wanted = (is_folder || name.ends_with(".imp")) && !name.starts_with('.');
            is_wanted.then_some((name, is_folder))
        })
        .take(MOST)
        .collect();
    names.sort();
    names
}

fn begins_like(label: &str, prefix: &str) -> bool {
    let mut letters = label.chars().flat_map(char::to_lowercase);
    prefix
        .chars()
        .flat_map(char::to_lowercase)
        .all(|letter| letters.next() == Some(letter))
}

#[cfg(test)]
mod tests;
