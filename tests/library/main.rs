//! The library that is written in Imp, driven from its doc comments: no entry can be forgotten.
//!
//! `Example:` lines are relations that must hold, or shapes. `Kind:` says what a shape's values
//! are, and so do the lines `Exact:`, `Exact outside:` and `Bound:` of operators; `distance` tests
//! that, and `membership` compares shapes with predicates that are written here from their
//! definitions.

#[path = "../common/mod.rs"]
mod common;
mod distance;
mod formulas;
mod membership;
mod names;
mod points;

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use imp::library::{Entry, entries};

use common::{Run, script};

/// What the doc comment of an entry promises.
struct Promise {
    kind: String,
    examples: Vec<String>,
    exact: Vec<String>,
    exact_outside: Vec<String>,
    bound: Vec<String>,
}

/// The lines of a doc comment that begin with `head`; the text goes on in lines below.
fn lines(entry: &Entry, head: &str) -> Vec<String> {
    entry
        .documentation()
        .filter_map(|line| line.strip_prefix(head))
        .map(|line| line.trim().to_string())
        .collect()
}

fn promise(entry: &Entry) -> Promise {
    let kind = lines(entry, "Kind: ").join(" ");
    let mut promise = Promise {
        examples: lines(entry, "Example: "),
        exact: lines(entry, "Exact: "),
        exact_outside: lines(entry, "Exact outside: "),
        bound: lines(entry, "Bound: "),
        kind,
    };
    let shapes = match &*promise.kind {
        kind if kind.starts_with("exact outside") => &mut promise.exact_outside,
        kind if kind.starts_with("exact") => &mut promise.exact,
        kind if kind.starts_with("bound") => &mut promise.bound,
        _ => return promise,
    };
    shapes.append(&mut promise.examples);
    promise
}

/// Does the work for every item, on as many threads as there are, and gives what went wrong.
fn failures<T: Sync>(items: &[T], work: impl Fn(&T) -> Result<(), String> + Sync) -> Vec<String> {
    let next = AtomicUsize::new(0);
    let found = Mutex::new(Vec::new());
    let threads = std::thread::available_parallelism().map_or(2, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some(item) = items.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if let Err(reason) = work(item) {
                        found.lock().unwrap().push(reason);
                    }
                }
            });
        }
    });
    let mut found = found.into_inner().unwrap();
    found.sort();
    found
}

fn assert_none(failures: &[String]) {
    let text = failures.join("\n");
    assert!(failures.is_empty(), "{} failures:\n{text}", failures.len());
}

/// What a script printed, or how it failed.
fn printed(text: &str) -> Result<Vec<String>, String> {
    let Run {
        code,
        stdout,
        stderr,
    } = script(text);
    if code == 0 {
        Ok(stdout.lines().map(str::to_string).collect())
    } else {
        Err(stderr)
    }
}

/// What has no example because it reads a file: `tests/language_text.rs` has a font.
const READ_FILES: &[&str] = &["text"];

#[test]
fn every_entry_is_documented() {
    let mut names: Vec<String> = Vec::new();
    for entry in entries() {
        let name = entry.full_name();
        assert!(!names.contains(&name), "`{name}` is defined twice");
        for head in ["Kind: ", "Source: "] {
            let count = lines(entry, head).len();
            assert_eq!(count, 1, "`{name}` has {count} lines `{head}`");
        }
        names.push(name.clone());
        if READ_FILES.contains(&&*name) {
            continue;
        }
        let promise = promise(entry);
        let examples = [
            &promise.examples,
            &promise.exact,
            &promise.exact_outside,
            &promise.bound,
        ];
        let count: usize = examples.iter().map(|list| list.len()).sum();
        assert!(count > 0, "`{name}` has no example");
        let own = lines(entry, "Example: ");
        assert!(
            own.iter().any(|example| example.contains(&name)),
            "no example of `{name}` shows it"
        );
    }
    assert!(names.len() > 250, "only {} entries", names.len());
}

#[test]
fn the_examples_hold() {
    let failures = failures(entries(), |entry| {
        let examples = promise(entry).examples;
        let lines: String = examples
            .iter()
            .map(|example| format!("print({example})\n"))
            .collect();
        let values = printed(&lines).map_err(|error| format!("{}: {error}", entry.full_name()))?;
        for (example, value) in examples.iter().zip(&values) {
            let a_field = value.contains("a field") || value.contains("field in R");
            if value != "true" && !a_field {
                return Err(format!("{example} is {value}"));
            }
        }
        Ok(())
    });
    assert_none(&failures);
}

/// Fields that are examples of themselves are numbers everywhere, and so are their gradients
/// almost everywhere.
#[test]
fn fields_are_finite() {
    let fields: Vec<String> = entries()
        .iter()
        .filter(|entry| entry.text.contains("\nfield "))
        .map(|entry| match &*entry.name {
            // A curve in space is where two fields vanish.
            "trefoil" | "viviani" => format!("{}[0]", entry.full_name()),
            _ => entry.full_name(),
        })
        .chain(
            [
                "gyroid(1, 0.1)",
                "superellipsoid(1, 0.8, 1.2, 0.5, 0.7)",
                "helix(0.8, 0.15, 0.6)",
                "as_field(p -> noise(p, 3))",
                "as_field(p -> fbm(p, 3), 2)",
                "as_field(p -> voronoi(p))",
                "sphere(1).twist(1)",
                "box(1).bend(0.5)",
                "box(1).taper()",
                "box(1).swirl(1)",
                "r_union(sphere(1), box(1))",
                "columns_union(sphere(1), box([3, 1, 1]), 0.4, 4)",
                "stairs_union(sphere(1), box([3, 1, 1]), 0.4, 4)",
            ]
            .map(str::to_string),
        )
        .collect();
    let failures = failures(&fields, |field| {
        for probe in distance::probe(field)? {
            if !probe.values[0].is_finite() {
                return Err(format!(
                    "{field} is {} at {:?}",
                    probe.values[0], probe.point
                ));
            }
            if !probe.special && !probe.gradient.iter().all(|slope| slope.is_finite()) {
                return Err(format!("{field} has no gradient at {:?}", probe.point));
            }
        }
        Ok(())
    });
    assert_none(&failures);
}
