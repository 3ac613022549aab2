//! The state of a session at the shell: what was entered, what can be taken back, what is shown.

use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use super::super::arguments::Common;
use super::super::output::{self, escaped};
use super::super::workspace::Workspace;
use super::answer::{self, Answer};
use super::commands;
use super::echo;
use super::editor::Editor;
use super::screen::Screen;
use crate::diagnostic::{Code, Diagnostic};
use crate::language::show::show;
use crate::language::{Entered, Mode, Snapshot, Value, names_of};
use crate::syntax::tree::{Expression, Statement, StatementKind, Tree};
use crate::syntax::{mentions, parse, renamed};

/// So many inputs can be taken back.
const KEPT_INPUTS: usize = 100;

/// What comes after an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum After {
    /// The next one.
    Next,
    /// The session has ended.
    End,
}

/// A session and what belongs to it at the shell.
pub(super) struct Repl {
    pub(super) workspace: Workspace,
    pub(super) common: Common,
    pub(super) screen: Screen,
    /// Whether a person types and reads; else what is data goes out, and nothing else.
    pub(super) is_typed: bool,
    /// Whether a field that is the last value is shown as a picture.
    pub(super) pictures: bool,
    /// How many lines came through the pipe before the present input.
    pub(super) lines_before: usize,
    /// The file that was loaded last.
    pub(super) file: Option<PathBuf>,
    answer: Option<Rc<Answer>>,
    past: Vec<Past>,
    inputs: usize,
}

/// What an input is taken back to.
struct Past {
    state: State,
    answer: Option<Rc<Answer>>,
    /// The beginning of the input.
    text: String,
}

enum State {
    /// The same session as it was.
    Before(Box<Snapshot>),
    /// The session before a file was loaded.
    Other(Box<Workspace>, Option<PathBuf>),
}

impl Repl {
    /// An empty session.
    pub(super) fn new(common: &Common, screen: Screen, is_typed: bool) -> Result<Repl, u8> {
        let workspace = Workspace::open(
            None,
            &Common {
                set: Vec::new(),
                ..common.clone()
            },
            Mode::Run,
        )?;
        Ok(Repl {
            workspace,
            common: common.clone(),
            screen,
            is_typed,
            pictures: true,
            lines_before: 0,
            file: None,
            answer: None,
            past: Vec::new(),
            inputs: 0,
        })
    }

    /// Finds out, once, whether the terminal shows graphics. What was typed meanwhile is not lost.
    pub(super) fn find_graphics(&mut self, editor: &mut Editor) {
        editor.typed_ahead = self.screen.ask_for_graphics();
    }

    /// Takes an input: a command or statements. What is wrong has been said when this fails with an
    /// exit code, and the session is as it was.
    pub(super) fn take(&mut self, text: &str) -> Result<After, u8> {
        if commands::is_command(text) {
            return commands::perform(self, text.trim());
        }
        self.enter(text).map(|()| After::Next)
    }

    /// Enters statements as one: if one of them fails, none has happened.
    pub(super) fn enter(&mut self, text: &str) -> Result<(), u8> {
        let tree = self.parsed(text)?;
        if tree.statements.is_empty() {
            return Ok(());
        }
        let before = self.workspace.session.snapshot();
        let answer = self.answer.clone();
        match self.run(&tree) {
            Ok(last) => {
                self.add_past(State::Before(Box::new(before)), answer, text);
                if let Some(value) = last {
                    self.show_picture(&value);
                }
                Ok(())
            }
            Err(errors) => {
                let code = self.workspace.fail(&errors);
                self.workspace.session.restore(before);
                self.answer = answer;
                Err(code)
            }
        }
    }

    fn parsed(&mut self, text: &str) -> Result<Tree, u8> {
        self.inputs += 1;
        let origin = match self.is_typed {
            true => format!("<input {}>", self.inputs),
            false => "<stdin>".to_string(),
        };
        let lines_before = match self.is_typed {
            true => 0,
            false => self.lines_before,
        };
        let mut sources = self.workspace.heard.sources.borrow_mut();
        let id = sources.add_part(origin, text, lines_before);
        drop(sources);
        let parsed = parse(id, text);
        match parsed.diagnostics.is_empty() {
            true => Ok(parsed.tree),
            false => Err(self.workspace.fail(&parsed.diagnostics)),
        }
    }

    /// Runs statements and says what comes of each; gives the last value if the last statement is an
    /// expression.
    fn run(&mut self, tree: &Tree) -> Result<Option<Value>, Vec<Diagnostic>> {
        if self.answer.is_none() && tree.statements.len() > 1 && !self.answer_is_defined() {
            // A value that comes first may be used by what comes behind it.
            let session = &mut self.workspace.session;
            session.remember(answer::NAME, Value::Nothing);
        }
        self.spare_answers(tree)?;
        let mut input = self.workspace.session.begin(tree)?;
        let mut last = None;
        loop {
            if let Some(next) = input.next_statement() {
                let rewritten = self.without_answer(next).map_err(|error| vec![*error])?;
                if let Some(statement) = rewritten {
                    input.replace_next(statement);
                }
            }
            let Some(entered) = self.workspace.session.step_through(&mut input) else {
                return Ok(last);
            };
            let entered = entered?;
            self.keep_answer(&entered);
            echo::entered(self, &entered);
            last = match entered.value {
                Value::Nothing => None,
                value => Some(value),
            };
        }
    }

    /// Fails where statements would define again what keeps an earlier last value.
    fn spare_answers(&self, tree: &Tree) -> Result<(), Vec<Diagnostic>> {
        let kept = self.workspace.session.statements();
        let sources = self.workspace.heard.sources.borrow();
        let of_answers = kept
            .iter()
            .filter(|statement| sources.get(statement.span.source).name == answer::ORIGIN);
        let taken: Vec<Arc<str>> = of_answers.flat_map(names_of).collect();
        let names = tree.statements.iter().map(|one| (one.span, names_of(one)));
        for (span, name) in
            names.flat_map(|(span, names)| names.into_iter().map(move |name| (span, name)))
        {
            if taken.contains(&name) {
                let message = format!("`{name}` keeps an earlier value of `{}`", answer::NAME);
                let error = Diagnostic::error(Code::BoundTwice, message).label(span, "bound again");
                return Err(vec![error.help("take another name")]);
            }
        }
        Ok(())
    }

    /// A definition with a name of its own for the last value that it uses.
    fn without_answer(
        &mut self,
        statement: &Statement,
    ) -> Result<Option<Statement>, Box<Diagnostic>> {
        let Some(last) = self.answer.clone() else {
            return Ok(None);
        };
        let text = self
            .workspace
            .heard
            .sources
            .borrow()
            .text(statement.span)
            .to_string();
        let is_kept = !matches!(statement.kind, StatementKind::Expression(_));
        if !is_kept || !mentions(&text, answer::NAME) || self.answer_is_defined() {
            return Ok(None);
        }
        let name = answer::name(&last, &mut self.workspace)?;
        let text = renamed(&text, answer::NAME, &name);
        let origin = format!("<input {}>", self.inputs);
        let documentation = statement.documentation.clone();
        Ok(
            answer::statement(&self.workspace, &origin, &text).map(|statement| Statement {
                documentation,
                ..statement
            }),
        )
    }

    /// Whether the session defines a name that is otherwise the last value's.
    fn answer_is_defined(&self) -> bool {
        self.workspace.session.defines(answer::NAME)
    }

    fn keep_answer(&mut self, entered: &Entered) {
        let StatementKind::Expression(expression) = &entered.statement.kind else {
            return;
        };
        if matches!(entered.value, Value::Nothing) || self.answer_is_defined() {
            return;
        }
        let value = entered.value.clone();
        let text = self
            .workspace
            .heard
            .sources
            .borrow()
            .text(expression.span)
            .to_string();
        let answer = Answer::new(&text, value.clone(), self.answer.as_ref());
        self.answer = Some(Rc::new(answer));
        self.workspace.session.remember(answer::NAME, value);
    }

    /// Parses an expression that a command is about; what is wrong has been said when this fails.
    pub(super) fn expression(&mut self, text: &str) -> Result<Expression, u8> {
        self.inputs += 1;
        let origin = match self.is_typed {
            true => format!("<input {}>", self.inputs),
            false => "<command>".to_string(),
        };
        self.workspace.parse(&origin, text)
    }

    /// The plain value of an expression that a command is about.
    pub(super) fn value(&mut self, text: &str) -> Result<Value, u8> {
        let expression = self.expression(text)?;
        let value = self.workspace.session.evaluate(&expression);
        value.map_err(|errors| self.workspace.fail(&errors))
    }

    /// Says that a command cannot be done.
    pub(super) fn refuse(&self, code: Code, message: impl Into<String>, help: &str) -> u8 {
        let error = Diagnostic::error(code, message);
        self.workspace.fail(&[match help {
            "" => error,
            help => error.help(help),
        }])
    }

    /// Begins a new session with the definitions of a file; the old one can be taken back.
    pub(super) fn load(&mut self, file: &Path) -> Result<(), u8> {
        let mut common = self.common.clone();
        let of_session = without_settings(&mut common);
        let mut workspace = Workspace::open(Some(file), &common, Mode::Run)?;
        let taken = workspace.session.take_in(&workspace.tree);
        taken.map_err(|errors| workspace.fail(&errors))?;
        let before = std::mem::replace(&mut self.workspace, workspace);
        let file_before = self.file.replace(file.to_owned());
        let answer = self.answer.take();
        let text = format!(":load {}", file.display());
        self.add_past(State::Other(Box::new(before), file_before), answer, &text);
        let count = self.workspace.session.statements().len();
        self.tell(&format!(
            "loaded {}: {count} statement{}",
            escaped(&file.display().to_string()),
            if count == 1 { "" } else { "s" }
        ));
        for setting in of_session {
            commands::set_value(self, &setting.name, &setting.text)?;
        }
        Ok(())
    }

    /// Takes the last input back and says which; false if there is none.
    pub(super) fn undo(&mut self) -> Option<String> {
        let past = self.past.pop()?;
        self.answer = past.answer;
        match past.state {
            State::Before(snapshot) => self.workspace.session.restore(*snapshot),
            State::Other(workspace, file) => {
                self.workspace = *workspace;
                self.file = file;
            }
        }
        Some(past.text)
    }

    fn add_past(&mut self, state: State, answer: Option<Rc<Answer>>, text: &str) {
        if self.past.len() >= KEPT_INPUTS {
            self.past.remove(0);
        }
        let line = text.trim().lines().next().unwrap_or_default();
        self.past.push(Past {
            state,
            answer,
            text: crate::diagnostic::shorten(line).into_owned(),
        });
    }

    /// Says something to whoever types, and nothing to a pipe.
    pub(super) fn tell(&self, text: &str) {
        if self.is_typed {
            output::data(text);
        }
    }

    /// A value as data.
    pub(super) fn data(&self, value: &Value) {
        output::data(&show(value, None));
    }
}

/// Takes away what is set for names without a module: the session does that as `:set`, so that it
/// can be changed again.
fn without_settings(common: &mut Common) -> Vec<super::super::arguments::Setting> {
    let all = std::mem::take(&mut common.set);
    let (of_modules, own) = all.into_iter().partition(|set| set.name.contains('.'));
    common.set = of_modules;
    own
}
