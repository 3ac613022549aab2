//! Conditions and branches: decided ones, open ones that become a select, and unknown ones.

use std::rc::Rc;

use crate::diagnostic::{Code, Span};
use crate::language::arithmetic::{self, not_a_condition};
use crate::language::function::At;
use crate::language::scope::Scope;
use crate::language::session::{Branch, BranchKind, Session};
use crate::language::value::{Condition, Outcome, Value, failure};
use crate::syntax::tree::{Expression, ExpressionKind};

impl Session {
    pub(super) fn choice(
        &mut self,
        condition: &Expression,
        consequence: &Expression,
        alternative: Option<&Expression>,
        span: Span,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        let decided = match self.usable(condition, scope)? {
            Value::Bool(holds) => holds,
            Value::Unknown => return self.unknown_choice(consequence, alternative, scope),
            Value::Condition(open) => {
                // Where a script's branches do more than give a value, only one may be run.
                let acts = |branch: &Expression| matches!(&*branch.kind, ExpressionKind::Block(_));
                let decidable = self.graph.level == 0;
                let plain = decidable && (acts(consequence) || alternative.is_none_or(acts));
                if !plain {
                    let chosen = self.open_choice(open, consequence, alternative, span, scope);
                    match chosen {
                        Err(error) if decidable && error.code == Code::WrongKind => {}
                        chosen => return chosen,
                    }
                }
                match self.plain(Value::Condition(open), condition.span)? {
                    Value::Bool(holds) => holds,
                    other => return Err(not_a_condition(&other).at(condition.span, "here")),
                }
            }
            other => return Err(not_a_condition(&other).at(condition.span, other.kind())),
        };
        match (decided, alternative) {
            (true, _) => self.expression(consequence, scope),
            (false, Some(alternative)) => self.expression(alternative, scope),
            (false, None) => Ok(Value::Nothing),
        }
    }

    /// Both branches under a condition that depends on the point or on parameters, joined by a
    /// select.
    fn open_choice(
        &mut self,
        condition: Condition,
        consequence: &Expression,
        alternative: Option<&Expression>,
        span: Span,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        let Some(alternative) = alternative else {
            let message = "this `if` has no `else`, so it may have no value";
            return Err(failure(Code::WrongKind, message).at(span, "without an `else`"));
        };
        let (first, second) = self.branch(BranchKind::Traced, |session| {
            let first = session.usable(consequence, scope)?;
            Ok((first, session.usable(alternative, scope)?))
        })?;
        arithmetic::select(&mut self.graph, condition, &first, &second)
            .at(span, "both branches are needed")
    }

    /// Both branches under an unknown condition: nothing is known afterwards but that they can
    /// be evaluated.
    pub(super) fn unknown_choice(
        &mut self,
        consequence: &Expression,
        alternative: Option<&Expression>,
        scope: &Rc<Scope>,
    ) -> Outcome<Value> {
        self.branch(BranchKind::Unknown, |session| {
            session.expression(consequence, scope)?;
            if let Some(alternative) = alternative {
                session.expression(alternative, scope)?;
            }
            Ok(Value::Unknown)
        })
    }

    /// Evaluates a part of the program of which it is open whether it is meant.
    pub(super) fn branch<T>(
        &mut self,
        kind: BranchKind,
        evaluate: impl FnOnce(&mut Session) -> Outcome<T>,
    ) -> Outcome<T> {
        let since = Scope::now();
        let outer = self.branch.replace(Branch { since, kind });
        let result = evaluate(self);
        self.branch = outer;
        result
    }
}
