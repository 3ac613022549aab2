//! Help for diagnostics that bring none of their own.

use super::{Code, Diagnostic};

impl Diagnostic {
    /// What to do about it: its own help, else what is good for its code in general, else where to
    /// read more.
    pub fn advice(&self) -> String {
        match (&self.help, general(self.code)) {
            (Some(help), _) => help.clone(),
            (None, Some(help)) => help.to_owned(),
            (None, None) => {
                let code = self.code.as_str();
                format!("`imp explain {code}` shows an example and its repair")
            }
        }
    }
}

/// What to do about an error of this kind, whatever the place.
fn general(code: Code) -> Option<&'static str> {
    Some(match code {
        Code::TooManyArguments => {
            "`help(f)` shows what a function takes; a point is one argument, a list"
        }
        Code::LengthsDiffer => {
            "elements are taken in pairs, so both lists need as many; a number goes with them all"
        }
        Code::NotACondition => "compare with something, as in `n > 0`",
        Code::OutsideRange => "give a value inside the range, or widen the range after `in`",
        Code::EmptyList => "ask `len(list) > 0` first, and say what it is otherwise",
        Code::WrongDimension => {
            "a point has a coordinate, and a box an interval, for each dimension of the field"
        }
        Code::AssertionFailed => {
            "`print` the values on both sides; compare computed numbers with a tolerance"
        }
        Code::CannotRead => {
            "check the path: it starts at the present folder, in a script at the script's own"
        }
        Code::CannotWrite => "check that the folder is there and that you may write in it",
        Code::UnknownFormat | Code::WrongFormat => "the extension of the name chooses the format",
        _ => return None,
    })
}
