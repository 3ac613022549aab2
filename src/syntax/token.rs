//! The words of the language: what the lexer makes of the text and the parser reads.
//!
//! A token is only a kind, one byte wide; what a name or a number says is read from the source
//! text under the token's span. A string is several tokens, so that the expressions in it have
//! places like any other: `"a{b:.3}"` is `StringStart TextRun InterpolationStart Name Format
//! InterpolationEnd StringEnd`.

use std::fmt;

use crate::diagnostic::Span;

/// A token and its place.
pub(super) type Spanned = (Token, Span);

macro_rules! tokens {
    ($($name:ident $text:literal,)*) => {
        /// A kind of token.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(super) enum Token {
            $(#[doc = $text] $name,)*
        }

        impl Token {
            /// All kinds.
            pub(super) const ALL: &[Token] = &[$(Token::$name,)*];

            /// What one writes for it, or a description where that varies.
            pub(super) fn text(self) -> &'static str {
                match self { $(Token::$name => $text,)* }
            }
        }
    };
}

tokens! {
    Let "let",
    Var "var",
    Param "param",
    Fn "fn",
    Field "field",
    Over "over",
    For "for",
    In "in",
    While "while",
    If "if",
    Then "then",
    Else "else",
    And "and",
    Or "or",
    Not "not",
    With "with",
    By "by",
    True "true",
    False "false",
    Setting "setting",
    Import "import",
    Test "test",
    As "as",
    Plus "+",
    Minus "-",
    Star "*",
    Slash "/",
    Percent "%",
    At "@",
    Caret "^",
    Bar "|",
    Ampersand "&",
    Backslash "\\",
    Bang "!",
    Equal "==",
    NotEqual "!=",
    Less "<",
    LessEqual "<=",
    Greater ">",
    GreaterEqual ">=",
    Assign "=",
    Arrow "->",
    Pipe "|>",
    DotDot "..",
    Dot ".",
    Comma ",",
    Semicolon ";",
    OpenParenthesis "(",
    CloseParenthesis ")",
    OpenBracket "[",
    CloseBracket "]",
    OpenBrace "{",
    CloseBrace "}",
    // From here on the text is a description.
    Name "a name",
    LambdaName "the parameter of a function",
    LambdaParenthesis "the parameters of a function",
    Number "a number",
    Newline "the end of the line",
    StringStart "a string",
    TextRun "text",
    TextEscape "an escape sequence",
    InterpolationStart "the `{` of an interpolation",
    Format "a format",
    InterpolationEnd "the `}` of an interpolation",
    StringEnd "the end of the string",
}

impl fmt::Display for Token {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_fixed() {
            write!(formatter, "`{}`", self.text())
        } else {
            formatter.write_str(self.text())
        }
    }
}

impl Token {
    /// Whether it is always written in the same way.
    pub(super) fn is_fixed(self) -> bool {
        (self as u8) < (Token::Name as u8)
    }

    /// All reserved words.
    pub(super) fn keywords() -> impl Iterator<Item = Token> {
        Token::ALL
            .iter()
            .copied()
            .filter(|token| token.is_keyword())
    }

    /// Whether it is a reserved word.
    pub(super) fn is_keyword(self) -> bool {
        (self as u8) <= (Token::As as u8)
    }

    /// For a bracket that opens: the one that closes it.
    pub(super) fn closer(self) -> Option<Token> {
        match self {
            Token::OpenParenthesis | Token::LambdaParenthesis => Some(Token::CloseParenthesis),
            Token::OpenBracket => Some(Token::CloseBracket),
            Token::OpenBrace => Some(Token::CloseBrace),
            Token::InterpolationStart => Some(Token::InterpolationEnd),
            _ => None,
        }
    }

    /// Whether it is a bracket that closes.
    pub(super) fn is_closer(self) -> bool {
        matches!(
            self,
            Token::CloseParenthesis
                | Token::CloseBracket
                | Token::CloseBrace
                | Token::InterpolationEnd
        )
    }

    /// Whether an operand can end with it, so that a `-` after it is a subtraction.
    pub(super) fn ends_operand(self) -> bool {
        self.is_closer()
            || matches!(
                self,
                Token::Name | Token::Number | Token::StringEnd | Token::True | Token::False
            )
    }

    /// Whether a line that begins with it goes on with the statement of the line before: the
    /// binary operators and the words that cannot start a statement. `-` and `not` can.
    pub(super) fn continues_statement(self) -> bool {
        use Token::*;
        matches!(
            self,
            Plus | Star
                | Slash
                | Percent
                | At
                | Caret
                | Bar
                | Ampersand
                | Backslash
                | Equal
                | NotEqual
                | Less
                | LessEqual
                | Greater
                | GreaterEqual
                | Assign
                | Arrow
                | Pipe
                | DotDot
                | Dot
                | And
                | Or
                | Then
                | Else
                | With
                | Over
                | By
                | In
        )
    }

    /// Whether the line after it goes on with its statement: an operator wants its operand.
    pub(super) fn wants_more(self) -> bool {
        self.continues_statement()
            || matches!(self, Token::Minus | Token::Bang | Token::Not | Token::Comma)
    }

    /// Whether it can only stand at the start of a statement. Such a word at the start of a line
    /// shows that a bracket was left open before it.
    pub(super) fn starts_definition(self) -> bool {
        use Token::*;
        matches!(
            self,
            Let | Var | Param | Fn | Field | While | Setting | Import | Test
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_formal_grammar_knows_every_fixed_token() {
        let grammar = include_str!("../../grammar/imp.ebnf");
        for token in Token::ALL.iter().filter(|token| token.is_fixed()) {
            let written = token.text();
            let quoted = grammar.contains(&format!("'{written}'"));
            assert!(
                quoted || grammar.contains(&format!("`{written}`")),
                "{token}"
            );
        }
    }
}
