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
}

struct Indexer<'tree> {
    text: &'tree str,
    index: Index,
    scopes: Vec<FxHashMap<&'tree str, usize>>,
    /// The bindings of the scopes that are open, to learn where each ends.
    open: Vec<Vec<usize>>,
    statements: Vec<&'tree Statement>,
    later: Vec<Later<'tree>>,
    /// The function whose parameters are being bound, and how many functions are around it.
    function: Option<(usize, u32)>,
    functions: u32,
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
            functions: 0,
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
                    if let Some(&function) = globals.get(&callee.text) {
                        self.argument_of(function, name);
                    }
                }
            }
        }
        let occurrences = &mut self.index.occurrences;
        occurrences.sort_by_key(|occurrence| (occurrence.range.start, occurrence.range.end));
        occurrences.dedup_by(|next, kept| next.range.start < kept.range.end);
        self.index
    }

    /// `name` as an argument of a function of the file.
    fn argument_of(&mut self, function: usize, name: &Name) {
        let arguments = &self.index.bindings[function].arguments;
        let found = arguments
            .iter()
            .copied()
            .find(|&argument| self.index.bindings[argument].name == name.text);
        if let Some(argument) = found {
            self.occurs(range(name.span), Target::Own(argument));
        }
    }
}

impl<'tree> Visitor<'tree> for Indexer<'tree> {
    fn open(&mut self) {
        self.scopes.push(FxHashMap::default());
        self.open.push(Vec::new());
    }

    fn close(&mut self) {
        self.scopes.pop();
        let end = match self.statements.last() {
            Some(statement) if !self.scopes.is_empty() => statement.span.end as usize,
            _ => self.text.len(),
        };
        for binding in self.open.pop().unwrap_or_default() {
            self.index.bindings[binding].scope.end = end;
        }
    }

    fn enter_function(&mut self) {
        self.functions += 1;
    }

    fn leave_function(&mut self) {
        self.functions -= 1;
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
        self.function = None;
    }

    fn bind(&mut self, name: &'tree Name, role: Role) {
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
        match (role, self.function) {
            (Role::Function, _) => self.function = Some((place, self.functions)),
            // Functions in its defaults and body have parameters too.
            (Role::Argument, Some((function, around))) if self.functions == around + 1 => {
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
        match self.find(&name.text) {
            Some(binding) => self.occurs(range(name.span), Target::Own(binding)),
            None => self.later.push(Later::Name(name)),
        }
    }

    fn property(&mut self, subject: &'tree Expression, name: &'tree Name, called: bool) {
        match self.module(subject) {
            Some(Ok(import)) => {
                let target = Target::Member(import, Arc::clone(&name.text));
                self.occurs(range(name.span), target);
            }
            Some(Err(namespace)) if vocabulary::find(&namespace.text).is_some() => {
                let full = format!("{}.{}", namespace.text, name.text);
                self.occurs_in_language(range(name.span), &full);
            }
            // `a.f(b)` is `f(a, b)` where a has no property f.
            _ if called => self.mention(name),
            _ => {}
        }
    }

    fn change(&mut self, name: &'tree Name) {
        let start = name.span.start as usize;
        let Some((module, member)) = name.text.split_once('.') else {
            let global = self.scopes.first().and_then(|file| file.get(&*name.text));
            return match global {
                Some(&binding) => self.occurs(range(name.span), Target::Own(binding)),
                None => self.later.push(Later::Name(name)),
            };
        };
        let is_plain = self.text.get(range(name.span)) == Some(&*name.text);
        if let Some(import) = self.find(module).filter(|_| is_plain) {
            self.occurs(start..start + module.len(), Target::Own(import));
            let target = Target::Member(import, Arc::from(member));
            self.occurs(start + module.len() + 1..name.span.end as usize, target);
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
                Some(Ok(import)) => {
                    let (function, argument) = (Arc::clone(&function.text), Arc::clone(&name.text));
                    let target = Target::MemberArgument(import, function, argument);
                    self.occurs(range(name.span), target);
                }
                _ => match self.find(&function.text) {
                    Some(function) => self.argument_of(function, name),
                    None => self.later.push(Later::Argument(function, name)),
                },
            },
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The places of what stands at the first `‸`, and those that are marked with it.
    fn check(marked: &str) {
        let text: String = marked.replace('‸', "");
        let mut expected = Vec::new();
        let mut gone = 0;
        for (place, _) in marked.match_indices('‸') {
            expected.push(place - gone);
            gone += '‸'.len_utf8();
        }
        let index = Index::of_text(&text);
        let found = index.at(expected[0]).expect("a name");
        let places: Vec<usize> = index
            .places(&found.target)
            .map(|place| place.start)
            .collect();
        assert_eq!(places, expected, "{marked}");
    }

    #[test]
    fn names_are_told_apart_by_their_scopes() {
        check("let ‸a = 1\nfn f(a) = a\nlet b = ‸a + f(‸a)");
        check("let a = 1\nfn f(‸a) = ‸a\nlet b = a + f(‸a = a)");
        check("param ‸r = 1\nfield f(x, y) = x - ‸r\nlet g = f with {‸r = 2}");
        check(
            "fn f(x) = later(x)\nfn ‸later(x) = x\nlet a = later(1)"
                .replacen("later(x)\n", "‸later(x)\n", 1)
                .replacen("= later(1)", "= ‸later(1)", 1)
                .as_str(),
        );
        check("let l = [‸i + j for ‸i in range(3) for j in range(‸i)]\nlet i = 1");
        check(
            "fn ‸twice(a) = 2 * a\nlet b = 3.‸twice()"
                .replace("3.", "(3).")
                .as_str(),
        );
        check("field f(‸x, y) = ‸x + y\nfield g(x, y) = x");
        check("fn f(a) {\n    let ‸t = a\n    ‸t + 1\n}\nlet t = 1\nprint(\"{t}\")");
    }

    #[test]
    fn only_its_own_parameters_are_a_functions_arguments() {
        let index = Index::of_text("fn f(a, b = t -> t, c = 1) = (u -> v -> a + u * v + c)");
        let arguments = index.bindings[0].arguments.iter();
        let names: Vec<&str> = arguments
            .map(|&place| &*index.bindings[place].name)
            .collect();
        assert_eq!(names, ["a", "b", "c"]);
    }

    #[test]
    fn names_of_the_language_are_found() {
        let text = "let a = ease.in_quad(0.5) + sin(1)";
        let index = Index::of_text(text);
        let target = |part: &str| {
            let place = text.find(part).expect("a part");
            index.at(place).map(|found| found.target.clone())
        };
        assert_eq!(
            target("in_quad"),
            Some(Target::Language("ease.in_quad".into()))
        );
        assert_eq!(target("sin"), Some(Target::Language("sin".into())));
        assert_eq!(target("0.5"), None);
    }

    #[test]
    fn members_of_modules_are_found() {
        let text = "import \"b.imp\" as b\nlet a = b.head(size = 1) with {b.width = 2}";
        let index = Index::of_text(text);
        let at = |part: &str| {
            let place = text.rfind(part).expect("a part");
            index.at(place).map(|found| found.target.clone())
        };
        assert_eq!(at("head"), Some(Target::Member(0, "head".into())));
        assert_eq!(at("width"), Some(Target::Member(0, "width".into())));
        assert_eq!(at("b.width"), Some(Target::Own(0)));
        let argument = Target::MemberArgument(0, "head".into(), "size".into());
        assert_eq!(at("size"), Some(argument));
        assert_eq!(index.imports.len(), 1);
    }

    #[test]
    fn broken_texts_have_an_index() {
        let text = "let a = 1\nlet b = (a +\nfn f(x = \nlet c = a";
        let index = Index::of_text(text);
        let found = index.at(4).expect("the name a");
        assert!(index.places(&found.target).count() >= 2);
    }
}
