//! Giving a name another one, everywhere, so that the program means the same.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::{Place, Project, Symbol, imported_path};
use crate::assist::index::{Binding, DoubtKind, Index, Target};
use crate::assist::vocabulary;
use crate::diagnostic::SourceId;
use crate::language::product;
use crate::syntax::parse;
use crate::syntax::walk::Role;
use crate::syntax::words::{is_name, keywords};

/// A binding that is to have another name.
struct Change<'change> {
    home: &'change Path,
    place: usize,
    binding: &'change Binding,
    new: &'change str,
}

impl Project {
    /// Whether the name at a place can be changed: where it stands, or why not.
    pub fn renamed(&mut self, path: &Path, offset: usize) -> Result<Range<usize>, String> {
        match self.symbol(path, offset) {
            None => Err("no name that a file defines stands here".into()),
            Some((Symbol::Language(name), _)) => Err(format!(
                "`{name}` belongs to the language, so it keeps its name"
            )),
            Some((Symbol::Bound(..), range)) => Ok(range),
        }
    }

    /// The places to change so that the name at a place becomes `name`, or why it cannot: the
    /// program must mean the same afterwards, as far as its text tells what it means.
    pub fn rename(&mut self, path: &Path, offset: usize, name: &str) -> Result<Vec<Place>, String> {
        self.renamed(path, offset)?;
        check_name(name)?;
        let nothing = || "no name that a file defines stands here".to_string();
        let Some((Symbol::Bound(home, place), _)) = self.symbol(path, offset) else {
            return Err(nothing());
        };
        let file = self.file(&home).ok_or_else(nothing)?;
        let binding = file.index().bindings.get(place).ok_or_else(nothing)?;
        if &*binding.name == name {
            return Ok(Vec::new());
        }
        let others = match binding.is_global || is_argument(binding) {
            true => self.users(&home),
            false => Vec::new(),
        };
        for user in std::iter::once(&home).chain(&others) {
            self.check_syntax(user)?;
        }
        if let Some(other) = collision(file.index(), binding, name) {
            let place = self.line(&home, other.range.start);
            return Err(format!("`{name}` is bound already, in {place}"));
        }
        let change = Change {
            home: &home,
            place,
            binding,
            new: name,
        };
        self.check_doubts(&change, &others)?;
        let places = self.places_of(&home, place);
        let mut edited: Vec<&Path> = places.iter().map(|place| &*place.path).collect();
        edited.sort();
        edited.dedup();
        for file in edited {
            let places = places.iter().filter(|place| place.path == file);
            let places: Vec<Range<usize>> = places.map(|place| place.start..place.end).collect();
            self.check_meanings(file, places, &change)?;
        }
        Ok(places)
    }

    /// A place in words: `line 3 of main.imp`.
    fn line(&mut self, path: &Path, offset: usize) -> String {
        let file = self.file(path);
        let before = file.as_ref().and_then(|file| file.text.get(..offset));
        let line = before.unwrap_or_default().matches('\n').count() + 1;
        format!("line {line} of {}", name_of_file(path))
    }

    fn check_syntax(&mut self, path: &Path) -> Result<(), String> {
        let file = self.file(path);
        let text = file.as_ref().map_or("", |file| &file.text);
        match parse(SourceId(0), text).diagnostics.is_empty() {
            true => Ok(()),
            false => Err(format!(
                "{} has syntax errors, so it is not known what its names mean",
                name_of_file(path)
            )),
        }
    }

    /// The files that a file imports.
    fn imports(&mut self, path: &Path) -> Vec<PathBuf> {
        let Some(file) = self.file(path) else {
            return Vec::new();
        };
        let index = file.index();
        let imports = index.imports.iter();
        imports
            .filter_map(|import| imported_path(path, index, import.binding))
            .collect()
    }

    /// The files that import `home`, or import one that does, and so on.
    fn users(&mut self, home: &Path) -> Vec<PathBuf> {
        let mut waiting: Vec<(PathBuf, Vec<PathBuf>)> = Vec::new();
        for other in self.other_files(home) {
            let imports = self.imports(&other);
            if !imports.is_empty() {
                waiting.push((other, imports));
            }
        }
        let mut users: Vec<PathBuf> = Vec::new();
        loop {
            let (found, rest): (Vec<_>, Vec<_>) = waiting.into_iter().partition(|(_, imports)| {
                let mut imports = imports.iter();
                imports.any(|file| file == home || users.contains(file))
            });
            if found.is_empty() {
                return users;
            }
            users.extend(found.into_iter().map(|(user, _)| user));
            waiting = rest;
        }
    }

    /// The files that `home` imports, those that they import, and so on.
    fn imported(&mut self, home: &Path) -> Vec<PathBuf> {
        let mut all = self.imports(home);
        let mut next = 0;
        while let Some(file) = all.get(next).cloned() {
            for file in self.imports(&file) {
                if !all.contains(&file) {
                    all.push(file);
                }
            }
            next += 1;
        }
        all
    }

    /// Whether no name of which the text does not tell what it means might be the one that is
    /// changed.
    fn check_doubts(&mut self, change: &Change, users: &[PathBuf]) -> Result<(), String> {
        let (old, new) = (&*change.binding.name, change.new);
        let imported = self.imported(change.home);
        let is_elsewhere = imported.iter().any(|path| {
            let file = self.file(path);
            file.is_some_and(|file| {
                file.index().global(old).is_some() || file.index().global(new).is_some()
            })
        });
        let own = [change.home.to_owned()];
        for path in own.iter().chain(users).chain(&imported) {
            let Some(file) = self.file(path) else {
                continue;
            };
            let index = file.index();
            for doubt in &index.doubts {
                let is_old = &*doubt.name == old;
                if !is_old && &*doubt.name != new {
                    continue;
                }
                let is_own = path == change.home;
                let is_user = !is_own && change.binding.is_global && users.contains(path);
                let is_changed = is_own && is_old && {
                    let own = Target::Own(change.place);
                    let mut places = index.places(&own);
                    places.any(|range| range == doubt.range)
                };
                let is_property = || {
                    let mut known = vocabulary::properties().iter();
                    product::is_swizzle(new) || known.any(|known| &*known.name == new)
                };
                let refused = match doubt.kind {
                    DoubtKind::Late => is_own,
                    DoubtKind::Argument => is_old && is_argument(change.binding),
                    DoubtKind::Member => is_user,
                    DoubtKind::Method => is_user || is_changed && (is_elsewhere || is_property()),
                };
                if refused {
                    return Err(self.doubtful(path, doubt.range.start, &doubt.name));
                }
            }
            for occurrence in &index.occurrences {
                if let Target::MemberArgument(_, _, argument) = &occurrence.target
                    && &**argument == old
                    && is_argument(change.binding)
                    && self.meaning(path, index, &occurrence.target).is_none()
                {
                    return Err(self.doubtful(path, occurrence.range.start, old));
                }
            }
        }
        Ok(())
    }

    fn doubtful(&mut self, path: &Path, offset: usize, name: &str) -> String {
        let place = self.line(path, offset);
        format!("only a run shows what `{name}` means in {place}, so that may become wrong")
    }

    /// Whether all names of a file stand for the same when those at `places` are changed.
    fn check_meanings(
        &mut self,
        path: &Path,
        mut places: Vec<Range<usize>>,
        change: &Change,
    ) -> Result<(), String> {
        places.sort_by_key(|range| range.start);
        let Some(file) = self.file(path) else {
            return Ok(());
        };
        let mut text = String::with_capacity(file.text.len());
        let mut copied = 0;
        for range in &places {
            text += file.text.get(copied..range.start).unwrap_or_default();
            text += change.new;
            copied = range.end;
        }
        text += file.text.get(copied..).unwrap_or_default();
        let (before, after) = (file.index(), Index::of_text(&text));
        let mut edits = 0;
        let mut others = after.occurrences.iter();
        for occurrence in &before.occurrences {
            let start = occurrence.range.start + edits * change.new.len()
                - edits * change.binding.name.len();
            if places.get(edits) == Some(&occurrence.range) {
                edits += 1;
            }
            let same = others.next().is_some_and(|other| {
                other.range.start == start && change.agrees(&occurrence.target, &other.target)
            });
            if !same {
                let place = self.line(path, occurrence.range.start);
                let new = change.new;
                return Err(format!(
                    "with `{new}`, a name in {place} would mean another"
                ));
            }
        }
        let mut late = after.doubts.iter();
        let late = late.any(|doubt| doubt.kind == DoubtKind::Late && &*doubt.name == change.new);
        match others.next().is_some() || late || !parse(SourceId(0), &text).diagnostics.is_empty() {
            true => Err(format!(
                "with `{}`, a name in {} would mean another",
                change.new,
                name_of_file(path)
            )),
            false => Ok(()),
        }
    }
}

impl Change<'_> {
    /// Whether something stands for the same as before.
    fn agrees(&self, before: &Target, after: &Target) -> bool {
        let same = |before: &Arc<str>, after: &Arc<str>| {
            before == after || (*before == self.binding.name && &**after == self.new)
        };
        match (before, after) {
            (Target::Member(one, name), Target::Member(other, new)) => {
                one == other && same(name, new)
            }
            (
                Target::MemberArgument(one, function, name),
                Target::MemberArgument(other, new_function, new),
            ) => one == other && same(function, new_function) && same(name, new),
            _ => before == after,
        }
    }
}

/// Whether calls can name it.
fn is_argument(binding: &Binding) -> bool {
    matches!(binding.role, Role::Argument | Role::Coordinate)
}

fn name_of_file(path: &Path) -> String {
    let name = path.file_name();
    name.unwrap_or_default().to_string_lossy().into_owned()
}

/// Whether something can have this name at all.
fn check_name(name: &str) -> Result<(), String> {
    if keywords().any(|word| word == name) {
        return Err(format!("`{name}` is a word of the language"));
    }
    if matches!(name, "R1" | "R2" | "R3") {
        return Err(format!("`{name}` is a space of the language"));
    }
    if !is_name(name) {
        let what = "names are made of letters, digits and `_`, and begin with no digit";
        return Err(format!("`{}` is not a name: {what}", shortened(name)));
    }
    if vocabulary::find(name).is_some() {
        return Err(format!("`{name}` is a name of the language or its library"));
    }
    Ok(())
}

/// Another binding that would be taken for this one, or the other way round.
fn collision<'index>(
    index: &'index Index,
    binding: &Binding,
    name: &str,
) -> Option<&'index Binding> {
    let meets = |other: &&Binding| {
        let apart =
            other.scope.end <= binding.scope.start || binding.scope.end <= other.scope.start;
        // Functions see the whole file's names before they are bound.
        binding.is_global || other.is_global || !apart
    };
    let mut others = index.bindings.iter().filter(|other| &*other.name == name);
    others.find(meets)
}

fn shortened(name: &str) -> String {
    name.chars().take(40).collect()
}

#[cfg(test)]
mod tests {
    use super::super::tests::project;

    #[test]
    fn new_names_are_refused_with_a_reason() {
        let text = "let one = 1\nlet two = one\nfn f(a) = a + sin(1)\n";
        let (_folder, mut project, paths) = project(&[("main.imp", text)]);
        let mut refused = |at: &str, name: &str| {
            let offset = text.find(at).expect("a place");
            project
                .rename(&paths[0], offset, name)
                .expect_err("a reason")
        };
        for (at, name, reason) in [
            (
                "one",
                "two",
                "`two` is bound already, in line 2 of main.imp",
            ),
            (
                "a) =",
                "one",
                "`one` is bound already, in line 1 of main.imp",
            ),
            ("one", "let", "`let` is a word of the language"),
            ("one", "sphere", "`sphere` is a name of the language"),
            ("one", "1a", "`1a` is not a name"),
            ("one", "", "`` is not a name"),
            ("one", "a b", "`a b` is not a name"),
            ("sin", "sine", "`sin` belongs to the language"),
            ("let", "a", "no name that a file defines stands here"),
        ] {
            let given = refused(at, name);
            assert!(given.starts_with(reason), "{given}");
        }
    }
}
