//! What the names of one file mean: each place where a name stands, with what it stands for.

use std::ops::Range;
use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use super::vocabulary;
use crate::diagnostic::{SourceId, Span};
use crate::syntax::parse;
use crate::syntax::tree::{
    Expression, ExpressionKind, Literal, Name, Statement, StatementKind, Tree,
};
use crate::syntax::walk::{Role, Visitor, walk};

/// What a name stands for.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Target {
    /// A binding of the file, by its number in [`Index::bindings`].
    Own(usize),
    /// A definition of an imported file: the binding of the import, and the name in that file.
    Member(usize, Arc<str>),
    /// A parameter of a function of an imported file: the binding of the import, the function's
    /// name and the parameter's.
    MemberArgument(usize, Arc<str>, Arc<str>),
    /// A name of the language, in full.
    Language(Arc<str>),
}

/// A place where a name stands.
#[derive(Clone, Debug)]
pub struct Occurrence {
    /// Its bytes.
    pub range: Range<usize>,
    /// What it stands for.
    pub target: Target,
}

/// A name that the file binds.
#[derive(Clone, Debug)]
pub struct Binding {
    /// The name.
    pub name: Arc<str>,
    /// Where it is bound.
    pub range: Range<usize>,
    /// As what.
    pub role: Role,
    /// Whether it belongs to the whole file, so that others can import it.
    pub is_global: bool,
    /// The statement that binds it.
    pub statement: Range<usize>,
    /// The doc comment of the statement.
    pub documentation: Option<Arc<str>>,
    /// Where it can be used.
    pub scope: Range<usize>,
    /// If it is a function: the bindings of its parameters.
    pub arguments: Vec<usize>,
}

/// A file that is imported.
#[derive(Clone, Debug)]
pub struct Import {
    /// The binding of its name.
    pub binding: usize,
    /// The path as it is written.
    pub path: Literal,
}

/// What the names of a file mean.
#[derive(Clone, Debug, Default)]
pub struct Index {
    /// In the order in which they are bound.
    pub bindings: Vec<Binding>,
    /// In the order of the text, without overlap.
    pub occurrences: Vec<Occurrence>,
    /// In order.
    pub imports: Vec<Import>,
    /// The names of the tests and where they stand, in order.
    pub tests: Vec<(Literal, Range<usize>)>,
    /// Names of which the text alone does not tell what they mean.
    pub doubts: Vec<Doubt>,
}

/// A place where a name stands that might mean several things, or something that only a run shows.
#[derive(Clone, Debug)]
pub struct Doubt {
    /// The name.
    pub name: Arc<str>,
    /// Its bytes.
    pub range: Range<usize>,
    /// Why it is in doubt.
    pub kind: DoubtKind,
}

/// Why a name is in doubt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DoubtKind {
    /// A named argument of a function that is not known.
    Argument,
    /// Behind the dot of something that is neither an import nor the library's.
    Member,
    /// The same with arguments: possibly a function that is used as a method.
    Method,
    /// Read in a function, and bound around that function later.
    Late,
}

impl Index {
    /// The index of a text, whole or broken. Takes time proportional to n log n.
    pub fn of_text(text: &str) -> Index {
        Index::of_tree(text, &parse(SourceId(0), text).tree)
    }

    /// The index of the tree of a text.
    pub fn of_tree(text: &str, tree: &Tree) -> Index {
        let mut indexer = Indexer::new(text);
        walk(tree, &mut indexer);
        indexer.finish()
    }

    /// The name at a place, or the one that ends there.
    pub fn at(&self, offset: usize) -> Option<&Occurrence> {
        let after = self
            .occurrences
            .partition_point(|occurrence| occurrence.range.start <= offset);
        let found = self.occurrences.get(after.checked_sub(1)?)?;
        (offset <= found.range.end).then_some(found)
    }

    /// The definition of that name which others can import.
    pub fn global(&self, name: &str) -> Option<usize> {
        let mut bindings = self.bindings.iter();
        bindings.position(|binding| binding.is_global && &*binding.name == name)
    }

    /// The places in this file where something stands.
    pub fn places<'index>(
        &'index self,
        target: &'index Target,
    ) -> impl Iterator<Item = Range<usize>> + 'index {
        let occurrences = self.occurrences.iter();
        occurrences
            .filter(move |occurrence| occurrence.target == *target)
            .map(|occurrence| occurrence.range.clone())
    }
}

/// An occurrence that can only be understood when the whole file has been seen.
enum Later<'tree> {
    Name(&'tree Name),
    Argument(&'tree Name, &'tree Name),
    /// `subject.name`, whether arguments follow, and the function of that name there.
    Member(&'tree Name, &'tree Name, bool, Option<usize>),
    /// `subject.function(name = …)`, and the function of that name there.
    MemberArgument(&'tree Name, &'tree Name, &'tree Name, Option<usize>),
    /// `with {module.name = …}`
    Change(&'tree Name),
}

/// A name that has been read, in how many functions, and as what.
struct Mention {
    range: Range<usize>,
    number: usize,
    functions: usize,
    found: Option<usize>,
}

/// What had been seen when a scope opened.
struct Opening {
    functions: usize,
    mentions: usize,
    bindings: usize,
}

struct Indexer<'tree> {
    text: &'tree str,
    index: Index,
    scopes: Vec<FxHashMap<&'tree str, usize>>,
    /// The bindings of the scopes that are open, to learn where each ends.
    open: Vec<Vec<usize>>,
    statements: Vec<&'tree Statement>,
    later: Vec<Later<'tree>>,
    /// The function that has been bound and is entered next.
    function: Option<usize>,
    /// The functions around, with the bindings of those that have names.
    functions: Vec<Option<usize>>,
    openings: Vec<Opening>,
    mentions: FxHashMap<&'tree str, Vec<Mention>>,
    /// How many names have been read.
    seen: usize,
    /// Imported names.
    modules: FxHashSet<usize>,
}

fn range(span: Span) -> Range<usize> {
    span.start as usize..span.end as usize
}

impl<'tree> Indexer<'tree> {
    fn new(text: &'tree str) -> Self {
        Indexer {
            text,
            index: Index::default(),
            scopes: Vec::new(),
            open: Vec::new(),
            statements: Vec::new(),
            later: Vec::new(),
            function: None,
            functions: Vec::new(),
            openings: Vec::new(),
            mentions: FxHashMap::default(),
            seen: 0,
            modules: FxHashSet::default(),
        }
    }

    fn find(&self, name: &str) -> Option<usize> {
        let mut scopes = self.scopes.iter().rev();
        scopes.find_map(|scope| scope.get(name).copied())
    }

    fn occurs(&mut self, span: Range<usize>, target: Target) {
        // Names that were put in where one is missing have no text.
        if !span.is_empty() && span.end <= self.text.len() {
            self.index.occurrences.push(Occurrence {
                range: span,
                target,
            });
        }
    }

    fn occurs_in_language(&mut self, span: Range<usize>, name: &str) {
        if vocabulary::find(name).is_some() {
            self.occurs(span, Target::Language(Arc::from(name)));
        }
    }

    /// The import that an expression names, or the library's namespace.
    fn module(&self, subject: &'tree Expression) -> Option<Result<usize, &'tree Name>> {
        let ExpressionKind::Name(name) = &*subject.kind else {
            return None;
        };
        match self.find(&name.text) {
            Some(binding) => self.modules.contains(&binding).then_some(Ok(binding)),
            None => Some(Err(name)),
        }
    }

    fn finish(mut self) -> Index {
        let globals: FxHashMap<Arc<str>, usize> = self
            .index
            .bindings
            .iter()
            .enumerate()
            .filter(|(_, binding)| binding.is_global)
            .map(|(place, binding)| (Arc::clone(&binding.name), place))
            .collect();
        for later in std::mem::take(&mut self.later) {
            match later {
                Later::Name(name) => match globals.get(&name.text) {
                    Some(&binding) => self.occurs(range(name.span), Target::Own(binding)),
                    None => self.occurs_in_language(range(name.span), &name.text),
                },
                Later::Argument(callee, name) => {
                    self.argument_of_some(globals.get(&callee.text).copied(), callee, name);
                }
                Later::Member(subject, name, called, found) => {
                    let module = globals.get(&subject.text).copied();
                    match module.filter(|module| self.modules.contains(module)) {
                        Some(module) => self.member(module, name),
                        None => {
                            self.doubts(name, called);
                            let function = found.or_else(|| globals.get(&name.text).copied());
                            match function.filter(|_| called) {
                                Some(function) => {
                                    self.occurs(range(name.span), Target::Own(function));
                                }
                                None if called => {
                                    self.occurs_in_language(range(name.span), &name.text);
                                }
                                None => {}
                            }
                        }
                    }
                }
                Later::MemberArgument(subject, function, name, found) => {
                    let module = globals.get(&subject.text).copied();
                    match module.filter(|module| self.modules.contains(module)) {
                        Some(module) => self.argument_of_member(module, function, name),
                        None => {
                            let found = found.or_else(|| globals.get(&function.text).copied());
                            self.argument_of_some(found, function, name);
                        }
                    }
                }
                Later::Change(name) => {
                    let module = name.text.split_once('.').map(|(module, _)| module);
                    let module = module.and_then(|module| globals.get(module).copied());
                    self.change_of(module, name);
                }
            }
        }
        let occurrences = &mut self.index.occurrences;
        occurrences.sort_by_key(|occurrence| (occurrence.range.start, occurrence.range.end));
        occurrences.dedup_by(|next, kept| next.range.start < kept.range.end);
        self.index
    }

    /// Functions read names late: those that have read this name in the scope where it is bound only
    /// now may mean either.
    fn find_late(&mut self, name: &'tree Name) {
        let (Some(opening), true) = (self.openings.last(), self.openings.len() > 1) else {
            return;
        };
        let mentions = self.mentions.get(&*name.text).into_iter().flatten().rev();
        let late = mentions
            .take_while(|mention| mention.number > opening.mentions)
            .filter(|mention| {
                mention.functions > opening.functions
                    && mention.found.is_none_or(|found| found < opening.bindings)
            })
            .map(|mention| Doubt {
                name: Arc::clone(&name.text),
                range: mention.range.clone(),
                kind: DoubtKind::Late,
            });
        self.index.doubts.extend(late);
    }

    fn doubt(&mut self, name: &Name, range: Range<usize>, kind: DoubtKind) {
        let name = Arc::clone(&name.text);
        self.index.doubts.push(Doubt { name, range, kind });
    }

    /// `name` behind a dot, of which only a run shows whether it is a property.
    fn doubts(&mut self, name: &Name, called: bool) {
        let kind = match called {
            true => DoubtKind::Method,
            false => DoubtKind::Member,
        };
        self.doubt(name, range(name.span), kind);
    }

    fn member(&mut self, module: usize, name: &Name) {
        let target = Target::Member(module, Arc::clone(&name.text));
        self.occurs(range(name.span), target);
    }

    fn argument_of_member(&mut self, module: usize, function: &Name, name: &Name) {
        let (function, argument) = (Arc::clone(&function.text), Arc::clone(&name.text));
        let target = Target::MemberArgument(module, function, argument);
        self.occurs(range(name.span), target);
    }

    fn argument_of_some(&mut self, function: Option<usize>, callee: &Name, name: &Name) {
        match function {
            Some(function) => self.argument_of(function, name),
            None if vocabulary::find(&callee.text).is_some() => {}
            None => self.doubt(name, range(name.span), DoubtKind::Argument),
        }
    }

    /// `module.member = …` behind `with`, where the name of the module may be known.
    fn change_of(&mut self, module: Option<usize>, name: &Name) {
        let start = name.span.start as usize;
        let Some((first, member)) = name.text.split_once('.') else {
            return;
        };
        let is_plain = self.text.get(range(name.span)) == Some(&*name.text);
        match module.filter(|_| is_plain && !member.contains('.')) {
            Some(import) => {
                self.occurs(start..start + first.len(), Target::Own(import));
                let target = Target::Member(import, Arc::from(member));
                self.occurs(start + first.len() + 1..name.span.end as usize, target);
            }
            None => {
                // Any of the names may be the one that is asked for.
                for part in name.text.split('.') {
                    self.index.doubts.push(Doubt {
                        name: Arc::from(part),
                        range: range(name.span),
                        kind: DoubtKind::Member,
                    });
                }
            }
        }
    }

    /// `name` as an argument of a function of the file.
    fn argument_of(&mut self, function: usize, name: &Name) {
        let arguments = &self.index.bindings[function].arguments;
        let found = arguments
            .iter()
            .copied()
            .find(|&argument| self.index.bindings[argument].name == name.text);
        match found {
            Some(argument) => self.occurs(range(name.span), Target::Own(argument)),
            None => self.doubt(name, range(name.span), DoubtKind::Argument),
        }
    }
}

impl<'tree> Visitor<'tree> for Indexer<'tree> {
    fn open(&mut self) {
        self.scopes.push(FxHashMap::default());
        self.open.push(Vec::new());
        self.openings.push(Opening {
            functions: self.functions.len(),
            mentions: self.seen,
            bindings: self.index.bindings.len(),
        });
    }

    fn close(&mut self) {
        self.scopes.pop();
        self.openings.pop();
        let end = match self.statements.last() {
            Some(statement) if !self.scopes.is_empty() => statement.span.end as usize,
            _ => self.text.len(),
        };
        for binding in self.open.pop().unwrap_or_default() {
            self.index.bindings[binding].scope.end = end;
        }
    }

    fn enter_function(&mut self) {
        self.functions.push(self.function.take());
    }

    fn leave_function(&mut self) {
        self.functions.pop();
    }

    fn statement(&mut self, statement: &'tree Statement) {
        while let Some(before) = self.statements.last() {
            if before.span.end > statement.span.start {
                break;
            }
            self.statements.pop();
        }
        if let StatementKind::Test { name, .. } = &statement.kind {
            let test = (name.clone(), range(statement.span));
            self.index.tests.push(test);
        }
        self.statements.push(statement);
    }

    fn bind(&mut self, name: &'tree Name, role: Role) {
        self.find_late(name);
        let place = self.index.bindings.len();
        let is_global = self.scopes.len() == 1;
        let statement = self
            .statements
            .iter()
            .rev()
            .find(|statement| statement.span.end >= name.span.end);
        let documentation = match role {
            Role::Argument | Role::Coordinate | Role::Loop => None,
            _ => statement.and_then(|statement| statement.documentation.clone()),
        };
        self.index.bindings.push(Binding {
            name: Arc::clone(&name.text),
            range: range(name.span),
            role,
            is_global,
            statement: statement.map_or(range(name.span), |statement| range(statement.span)),
            documentation,
            scope: name.span.start as usize..self.text.len(),
            arguments: Vec::new(),
        });
        match (role, self.functions.last()) {
            (Role::Function, _) => self.function = Some(place),
            (Role::Argument, Some(&Some(function))) => {
                self.index.bindings[function].arguments.push(place);
            }
            _ => {}
        }
        if role == Role::Module {
            self.modules.insert(place);
            let statement = statement.map(|statement| &statement.kind);
            if let Some(StatementKind::Import { path, .. }) = statement {
                let path = path.clone();
                self.index.imports.push(Import {
                    binding: place,
                    path,
                });
            }
        }
        if let (Some(scope), Some(open)) = (self.scopes.last_mut(), self.open.last_mut()) {
            scope.insert(&name.text, place);
            open.push(place);
        }
        self.occurs(range(name.span), Target::Own(place));
    }

    fn mention(&mut self, name: &'tree Name) {
        let found = self.find(&name.text);
        self.seen += 1;
        self.mentions.entry(&name.text).or_default().push(Mention {
            range: range(name.span),
            number: self.seen,
            functions: self.functions.len(),
            found,
        });
        match found {
            Some(binding) => self.occurs(range(name.span), Target::Own(binding)),
            None => self.later.push(Later::Name(name)),
        }
    }

    fn property(&mut self, subject: &'tree Expression, name: &'tree Name, called: bool) {
        match self.module(subject) {
            Some(Ok(import)) => self.member(import, name),
            Some(Err(namespace)) if vocabulary::find(&namespace.text).is_some() => {
                let full = format!("{}.{}", namespace.text, name.text);
                self.occurs_in_language(range(name.span), &full);
            }
            Some(Err(unknown)) => {
                let found = self.find(&name.text);
                self.later.push(Later::Member(unknown, name, called, found));
            }
            None => {
                self.doubts(name, called);
                // `a.f(b)` is `f(a, b)` where a has no property f.
                if called {
                    self.mention(name);
                }
            }
        }
    }

    fn change(&mut self, name: &'tree Name) {
        let Some((module, _)) = name.text.split_once('.') else {
            let global = self.scopes.first().and_then(|file| file.get(&*name.text));
            return match global {
                Some(&binding) => self.occurs(range(name.span), Target::Own(binding)),
                None => self.later.push(Later::Name(name)),
            };
        };
        match self.find(module) {
            Some(import) => self.change_of(Some(import), name),
            None => self.later.push(Later::Change(name)),
        }
    }

    fn argument(&mut self, callee: &'tree Expression, name: &'tree Name) {
        match &*callee.kind {
            ExpressionKind::Name(function) => match self.find(&function.text) {
                Some(function) => self.argument_of(function, name),
                None => self.later.push(Later::Argument(function, name)),
            },
            ExpressionKind::Property {
                subject,
                name: function,
            } => match self.module(subject) {
                Some(Ok(import)) => self.argument_of_member(import, function, name),
                Some(Err(unknown)) if vocabulary::find(&unknown.text).is_none() => {
                    let found = self.find(&function.text);
                    let later = Later::MemberArgument(unknown, function, name, found);
                    self.later.push(later);
                }
                Some(Err(_)) => {}
                None => match self.find(&function.text) {
                    Some(function) => self.argument_of(function, name),
                    None => self.later.push(Later::Argument(function, name)),
                },
            },
            _ => self.doubt(name, range(name.span), DoubtKind::Argument),
        }
    }
}

#[cfg(test)]
mod tests;
