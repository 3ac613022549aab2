//! What is known of the roots of a field in R1.

/// The roots in an interval, and where nothing certain can be said.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Roots {
    /// The roots, ascending. Poles, jumps and ends of the domain are none.
    pub roots: Vec<IsolatedRoot>,
    /// The parts of the interval that could not be decided, ascending. Outside of them and of the
    /// enclosures of the roots there is no root if the method is `Newton`.
    pub undecided: Vec<Undecided>,
}

/// A root.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IsolatedRoot {
    /// Where.
    pub value: f64,
    /// An interval that holds the root; where nothing is proven, one that should.
    pub enclosure: (f64, f64),
    /// Whether it is proven that there is exactly one root in the enclosure, and a simple one.
    pub proven: bool,
}

/// A part of the interval of which intervals prove neither that it has no root nor that it has
/// exactly one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Undecided {
    /// Where it begins.
    pub low: f64,
    /// Where it ends.
    pub high: f64,
    /// What it seems to be.
    pub reason: Reason,
    /// The root there, if F is 0 at one to rounding; it is among the roots, too.
    pub root: Option<f64>,
}

/// Why a part of the interval is undecided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// F comes to 0 without a change of sign: a root of even order, or none.
    Touches,
    /// F changes its sign, so there is a root, but perhaps of higher order, or several.
    Multiple,
    /// The end of the interval is a root to rounding, which may lie beyond it.
    End,
    /// F is 0 all along.
    Vanishes,
    /// F grows beyond all bounds.
    Pole,
    /// F jumps.
    Jump,
    /// F is not defined there, or on one side.
    Undefined,
    /// The search was given up: there are too many roots, or F is too steep.
    Unfinished,
}

impl Reason {
    /// In words.
    pub fn text(self) -> &'static str {
        match self {
            Reason::Touches => "the field comes to 0 without changing its sign",
            Reason::Multiple => {
                "the field changes its sign at a root of higher order, or at several"
            }
            Reason::End => "the root is at the end of the interval, or just beyond",
            Reason::Vanishes => "the field is 0 all along",
            Reason::Pole => "the field has a pole",
            Reason::Jump => "the field jumps",
            Reason::Undefined => "the field is not defined there, or on one side",
            Reason::Unfinished => "the search was given up",
        }
    }

    /// One word for it, as in reports.
    pub fn name(self) -> &'static str {
        match self {
            Reason::Touches => "touches",
            Reason::Multiple => "multiple",
            Reason::End => "end",
            Reason::Vanishes => "vanishes",
            Reason::Pole => "pole",
            Reason::Jump => "jump",
            Reason::Undefined => "undefined",
            Reason::Unfinished => "unfinished",
        }
    }

    /// Whether F cannot be 0 there although intervals do not show it.
    pub fn is_break(self) -> bool {
        matches!(self, Reason::Pole | Reason::Jump | Reason::Undefined)
    }
}

impl Roots {
    /// The roots as numbers.
    pub fn values(&self) -> Vec<f64> {
        self.roots.iter().map(|root| root.value).collect()
    }

    /// Whether the list is proven to be that of all roots, each of them simple.
    pub fn is_proven(&self) -> bool {
        self.undecided.is_empty() && self.roots.iter().all(|root| root.proven)
    }
}
