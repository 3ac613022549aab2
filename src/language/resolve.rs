//! Names before anything runs: every misspelt name, every name bound twice in a scope and every
//! assignment to something that is not a `var` is found in one pass over the tree.

use std::rc::Rc;
use std::sync::Arc;

use rustc_hash::{FxHashMap, FxHashSet};

use super::degrees;
use super::scope::Scope;
use crate::diagnostic::{Code, Diagnostic, Span, suggest};
use crate::syntax::tree::{
    Argument, Block, Clause, Coordinates, Expression, ExpressionKind, Function, Name, Pattern,
    Statement, StatementKind, TextPart, Tree,
};

/// What is wrong with the names of a file, whose surroundings are `globals`.
pub fn resolve(tree: &Tree, globals: &Rc<Scope>) -> Vec<Diagnostic> {
    resolve_file(tree, globals).errors
}

/// What is wrong with the names of a file, and what is allowed but probably not meant.
pub fn resolve_with_warnings(
    tree: &Tree,
    globals: &Rc<Scope>,
) -> (Vec<Diagnostic>, Vec<Diagnostic>) {
    let mut resolver = resolve_file(tree, globals);
    for statement in &tree.statements {
        if let StatementKind::Parameter { name, .. } = &statement.kind
            && !resolver.used.contains(&name.text)
        {
            let message = format!("nothing uses the parameter `{}`", name.text);
            let help = "use it in a field, or leave it out: changing it does nothing";
            let warning = Diagnostic::warning(Code::UnusedParameter, message);
            resolver
                .warnings
                .push(warning.label(name.span, "never used").help(help));
        }
    }
    (resolver.errors, resolver.warnings)
}

/// What is wrong with the names of what is entered into a session, and what is probably not meant:
/// names at the top may be bound again, and bodies of functions may use names of `later`.
pub(super) fn resolve_input(
    tree: &Tree,
    globals: &Rc<Scope>,
    later: &[Arc<str>],
) -> (Vec<Diagnostic>, Vec<Diagnostic>) {
    let mut resolver = Resolver::new(globals);
    resolver.rebinds = true;
    resolver.later.extend(later.iter().cloned());
    resolve_statements(tree, &mut resolver);
    (resolver.errors, resolver.warnings)
}

fn resolve_file<'a>(tree: &Tree, globals: &'a Rc<Scope>) -> Resolver<'a> {
    let mut resolver = Resolver::new(globals);
    resolve_statements(tree, &mut resolver);
    resolver
}

fn resolve_statements(tree: &Tree, resolver: &mut Resolver<'_>) {
    for statement in &tree.statements {
        for name in defined_names(statement) {
            resolver.later.insert(Arc::clone(&name.text));
        }
    }
    resolver.inside(|resolver| {
        for statement in &tree.statements {
            resolver.statement(statement);
        }
    });
}

/// What is wrong with the names of one expression.
pub fn resolve_expression(expression: &Expression, globals: &Rc<Scope>) -> Vec<Diagnostic> {
    let mut resolver = Resolver::new(globals);
    resolver.expression(expression);
    resolver.errors
}

/// The names that a pattern binds.
pub fn pattern_names(pattern: &Pattern) -> Vec<&Name> {
    match pattern {
        Pattern::Name(name) => vec![name],
        Pattern::List(patterns, _) => patterns.iter().flat_map(pattern_names).collect(),
    }
}

/// The names that a statement of a file binds.
pub(super) fn defined_names(statement: &Statement) -> Vec<&Name> {
    match &statement.kind {
        StatementKind::Parameter { name, .. }
        | StatementKind::Setting { name, .. }
        | StatementKind::Import { name, .. }
        | StatementKind::Variable { name, .. }
        | StatementKind::Function { name, .. }
        | StatementKind::Field { name, .. } => vec![name],
        StatementKind::Let { pattern, .. } => pattern_names(pattern),
        _ => Vec::new(),
    }
}

struct Resolver<'a> {
    globals: &'a Rc<Scope>,
    scopes: Vec<FxHashMap<Arc<str>, Bound>>,
    /// Names of the file, wherever they stand: the body of a function may use later ones.
    later: FxHashSet<Arc<str>>,
    /// How many function bodies are around.
    functions: usize,
    /// Whether a name at the top may be bound again.
    rebinds: bool,
    errors: Vec<Diagnostic>,
    warnings: Vec<Diagnostic>,
    /// Every name that occurs anywhere but where it is bound.
    used: FxHashSet<Arc<str>>,
}

#[derive(Clone, Copy)]
struct Bound {
    span: Span,
    assignable: bool,
}

impl<'a> Resolver<'a> {
    fn new(globals: &'a Rc<Scope>) -> Self {
        Resolver {
            globals,
            scopes: Vec::new(),
            later: FxHashSet::default(),
            functions: 0,
            rebinds: false,
            errors: Vec::new(),
            warnings: Vec::new(),
            used: FxHashSet::default(),
        }
    }

    fn inside(&mut self, walk: impl FnOnce(&mut Self)) {
        self.scopes.push(FxHashMap::default());
        walk(self);
        self.scopes.pop();
    }

    fn bind(&mut self, name: &Name, assignable: bool) {
        let bound = Bound {
            span: name.span,
            assignable,
        };
        let may_rebind = self.rebinds && self.scopes.len() == 1;
        let Some(scope) = self.scopes.last_mut() else {
            return;
        };
        if let Some(before) = scope.insert(Arc::clone(&name.text), bound)
            && !may_rebind
        {
            self.errors.push(
                Diagnostic::error(
                    Code::BoundTwice,
                    format!("the name `{}` is bound twice in one scope", name.text),
                )
                .label(name.span, "bound again here")
                .label(before.span, "first bound here")
                .help("give it another name, or use `var` and an assignment"),
            );
        }
    }

    fn bind_pattern(&mut self, pattern: &Pattern) {
        for name in pattern_names(pattern) {
            self.bind(name, false);
        }
    }

    fn find(&self, name: &str) -> Option<Bound> {
        self.scopes
            .iter()
            .rev()
            .find_map(|scope| scope.get(name).copied())
    }

    fn use_name(&mut self, name: &Name) {
        self.used.insert(Arc::clone(&name.text));
        let known = self.find(&name.text).is_some()
            || self.globals.find(&name.text).is_some()
            || (self.functions > 0 && self.later.contains(&name.text));
        if !known {
            let error = self.unknown(name);
            self.errors.push(error);
        }
    }

    fn unknown(&self, name: &Name) -> Diagnostic {
        if self.later.contains(&name.text) {
            return Diagnostic::error(
                Code::UnknownName,
                format!("`{}` is used before it is defined", name.text),
            )
            .label(name.span, "not defined yet")
            .help("statements run from top to bottom: move the definition up");
        }
        let mut names: Vec<Arc<str>> = self.globals.names();
        names.extend(self.scopes.iter().flat_map(sorted_names));
        let error = Diagnostic::error(
            Code::UnknownName,
            format!("there is no `{}` here", name.text),
        )
        .label(name.span, "unknown name");
        match suggest::nearest(&name.text, names.iter().map(|name| &**name)) {
            Some(near) => error.help(format!("did you mean `{near}`?")),
            None => error,
        }
    }

    fn statement(&mut self, statement: &Statement) {
        match &statement.kind {
            StatementKind::Parameter { name, value, range } => {
                self.only_at_top("parameters", name.span);
                self.expression(value);
                range.iter().for_each(|range| self.expression(range));
                self.bind(name, false);
            }
            StatementKind::Setting { name, value, range } => {
                self.only_at_top("settings", name.span);
                self.expression(value);
                range.iter().for_each(|range| self.expression(range));
                self.bind(name, false);
            }
            StatementKind::Import { name, .. } => {
                self.only_at_top("imports", name.span);
                self.bind(name, false);
            }
            StatementKind::Test { name, body } => {
                self.only_at_top("tests", name.span);
                // It is run after the whole file.
                self.functions += 1;
                self.block(body);
                self.functions -= 1;
            }
            StatementKind::Let { pattern, value } => {
                self.expression(value);
                self.bind_pattern(pattern);
            }
            StatementKind::Variable { name, value } => {
                self.expression(value);
                self.bind(name, true);
            }
            StatementKind::Assignment { target, value } => {
                self.expression(value);
                self.target(target);
            }
            StatementKind::Function { name, function } => {
                self.bind(name, false);
                self.function(function);
            }
            StatementKind::Field {
                name,
                coordinates,
                domain,
                body,
            } => {
                domain.iter().for_each(|side| self.expression(side));
                self.inside(|resolver| {
                    match coordinates {
                        Coordinates::Named(names) => {
                            names.iter().for_each(|name| resolver.bind(name, false));
                        }
                        Coordinates::Point { name, .. } => resolver.bind(name, false),
                    }
                    resolver.expression(body);
                });
                self.bind(name, false);
            }
            StatementKind::For {
                pattern,
                iterable,
                body,
            } => {
                self.expression(iterable);
                self.inside(|resolver| {
                    resolver.bind_pattern(pattern);
                    resolver.block(body);
                });
            }
            StatementKind::While { condition, body } => {
                self.expression(condition);
                self.block(body);
            }
            StatementKind::Expression(expression) => self.expression(expression),
            StatementKind::Error => {}
        }
    }

    /// Some definitions belong to the whole file, so they may not stand inside a block.
    fn only_at_top(&mut self, what: &str, span: Span) {
        if self.scopes.len() > 1 {
            self.errors.push(
                Diagnostic::error(Code::NotAtTop, format!("{what} inside a block"))
                    .label(span, "not at the top of the file")
                    .help(format!("{what} belong to the whole file: move this out")),
            );
        }
    }

    fn block(&mut self, block: &Block) {
        self.inside(|resolver| {
            for statement in &block.statements {
                resolver.statement(statement);
            }
        });
        // The last value is the block's own.
        let unused = block.statements.iter().rev().skip(1);
        for statement in unused.rev() {
            self.only_if_used(statement);
        }
    }

    /// A value by itself does nothing: a formula was meant to go on, most likely.
    fn only_if_used(&mut self, statement: &Statement) {
        let StatementKind::Expression(expression) = &statement.kind else {
            return;
        };
        let does_nothing = matches!(
            *expression.kind,
            ExpressionKind::Number(_)
                | ExpressionKind::Bool(_)
                | ExpressionKind::Text(_)
                | ExpressionKind::Name(_)
                | ExpressionKind::List(_)
                | ExpressionKind::Unary { .. }
                | ExpressionKind::Binary { .. }
                | ExpressionKind::Comparison { .. }
                | ExpressionKind::Interval { .. }
                | ExpressionKind::Index { .. }
                | ExpressionKind::Property { .. }
                | ExpressionKind::Lambda(_)
        );
        if does_nothing {
            self.errors.push(
                Diagnostic::error(Code::UnusedValue, "nothing uses this value")
                    .label(expression.span, "not the block's last line")
                    .help(
                        "if the next line goes on with it, put the operator at the end of this \
                         one, or the whole in parentheses",
                    ),
            );
        }
    }

    fn function(&mut self, function: &Function) {
        self.functions += 1;
        self.inside(|resolver| {
            for parameter in &function.parameters {
                if let Some(default) = &parameter.default {
                    resolver.expression(default);
                }
                resolver.bind_pattern(&parameter.pattern);
            }
            resolver.expression(&function.body);
        });
        self.functions -= 1;
    }

    /// The target of an assignment: its name must be a `var`.
    fn target(&mut self, target: &Expression) {
        match &*target.kind {
            ExpressionKind::Name(name) => {
                self.use_name(name);
                if let Some(bound) = self.find(&name.text)
                    && !bound.assignable
                {
                    self.errors.push(
                        Diagnostic::error(
                            Code::NotAssignable,
                            format!("`{}` is not a `var`, so it keeps its value", name.text),
                        )
                        .label(name.span, "cannot be assigned")
                        .label(bound.span, "bound here")
                        .help(format!("bind it with `var {} = …` to change it", name.text)),
                    );
                }
            }
            ExpressionKind::Index { subject, index } => {
                self.expression(index);
                self.target(subject);
            }
            ExpressionKind::Property { subject, .. } => self.target(subject),
            _ => self.expression(target),
        }
    }

    fn expression(&mut self, expression: &Expression) {
        // Trees may be thousands of levels deep.
        stacker::maybe_grow(64 * 1024, 4 * 1024 * 1024, || {
            self.expression_kind(expression);
        });
    }

    fn expression_kind(&mut self, expression: &Expression) {
        match &*expression.kind {
            ExpressionKind::Number(_) | ExpressionKind::Bool(_) | ExpressionKind::Error => {}
            ExpressionKind::Text(parts) => {
                for part in parts {
                    if let TextPart::Interpolation { value, .. } = part {
                        self.expression(value);
                    }
                }
            }
            ExpressionKind::Name(name) => self.use_name(name),
            ExpressionKind::List(elements) => {
                elements.iter().for_each(|element| self.expression(element));
            }
            ExpressionKind::Comprehension { element, clauses } => {
                self.comprehension(element, clauses);
            }
            ExpressionKind::Group(inner)
            | ExpressionKind::Unary { operand: inner, .. }
            | ExpressionKind::Property { subject: inner, .. } => self.expression(inner),
            ExpressionKind::Binary { left, right, .. }
            | ExpressionKind::Interval {
                low: left,
                high: right,
            }
            | ExpressionKind::Steps {
                interval: left,
                step: right,
            }
            | ExpressionKind::Pipe { left, right }
            | ExpressionKind::Index {
                subject: left,
                index: right,
            } => {
                self.expression(left);
                self.expression(right);
            }
            ExpressionKind::Comparison { first, rest } => {
                self.expression(first);
                rest.iter()
                    .for_each(|(_, operand)| self.expression(operand));
            }
            ExpressionKind::With { subject, bindings } => {
                self.expression(subject);
                bindings
                    .iter()
                    .for_each(|(_, value)| self.expression(value));
            }
            ExpressionKind::Call { callee, arguments } => self.call(callee, arguments),
            ExpressionKind::Lambda(function) => self.function(function),
            ExpressionKind::If {
                condition,
                consequence,
                alternative,
            } => {
                self.expression(condition);
                self.expression(consequence);
                alternative
                    .iter()
                    .for_each(|alternative| self.expression(alternative));
            }
            ExpressionKind::Block(block) => self.block(block),
        }
    }

    fn call(&mut self, callee: &Expression, arguments: &[Argument]) {
        if let ExpressionKind::Name(name) | ExpressionKind::Property { name, .. } = &*callee.kind
            && self.find(&name.text).is_none()
        {
            self.warnings.extend(degrees::warning(name, arguments));
        }
        // `a.f(b)`: whether f is a property or a function is known when a is.
        match &*callee.kind {
            ExpressionKind::Property { subject, .. } => self.expression(subject),
            _ => self.expression(callee),
        }
        for argument in arguments {
            self.expression(&argument.value);
        }
    }

    fn comprehension(&mut self, element: &Expression, clauses: &[Clause]) {
        let Some((clause, rest)) = clauses.split_first() else {
            return self.expression(element);
        };
        match clause {
            Clause::For { pattern, iterable } => {
                self.expression(iterable);
                self.inside(|resolver| {
                    resolver.bind_pattern(pattern);
                    resolver.comprehension(element, rest);
                });
            }
            Clause::If(condition) => {
                self.expression(condition);
                self.comprehension(element, rest);
            }
        }
    }
}

fn sorted_names(scope: &FxHashMap<Arc<str>, Bound>) -> Vec<Arc<str>> {
    let mut names: Vec<Arc<str>> = scope.keys().cloned().collect();
    names.sort();
    names
}
