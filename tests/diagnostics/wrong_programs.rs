//! Wrong programs and the messages they get, word for word: `tests/wrong_programs/`.
//!
//! With `IMP_WRITE_MESSAGES=1` the messages are written instead of compared.

use std::fs;
use std::path::Path;

use crate::common::imp_in;

#[test]
fn wrong_programs_get_their_messages() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = root.join("tests/wrong_programs");
    let mut names: Vec<String> = fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter_map(|name| Some(name.strip_suffix(".imp")?.to_string()))
        .collect();
    names.sort();
    assert!(names.len() >= 10, "{names:?}");
    for name in names {
        let file = format!("{name}.imp");
        let output = tempfile::tempdir().unwrap();
        let out = output.path().to_str().unwrap();
        let run = imp_in(&folder, &["run", &file, "--out", out]);
        assert_ne!(run.code, 0, "{file}");
        let expected = folder.join(format!("{name}.txt"));
        if std::env::var_os("IMP_WRITE_MESSAGES").is_some() {
            fs::write(&expected, &run.stderr).unwrap();
            continue;
        }
        let expected = fs::read_to_string(expected).unwrap();
        assert_eq!(run.stderr, expected, "{file}");
        if name == "three_errors" {
            assert_eq!(run.stderr.matches(" Error: ").count(), 3);
        }
    }
}
