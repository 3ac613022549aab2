//! `ans`: the last value, and how it came about, so that a definition that uses it can be kept.

use std::rc::Rc;

use super::super::workspace::Workspace;
use crate::diagnostic::{Code, Diagnostic};
use crate::language::Value;
use crate::syntax::tree::Statement;
use crate::syntax::{mentions, parse, renamed};

/// The name of the last value.
pub(super) const NAME: &str = "ans";

/// What errors call the text of a definition that keeps a last value.
pub(super) const ORIGIN: &str = "<answer>";

/// So many values in a row may be made of each other before the first of them is forgotten.
const LONGEST: usize = 100;

/// A last value and the expression that gave it.
#[derive(Clone)]
pub(super) struct Answer {
    text: String,
    value: Value,
    /// The last value before it, if the expression uses that.
    of: Option<Rc<Answer>>,
    length: usize,
}

impl Answer {
    /// The value of an expression that was entered after `before` was the last value.
    pub(super) fn new(text: &str, value: Value, before: Option<&Rc<Answer>>) -> Answer {
        let before = before.filter(|_| mentions(text, NAME));
        let length = before.map_or(0, |before| before.length) + 1;
        Answer {
            text: text.to_string(),
            value,
            of: before.filter(|_| length <= LONGEST).map(Rc::clone),
            length: length.min(LONGEST + 1),
        }
    }
}

/// Gives a last value a name of its own in the session, so that what uses it stays true when the
/// last value is another; gives that name.
pub(super) fn name(
    answer: &Rc<Answer>,
    workspace: &mut Workspace,
) -> Result<String, Box<Diagnostic>> {
    let mut chain = vec![Rc::clone(answer)];
    while let Some(before) = chain.last().and_then(|answer| answer.of.clone()) {
        chain.push(before);
    }
    let mut name = String::new();
    for answer in chain.iter().rev() {
        let text = match (mentions(&answer.text, NAME), name.is_empty()) {
            (false, _) => answer.text.clone(),
            (true, false) => renamed(&answer.text, NAME, &name),
            (true, true) => {
                let message = format!("`{NAME}` was made of too many values in a row to be kept");
                let error = Diagnostic::error(Code::LengthLimit, message);
                return Err(Box::new(
                    error.help("give a value on the way a name with `let`"),
                ));
            }
        };
        name = free_name(workspace);
        let text = format!("let {name} = {text}");
        if let Some(statement) = statement(workspace, ORIGIN, &text) {
            let value = answer.value.clone();
            workspace.session.keep_as(statement, &name, value);
        }
    }
    Ok(name)
}

/// The only statement of a text.
pub(super) fn statement(workspace: &Workspace, origin: &str, text: &str) -> Option<Statement> {
    let id = workspace.heard.sources.borrow_mut().add(origin, text);
    parse(id, text).tree.statements.into_iter().next()
}

fn free_name(workspace: &Workspace) -> String {
    let mut number = 1;
    loop {
        let name = format!("{NAME}{number}");
        if workspace.session.bound(&name).is_none() {
            return name;
        }
        number += 1;
    }
}
