//! Random programs that parse and often run.

use imp::language::builtin;

/// SplitMix64 (Steele, Lea and Flood, OOPSLA 2014).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number below `count`, which is not 0.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.next() % count as u64) as usize
    }

    pub(crate) fn chance(&mut self, percent: u64) -> bool {
        self.next() % 100 < percent
    }

    pub(crate) fn of<'a, T: ?Sized>(&mut self, choices: &[&'a T]) -> &'a T {
        choices[self.below(choices.len())]
    }
}

/// What is known of a name.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Number,
    /// A field in so many dimensions.
    Field(usize),
    Other,
}

/// Programs that parse and often run: some parts are made by kind, others of anything.
pub(crate) struct Grammar<'a> {
    random: &'a mut Random,
    /// Names that are bound here.
    names: Vec<(String, Kind)>,
    count: usize,
}

impl<'a> Grammar<'a> {
    pub(crate) fn new(random: &'a mut Random) -> Self {
        Grammar {
            random,
            names: Vec::new(),
            count: 0,
        }
    }

    /// Some statements, each on its line.
    pub(crate) fn program(&mut self) -> String {
        let count = 1 + self.random.below(8);
        (0..count).map(|_| self.statement(2) + "\n").collect()
    }

    /// A new name, to be known from here on.
    fn bind(&mut self, kind: Kind) -> String {
        self.count += 1;
        let name = format!("n{}", self.count);
        self.names.push((name.clone(), kind));
        name
    }

    /// What is made with these names bound besides, each a number.
    fn within<T>(&mut self, names: &[&str], make: impl FnOnce(&mut Self) -> T) -> T {
        let outside = self.names.len();
        let inner = names.iter().map(|name| (name.to_string(), Kind::Number));
        self.names.extend(inner);
        let made = make(self);
        self.names.truncate(outside);
        made
    }

    fn statement(&mut self, depth: usize) -> String {
        match self.random.below(14) {
            0 => {
                let value = self.random.below(9);
                format!("param {} = {value} in -5..9", self.bind(Kind::Number))
            }
            1 | 2 => {
                let value = self.scalar(depth + 1);
                let word = self.random.of(&["let", "var", "param"]);
                format!("{word} {} = {value}", self.bind(Kind::Number))
            }
            3 => {
                let value = self.expression(depth + 1);
                format!("let {} = {value}", self.bind(Kind::Other))
            }
            4 if depth > 0 => {
                let list = format!("range({})", self.random.below(4));
                self.within(&["i"], |inner| {
                    let body = inner.statement(depth - 1);
                    format!("for i in {list} {{ {body} }}")
                })
            }
            5 => {
                let value = self.scalar(depth + 1);
                let body = self.within(&["a", "b"], |inner| inner.expression(depth + 1));
                format!("fn {}(a, b = {value}) = {body}", self.bind(Kind::Other))
            }
            6..=8 => {
                let (dimension, coordinates) =
                    [(1, "x"), (2, "x, y"), (3, "x, y, z"), (3, "x, y, z")][self.random.below(4)];
                let names: Vec<&str> = coordinates.split(", ").collect();
                let body = self.within(&names, |inner| match inner.random.chance(80) {
                    true => inner.scalar(depth + 3),
                    false => inner.expression(depth + 2),
                });
                let name = self.bind(Kind::Field(dimension));
                format!("field {name}({coordinates}) over -2..2 = {body}")
            }
            9..=11 => self.action(),
            _ => self.expression(depth + 1),
        }
    }

    /// Something that is done with a field, if one is known.
    fn action(&mut self) -> String {
        let known = self.names.iter().rev();
        let mut fields = known.filter_map(|(name, kind)| match kind {
            Kind::Field(dimension) => Some((name.clone(), *dimension)),
            _ => None,
        });
        let Some((f, dimension)) = fields.next() else {
            return format!("print({})", self.scalar(2));
        };
        let point = vec!["0.5"; dimension].join(", ");
        match self.random.below(8) {
            0 => format!("print(len(singularities({f})))"),
            1 => format!("print(check({f}))"),
            2 => format!("print(grad({f})({point}), hessian({f})({point}))"),
            3 => format!("print({f}({}))", vec!["-1..1"; dimension].join(", ")),
            4 => format!("print(len(sample({f}, count = 20, seed = 3)))"),
            5 => format!("plot({f}, size = 9, samples = 1)"),
            6 => format!("print(polygonize({f} & {f} + 0.5, cell = 0.5))"),
            _ => format!("print(polygonize({f}, cell = 0.25, cap = true))"),
        }
    }

    /// An expression that gives a number if its names do.
    fn scalar(&mut self, depth: usize) -> String {
        if depth == 0 || self.random.chance(10) {
            let known = self.names.iter().filter(|(_, kind)| *kind == Kind::Number);
            let numbers: Vec<&str> = known.map(|(name, _)| name.as_str()).collect();
            return match numbers.is_empty() || self.random.chance(30) {
                true => format!("{}", self.random.below(40) as f64 / 8.0 - 2.0),
                false => self.random.of(&numbers).to_string(),
            };
        }
        let (a, b) = (self.scalar(depth - 1), self.scalar(depth - 1));
        match self.random.below(10) {
            0..=4 => format!("({a} {} {b})", self.random.of(&["+", "-", "*", "/", "%"])),
            5 => format!(
                "{}({a}, {b})",
                self.random.of(&["min", "max", "atan2", "mod"])
            ),
            6 => format!("({a})^{}", self.random.below(4)),
            7 => format!("(if {a} < {b} then {a} else -{b})"),
            8 => format!("norm([{a}, {b}])"),
            _ => {
                let names = [
                    "sin", "cos", "tan", "exp", "log", "sqrt", "abs", "floor", "tanh",
                ];
                format!("{}({a})", self.random.of(&names))
            }
        }
    }

    fn expression(&mut self, depth: usize) -> String {
        if depth == 0 || self.random.chance(15) {
            return self.leaf();
        }
        let a = self.expression(depth - 1);
        match self.random.below(20) {
            0..=4 => {
                let operator = self.random.of(&[
                    "+", "-", "*", "/", "%", "@", "^", "|", "&", "\\", "<", "<=", "==", "!=",
                    " and ", " or ",
                ]);
                format!("({a} {operator} {})", self.expression(depth - 1))
            }
            5 => format!("{}({a})", self.random.of(&["-", "!", "not "])),
            6 => format!("[{a}, {}, {}]", self.expression(depth - 1), self.leaf()),
            7 => format!("{a}..{}", self.expression(depth - 1)),
            8 => format!("({a}..{} by {})", self.leaf(), self.leaf()),
            9 => format!("{a}[{}]", self.leaf()),
            10 => format!(
                "{a}.{}",
                self.random
                    .of(&["x", "zyx", "area", "low", "points", "map"])
            ),
            11 => format!(
                "(if {a} then {} else {})",
                self.expression(depth - 1),
                self.leaf()
            ),
            12 => {
                let body = self.within(&["t"], |inner| inner.expression(depth - 1));
                format!("[{body} for t in {a}]")
            }
            13 => format!("({a} with {{{} = {}}})", self.name(), self.leaf()),
            14 => {
                let body = self.within(&["t"], |inner| inner.expression(depth - 1));
                format!("(t -> {body})")
            }
            15 => format!("{a}({}, {})", self.leaf(), self.leaf()),
            16 => format!("\"{{{}}}\"", self.leaf()),
            _ => self.call(a, depth),
        }
    }

    /// A call of a function of the language with roughly as many arguments as it wants.
    fn call(&mut self, first: String, depth: usize) -> String {
        let function = builtin::all()[self.random.below(builtin::all().len())];
        if function.name == "plot" {
            return format!("plot({first}, size = 9, samples = 1)");
        }
        let mut arguments = vec![first];
        for parameter in function.parameters.iter().skip(1) {
            match parameter.split_once('=') {
                None => arguments.push(self.expression(depth - 1)),
                Some((name, _)) if self.random.chance(30) => {
                    arguments.push(format!("{} = {}", name.trim(), self.leaf()));
                }
                Some(_) => {}
            }
        }
        format!("{}({})", function.name, arguments.join(", "))
    }

    /// The name of a parameter, or of something else.
    fn name(&mut self) -> String {
        format!("n{}", 1 + self.random.below(1 + self.count))
    }

    fn leaf(&mut self) -> String {
        match self.random.below(10) {
            0..=4 if !self.names.is_empty() => {
                self.names[self.random.below(self.names.len())].0.clone()
            }
            5 => self
                .random
                .of(&["true", "\"a\"", "[]", "inf", "nan", "pi", "-2..2"])
                .to_string(),
            6 => format!("{}", self.random.below(2000) as f64 / 64.0 - 8.0),
            7 => self
                .random
                .of(&["1e300", "-0.0", "1e-300", "9007199254740993", "0"])
                .to_string(),
            _ => self.random.below(6).to_string(),
        }
    }
}
