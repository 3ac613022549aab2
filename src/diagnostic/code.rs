//! The table of codes.

use super::Severity;

macro_rules! codes {
    ($($code:ident $name:ident $title:literal,)*) => {
        /// A stable code. Its number never changes meaning; its first digits say the stage:
        /// 00 the command line, 01 syntax, 02 names, 03 values, 04 fields, 05 scripts, 06 limits, 07 files, 08 warnings.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Code {
            $(#[doc = $title] $name,)*
        }

        impl Code {
            /// All codes, in order.
            pub const ALL: &[Code] = &[$(Code::$name,)*];

            /// The code as people see it, `E0201`.
            pub fn as_str(self) -> &'static str {
                match self { $(Code::$name => stringify!($code),)* }
            }

            /// A short title.
            pub fn title(self) -> &'static str {
                match self { $(Code::$name => $title,)* }
            }

            /// What it means, as Markdown: some sentences, then a wrong example and its repair,
            /// each in a block of code. It stands in `explain/`, a file for each code.
            pub fn page(self) -> &'static str {
                match self {
                    $(Code::$name => include_str!(
                        concat!("explain/", stringify!($code), ".md")
                    ),)*
                }
            }

            /// The code that is written so, in capitals or not.
            pub fn named(text: &str) -> Option<Code> {
                Code::ALL.iter().copied().find(|code| code.as_str().eq_ignore_ascii_case(text))
            }
        }
    };
}

codes! {
    E0001 Usage "command line that is not understood",
    E0101 UnexpectedToken "unexpected token",
    E0102 UnclosedBracket "bracket without its partner",
    E0103 UnclosedText "string without its closing quote",
    E0104 UnknownCharacter "character that is not part of the language",
    E0105 ImplicitMultiplication "multiplication without `*`",
    E0106 DoubleStar "`**` instead of `^`",
    E0107 BadNumber "malformed number",
    E0108 TooDeep "nesting too deep",
    E0109 BadFormat "malformed format or escape in a string",
    E0201 UnknownName "unknown name",
    E0202 BoundTwice "name bound twice in one scope",
    E0203 UnknownArgument "no argument of that name",
    E0204 MissingArgument "argument missing",
    E0205 TooManyArguments "too many arguments",
    E0206 UnknownProperty "no property or function of that name",
    E0207 NotAssignable "assignment to something that is not a `var`",
    E0208 UnknownParameter "no parameter of that name",
    E0209 WhichField "no field, or several, to choose from",
    E0210 NotAtTop "definition that belongs to the top of the file",
    E0211 ImportCircle "files that import each other in a circle",
    E0212 UnusedValue "value that nothing uses",
    E0301 WrongKind "value of the wrong kind",
    E0302 LengthsDiffer "lists of different lengths",
    E0303 IndexOutOfRange "index out of range",
    E0304 NotCallable "something that cannot be called",
    E0305 NotACondition "condition that is neither true nor false",
    E0306 BareInterval "interval where a list is needed",
    E0307 OutsideRange "value outside its range",
    E0308 EmptyList "empty list where an element is needed",
    E0309 BadValue "value that makes no sense here",
    E0310 NotConcrete "value that depends on a point or on parameters where a plain number is needed",
    E0401 WrongDimension "point and field of different dimensions",
    E0402 NoBounds "no bounding box",
    E0403 NotAField "body that is not a field",
    E0404 NotAVariable "derivative with respect to something that is not a parameter",
    E0405 NoSurface "no zero in the box",
    E0501 AssertionFailed "assertion failed",
    E0502 Cancelled "work that was cancelled",
    E0503 NotVerified "certificate that is not accepted",
    E0601 RecursionLimit "recursion too deep",
    E0602 NodeLimit "expression graph too large",
    E0603 LengthLimit "list too long",
    E0604 StepLimit "too many steps",
    E0605 CellLimit "too many cells",
    E0606 ParticleLimit "too many particles",
    E0607 TimeLimit "too much time",
    E0608 OutputLimit "too much output",
    E0609 InputLimit "file too large to load",
    E0701 CannotRead "file that cannot be read",
    E0702 NotText "file that is not UTF-8 text",
    E0703 CannotWrite "file that cannot be written",
    E0704 OutsideOutput "path outside the output directory",
    E0705 UnknownFormat "unknown file format",
    E0706 WrongFormat "format that cannot hold this value",
    E0707 BadContent "file whose content is not understood",
    E0708 OutsideInput "import from outside the allowed folders",
    W0801 NanRegion "field is not a number in part of the box",
    W0802 CutByBox "surface cut by the box",
    W0803 DroppedPoints "points dropped",
    W0804 PoorRoots "roots beyond the tolerance",
    W0805 NoMachineCode "machine code that cannot be made",
    W0806 NothingSeen "nothing to be seen in the picture",
    W0807 UnusedParameter "parameter that nothing uses",
    W0808 LooksLikeDegrees "angle that looks like degrees",
    W0809 InsideOut "field whose inside is the unbounded side",
    W0810 ConstantField "field that is constant on its box",
    W0811 UndefinedField "field that is not a number anywhere in its box",
    W0812 SingularPoints "gradient that vanishes on the zero set",
    W0813 MaybeMissed "components that may have been missed",
    W0814 CoarseSpacing "spacing larger than the surface",
    W0815 NotFollowed "points that the surface cannot follow",
    W0816 LostSurface "surface that floaters lose",
    W0817 CrushedSolid "solid that its fall crushes",
    W0818 UndecidedRoots "roots that are not proven",
    W0819 FoldedFacets "facets that are turned over",
    W0820 TopologyNotProven "topology that is not proven",
    W0821 Plateau "level set with an interior",
}

impl Code {
    /// Whether it ends the work or only warns.
    pub fn severity(self) -> Severity {
        if self.as_str().starts_with('W') {
            Severity::Warning
        } else {
            Severity::Error
        }
    }

    /// The program's exit code when this error ends it: 1 the script is wrong, 2 usage,
    /// 3 input or output, 4 no surface found.
    pub fn exit_code(self) -> u8 {
        match self {
            Code::Usage => 2,
            Code::CannotRead
            | Code::NotText
            | Code::CannotWrite
            | Code::OutsideOutput
            | Code::OutsideInput
            | Code::UnknownFormat
            | Code::WrongFormat
            | Code::BadContent => 3,
            Code::NoSurface => 4,
            _ => 1,
        }
    }
}
