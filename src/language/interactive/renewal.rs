//! What follows when a definition is given again: which statements it replaces, and which ones have
//! to be run again because they depend on it.

use std::sync::Arc;

use crate::language::mention::{self, Names};
use crate::syntax::tree::Statement;

/// What becomes of the statements of a session when names are bound again.
pub(super) struct Renewal {
    /// Those that stay as they are.
    pub(super) kept: Vec<Statement>,
    /// Those that depend on the new definition, in order, and whether running them again changes
    /// a name; others only mention one.
    pub(super) again: Vec<(Statement, bool)>,
    /// All names that are bound again or depend on them.
    pub(super) names: Names,
    /// A name that was bound in one statement with a name that is bound again, but is not bound
    /// again itself.
    pub(super) orphan: Option<Arc<str>>,
}

impl Renewal {
    /// Works out what follows from binding `new` again.
    pub(super) fn of(statements: &[Statement], new: &Names) -> Renewal {
        let effects = mention::effects(statements);
        let replaced: Vec<bool> = effects
            .iter()
            .map(|effects| !effects.changed.is_empty() && effects.changed.is_subset(new))
            .collect();
        let mut orphans: Vec<&Arc<str>> = effects
            .iter()
            .zip(&replaced)
            .filter(|(effects, replaced)| !*replaced && !effects.bound.is_disjoint(new))
            .flat_map(|(effects, _)| effects.bound.difference(new))
            .collect();
        orphans.sort();
        let orphan = orphans.first().map(|name| Arc::clone(name));
        let mut names = new.clone();
        let mut affected = vec![false; statements.len()];
        loop {
            let mut grown = false;
            for (place, effects) in effects.iter().enumerate() {
                let depends =
                    !effects.mentioned.is_disjoint(&names) || !effects.changed.is_disjoint(&names);
                if !replaced[place] && !affected[place] && depends {
                    affected[place] = true;
                    grown = true;
                    names.extend(effects.changed.iter().cloned());
                }
            }
            if !grown {
                break;
            }
        }
        let mut kept = Vec::new();
        let mut again = Vec::new();
        for (place, statement) in statements.iter().enumerate() {
            if replaced[place] {
                continue;
            }
            match affected[place] {
                true => again.push((statement.clone(), !effects[place].changed.is_empty())),
                false => kept.push(statement.clone()),
            }
        }
        Renewal {
            kept,
            again,
            names,
            orphan,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnostic::SourceId;
    use crate::syntax::parse;

    /// The statements that stay, and those that are run again, as they are written.
    fn renewed(text: &str, new: &[&str]) -> (Vec<String>, Vec<String>) {
        let statements = parse(SourceId(0), text).tree.statements;
        let new: Names = new.iter().map(|&name| Arc::from(name)).collect();
        let renewal = Renewal::of(&statements, &new);
        let written = |statement: &Statement| {
            let span = statement.span;
            text[span.start as usize..span.end as usize].to_string()
        };
        let again = renewal
            .again
            .iter()
            .map(|(statement, _)| written(statement));
        (renewal.kept.iter().map(written).collect(), again.collect())
    }

    #[test]
    fn dependents_are_run_again_in_order() {
        let text = "let a = 1\nlet b = a\nlet c = 3\nfn f(x) = x + b\nlet d = f(c)";
        let (kept, again) = renewed(text, &["a"]);
        assert_eq!(kept, ["let c = 3"]);
        assert_eq!(again, ["let b = a", "fn f(x) = x + b", "let d = f(c)"]);
    }

    #[test]
    fn what_only_changed_an_old_variable_goes_with_it() {
        let text = "var n = 0\nn = n + 1\nlet k = n\nfor i in range(3) { n = n + i }";
        let (kept, again) = renewed(text, &["n"]);
        assert!(kept.is_empty());
        assert_eq!(again, ["let k = n"]);
    }

    #[test]
    fn all_that_changes_a_variable_is_run_again_when_one_change_is() {
        let text = "let step = 1\nvar n = 0\nn = n + 1\nn = n + step";
        let (_, again) = renewed(text, &["step"]);
        assert_eq!(again, ["var n = 0", "n = n + 1", "n = n + step"]);
        let text = "let step = 1\nvar n = 0\nfn count() { n = n + step }\ncount()";
        let (_, again) = renewed(text, &["step"]);
        assert_eq!(
            again,
            ["var n = 0", "fn count() { n = n + step }", "count()"]
        );
    }

    #[test]
    fn a_name_that_would_lose_its_definition_is_told() {
        let statements = parse(SourceId(0), "let [a, b] = [1, 2]").tree.statements;
        let new: Names = [Arc::from("a")].into_iter().collect();
        let orphan = Renewal::of(&statements, &new).orphan;
        assert_eq!(orphan.as_deref(), Some("b"));
    }
}
