//! The tree as a compact S-expression.

use crate::syntax::tree::*;

pub(super) fn statements(statements: &[Statement]) -> String {
    let all: Vec<String> = statements.iter().map(statement).collect();
    all.join("; ")
}

fn statement(statement: &Statement) -> String {
    match &statement.kind {
        StatementKind::Parameter { name, value, range } => {
            let range = range
                .as_ref()
                .map_or(String::new(), |range| format!(" {}", expression(range)));
            format!("(param {} {}{range})", name.text, expression(value))
        }
        StatementKind::Setting { name, value, range } => {
            let range = range
                .as_ref()
                .map_or(String::new(), |range| format!(" {}", expression(range)));
            format!("(setting {} {}{range})", name.text, expression(value))
        }
        StatementKind::Import { path, name } => {
            format!("(import {:?} {})", path.text, name.text)
        }
        StatementKind::Test { name, body } => format!("(test {:?} {})", name.text, block(body)),
        StatementKind::Let {
            pattern: bound,
            value,
        } => {
            format!("(let {} {})", pattern(bound), expression(value))
        }
        StatementKind::Variable { name, value } => {
            format!("(var {} {})", name.text, expression(value))
        }
        StatementKind::Assignment { target, value } => {
            format!("(set {} {})", expression(target), expression(value))
        }
        StatementKind::Function { name, function: f } => {
            format!("(fn {} {})", name.text, function(f))
        }
        StatementKind::Field {
            name,
            coordinates,
            domain,
            body,
        } => {
            let coordinates = match coordinates {
                Coordinates::Named(names) => {
                    let names: Vec<&str> = names.iter().map(|name| &*name.text).collect();
                    names.join(" ")
                }
                Coordinates::Point { name, dimension } => {
                    format!("{} in R{dimension}", name.text)
                }
            };
            format!(
                "(field {} ({coordinates}) ({}) {})",
                name.text,
                list(domain),
                expression(body)
            )
        }
        StatementKind::For {
            pattern: bound,
            iterable,
            body,
        } => {
            format!(
                "(for {} {} {})",
                pattern(bound),
                expression(iterable),
                block(body)
            )
        }
        StatementKind::While { condition, body } => {
            format!("(while {} {})", expression(condition), block(body))
        }
        StatementKind::Expression(value) => expression(value),
        StatementKind::Error => "ERROR".to_owned(),
    }
}

fn list(expressions: &[Expression]) -> String {
    let all: Vec<String> = expressions.iter().map(expression).collect();
    all.join(" ")
}

fn block(block: &Block) -> String {
    format!("{{{}}}", statements(&block.statements))
}

fn pattern(bound: &Pattern) -> String {
    match bound {
        Pattern::Name(name) => name.text.to_string(),
        Pattern::List(elements, _) => {
            let elements: Vec<String> = elements.iter().map(pattern).collect();
            format!("[{}]", elements.join(" "))
        }
    }
}

fn function(function: &Function) -> String {
    let parameters: Vec<String> = function
        .parameters
        .iter()
        .map(|parameter| match &parameter.default {
            Some(default) => format!("{}={}", pattern(&parameter.pattern), expression(default)),
            None => pattern(&parameter.pattern),
        })
        .collect();
    format!("({}) {}", parameters.join(" "), expression(&function.body))
}

fn expression(value: &Expression) -> String {
    use ExpressionKind as E;
    match &*value.kind {
        E::Number(number) => number.to_string(),
        E::Bool(truth) => truth.to_string(),
        E::Text(parts) => text(parts),
        E::Name(name) => name.text.to_string(),
        E::List(elements) => format!("[{}]", list(elements)),
        E::Comprehension {
            element,
            clauses: all,
        } => {
            format!("(each {}{})", expression(element), clauses(all))
        }
        E::Group(inner) => format!("<{}>", expression(inner)),
        E::Unary { operator, operand } => {
            let operator = match operator {
                UnaryOperator::Negate => "-",
                UnaryOperator::Complement => "!",
                UnaryOperator::Not => "not",
            };
            format!("({operator} {})", expression(operand))
        }
        E::Binary {
            operator,
            left,
            right,
        } => {
            format!(
                "({} {} {})",
                binary(*operator),
                expression(left),
                expression(right)
            )
        }
        E::Comparison { first, rest } => {
            let rest: Vec<String> = rest
                .iter()
                .map(|(operator, right)| {
                    format!(" {} {}", comparison(*operator), expression(right))
                })
                .collect();
            format!("(? {}{})", expression(first), rest.concat())
        }
        E::Interval { low, high } => format!("(.. {} {})", expression(low), expression(high)),
        E::Steps { interval, step } => {
            format!("(by {} {})", expression(interval), expression(step))
        }
        E::With { subject, bindings } => {
            let bindings: Vec<String> = bindings
                .iter()
                .map(|(name, value)| format!(" {}={}", name.text, expression(value)))
                .collect();
            format!("(with {}{})", expression(subject), bindings.concat())
        }
        E::Pipe { left, right } => format!("(|> {} {})", expression(left), expression(right)),
        E::Call { callee, arguments } => {
            let arguments: Vec<String> = arguments
                .iter()
                .map(|argument| match &argument.name {
                    Some(name) => format!(" {}={}", name.text, expression(&argument.value)),
                    None => format!(" {}", expression(&argument.value)),
                })
                .collect();
            format!("(call {}{})", expression(callee), arguments.concat())
        }
        E::Index { subject, index } => {
            format!("(at {} {})", expression(subject), expression(index))
        }
        E::Property { subject, name } => format!("(. {} {})", expression(subject), name.text),
        E::Lambda(f) => format!("(-> {})", function(f)),
        E::If {
            condition,
            consequence,
            alternative,
        } => {
            let alternative = alternative.as_ref().map_or(String::new(), |alternative| {
                format!(" {}", expression(alternative))
            });
            format!(
                "(if {} {}{alternative})",
                expression(condition),
                expression(consequence)
            )
        }
        E::Block(inner) => block(inner),
        E::Error => "ERROR".to_owned(),
    }
}

fn text(parts: &[TextPart]) -> String {
    let parts: Vec<String> = parts
        .iter()
        .map(|part| match part {
            TextPart::Literal(characters) => format!("{characters:?}"),
            TextPart::Interpolation {
                value,
                precision: None,
            } => expression(value),
            TextPart::Interpolation {
                value,
                precision: Some(precision),
            } => {
                format!("{}:.{precision}", expression(value))
            }
        })
        .collect();
    format!("(text {})", parts.join(" "))
}

fn clauses(clauses: &[Clause]) -> String {
    let clauses: Vec<String> = clauses
        .iter()
        .map(|clause| match clause {
            Clause::For {
                pattern: bound,
                iterable,
            } => {
                format!(" for {} {}", pattern(bound), expression(iterable))
            }
            Clause::If(condition) => format!(" if {}", expression(condition)),
        })
        .collect();
    clauses.concat()
}

fn binary(operator: BinaryOperator) -> &'static str {
    match operator {
        BinaryOperator::Add => "+",
        BinaryOperator::Subtract => "-",
        BinaryOperator::Multiply => "*",
        BinaryOperator::Divide => "/",
        BinaryOperator::Modulo => "%",
        BinaryOperator::MatrixMultiply => "@",
        BinaryOperator::Power => "^",
        BinaryOperator::Union => "|",
        BinaryOperator::Intersection => "&",
        BinaryOperator::Difference => "\\",
        BinaryOperator::And => "and",
        BinaryOperator::Or => "or",
    }
}

fn comparison(operator: ComparisonOperator) -> &'static str {
    match operator {
        ComparisonOperator::Equal => "==",
        ComparisonOperator::NotEqual => "!=",
        ComparisonOperator::Less => "<",
        ComparisonOperator::LessEqual => "<=",
        ComparisonOperator::Greater => ">",
        ComparisonOperator::GreaterEqual => ">=",
    }
}
