//! Random sentences of the grammar: programs that parse, whatever they mean, with few parentheses
//! and with every construct.

use crate::programs::Random;

/// Makes programs.
pub(crate) struct Sentences<'a> {
    random: &'a mut Random,
}

impl<'a> Sentences<'a> {
    pub(crate) fn new(random: &'a mut Random) -> Self {
        Sentences { random }
    }

    pub(crate) fn program(&mut self) -> String {
        let count = 1 + self.random.below(4);
        (0..count).map(|_| self.statement(3) + "\n").collect()
    }

    /// Some parts with something between them.
    fn several(&mut self, between: &str, mut part: impl FnMut(&mut Self) -> String) -> String {
        let count = self.random.below(4);
        let parts: Vec<String> = (0..count).map(|_| part(self)).collect();
        parts.join(between)
    }

    fn name(&mut self) -> String {
        let names = [
            "a",
            "p",
            "distance_to_the_next",
            "π",
            "radius",
            "x",
            "some_field_of_mine",
        ];
        self.random.of(&names).to_owned()
    }

    fn pattern(&mut self) -> String {
        match self.random.below(4) {
            0 => format!("[{}]", self.several(", ", Self::pattern)),
            _ => self.name(),
        }
    }

    fn parameters(&mut self, depth: usize) -> String {
        self.several(", ", |inner| match inner.random.below(4) {
            0 => format!("{} = {}", inner.name(), inner.expression(depth)),
            1 => inner.name() + "..",
            _ => inner.pattern(),
        })
    }

    fn block(&mut self, depth: usize) -> String {
        let between = self.random.of(&["; ", "\n", "\n\n", ";\n"]).to_owned();
        let inside = self.several(&between, |inner| inner.statement(depth.saturating_sub(1)));
        let space = self.random.of(&[" ", "\n"]).to_owned();
        format!("{{{space}{inside}{space}}}")
    }

    fn statement(&mut self, depth: usize) -> String {
        let below = depth.saturating_sub(1);
        match self.random.below(if depth == 0 { 6 } else { 14 }) {
            0 => format!("let {} = {}", self.name(), self.expression(depth)),
            1 => format!("let [{}] = {}", self.pattern(), self.expression(depth)),
            2 => format!("var {} = {}", self.name(), self.expression(depth)),
            3 => format!(
                "{}[{}] = {}",
                self.name(),
                self.name(),
                self.expression(depth)
            ),
            4 => format!("setting {} = 3 in {}", self.name(), self.expression(below)),
            5 => format!("import \"{}.imp\" as {}", self.name(), self.name()),
            6 => format!("test \"a {{{{ b\" {}", self.block(depth)),
            7 => format!(
                "fn {}({}) {}",
                self.name(),
                self.parameters(below),
                self.block(depth)
            ),
            8 => {
                let parameters = self.parameters(below);
                format!(
                    "fn {}({parameters}) = {}",
                    self.name(),
                    self.expression(depth)
                )
            }
            9 => {
                let sides = [String::new(), format!(" over {}, 0..1", self.name())];
                let side = self.random.below(2);
                let body = self.expression(depth);
                format!("field {}(p in R3){} = {body}", self.name(), sides[side])
            }
            10 => {
                let (pattern, list) = (self.pattern(), self.expression(below));
                format!("for {pattern} in {list} {}", self.block(depth))
            }
            11 => format!("while {} {}", self.expression(below), self.block(depth)),
            12 => format!("param {} = [1, -2.5] in 0..{}", self.name(), self.name()),
            _ => self.expression(depth),
        }
    }

    fn expression(&mut self, depth: usize) -> String {
        if depth == 0 || self.random.chance(10) {
            return self.leaf();
        }
        let below = depth - 1;
        match self.random.below(18) {
            0..=3 => {
                let operators = [
                    "+", "-", "*", "/", "%", "@", "^", "|", "&", "\\", "<", "<=", "==", "!=",
                    " and ", " or ", " + ", " - ", " * ", " |> ",
                ];
                let operator = self.random.of(&operators).to_owned();
                let count = 2 + self.random.below(6);
                let operands: Vec<String> = (0..count).map(|_| self.operand(below)).collect();
                operands.join(&operator)
            }
            4 => format!(
                "{}{}",
                self.random.of(&["-", "!", "not "]),
                self.operand(below)
            ),
            5 => {
                let end = self.random.of(&["]", ",]"]);
                let inside = self.several(", ", |inner| inner.expression(below));
                format!("[{inside}{}", if inside.is_empty() { "]" } else { end })
            }
            6 => format!("{}..{} by {}", self.leaf(), self.leaf(), self.leaf()),
            7 => format!("{}[{}]", self.operand(below), self.expression(below)),
            8 => format!("({}).{}", self.expression(below), self.name()),
            9 => {
                let (a, b) = (self.expression(below), self.expression(below));
                format!("if {} then {a} else {b}", self.operand(below))
            }
            10 => {
                let (a, b) = (self.block(below), self.block(below));
                let (c, d) = (self.operand(below), self.operand(below));
                let endings = [
                    String::new(),
                    format!(" else {b}"),
                    format!(" else if {d} {b} else {b}"),
                ];
                let ending = self.random.below(3);
                format!("(if {c} {a}{})", endings[ending])
            }
            11 => {
                let (element, pattern) = (self.expression(below), self.pattern());
                let (list, condition) = (self.operand(below), self.operand(below));
                let forms = [
                    format!("[{element} for {pattern} in {list}]"),
                    format!("sum({element} for {pattern} in {list} if {condition})"),
                    format!("[{element} for {pattern} in {list} for i in {condition}]"),
                ];
                forms[self.random.below(3)].clone()
            }
            12 => {
                let comma = self.random.of(&[", ", "\n", "; "]).to_owned();
                let bindings = self.several(&comma, |inner| {
                    format!(
                        "{}.{} = {}",
                        inner.name(),
                        inner.name(),
                        inner.expression(below)
                    )
                });
                format!("{} with {{{bindings}}}", self.operand(below))
            }
            13 => format!("{} -> {}", self.name(), self.expression(below)),
            14 => format!("({}) -> {}", self.parameters(below), self.block(below)),
            15 => self.block(below),
            _ => {
                let arguments = self.several(", ", |inner| match inner.random.below(3) {
                    0 => format!("{} = {}", inner.name(), inner.expression(below)),
                    _ => inner.expression(below),
                });
                format!("{}.{}({arguments})", self.name(), self.name())
            }
        }
    }

    /// An expression that operators can stand beside.
    fn operand(&mut self, depth: usize) -> String {
        match self.random.below(3) {
            0 => self.leaf(),
            1 => format!("({})", self.expression(depth)),
            _ => format!("{}({})", self.name(), self.expression(depth)),
        }
    }

    fn leaf(&mut self) -> String {
        match self.random.below(6) {
            0 => self
                .random
                .of(&["1_000", "2.5e-3", "45deg", "0.25turn", "0", "true"])
                .to_owned(),
            1 => "\"π {a + \"{b}\":.3} \\\"\"".to_owned(),
            _ => self.name(),
        }
    }
}
