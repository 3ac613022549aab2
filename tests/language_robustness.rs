//! Whatever a program says, it ends: with a value or with an error that has a code, never by a
//! panic. Programs are made at random from a fixed seed, of definitions that make sense and of
//! uses that mostly do not. More rounds, from other seeds: `IMP_ROUNDS=100000 IMP_SEED=2 cargo test
//! --release --test language_robustness`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use imp::diagnostic::{Code, Diagnostic, SourceId};
use imp::engine::{Monitor, Silent};
use imp::language::{Host, Limits, Mode, Session};
use imp::syntax::parse;

/// What the random statements can speak of.
const DEFINITIONS: &str = r#"
import "module.imp" as module
param r = 1 in 0..5
setting k = 3 in 1..6
setting n = 2
var c = 1
let a = 2
let b = [1, 2, 3]
fn f(p) = norm(p) - r
fn g(x, y, z) = x*y - k*z
field ball(p in R3) over -2..2 = norm(p) - r*k
field knot(p in R3) = [p.x^2 + p.y^2 - r, p.z - n]
field h(x, y) over -2..2 = x^2 - y - n
let p = [0.3, 0.4, 0.5]
let x = 0.7
let q = (t -> t^2)
let m = polygonize(ball, cell = 2, bounds = -4..4)
let s = sample(ball, count = 5)
"#;

const MODULE: &str = r#"
param r = 2
setting k = 4
field w(p in R3) = norm(p) - r*k
fn u(x) = x + k
let z = polygonize(w, bounds = -9..9, cell = 6)
"#;

const NAMES: &[&str] = &[
    "a", "b", "c", "f", "g", "h", "p", "x", "n", "k", "r", "ball", "knot", "m", "s", "q", "module",
];

const LITERALS: &[&str] = &[
    "1",
    "0",
    "-1",
    "0.5",
    "2",
    "[1, 2, 3]",
    "[1, 2]",
    "true",
    "\"t\"",
    "[]",
    "pi",
    "0..1",
    "nan",
    "inf",
    "1e300",
    "[[1, 2], [3, 4]]",
];

const FUNCTIONS: &[&str] = &[
    "sin",
    "norm",
    "sum",
    "max",
    "min",
    "grad",
    "diff",
    "hessian",
    "jacobian",
    "laplacian",
    "div",
    "curl",
    "normal",
    "mean_curvature",
    "gaussian_curvature",
    "k1",
    "k2",
    "len",
    "range",
    "zip",
    "map",
    "filter",
    "concat",
    "append",
    "reverse",
    "sort",
    "transpose",
    "dot",
    "cross",
    "clamp",
    "normalize",
    "mix",
    "json",
    "product",
    "mean",
    "norm2",
    "help",
    "print",
    "assert",
    "polygonize",
    "sample",
    "thin",
    "area",
    "load",
    "export",
    "abs",
    "sqrt",
    "atan2",
    "step",
    "smoothstep",
];

const OPERATORS: &[&str] = &[
    "+", "-", "*", "/", "%", "@", "^", "|", "&", "\\", "==", "!=", "<", "<=", ">", ">=", "and",
    "or", "..", "|>",
];

/// Numbers by Marsaglia's xorshift, with the shifts 13, 7 and 17.
struct Dice(u64);

impl Dice {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % bound
    }

    fn one(&mut self, of: &[&'static str]) -> &'static str {
        of[self.below(of.len())]
    }

    fn expression(&mut self, depth: usize) -> String {
        if depth == 0 {
            let of = if self.below(2) == 0 { NAMES } else { LITERALS };
            return self.one(of).to_string();
        }
        let depth = depth - 1;
        let first = self.expression(depth);
        let name = self.one(NAMES);
        match self.below(20) {
            0..=5 => format!(
                "({first} {} {})",
                self.one(OPERATORS),
                self.expression(depth)
            ),
            6 => format!("({}{first})", self.one(&["-", "!", "not "])),
            7..=9 => format!("{}({first})", self.one(FUNCTIONS)),
            10 => format!(
                "{}({first}, {})",
                self.one(FUNCTIONS),
                self.expression(depth)
            ),
            11 => format!("{name}({first}, {}, 1)", self.expression(depth)),
            12 => format!(
                "{first}.{}",
                self.one(&["x", "xy", "zz", "low", "points", "w", "sort"])
            ),
            13 => format!("{first}[{}]", self.expression(depth)),
            14 => format!("(if {first} then {} else 1)", self.expression(depth)),
            15 => format!("[{} for {name} in {first}]", self.expression(depth)),
            16 => format!("({name} -> {first})"),
            17 => {
                let changed = self.one(&["r", "k", "n", "c", "module.r", "module.k", "x.y"]);
                format!("({first} with {{{changed} = {}}})", self.expression(depth))
            }
            18 => format!("{{ let y = {first}; {} }}", self.expression(depth)),
            _ => format!("(0..{first} by {})", self.expression(depth)),
        }
    }

    fn statement(&mut self, place: usize) -> String {
        let (first, second) = (self.expression(3), self.expression(1));
        match self.below(13) {
            0..=2 => format!("let v{place} = {first}"),
            3 | 4 => format!("field v{place}(p in R{}) = {first}", 1 + self.below(3)),
            5 => format!("fn v{place}(x, y = {second}) = {first}"),
            6 => format!("param v{place} = {second} in {first}"),
            7 => format!("setting v{place} = {second} in {first}"),
            8 => format!("for i in {first} {{ c = {second} }}"),
            9 => format!("test \"t\" {{ c = {second}; assert({first}) }}"),
            10 => format!("if {first} {{ c = {second} }} else {{ let u = 1 }}"),
            11 => format!("print({first})"),
            _ => first,
        }
    }
}

/// Nobody listens.
struct Deaf;

impl Host for Deaf {
    fn print(&mut self, _line: &str) {}

    fn warn(&mut self, _warning: Diagnostic) {}

    fn wrote(&mut self, _path: &Path) {}

    fn read_source(&mut self, path: &Path) -> Result<(SourceId, Arc<str>), Diagnostic> {
        match path.to_str() {
            Some("module.imp") => Ok((SourceId(1), MODULE.into())),
            _ => Err(Diagnostic::error(Code::CannotRead, "no such file")),
        }
    }

    fn monitor(&self) -> &dyn Monitor {
        &Silent
    }
}

/// How a program ends: the codes of its errors.
fn ends(text: &str, mode: Mode, folder: &Path) -> Vec<&'static str> {
    let mut limits = Limits::default();
    for (name, value) in [
        ("nodes", 100_000),
        ("elements", 100_000),
        ("cells", 100_000),
        ("particles", 1_000),
        ("steps", 100_000),
        ("seconds", 20),
    ] {
        assert!(limits.set(name, value), "{name}");
    }
    let mut session = Session::new(
        Box::new(Deaf),
        mode,
        limits,
        PathBuf::new(),
        vec![folder.to_owned()],
    );
    let parsed = parse(SourceId(0), text);
    let mut errors = parsed.diagnostics;
    if errors.is_empty() {
        errors.extend(session.run(&parsed.tree).err().into_iter().flatten());
        for test in session.tests() {
            errors.extend(session.run_test(&test).err().into_iter().flatten());
        }
    }
    errors.iter().map(|error| error.code.as_str()).collect()
}

fn number(name: &str, default: u64) -> u64 {
    let given = std::env::var(name).ok();
    given.and_then(|text| text.parse().ok()).unwrap_or(default)
}

#[test]
fn random_programs_end_with_a_value_or_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let good = ends(DEFINITIONS, Mode::Run, folder.path());
    assert_eq!(good, [""; 0], "the definitions alone");
    let mut dice = Dice(0x9E37_79B9_7F4A_7C15 ^ number("IMP_SEED", 1));
    let (mut well, mut codes) = (0, std::collections::BTreeSet::new());
    for _ in 0..number("IMP_ROUNDS", 1_500) {
        let statements: Vec<String> = (0..1 + dice.below(2))
            .map(|place| dice.statement(place))
            .collect();
        let text = format!("{DEFINITIONS}{}\n", statements.join("\n"));
        let mode = [Mode::Run, Mode::Run, Mode::Check, Mode::Define][dice.below(4)];
        let found = ends(&text, mode, folder.path());
        well += usize::from(found.is_empty());
        codes.extend(found);
    }
    // The programs are neither all nonsense nor all alike.
    assert!(well > 50, "{well}");
    assert!(codes.len() > 15, "{codes:?}");
}
