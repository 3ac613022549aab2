//! Statements, blocks, and how the parser goes on after a mistake.

use std::sync::Arc;

use chumsky::prelude::*;

use super::build::{Deep, DeepExpression, gather, optional};
use super::error::{Expectation, SyntaxError};
use super::expression::expression;
use super::input::{Extra, Input, Place, Rule, next_span, pick, rest_of_statement, token};
use super::input::{name, rest_of_brackets};
use super::operand::literal;
use super::pattern::{list_pattern, parameter, pattern};
use crate::diagnostic::{Code, Diagnostic};
use crate::syntax::token::Token;
use crate::syntax::tree::{
    Block, Coordinates, Expression, ExpressionKind, Function, Name, Pattern, Statement,
    StatementKind,
};

type DeepKind = Deep<StatementKind>;

/// The rule for a whole file.
pub(super) fn file<'source>() -> Rule<'source, Vec<Statement>> {
    let statement = recursive(|statement| {
        let statement: Rule<'source, Deep<Statement>> = statement.boxed();
        let block = block(statement);
        let expression = expression(block.clone());
        recovering(kind(expression, block))
    });
    statements(statement.boxed())
        .map(|statements| statements.value)
        .boxed()
}

/// Statements with line ends or `;` between them.
fn statements<'source>(
    statement: Rule<'source, Deep<Statement>>,
) -> Rule<'source, Deep<Vec<Statement>>> {
    let separator = pick(Expectation::EndOfStatement, |token| {
        matches!(token, Token::Newline | Token::Semicolon).then_some(())
    });
    statement
        .separated_by(separator.repeated().at_least(1))
        .allow_leading()
        .allow_trailing()
        .collect::<Vec<_>>()
        .map(gather)
        .boxed()
}

/// `{ statements }`
fn block<'source>(statement: Rule<'source, Deep<Statement>>) -> Rule<'source, Deep<Block>> {
    let separators = pick(Expectation::EndOfStatement, |token| {
        matches!(token, Token::Newline | Token::Semicolon).then_some(())
    })
    .repeated();
    token(Token::OpenBrace, Expectation::OpenBody)
        .ignore_then(separators)
        .ignore_then(statements(statement))
        .then_ignore(token(Token::CloseBrace, Expectation::EndOfStatement))
        .map_with(|statements, place: &mut Place<'source, '_>| {
            let span = place.span();
            statements.map(|statements| Block { statements, span })
        })
        .boxed()
}

/// A statement up to its end; where that does not fit, an error node for all up to its end.
fn recovering<'source>(kind: Rule<'source, DeepKind>) -> Rule<'source, Deep<Statement>> {
    kind.then_ignore(end_of_statement())
        .recover_with(via_parser(
            rest_of_statement().map(|()| Deep::new(StatementKind::Error, 0)),
        ))
        .map_with(|kind, place: &mut Place<'source, '_>| {
            let span = place.span();
            let documentation = place.state().documentation(span.start);
            kind.map(|kind| Statement {
                kind,
                span,
                documentation,
            })
        })
        .boxed()
}

/// Looks whether a statement can end here; takes nothing.
fn end_of_statement<'source>() -> Rule<'source, ()> {
    custom(
        |input: &mut chumsky::input::InputRef<'source, '_, Input<'source>, Extra<'source>>| {
            match input.peek() {
                None | Some(Token::Newline | Token::Semicolon | Token::CloseBrace) => Ok(()),
                Some(_) => Err(SyntaxError::expected(
                    Expectation::EndOfStatement,
                    next_span(input),
                )),
            }
        },
    )
    .boxed()
}

fn kind<'source>(
    expression: Rule<'source, DeepExpression>,
    block: Rule<'source, Deep<Block>>,
) -> Rule<'source, DeepKind> {
    choice((
        binding(expression.clone()),
        variable(expression.clone()),
        parameter_definition(expression.clone()),
        setting_definition(expression.clone()),
        import(),
        test(block.clone()),
        function(expression.clone(), block.clone()),
        field(expression.clone()),
        for_loop(expression.clone(), block.clone()),
        while_loop(expression.clone(), block),
        assignment(expression),
    ))
    .boxed()
}

/// `let pattern = value`
fn binding<'source>(expression: Rule<'source, DeepExpression>) -> Rule<'source, DeepKind> {
    let name = name(Expectation::Pattern)
        .map(Pattern::Name)
        .then_ignore(token(Token::Assign, Expectation::EqualsAfterName));
    let list = list_pattern(Expectation::Pattern)
        .then_ignore(token(Token::Assign, Expectation::EqualsAfterPattern));
    token(Token::Let, Expectation::Expression)
        .ignore_then(name.boxed().or(list.boxed()))
        .then(expression)
        .map(|(pattern, value)| value.map(|value| StatementKind::Let { pattern, value }))
        .boxed()
}

/// `var name = value`
fn variable<'source>(expression: Rule<'source, DeepExpression>) -> Rule<'source, DeepKind> {
    token(Token::Var, Expectation::Expression)
        .ignore_then(name(Expectation::DefinedName))
        .then_ignore(token(Token::Assign, Expectation::EqualsAfterName))
        .then(expression)
        .map(|(name, value)| value.map(|value| StatementKind::Variable { name, value }))
        .boxed()
}

/// `param name = value in range`
fn parameter_definition<'source>(
    expression: Rule<'source, DeepExpression>,
) -> Rule<'source, DeepKind> {
    ranged_definition(Token::Param, expression)
        .map(|ranged| {
            ranged.map(|(name, value, range)| StatementKind::Parameter { name, value, range })
        })
        .boxed()
}

/// `setting name = value in range`
fn setting_definition<'source>(
    expression: Rule<'source, DeepExpression>,
) -> Rule<'source, DeepKind> {
    ranged_definition(Token::Setting, expression)
        .map(|ranged| {
            ranged.map(|(name, value, range)| StatementKind::Setting { name, value, range })
        })
        .boxed()
}

/// `word name = value in range`
fn ranged_definition<'source>(
    word: Token,
    expression: Rule<'source, DeepExpression>,
) -> Rule<'source, Deep<(Name, Expression, Option<Expression>)>> {
    let range = token(Token::In, Expectation::Range)
        .ignore_then(expression.clone())
        .or_not();
    token(word, Expectation::Expression)
        .ignore_then(name(Expectation::DefinedName))
        .then_ignore(token(Token::Assign, Expectation::EqualsAfterName))
        .then(expression)
        .then(range)
        .map(|((name, value), range)| {
            value
                .and(optional(range))
                .map(|(value, range)| (name, value, range))
        })
        .boxed()
}

/// `import "path" as name`
fn import<'source>() -> Rule<'source, DeepKind> {
    token(Token::Import, Expectation::Expression)
        .ignore_then(literal(Expectation::ImportPath))
        .then_ignore(token(Token::As, Expectation::As))
        .then(name(Expectation::ModuleName))
        .map(|(path, name)| Deep::new(StatementKind::Import { path, name }, 0))
        .boxed()
}

/// `test "name" { … }`
fn test<'source>(block: Rule<'source, Deep<Block>>) -> Rule<'source, DeepKind> {
    token(Token::Test, Expectation::Expression)
        .ignore_then(literal(Expectation::TestName))
        .then(block)
        .map(|(name, body)| body.map(|body| StatementKind::Test { name, body }))
        .boxed()
}

/// `fn name(parameters) = body` or `fn name(parameters) { … }`
fn function<'source>(
    expression: Rule<'source, DeepExpression>,
    block: Rule<'source, Deep<Block>>,
) -> Rule<'source, DeepKind> {
    let parameters = token(Token::OpenParenthesis, Expectation::OpenParameters)
        .ignore_then(
            parameter(expression.clone())
                .separated_by(token(Token::Comma, Expectation::Comma))
                .allow_trailing()
                .collect::<Vec<_>>()
                .map(gather)
                .then_ignore(token(
                    Token::CloseParenthesis,
                    Expectation::CloseParenthesis,
                ))
                .recover_with(via_parser(
                    rest_of_brackets().map(|()| Deep::new(Vec::new(), 0)),
                )),
        )
        .boxed();
    let short = token(Token::Assign, Expectation::BodyAfterParameters).ignore_then(expression);
    let long = block
        .labelled(Expectation::BodyAfterParameters)
        .map(|block| {
            let span = block.value.span;
            block.map(|block| Expression {
                kind: Arc::new(ExpressionKind::Block(block)),
                span,
            })
        });
    token(Token::Fn, Expectation::Expression)
        .ignore_then(name(Expectation::FunctionName))
        .then(parameters)
        .then(short.boxed().or(long.boxed()))
        .map(|((name, parameters), body)| {
            parameters
                .and(body)
                .map(|(parameters, body)| StatementKind::Function {
                    name,
                    function: Arc::new(Function { parameters, body }),
                })
        })
        .boxed()
}

/// `field name(coordinates) over domain = body`
fn field<'source>(expression: Rule<'source, DeepExpression>) -> Rule<'source, DeepKind> {
    let coordinates = token(Token::OpenParenthesis, Expectation::OpenCoordinates)
        .ignore_then(
            coordinates()
                .then_ignore(token(
                    Token::CloseParenthesis,
                    Expectation::CloseParenthesis,
                ))
                .recover_with(via_parser(
                    rest_of_brackets().map(|()| Coordinates::Named(Vec::new())),
                )),
        )
        .boxed();
    let domain = token(Token::Over, Expectation::Over)
        .ignore_then(
            expression
                .clone()
                .separated_by(token(Token::Comma, Expectation::Comma))
                .at_least(1)
                .collect::<Vec<_>>()
                .map(gather),
        )
        .then_ignore(token(Token::Assign, Expectation::EqualsAfterDomain))
        .boxed();
    let no_domain = token(Token::Assign, Expectation::EqualsAfterCoordinates)
        .map(|()| Deep::new(Vec::new(), 0));
    token(Token::Field, Expectation::Expression)
        .ignore_then(name(Expectation::FieldName))
        .then(coordinates)
        .then(domain.or(no_domain))
        .then(expression)
        .map(|(((name, coordinates), domain), body)| {
            domain.and(body).map(|(domain, body)| StatementKind::Field {
                name,
                coordinates,
                domain,
                body,
            })
        })
        .boxed()
}

/// `x`, `x, y` or `x, y, z`, or `p in R3`; what stands between the parentheses.
fn coordinates<'source>() -> Rule<'source, Coordinates> {
    let space = name(Expectation::Space).validate(|name, _, emitter| {
        let dimension = match &*name.text {
            "R1" => 1,
            "R2" => 2,
            "R3" => 3,
            _ => {
                emitter.emit(SyntaxError::expected(Expectation::Space, name.span));
                3
            }
        };
        (name.span, dimension)
    });
    let more = token(Token::Comma, Expectation::Comma).ignore_then(
        name(Expectation::Coordinate)
            .separated_by(token(Token::Comma, Expectation::Comma))
            .allow_trailing()
            .collect::<Vec<_>>(),
    );
    let point = token(Token::In, Expectation::InAfterCoordinate)
        .ignore_then(space)
        .map(|(_, dimension)| Err(dimension));
    let named = more.or_not().map(|more| Ok(more.unwrap_or_default()));
    name(Expectation::Coordinate)
        .then(point.boxed().or(named.boxed()))
        .validate(|(first, rest), _, emitter| match rest {
            Err(dimension) => Coordinates::Point {
                name: first,
                dimension,
            },
            Ok(mut names) => {
                names.insert(0, first);
                if let Some(fourth) = names.get(3) {
                    emitter.emit(too_many_coordinates(fourth));
                    names.truncate(3);
                }
                Coordinates::Named(names)
            }
        })
        .boxed()
}

fn too_many_coordinates(fourth: &Name) -> SyntaxError {
    let diagnostic = Diagnostic::error(
        Code::UnexpectedToken,
        "a field has one, two or three coordinates",
    )
    .label(fourth.span, "one too many");
    SyntaxError::said(diagnostic, fourth.span)
}

/// `for pattern in iterable { … }`
fn for_loop<'source>(
    expression: Rule<'source, DeepExpression>,
    block: Rule<'source, Deep<Block>>,
) -> Rule<'source, DeepKind> {
    token(Token::For, Expectation::Expression)
        .ignore_then(pattern(Expectation::Pattern))
        .then_ignore(token(Token::In, Expectation::InAfterPattern))
        .then(expression)
        .then(block)
        .map(|((pattern, iterable), body)| {
            iterable
                .and(body)
                .map(|(iterable, body)| StatementKind::For {
                    pattern,
                    iterable,
                    body,
                })
        })
        .boxed()
}

/// `while condition { … }`
fn while_loop<'source>(
    expression: Rule<'source, DeepExpression>,
    block: Rule<'source, Deep<Block>>,
) -> Rule<'source, DeepKind> {
    token(Token::While, Expectation::Expression)
        .ignore_then(expression)
        .then(block)
        .map(|(condition, body)| {
            condition
                .and(body)
                .map(|(condition, body)| StatementKind::While { condition, body })
        })
        .boxed()
}

/// An expression on its own, or `target = value`.
fn assignment<'source>(expression: Rule<'source, DeepExpression>) -> Rule<'source, DeepKind> {
    let value = token(Token::Assign, Expectation::Operator).ignore_then(expression.clone());
    expression
        .then(value.or_not())
        .validate(|(target, value), _, emitter| {
            let Some(value) = value else {
                return target.map(StatementKind::Expression);
            };
            if let Some(diagnostic) = not_a_target(&target.value) {
                emitter.emit(SyntaxError::said(diagnostic, target.value.span));
            }
            target
                .and(value)
                .map(|(target, value)| StatementKind::Assignment { target, value })
        })
        .boxed()
}

/// What is wrong with the left side of an assignment.
fn not_a_target(target: &Expression) -> Option<Diagnostic> {
    let help = match &*target.kind {
        ExpressionKind::Name(_)
        | ExpressionKind::Index { .. }
        | ExpressionKind::Property { .. }
        | ExpressionKind::Error => return None,
        ExpressionKind::Call { .. } => {
            "write `fn f(x) = …` for a function and `field f(x, y, z) = …` for a field"
        }
        ExpressionKind::List(_) => "write `let [a, b] = …` to give names to the elements of a list",
        _ => "`==` asks whether two values are equal",
    };
    Some(
        Diagnostic::error(
            Code::UnexpectedToken,
            "the left side of `=` is a name, an element `a[i]` or a property `a.b`",
        )
        .label(target.span, "cannot be assigned to")
        .help(help),
    )
}
