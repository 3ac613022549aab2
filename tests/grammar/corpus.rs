//! The tests in tree-sitter's own format, `grammar/tree-sitter-imp/test/corpus/`: a title between
//! lines of `=`, a text, a line `---`, and the tree that it must give.

use std::path::Path;

use crate::tree_sitter::{files, parser};

/// A test: its title, the text and the tree as an S-expression.
struct Case {
    title: String,
    text: String,
    tree: String,
}

fn cases(file: &str) -> Vec<Case> {
    let mut cases = Vec::new();
    let mut lines = file.lines().peekable();
    while let Some(line) = lines.next() {
        if line.is_empty() {
            continue;
        }
        assert!(
            line.starts_with("==="),
            "{line:?} is not the border of a title"
        );
        let title = lines.next().unwrap_or_default().to_owned();
        assert!(
            lines.next().is_some_and(|border| border.starts_with("===")),
            "{title}"
        );
        let text: Vec<&str> = lines.by_ref().take_while(|&line| line != "---").collect();
        let mut tree = Vec::new();
        while let Some(line) = lines.next_if(|line| !line.starts_with("===")) {
            tree.extend(line.split_whitespace());
        }
        cases.push(Case {
            title,
            text: text.join("\n"),
            tree: tree.join(" ").replace(" )", ")"),
        });
    }
    cases
}

#[test]
fn the_corpus_gives_its_trees() {
    let mut parser = parser();
    let mut count = 0;
    for path in files("grammar/tree-sitter-imp/test/corpus", "txt") {
        let file = std::fs::read_to_string(&path).expect("a text");
        for case in cases(&file) {
            let tree = parser
                .parse(&case.text, None)
                .expect("nothing stops the parser");
            let name = path.file_stem().map(Path::new).unwrap_or(&path).display();
            assert_eq!(
                tree.root_node().to_sexp(),
                case.tree,
                "{name}: {}",
                case.title
            );
            count += 1;
        }
    }
    assert!(count >= 20, "only {count} cases");
}
