//! The arguments of a call, checked against the table's parameters.

use super::Builtin;
use crate::diagnostic::{Code, Diagnostic, Span};
use crate::language::function::{Argument, At, match_arguments};
use crate::language::list::List;
use crate::language::session::Session;
use crate::language::value::{Outcome, Value, failure};

/// Arguments by the names of the parameters.
pub struct Arguments {
    builtin: &'static Builtin,
    places: Vec<Option<Argument>>,
    rest: Vec<Argument>,
    /// The whole call.
    pub span: Span,
}

impl Arguments {
    /// Puts the arguments of a call in order and checks that the required ones are there.
    pub fn new(
        builtin: &'static Builtin,
        mut arguments: Vec<Argument>,
        span: Span,
    ) -> Outcome<Arguments> {
        let names: Vec<Option<&str>> = fixed_parameters(builtin).map(Some).collect();
        let mut rest = Vec::new();
        if is_variadic(builtin) {
            let (named, unnamed) = arguments
                .into_iter()
                .partition(|argument| argument.name.is_some());
            arguments = named;
            rest = unnamed;
        }
        let places = match_arguments(builtin.name, &names, arguments).at(span, "in this call")?;
        for (parameter, place) in builtin.parameters.iter().zip(&places) {
            let required = !parameter.contains('=') && !parameter.ends_with('…');
            if required && place.is_none() {
                let mut error = failure(
                    Code::MissingArgument,
                    format!("`{}` needs the argument `{parameter}`", builtin.name),
                )
                .at(span, "not given here");
                error.help = Some(signature(builtin));
                return Err(error);
            }
        }
        Ok(Arguments {
            builtin,
            places,
            rest,
            span,
        })
    }

    /// The name of the function that is called.
    pub fn function(&self) -> &'static str {
        self.builtin.name
    }

    /// The function that is called.
    pub fn builtin(&self) -> &'static Builtin {
        self.builtin
    }

    /// The name of its first parameter.
    pub fn first_name(&self) -> &'static str {
        fixed_parameters(self.builtin).next().unwrap_or("")
    }

    /// The arguments of the parameter that takes any number.
    pub fn rest(&self) -> &[Argument] {
        &self.rest
    }

    /// The argument of that name, if it was given.
    pub fn given(&self, name: &str) -> Option<&Argument> {
        let place = fixed_parameters(self.builtin).position(|known| known == name)?;
        self.places.get(place)?.as_ref()
    }

    /// The values of all arguments in the order of the parameters.
    pub fn values(&self) -> Vec<Value> {
        self.places
            .iter()
            .flatten()
            .map(|argument| argument.value.clone())
            .collect()
    }

    /// The value of a required argument.
    pub fn value(&self, name: &str) -> Value {
        // `new` has checked that required arguments are there.
        self.given(name)
            .map_or(Value::Unknown, |argument| argument.value.clone())
    }

    /// Where an argument is written, or the whole call.
    pub fn place(&self, name: &str) -> Span {
        self.given(name).map_or(self.span, |argument| argument.span)
    }

    /// A plain value for an argument, if it was given.
    pub fn plain(&self, session: &mut Session, name: &str) -> Outcome<Option<Value>> {
        match self.given(name) {
            None => Ok(None),
            Some(argument) => session
                .plain(argument.value.clone(), argument.span)
                .map(Some),
        }
    }

    /// A number, if it was given.
    pub fn number(&self, session: &mut Session, name: &str) -> Outcome<Option<f64>> {
        match self.plain(session, name)? {
            None => Ok(None),
            Some(Value::Number(number)) => Ok(Some(number)),
            Some(other) => Err(self.expected("a number", name, &other)),
        }
    }

    /// A number greater than 0, if it was given.
    pub fn positive(&self, session: &mut Session, name: &str) -> Outcome<Option<f64>> {
        match self.number(session, name)? {
            Some(number) if !(number > 0.0 && number.is_finite()) => Err(self.bad(
                name,
                format!("`{name}` must be greater than 0 and finite, but it is {number}"),
            )),
            number => Ok(number),
        }
    }

    /// A whole number that is not negative, if it was given.
    pub fn count(&self, session: &mut Session, name: &str) -> Outcome<Option<u64>> {
        match self.number(session, name)? {
            None => Ok(None),
            // Beyond 2^53 neighbouring whole numbers are no longer told apart.
            Some(number)
                if number >= 0.0
                    && number.floor() == number
                    && number <= 9_007_199_254_740_992.0 =>
            {
                Ok(Some(number as u64))
            }
            Some(number) => Err(self.bad(
                name,
                format!("`{name}` must be a whole number, at least 0, but it is {number}"),
            )),
        }
    }

    /// A bool, if it was given.
    pub fn bool(&self, session: &mut Session, name: &str) -> Outcome<Option<bool>> {
        match self.plain(session, name)? {
            None => Ok(None),
            Some(Value::Bool(value)) => Ok(Some(value)),
            Some(other) => Err(self.expected("`true` or `false`", name, &other)),
        }
    }

    /// A string, if it was given.
    pub fn text(&self, name: &str) -> Outcome<Option<String>> {
        match self.given(name).map(|argument| &argument.value) {
            None => Ok(None),
            Some(Value::Text(text)) => Ok(Some(text.to_string())),
            Some(other) => Err(self.expected("a string", name, other)),
        }
    }

    /// A list.
    pub fn list(&self, name: &str) -> Outcome<List> {
        match self.value(name) {
            Value::List(elements) => Ok(elements),
            other => Err(self.expected("a list", name, &other)),
        }
    }

    /// The error for an argument of the wrong kind.
    pub fn expected(&self, expected: &str, name: &str, found: &Value) -> Box<Diagnostic> {
        failure(
            Code::WrongKind,
            format!("`{name}` must be {expected}, but it is {}", found.kind()),
        )
        .at(self.place(name), found.kind())
    }

    /// The error for an argument whose value makes no sense.
    pub fn bad(&self, name: &str, message: String) -> Box<Diagnostic> {
        failure(Code::BadValue, message).at(self.place(name), "this value")
    }
}

/// `name(parameters)`: how a function is called.
pub(crate) fn signature(builtin: &Builtin) -> String {
    format!("{}({})", builtin.name, builtin.parameters.join(", "))
}

fn is_variadic(builtin: &Builtin) -> bool {
    builtin
        .parameters
        .iter()
        .any(|parameter| parameter.ends_with('…'))
}

fn fixed_parameters(builtin: &'static Builtin) -> impl Iterator<Item = &'static str> {
    builtin
        .parameters
        .iter()
        .filter(|parameter| !parameter.ends_with('…'))
        .map(|parameter| {
            parameter
                .split_once('=')
                .map_or(*parameter, |(name, _)| name.trim())
        })
}
