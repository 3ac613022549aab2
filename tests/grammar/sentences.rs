//! Sentences of the formal grammar are programs.

use imp::diagnostic::SourceId;
use imp::syntax::parse;

use crate::generator::Generator;
use crate::notation::Grammar;

/// How many sentences are tried.
pub(crate) const SENTENCES: usize = 10_000;

/// Where the random numbers begin.
pub(crate) const SEED: u64 = 1;

pub(crate) fn formal_grammar() -> Grammar {
    Grammar::read(include_str!("../../grammar/imp.ebnf"))
}

#[test]
fn sentences_of_the_formal_grammar_are_programs() {
    let grammar = formal_grammar();
    let mut generator = Generator::new(&grammar, SEED);
    let mut wrong = Vec::new();
    for _ in 0..SENTENCES {
        let text = generator.sentence("file");
        let parsed = parse(SourceId(0), &text);
        if let Some(diagnostic) = parsed.diagnostics.first() {
            wrong.push((text, diagnostic.message.clone()));
        }
    }
    wrong.sort_by_key(|(text, _)| text.len());
    assert!(
        wrong.is_empty(),
        "{} sentences are no programs:\n{}",
        wrong.len(),
        shortest(&wrong)
    );
    let unused: Vec<&String> = (grammar.marks.iter().zip(&generator.used))
        .filter(|&(_, &used)| used == 0)
        .map(|(mark, _)| mark)
        .collect();
    assert!(unused.is_empty(), "never used: {unused:#?}");
}

/// The shortest of the sentences that failed, with what is wrong with them.
fn shortest(wrong: &[(String, String)]) -> String {
    let lines = wrong.iter().take(10);
    let lines = lines.map(|(text, message)| format!("{message}: {text:?}"));
    lines.collect::<Vec<String>>().join("\n")
}
