//! What the formatter makes of each construct, and of comments in every odd place.

use imp::diagnostic::SourceId;
use imp::formatter::format;

use crate::{check, formatted};

/// Checks what becomes of texts: pairs of before and after.
fn check_pairs(pairs: &[(&str, &str)]) {
    for (before, after) in pairs {
        assert_eq!(formatted(before), *after, "from\n{before}");
        assert_eq!(check(before), Ok(true));
    }
}

#[test]
fn spaces_stand_around_operators_and_nowhere_else() {
    check_pairs(&[
        ("let  a=1+2 -3*4\n", "let a = 1 + 2 - 3*4\n"),
        ("a =b [ 0 ] . x\n", "a = b[0].x\n"),
        (
            "let a = 2 ^ -1 / 3 .. 4 by 5\n",
            "let a = 2^-1 / 3..4 by 5\n",
        ),
        (
            "let a = - x ^ 2\nlet b = ! f | not  c\n",
            "let a = -x^2\nlet b = !f | not c\n",
        ),
        (
            "f( x ,k=3 , ) |>g( )\n",
            "f(\n    x,\n    k = 3,\n)\n    |> g()\n",
        ),
        (
            "let a = [ 1,2 , 3 ]\nlet b = [ ]\n",
            "let a = [1, 2, 3]\nlet b = []\n",
        ),
        (
            "let [a,b] = c with{ r=1;s = 2 }\n",
            "let [a, b] = c with {r = 1, s = 2}\n",
        ),
        ("fn f(a,b=1,c ..)=a\n", "fn f(a, b = 1, c..) = a\n"),
        (
            "field f( p in R3 )over 0..1,-1 .. 1=p.x\n",
            "field f(p in R3) over 0..1, -1..1 = p.x\n",
        ),
        (
            "param r=1 in 0 .. 2\nsetting n= 3\n",
            "param r = 1 in 0..2\nsetting n = 3\n",
        ),
        ("import   \"a.imp\"as a\n", "import \"a.imp\" as a\n"),
        (
            "let g = ( x,y )->x<y<=1 and  true\n",
            "let g = (x, y) -> x < y <= 1 and true\n",
        ),
        (
            "[i for i in range( 3 )if i>0]\n",
            "[i for i in range(3) if i > 0]\n",
        ),
    ]);
}

#[test]
fn numbers_strings_and_parentheses_stay_as_they_are() {
    let text =
        "let a = 1_000 + 1e-3 + 45deg + 0.25turn + ((2.50))\nprint(\"{ a:.3 }  {{ \\u{3c0}\")\n";
    check_pairs(&[(text, text)]);
}

#[test]
fn products_stay_as_tight_as_they_were_written() {
    check_pairs(&[
        ("let a = 2*pi* r  /  3\n", "let a = 2*pi*r / 3\n"),
        ("let a = b  *  c + d@e\n", "let a = b * c + d@e\n"),
    ]);
}

#[test]
fn statements_stand_on_lines_of_their_own() {
    check_pairs(&[
        (
            "\n\n\nlet a = 1;let b = 2;\n\n\n\nlet c = 3\n;\n",
            "let a = 1\nlet b = 2\n\nlet c = 3\n",
        ),
        ("for i in x { f(i) ;g(i)}\n", "for i in x { f(i); g(i) }\n"),
        (
            "for i in x { f(i)\ng(i)}\n",
            "for i in x {\n    f(i)\n    g(i)\n}\n",
        ),
        (
            "while true {\n}\ntest \"t\"{ }\n",
            "while true {}\ntest \"t\" {}\n",
        ),
        (
            "if a { b } else if c { d\n} else { e }\n",
            "if a {\n    b\n} else if c {\n    d\n} else {\n    e\n}\n",
        ),
        ("let a = 1\r\n\r\nlet b = 2\r\n", "let a = 1\n\nlet b = 2\n"),
        ("\u{feff}let a = 1", "let a = 1\n"),
        ("", ""),
        ("\n \n", ""),
    ]);
}

#[test]
fn long_lines_break_at_the_loosest_operator_and_stay_one_statement() {
    let name = "a_name_that_is_quite_long";
    check_pairs(&[
        (
            &format!("let a = {name} * {name} and {name} == {name}, 1\n").replace(", 1", ""),
            &format!("let a =\n    {name} * {name}\n    and {name} == {name}\n"),
        ),
        (
            &format!("let a = {name} + {name} + {name} + {name}\n"),
            &format!("let a =\n    {name} + {name} + {name}\n    + {name}\n"),
        ),
        // A line that begins with `-` would be a statement of its own.
        (
            &format!("let a = {name} + {name} - {name} - {name}\n"),
            &format!("let a =\n    {name} + {name} - {name} -\n    {name}\n"),
        ),
        (
            &format!("let a = ({name} + {name} - {name} - {name})\n"),
            &format!("let a = (\n    {name} + {name} - {name}\n    - {name}\n)\n"),
        ),
        (
            &format!("f({name}, {name}, {name}, {name})\n"),
            &format!("f(\n    {name},\n    {name},\n    {name},\n    {name},\n)\n"),
        ),
        (
            &format!("let a = if {name} then {name} else if {name} then {name} else {name}\n"),
            &format!(
                "let a =\n    if {name} then {name}\n    else if {name} then {name}\n    else {name}\n"
            ),
        ),
        (
            &format!("let a = [{name} for {name} in {name} if {name}, ]\n").replace(", ]", " ]"),
            &format!("let a = [\n    {name}\n    for {name} in {name}\n    if {name}\n]\n"),
        ),
        (
            &format!("a |> {name}(1) |> {name}(2) |> {name}(3) |> f()\n"),
            &format!("a\n    |> {name}(1)\n    |> {name}(2)\n    |> {name}(3)\n    |> f()\n"),
        ),
    ]);
}

#[test]
fn a_function_with_a_block_stands_close_in_its_brackets() {
    check_pairs(&[
        (
            "as_field(p->{\nlet q = p\nq },2)\n",
            "as_field(p -> {\n    let q = p\n    q\n}, 2)\n",
        ),
        (
            "sum({ let a = i\na } for i in x)\n",
            "sum({\n    let a = i\n    a\n} for i in x)\n",
        ),
    ]);
}

#[test]
fn a_comma_behind_the_last_element_keeps_a_list_broken() {
    check_pairs(&[
        ("let a = [b, c,]\n", "let a = [\n    b,\n    c,\n]\n"),
        ("let a = [\n    b,\n    c]\n", "let a = [b, c]\n"),
    ]);
}

#[test]
fn comments_stay_where_they_are() {
    check_pairs(&[
        (
            "#!x\n#a  \n\n\n#b\nlet a = 1#c\n",
            "#!x\n#a\n\n#b\nlet a = 1 #c\n",
        ),
        (
            "let a = 1 # a\nlet bc = 2 # b\n\nlet d = 3 # c\n",
            "let a = 1  # a\nlet bc = 2 # b\n\nlet d = 3 # c\n",
        ),
        (
            "f(a, # first\nb # second\n)\n",
            "f(\n    a, # first\n    b, # second\n)\n",
        ),
        (
            "f(\n# before\na\n# behind\n)\n",
            "f(\n    # before\n    a,\n    # behind\n)\n",
        ),
        ("f(# inside\n)\n", "f( # inside\n)\n"),
        (
            "let a = (b + # plus\nc)\n",
            "let a = (\n    b\n    + # plus\n    c\n)\n",
        ),
        (
            "let a = (b # left\n+ c)\n",
            "let a = (\n    b # left\n    + c\n)\n",
        ),
        ("let a = # why\n1\n", "let a = # why\n    1\n"),
        (
            "for i in x {# head\n# body\n}\n",
            "for i in x { # head\n    # body\n}\n",
        ),
        (
            "for i in x {\nf(i)\n\n# end\n}\n",
            "for i in x {\n    f(i)\n\n    # end\n}\n",
        ),
        (
            "if a {\nb\n} # so\nelse {\nc\n}\n",
            "if a {\n    b\n} else { # so\n    c\n}\n",
        ),
        (
            "if a {\nb\n}\n# so\nelse {\nc\n}\n",
            "if a {\n    b\n}\n# so\nelse {\n    c\n}\n",
        ),
        ("## says\nfn f(x) = x\n", "## says\nfn f(x) = x\n"),
    ]);
}

#[test]
fn what_is_not_a_doc_comment_does_not_become_one() {
    check_pairs(&[
        ("## a\n;let b = 1\n", "## a\n\nlet b = 1\n"),
        ("## a\n\nlet b = 1\n", "## a\n\nlet b = 1\n"),
        (
            "let a = 1\n# x\n;## y\n## z\nlet b = 2\n",
            "let a = 1\n# x\n## y\n\n## z\nlet b = 2\n",
        ),
    ]);
}

#[test]
fn a_text_with_mistakes_is_refused() {
    let errors = format(SourceId(0), "let a = (1").unwrap_err();
    assert_eq!(errors[0].message, "`(` is never closed");
}

#[test]
fn the_deepest_tree_and_a_long_text_can_be_formatted() {
    for link in ["-", "not ", "x -> ", "if a then b else ", "x^"] {
        assert_eq!(check(&(link.repeat(900) + "x")), Ok(true), "{link}");
    }
    let sum = "x + ".repeat(1_900) + "x";
    assert_eq!(check(&sum), Ok(true));
    let brackets = "f([".repeat(120) + &"])".repeat(120);
    assert_eq!(check(&brackets), Ok(true));
    let long = "let a = f(x, [1, 2, 3], y -> { y + 1 }) # note\n".repeat(2_000);
    assert_eq!(formatted(&long), long);
}
