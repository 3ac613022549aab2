//! What chumsky carries when a rule does not fit, and how that becomes a diagnostic.
//!
//! The parser tries many alternatives for each token, so an error is made far more often than it
//! is shown: it is a place and a set of bits, and allocates nothing. Only the error that is left
//! in the end is put into words, with a hint where the mistake is a known one.

use chumsky::DefaultExpected;
use chumsky::error::{Error, LabelError};
use chumsky::util::MaybeRef;

use super::input::Input;
use crate::diagnostic::{Code, Diagnostic, Span, shorten};
use crate::syntax::token::{Spanned, Token};

macro_rules! expectations {
    ($($name:ident $text:literal,)*) => {
        /// What can be expected at a place, in the order in which a message names it.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub(super) enum Expectation {
            $(#[doc = $text] $name,)*
        }

        impl Expectation {
            const ALL: &[Expectation] = &[$(Expectation::$name,)*];

            fn text(self) -> &'static str {
                match self { $(Expectation::$name => $text,)* }
            }
        }
    };
}

expectations! {
    Expression "an expression",
    ParameterName "the name of a parameter",
    DefinedName "a name",
    FieldName "the field's name",
    FunctionName "the function's name",
    PropertyName "the name of a property after `.`",
    BindingName "the name of a parameter or setting",
    ImportPath "the path of a file, a string",
    TestName "the test's name, a string",
    ModuleName "the module's name",
    PlainText "a string without interpolations",
    Pattern "a name or a list of names",
    Coordinate "the name of a coordinate",
    OpenCoordinates "`(` and the field's coordinates",
    OpenParameters "`(` and the function's parameters",
    Space "`R1`, `R2` or `R3`",
    OpenBindings "`{` after `with`",
    Operator "an operator",
    OpenBody "`{`",
    Comma "`,`",
    Over "`over`",
    EqualsAfterName "`=` after the name",
    EqualsAfterPattern "`=` after the names",
    EqualsAfterCoordinates "`=` after the field's coordinates",
    EqualsAfterDomain "`=` after the field's domain",
    BodyAfterParameters "`=` or `{` after the function's parameters",
    InAfterPattern "`in` after the names",
    InAfterCoordinate "`in`",
    As "`as` and a name for the module",
    Range "`in` and a range",
    Then "`then`",
    Else "`else`",
    IfOrBlock "`if` or `{` after `else`",
    Comprehension "`for`",
    Clause "`if`",
    Arrow "`->`",
    Format "a format such as `:.3`",
    CloseInterpolation "`}`",
    CloseParenthesis "`)`",
    CloseBracket "`]`",
    CloseBrace "`}`",
    EndOfStatement "the end of the statement",
}

/// A rule that did not fit.
#[derive(Clone, Debug)]
pub(super) struct SyntaxError {
    /// The token that was found, unless another error at this place says it.
    span: Option<Span>,
    /// The set of what would have fitted: bit i is the i-th [`Expectation`].
    expected: u64,
    /// What to say instead, where that is known.
    diagnostic: Option<Box<Diagnostic>>,
}

impl SyntaxError {
    /// The token at `span` is not what was expected.
    pub(super) fn expected(expectation: Expectation, span: Span) -> Self {
        SyntaxError {
            span: Some(span),
            expected: 1 << expectation as u64,
            diagnostic: None,
        }
    }

    /// A token that another rule, which is tried at the same place, has something to say about.
    pub(super) const UNSAID: SyntaxError = SyntaxError {
        span: None,
        expected: 0,
        diagnostic: None,
    };

    /// A mistake with its own words.
    pub(super) fn said(diagnostic: Diagnostic, span: Span) -> Self {
        SyntaxError {
            span: Some(span),
            expected: 0,
            diagnostic: Some(Box::new(diagnostic)),
        }
    }

    fn expects(&self, expectation: Expectation) -> bool {
        self.expected & (1 << expectation as u64) != 0
    }
}

impl<'source> LabelError<'source, Input<'source>, DefaultExpected<'source, Token>> for SyntaxError {
    fn expected_found<E: IntoIterator<Item = DefaultExpected<'source, Token>>>(
        _: E,
        _: Option<MaybeRef<'source, Token>>,
        span: Span,
    ) -> Self {
        SyntaxError {
            span: Some(span),
            expected: 0,
            diagnostic: None,
        }
    }
}

impl<'source> LabelError<'source, Input<'source>, Expectation> for SyntaxError {
    fn expected_found<E: IntoIterator<Item = Expectation>>(
        expected: E,
        _: Option<MaybeRef<'source, Token>>,
        span: Span,
    ) -> Self {
        let bits = expected.into_iter().map(|one| 1 << one as u64);
        SyntaxError {
            span: Some(span),
            expected: bits.fold(0, |set, bit: u64| set | bit),
            diagnostic: None,
        }
    }

    fn label_with(&mut self, label: Expectation) {
        self.expected = 1 << label as u64;
    }
}

impl<'source> Error<'source, Input<'source>> for SyntaxError {
    fn merge(mut self, other: Self) -> Self {
        self.span = self.span.or(other.span);
        self.expected |= other.expected;
        self.diagnostic = self.diagnostic.or(other.diagnostic);
        self
    }
}

/// Puts an error into words. `tokens` is what was parsed and `end` the place of its end.
pub(super) fn describe(
    error: SyntaxError,
    text: &str,
    tokens: &[Spanned],
    end: Span,
) -> Diagnostic {
    if let Some(diagnostic) = error.diagnostic {
        return *diagnostic;
    }
    let place = error.span.unwrap_or(end);
    let at = tokens.partition_point(|(_, span)| span.start < place.start);
    let found = tokens
        .get(at)
        .filter(|(_, span)| *span == place)
        .map(|&(token, _)| token);
    let found_words = found_words(found, place, text);
    let (message, label) = match expected_words(&error) {
        Some(expected) => (
            format!("expected {expected}, found {found_words}"),
            format!("expected {expected}"),
        ),
        None => (
            format!("unexpected {found_words}"),
            "not expected here".to_owned(),
        ),
    };
    let diagnostic = Diagnostic::error(Code::UnexpectedToken, message).label(place, label);
    match hint(&error, found, text, &tokens[..at]) {
        Some(help) => diagnostic.help(help),
        None => diagnostic,
    }
}

/// “a, b or c”, with at most four alternatives: where an expression is expected, nothing else is
/// worth naming.
fn expected_words(error: &SyntaxError) -> Option<String> {
    let mut all: Vec<&str> = Expectation::ALL
        .iter()
        .filter(|&&one| error.expects(one))
        .map(|one| one.text())
        .collect();
    if error.expects(Expectation::Expression) {
        all.truncate(1);
    }
    all.truncate(4);
    let last = all.pop()?;
    Some(if all.is_empty() {
        last.to_owned()
    } else {
        format!("{} or {last}", all.join(", "))
    })
}

fn found_words(found: Option<Token>, place: Span, text: &str) -> String {
    match found {
        None => "the end of the file".to_owned(),
        Some(Token::Newline) => "the end of the line".to_owned(),
        Some(Token::StringStart) => "a string".to_owned(),
        Some(Token::TextRun | Token::TextEscape | Token::StringEnd) => "text".to_owned(),
        Some(_) => {
            let written = &text[place.start as usize..place.end as usize];
            format!("`{}`", shorten(written))
        }
    }
}

/// What to write instead, for the mistakes that people make.
fn hint(
    error: &SyntaxError,
    found: Option<Token>,
    text: &str,
    before: &[Spanned],
) -> Option<String> {
    use Expectation as E;
    let word = |span: Span| shorten(&text[span.start as usize..span.end as usize]);
    let wants_name = [
        E::ParameterName,
        E::DefinedName,
        E::FieldName,
        E::FunctionName,
        E::PropertyName,
        E::BindingName,
        E::ModuleName,
        E::Pattern,
        E::Coordinate,
    ]
    .iter()
    .any(|&name| error.expects(name));
    match (found, before) {
        (Some(token), _) if wants_name && token.is_keyword() => Some(format!(
            "{token} is a word of the language, so it cannot be a name"
        )),
        (Some(Token::Assign), _) if error.expects(E::Operator) => {
            Some("`==` asks whether two values are equal; `=` gives a name its value".to_owned())
        }
        (Some(Token::Arrow), _) => Some(
            "the parameters of a function stand before `->`: `x -> …` or `(x, y) -> …`".to_owned(),
        ),
        (_, [.., (keyword, _), (Token::Name, name)])
            if error.expects(E::EqualsAfterName) && keyword.is_keyword() =>
        {
            Some(format!("write `{} {} = …`", keyword.text(), word(*name)))
        }
        _ if error.expects(E::BodyAfterParameters) => {
            Some("write `fn f(x) = x^2` or `fn f(x) { … }`".to_owned())
        }
        _ if error.expects(E::EqualsAfterCoordinates) => {
            Some("write `field f(x, y, z) = …`, or `field f(x, y, z) over -1..1 = …`".to_owned())
        }
        _ if error.expects(E::ImportPath) || error.expects(E::As) => {
            Some("write `import \"parts.imp\" as parts`".to_owned())
        }
        _ if error.expects(E::TestName) => Some("write `test \"what is tested\" { … }`".to_owned()),
        _ if error.expects(E::Then) || error.expects(E::Else) => {
            Some("write `if c then a else b` or `if c { … } else { … }`".to_owned())
        }
        (_, [.., (Token::Number, number), (Token::Dot, dot)]) if number.end == dot.start => {
            Some(format!(
                "a number has a digit on both sides of its point: `{}.0`",
                word(*number)
            ))
        }
        (Some(Token::InterpolationEnd), [.., (Token::InterpolationStart, _)]) => {
            Some("`{{` and `}}` are braces in a string".to_owned())
        }
        _ => None,
    }
}
