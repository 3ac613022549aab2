//! Random and spoilt programs: whatever is read, nothing panics, hangs or takes memory without
//! bounds, and every error names a place in the text.
//!
//! Texts are examples and the corpus (`tests/fuzz_corpus/`) with random changes, random tokens, and
//! programs made by a grammar that knows the functions of the language. By default a fixed number
//! of them is tried from a fixed seed. For long rounds:
//!
//! ```console
//! $ IMP_FUZZ_SECONDS=600 IMP_FUZZ_SEED=7 cargo test --release --test fuzz -- --nocapture
//! ```
//!
//! What fails is printed whole, to be put into the corpus.

#![allow(clippy::print_stdout, clippy::print_stderr)]

#[path = "common/host.rs"]
mod host;
#[path = "common/programs.rs"]
mod programs;

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use host::{Deadline, Listener};
use imp::diagnostic::render::{render, short};
use imp::diagnostic::{Code, Diagnostic, SourceId, Sources};
use imp::language::{Limits, Mode, Session, builtin};
use imp::syntax::parse;
use programs::{Grammar, Random};

/// One program may take this long; limits and the monitor end ordinary ones far earlier.
const LONGEST: Duration = Duration::from_secs(60);

/// When work that asks its monitor is cancelled.
const PATIENCE: Duration = Duration::from_secs(2);

/// Bytes that the process may have in memory after many programs.
const MOST_MEMORY: u64 = 2_000_000_000;

/// How many programs: a number of them, or as many as a time allows.
enum Rounds {
    Count(usize),
    Until(Instant),
}

/// What the environment asks for, else this many programs from seed 0.
fn plan(count: usize) -> (Random, Rounds) {
    let number = |name: &str| std::env::var(name).ok().map(|text| text.parse().unwrap());
    let seed = number("IMP_FUZZ_SEED").unwrap_or(0);
    let rounds = match number("IMP_FUZZ_SECONDS") {
        Some(seconds) => Rounds::Until(Instant::now() + Duration::from_secs(seconds)),
        None => Rounds::Count(count),
    };
    (Random(seed), rounds)
}

/// The texts that are changed: examples, the corpus, wrong programs and the pages of errors.
fn corpus() -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = ["examples", "tests/fuzz_corpus", "tests/wrong_programs"];
    let mut paths: Vec<PathBuf> = folders
        .iter()
        .flat_map(|folder| std::fs::read_dir(root.join(folder)).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "imp"))
        .collect();
    paths.sort();
    let texts = paths
        .iter()
        .map(|path| std::fs::read_to_string(path).unwrap());
    let mut texts: Vec<String> = texts.collect();
    for code in Code::ALL {
        let blocks = code.page().split("```imp\n").skip(1);
        texts.extend(blocks.filter_map(|block| Some(block.split_once("```")?.0.to_string())));
    }
    texts
}

/// Pieces that programs are made of.
const TOKENS: &[&str] = &[
    "param ", "let ", "var ", "fn ", "field ", "over ", "in ", "for ", "while ", "if ", "then ",
    "else ", "and ", "or ", "not ", "with ", "by ", "true", "false", "setting ", "import ", "as ",
    "test ", "(", ")", "[", "]", "{", "}", "\"", "\\", "\n", ";", ",", ".", "..", "->", "|>", "=",
    "==", "!=", "<", "<=", ">", ">=", "+", "-", "*", "/", "%", "@", "^", "**", "!", "|", "&", "#",
    "##", "x", "y", "z", "p", "f", "π", "R1", "R2", "R3", "0", "1", "2.5", ".5", "1e999", "1e-400",
    "0x1", "1_000", "90deg", "0.25turn", "é", "\u{feff}", "\t", "\r\n", "\0", "𝔽", "−", "…",
];

/// A text with some random changes.
fn changed(random: &mut Random, texts: &[String]) -> String {
    let mut text: Vec<char> = texts[random.below(texts.len())].chars().collect();
    for _ in 0..1 + random.below(6) {
        let at = random.below(text.len() + 1);
        let length = 1 + random.below(1 + (text.len() - at).min(30));
        let end = (at + length).min(text.len());
        match random.below(6) {
            0 => drop(text.drain(at..end)),
            1 => {
                let piece = text[at..end].to_vec();
                let to = random.below(text.len() + 1);
                text.splice(to..to, piece);
            }
            2 => {
                let other: Vec<char> = texts[random.below(texts.len())].chars().collect();
                let from = random.below(other.len() + 1);
                let to = (from + length).min(other.len());
                text.splice(at..at, other[from..to].iter().copied());
            }
            3 => {
                let name = builtin::all()[random.below(builtin::all().len())].name;
                text.splice(at..end, name.chars());
            }
            4 if at < text.len() => {
                text[at] = char::from_digit(random.below(10) as u32, 10).unwrap()
            }
            _ => drop(text.splice(at..at, random.of(TOKENS).chars())),
        }
    }
    text.into_iter().collect()
}

fn tokens(random: &mut Random) -> String {
    (0..random.below(60)).map(|_| random.of(TOKENS)).collect()
}

/// What is tried at present, for the watchdog.
type Present = Arc<Mutex<Option<(Instant, String)>>>;

/// Ends the process with the program that takes too long: a hang cannot be unwound.
fn watch(present: &Present) {
    let present = Arc::downgrade(present);
    std::thread::spawn(move || {
        while let Some(present) = present.upgrade() {
            let hanging = match &*present.lock().unwrap() {
                Some((since, text)) if since.elapsed() > LONGEST => Some(text.clone()),
                _ => None,
            };
            if let Some(text) = hanging {
                eprintln!("this program takes longer than {LONGEST:?}:\n{text}");
                std::process::abort();
            }
            drop(present);
            std::thread::sleep(Duration::from_millis(200));
        }
    });
}

/// Tries programs until the plan is fulfilled; gives their number.
fn try_all(
    (mut random, rounds): (Random, Rounds),
    mut make: impl FnMut(&mut Random) -> String,
    mut attempt: impl FnMut(&mut Random, &str) -> bool,
) {
    let present = Present::default();
    watch(&present);
    let (mut count, mut well) = (0, 0);
    while match rounds {
        Rounds::Count(all) => count < all,
        Rounds::Until(end) => Instant::now() < end,
    } {
        let text = make(&mut random);
        *present.lock().unwrap() = Some((Instant::now(), text.clone()));
        let result = catch_unwind(AssertUnwindSafe(|| attempt(&mut random, &text)));
        assert!(
            result.is_ok(),
            "this program fails, after {count} others:\n{text}"
        );
        *present.lock().unwrap() = None;
        count += 1;
        well += usize::from(matches!(result, Ok(true)));
        if count % 64 == 0 {
            let memory = memory();
            assert!(
                memory < MOST_MEMORY,
                "{memory} bytes after {count} programs:\n{text}"
            );
        }
    }
    let megabytes = memory() / 1_000_000;
    println!("{count} programs, {well} without an error, {megabytes} MB in memory");
    // Programs that all fail at once would test nothing.
    assert!(well > count / 20, "{well} of {count}");
}

/// Bytes of this process in memory; 0 where the system does not tell.
fn memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    let kilobytes = line.and_then(|line| line.trim().strip_suffix(" kB")?.parse::<u64>().ok());
    kilobytes.unwrap_or(0) * 1000
}

/// Whether diagnostics can be shown in all forms, and stand in their texts.
fn check_diagnostics(diagnostics: &[Diagnostic], sources: &Sources, id: SourceId) {
    assert!(!render(diagnostics, sources, true).is_empty());
    assert!(!short(diagnostics, sources).is_empty());
    for diagnostic in diagnostics {
        assert!(!diagnostic.message.is_empty());
        for label in &diagnostic.labels {
            let text = &sources.get(label.span.source).text;
            let (start, end) = (label.span.start as usize, label.span.end as usize);
            assert!(start <= end && end <= text.len(), "{diagnostic:?}");
            assert!(
                text.is_char_boundary(start) && text.is_char_boundary(end),
                "{diagnostic:?}"
            );
        }
        let primary = diagnostic.span().map(|span| span.source);
        assert_eq!(primary, Some(id), "no place in the file: {diagnostic:?}");
    }
}

/// Parses a text; says whether it is without an error.
fn parse_one(text: &str) -> bool {
    let mut sources = Sources::default();
    let id = sources.add("fuzz.imp", text);
    let parsed = parse(id, text);
    if !parsed.diagnostics.is_empty() {
        check_diagnostics(&parsed.diagnostics, &sources, id);
    }
    parsed.diagnostics.is_empty()
}

/// Limits so small that nothing ordinary takes long.
fn limits() -> Limits {
    let mut limits = Limits::default();
    for (name, value) in [
        ("recursion", 300),
        ("nodes", 20_000),
        ("elements", 20_000),
        ("characters", 20_000),
        ("steps", 20_000),
        ("cells", 20_000),
        ("particles", 300),
    ] {
        assert!(limits.set(name, value), "{name}");
    }
    limits
}

/// Runs a program in one of the modes; says whether it ends without an error.
fn run_one(random: &mut Random, text: &str, folder: &Path) -> bool {
    let mut sources = Sources::default();
    let id = sources.add("fuzz.imp", text);
    let parsed = parse(id, text);
    if !parsed.diagnostics.is_empty() {
        check_diagnostics(&parsed.diagnostics, &sources, id);
        return false;
    }
    let warnings = Rc::new(RefCell::new(Vec::new()));
    let listener = Listener {
        warnings: Rc::clone(&warnings),
        deadline: Deadline(Instant::now() + PATIENCE),
    };
    let mode = [Mode::Run, Mode::Run, Mode::Check, Mode::Define][random.below(4)];
    let place = folder.to_owned();
    let mut session = Session::new(
        Box::new(listener),
        mode,
        limits(),
        place.clone(),
        vec![place],
    );
    let result = session.run(&parsed.tree);
    if let Err(errors) = &result {
        assert!(!errors.is_empty());
        check_diagnostics(errors, &sources, id);
    }
    let warnings = warnings.borrow();
    if !warnings.is_empty() {
        check_diagnostics(&warnings, &sources, id);
    }
    result.is_ok()
}

#[test]
fn no_text_is_too_much_for_the_parser() {
    let texts = corpus();
    let make = |random: &mut Random| match random.below(4) {
        0 => tokens(random),
        1 => Grammar::new(random).program(),
        _ => changed(random, &texts),
    };
    try_all(plan(4_000), make, |_, text| parse_one(text));
}

#[test]
fn no_program_is_too_much_for_the_evaluator() {
    let texts = corpus();
    let folder = tempfile::tempdir().unwrap();
    let make = |random: &mut Random| match random.below(4) {
        0 => changed(random, &texts),
        _ => Grammar::new(random).program(),
    };
    try_all(plan(1_000), make, |random, text| {
        run_one(random, text, folder.path())
    });
}
