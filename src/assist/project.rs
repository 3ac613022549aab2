//! Names across files: where they are defined, where they are used, and giving them another name.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use std::time::SystemTime;

use rustc_hash::FxHashMap;

use super::index::{Binding, Import, Index, Target};

mod rename;

/// The largest file that is read, in bytes.
const LARGEST: u64 = 10_000_000;

/// The most files that are looked through for the users of a definition.
const MOST_FILES: usize = 2_000;

/// A file, as it is in an editor or on disk.
#[derive(Debug)]
pub struct File {
    /// Its text.
    pub text: Arc<str>,
    index: OnceLock<Index>,
}

impl File {
    fn new(text: Arc<str>) -> Arc<File> {
        let index = OnceLock::new();
        Arc::new(File { text, index })
    }

    /// What its names mean; found when it is first asked for.
    pub fn index(&self) -> &Index {
        self.index.get_or_init(|| Index::of_text(&self.text))
    }
}

/// A stretch of a file.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// The file.
    pub path: PathBuf,
    /// First byte.
    pub start: usize,
    /// One past the last byte.
    pub end: usize,
}

impl Place {
    fn new(path: &Path, range: &Range<usize>) -> Place {
        Place {
            path: path.to_owned(),
            start: range.start,
            end: range.end,
        }
    }
}

/// What a name stands for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Symbol {
    /// A binding of a file, by its number in the file's index.
    Bound(PathBuf, usize),
    /// A name of the language, in full.
    Language(Arc<str>),
}

/// When a file on disk was changed, and how long it is.
type Stamp = (Option<SystemTime>, u64);

/// The files that an editor has open, and those that have been read on disk.
#[derive(Debug, Default)]
pub struct Project {
    open: FxHashMap<PathBuf, Arc<File>>,
    read: FxHashMap<PathBuf, (Stamp, Arc<File>)>,
    /// The folders in which users of a definition are looked for.
    pub folders: Vec<PathBuf>,
}

impl Project {
    /// Takes the text of an open file from now on.
    pub fn open(&mut self, path: PathBuf, text: Arc<str>) {
        self.open.insert(path, File::new(text));
    }

    /// Takes the file on disk from now on.
    pub fn close(&mut self, path: &Path) {
        self.open.remove(path);
    }

    /// The texts of the open files.
    pub fn texts(&self) -> FxHashMap<PathBuf, Arc<str>> {
        let open = self.open.iter();
        open.map(|(path, file)| (path.clone(), Arc::clone(&file.text)))
            .collect()
    }

    /// A file; nothing if it cannot be read.
    pub fn file(&mut self, path: &Path) -> Option<Arc<File>> {
        if let Some(file) = self.open.get(path) {
            return Some(Arc::clone(file));
        }
        let data = std::fs::metadata(path).ok()?;
        if !data.is_file() || data.len() > LARGEST {
            return None;
        }
        let stamp = (data.modified().ok(), data.len());
        if let Some((known, file)) = self.read.get(path)
            && *known == stamp
        {
            return Some(Arc::clone(file));
        }
        let text: Arc<str> = std::fs::read_to_string(path).ok()?.into();
        let file = File::new(text);
        let kept = (stamp, Arc::clone(&file));
        self.read.insert(path.to_owned(), kept);
        Some(file)
    }

    /// What the name at a place stands for, and where that name stands.
    pub fn symbol(&mut self, path: &Path, offset: usize) -> Option<(Symbol, Range<usize>)> {
        let file = self.file(path)?;
        let found = file.index().at(offset)?;
        let symbol = self.meaning(path, file.index(), &found.target)?;
        Some((symbol, found.range.clone()))
    }

    fn meaning(&mut self, path: &Path, index: &Index, target: &Target) -> Option<Symbol> {
        let (import, name, argument) = match target {
            Target::Own(binding) => return Some(Symbol::Bound(path.to_owned(), *binding)),
            Target::Language(name) => return Some(Symbol::Language(Arc::clone(name))),
            Target::Member(import, name) => (*import, name, None),
            Target::MemberArgument(import, name, argument) => (*import, name, Some(argument)),
        };
        let imported = imported_path(path, index, import)?;
        let file = self.file(&imported)?;
        let bindings = &file.index().bindings;
        let mut found = file.index().global(name)?;
        if let Some(argument) = argument {
            let arguments = bindings[found].arguments.iter();
            found = arguments
                .copied()
                .find(|&place| bindings[place].name == *argument)?;
        }
        Some(Symbol::Bound(imported, found))
    }

    /// A binding.
    pub fn binding(&mut self, path: &Path, place: usize) -> Option<Binding> {
        self.file(path)?.index().bindings.get(place).cloned()
    }

    /// Where the name at a place is bound. The path of an import leads to the file.
    pub fn definition(&mut self, path: &Path, offset: usize) -> Option<Place> {
        let file = self.file(path)?;
        let mut imports = file.index().imports.iter();
        let on_path = |import: &&Import| {
            (import.path.span.start as usize..import.path.span.end as usize).contains(&offset)
        };
        if let Some(import) = imports.find(on_path) {
            let target = imported_path(path, file.index(), import.binding)?;
            return self.file(&target).map(|_| Place::new(&target, &(0..0)));
        }
        match self.symbol(path, offset)?.0 {
            Symbol::Bound(path, place) => {
                let binding = self.binding(&path, place)?;
                Some(Place::new(&path, &binding.range))
            }
            Symbol::Language(_) => None,
        }
    }

    /// Everywhere where what stands at a place stands, the place of its binding first, then in the
    /// order of files and texts: in the file itself, and if others can import it, in the open files
    /// and in those in the project's folders.
    pub fn references(&mut self, path: &Path, offset: usize) -> Vec<Place> {
        let Some((symbol, _)) = self.symbol(path, offset) else {
            return Vec::new();
        };
        match &symbol {
            Symbol::Language(name) => {
                let target = Target::Language(Arc::clone(name));
                let file = self.file(path);
                let places = file.iter().flat_map(|file| file.index().places(&target));
                places.map(|range| Place::new(path, &range)).collect()
            }
            Symbol::Bound(home, place) => self.places_of(home, *place),
        }
    }

    fn places_of(&mut self, home: &Path, place: usize) -> Vec<Place> {
        let Some(file) = self.file(home) else {
            return Vec::new();
        };
        let Some(binding) = file.index().bindings.get(place) else {
            return Vec::new();
        };
        let own = Target::Own(place);
        let mut places: Vec<Place> = file
            .index()
            .places(&own)
            .map(|range| Place::new(home, &range))
            .collect();
        let function = file
            .index()
            .bindings
            .iter()
            .find(|function| function.is_global && function.arguments.contains(&place));
        let (name, argument) = match (binding.is_global, function) {
            (true, _) => (&binding.name, None),
            (_, Some(function)) => (&function.name, Some(&binding.name)),
            _ => return places,
        };
        for other in self.other_files(home) {
            let Some(user) = self.file(&other) else {
                continue;
            };
            for import in &user.index().imports {
                if imported_path(&other, user.index(), import.binding).as_deref() != Some(home) {
                    continue;
                }
                let target = match argument {
                    None => Target::Member(import.binding, Arc::clone(name)),
                    Some(argument) => Target::MemberArgument(
                        import.binding,
                        Arc::clone(name),
                        Arc::clone(argument),
                    ),
                };
                let found = user.index().places(&target);
                places.extend(found.map(|range| Place::new(&other, &range)));
            }
        }
        places
    }

    /// The files that might import `home`, in order.
    fn other_files(&self, home: &Path) -> Vec<PathBuf> {
        let mut files: Vec<PathBuf> = self.open.keys().cloned().collect();
        let mut folders = self.folders.clone();
        folders.extend(home.parent().map(Path::to_owned));
        for folder in folders {
            imp_files(&folder, &mut files);
        }
        files.sort();
        files.dedup();
        files.retain(|file| file != home);
        files
    }
}

/// Where an import leads.
fn imported_path(path: &Path, index: &Index, binding: usize) -> Option<PathBuf> {
    let mut imports = index.imports.iter();
    let import = imports.find(|import| import.binding == binding)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    Some(plain(&folder.join(&*import.path.text)))
}

/// The path without symbolic links; one that is not there, as it is written.
pub fn plain(path: &Path) -> PathBuf {
    std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned())
}

/// Adds the Imp files in a folder and the folders in it, hidden ones left out, until there are
/// enough.
fn imp_files(folder: &Path, files: &mut Vec<PathBuf>) {
    let mut pending = vec![folder.to_owned()];
    let mut seen = 0;
    while let Some(folder) = pending.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            seen += 1;
            if files.len() >= MOST_FILES || seen > 10 * MOST_FILES {
                return;
            }
            let is_hidden = entry.file_name().as_encoded_bytes().starts_with(b".");
            let path = entry.path();
            // A link to a folder could lead back.
            let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
            if is_folder && !is_hidden {
                pending.push(path);
            } else if path.extension().is_some_and(|extension| extension == "imp") {
                files.push(plain(&path));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn project(files: &[(&str, &str)]) -> (tempfile::TempDir, Project, Vec<PathBuf>) {
        let folder = tempfile::tempdir().expect("a folder");
        let paths = files.iter().map(|(name, text)| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).expect("a file");
            plain(&path)
        });
        let paths = paths.collect();
        (folder, Project::default(), paths)
    }

    const PART: &str = "param size = 1\nfn head(width) = width * size\n";
    const MAIN: &str = "import \"part.imp\" as part\nlet a = part.head(width = 2)\n\
                        let b = (x -> x + part.size)(1)\n";

    #[test]
    fn definitions_are_found_in_other_files() {
        let (_folder, mut project, paths) = project(&[("part.imp", PART), ("main.imp", MAIN)]);
        let mut defined = |part: &str, delta: usize| {
            let offset = MAIN.find(part).expect("a part") + delta;
            project.definition(&paths[1], offset)
        };
        let in_part = |start: usize, end: usize| Place::new(&paths[0], &(start..end));
        let head = PART.find("head").expect("head");
        assert_eq!(defined("head", 0), Some(in_part(head, head + 4)));
        let width = PART.find("width").expect("width");
        assert_eq!(defined("width", 1), Some(in_part(width, width + 5)));
        assert_eq!(defined("part.imp", 2), Some(in_part(0, 0)));
        assert_eq!(defined("= 2", 2), None);
    }

    #[test]
    fn names_are_changed_in_all_files() {
        let (_folder, mut project, paths) = project(&[("part.imp", PART), ("main.imp", MAIN)]);
        let offset = PART.find("size").expect("size");
        let places = project.rename(&paths[0], offset, "extent_of_it");
        let places = places.expect("a new name");
        let by_file = |path: &Path| places.iter().filter(|place| place.path == path).count();
        assert_eq!((by_file(&paths[0]), by_file(&paths[1])), (2, 1));
        let offset = MAIN.find("width").expect("width");
        let places = project.rename(&paths[1], offset, "breadth");
        assert_eq!(places.map(|places| places.len()), Ok(3));
    }

    #[test]
    fn the_text_in_the_editor_counts() {
        let (_folder, mut project, paths) = project(&[("part.imp", PART), ("main.imp", MAIN)]);
        project.open(paths[0].clone(), Arc::from("\nparam size = 1\n"));
        let offset = MAIN.find("size").expect("size");
        let found = project.definition(&paths[1], offset);
        assert_eq!(found.map(|place| place.start), Some(7));
        project.close(&paths[0]);
        let found = project.definition(&paths[1], offset);
        assert_eq!(found.map(|place| place.start), Some(6));
    }
}
