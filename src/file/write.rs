//! Atomic writing: a file appears whole under its name, or not at all.
//!
//! The content goes to a temporary file in the same folder, which takes the name by a rename
//! when everything has been written. A failure, a full disk for instance, removes the temporary
//! file and leaves an older file of that name as it was.

use std::ffi::OsString;
use std::fs::{self, Metadata, Permissions};
use std::io::{self, BufWriter, Write};
use std::path::{Component, Path, PathBuf};

use std::sync::{Mutex, MutexGuard, PoisonError};

use tempfile::{Builder, NamedTempFile};

/// Bytes that are gathered before they are handed to the system.
const CAPACITY: usize = 1 << 17;

/// Symbolic links that are followed in one path; more of them are a circle.
const LINKS: usize = 40;

/// The temporary files that are being written.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

fn unfinished() -> MutexGuard<'static, Vec<PathBuf>> {
    // The list is whole after a panic, too.
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Nothing new is written while this lives.
pub struct Abandoned {
    _unfinished: MutexGuard<'static, Vec<PathBuf>>,
}

/// Removes what has been written in part, for a process that is about to be ended from outside:
/// nothing new is begun until the result is dropped.
pub fn abandon() -> Abandoned {
    let mut unfinished = unfinished();
    for path in unfinished.drain(..) {
        // It may have taken its name in the meantime; there is nobody to tell of anything else.
        let _ = fs::remove_file(path);
    }
    Abandoned {
        _unfinished: unfinished,
    }
}

/// Whether a file could be written, as far as the disk tells before it is done: what stands there
/// may be replaced, and its folder takes new files. `made` is a folder that will be made for it
/// if it is not there. Leaves nothing behind.
pub(super) fn check_writable(path: &Path, made: Option<&Path>) -> io::Result<()> {
    let made = made.map(resolve).transpose()?;
    // The present folder is the empty path here.
    let exists = |folder: &Path| folder == Path::new("") || folder.exists();
    if let Some(made) = made.filter(|folder| !exists(folder)) {
        let present = made.ancestors().find(|folder| exists(folder));
        let folder = present.unwrap_or(Path::new("."));
        return create_beside(&folder.join("new")).map(drop);
    }
    let target = resolve(path)?;
    if let Ok(existing) = fs::metadata(&target) {
        check_replaceable(&existing)?;
    }
    create_beside(&target).map(drop)
}

/// Where a path really leads: the same place without symbolic links.
///
/// Unlike `canonicalize` this resolves what does not exist, too, and links that lead there, since
/// that is where a new file would appear. A relative path stays relative. Fails only where links
/// lead in a circle. The cost is one look at the disk for each name in the path.
pub fn resolve(path: &Path) -> io::Result<PathBuf> {
    let mut resolved = PathBuf::new();
    // Names that are still to be followed, the next one last.
    let mut pending = Vec::new();
    push_reversed(&mut pending, path);
    let mut links = 0;
    while let Some(name) = pending.pop() {
        match Path::new(&name).components().next() {
            None | Some(Component::CurDir) => {}
            Some(Component::ParentDir) => climb(&mut resolved),
            Some(Component::Prefix(_) | Component::RootDir) => resolved.push(&name),
            Some(Component::Normal(_)) => {
                let candidate = resolved.join(&name);
                // What is not a link cannot be read as one, whether it exists or not.
                let Ok(target) = fs::read_link(&candidate) else {
                    resolved = candidate;
                    continue;
                };
                links += 1;
                if links > LINKS {
                    let message = "its symbolic links lead in a circle";
                    return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
                }
                // An absolute target begins with the root, which replaces what is resolved.
                push_reversed(&mut pending, &target);
            }
        }
    }
    Ok(resolved)
}

fn push_reversed(pending: &mut Vec<OsString>, path: &Path) {
    let names: Vec<OsString> = path
        .components()
        .map(|component| component.as_os_str().to_owned())
        .collect();
    pending.extend(names.into_iter().rev());
}

/// One folder up. Nothing before the `..` is a link, so that taking off a name is right.
fn climb(resolved: &mut PathBuf) {
    match resolved.components().next_back() {
        None | Some(Component::ParentDir) => resolved.push(".."),
        Some(Component::Normal(_)) => drop(resolved.pop()),
        // Above the root is the root.
        Some(_) => {}
    }
}

/// Writes a file with the given content, or changes nothing on the disk and says why.
///
/// An existing file keeps its permissions; a new one gets those that any program would give it.
/// A symbolic link stays, and the file it leads to is replaced or made. Folders are not created.
pub(super) fn write_whole(
    path: &Path,
    content: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let target = resolve(path)?;
    let existing = fs::metadata(&target).ok();
    if let Some(existing) = &existing {
        check_replaceable(existing)?;
    }
    let (_listed, temporary) = create_beside(&target)?;
    if let Some(existing) = existing {
        temporary
            .as_file()
            .set_permissions(existing.permissions())?;
    }
    let mut output = BufWriter::with_capacity(CAPACITY, temporary);
    content(&mut output)?;
    let temporary = output.into_inner().map_err(|error| error.into_error())?;
    // Some systems report a full disk only now.
    temporary.as_file().sync_all()?;
    temporary.persist(&target)?;
    Ok(())
}

/// Whether what stands at the target may be replaced: a rename alone would ask nobody.
fn check_replaceable(existing: &Metadata) -> io::Result<()> {
    if existing.is_dir() {
        let message = "it is a folder";
        return Err(io::Error::new(io::ErrorKind::IsADirectory, message));
    }
    if !existing.is_file() {
        let message = "it is not an ordinary file";
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    if existing.permissions().readonly() {
        let message = "the file is write-protected";
        return Err(io::Error::new(io::ErrorKind::PermissionDenied, message));
    }
    Ok(())
}

/// A place in the list of unfinished files, for as long as it lives.
struct Listed {
    path: PathBuf,
}

impl Drop for Listed {
    fn drop(&mut self) {
        unfinished().retain(|path| *path != self.path);
    }
}

/// A temporary file in the folder of the target. It is removed when it is dropped, and by
/// [`abandon`].
fn create_beside(target: &Path) -> io::Result<(Listed, NamedTempFile)> {
    let mut unfinished = unfinished();
    let file = create_unlisted(target)?;
    let path = file.path().to_owned();
    unfinished.push(path.clone());
    Ok((Listed { path }, file))
}

fn create_unlisted(target: &Path) -> io::Result<NamedTempFile> {
    let folder = match target.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    };
    let mut builder = Builder::new();
    builder.prefix(".imp-").suffix(".tmp");
    if let Some(permissions) = ordinary_permissions() {
        builder.permissions(permissions);
    }
    builder.tempfile_in(folder).map_err(|error| {
        let message = match error.kind() {
            io::ErrorKind::NotFound => format!("the folder `{}` does not exist", folder.display()),
            io::ErrorKind::NotADirectory => format!("`{}` is not a folder", folder.display()),
            io::ErrorKind::PermissionDenied => {
                format!(
                    "no permission to write in the folder `{}`",
                    folder.display()
                )
            }
            _ => return error,
        };
        io::Error::new(error.kind(), message)
    })
}

/// What a new file is asked to permit; the system takes off what the user's mask forbids.
/// Temporary files would otherwise be closed to everybody else.
#[cfg(unix)]
fn ordinary_permissions() -> Option<Permissions> {
    use std::os::unix::fs::PermissionsExt;
    Some(Permissions::from_mode(0o666))
}

#[cfg(not(unix))]
fn ordinary_permissions() -> Option<Permissions> {
    None
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use tempfile::{TempDir, tempdir};

    use super::*;

    /// The names in a folder, sorted.
    fn names(folder: &TempDir) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<String> = entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    /// Writes more than the buffer holds, then fails as a full disk does.
    fn half_then_full(output: &mut dyn Write) -> io::Result<()> {
        output.write_all(&vec![7; 3 * CAPACITY])?;
        Err(io::ErrorKind::StorageFull.into())
    }

    #[test]
    fn the_content_arrives_whole_and_alone() {
        let folder = tempdir().unwrap();
        let path = folder.path().join("a.bin");
        let content: Vec<u8> = (0..3 * CAPACITY + 5).map(|k| (k % 251) as u8).collect();
        write_whole(&path, |output| {
            content
                .chunks(1000)
                .try_for_each(|chunk| output.write_all(chunk))
        })
        .unwrap();
        assert_eq!(fs::read(&path).unwrap(), content);
        assert_eq!(names(&folder), ["a.bin"]);
    }

    #[test]
    fn a_failure_leaves_neither_the_file_nor_a_temporary_one() {
        let folder = tempdir().unwrap();
        let error = write_whole(&folder.path().join("a.bin"), half_then_full).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
        assert_eq!(names(&folder), [""; 0]);
    }

    #[test]
    fn a_failure_leaves_the_old_file_and_a_success_replaces_it() {
        let folder = tempdir().unwrap();
        let path = folder.path().join("a.bin");
        fs::write(&path, "old").unwrap();
        write_whole(&path, half_then_full).unwrap_err();
        assert_eq!(fs::read(&path).unwrap(), b"old");
        write_whole(&path, |output| output.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(names(&folder), ["a.bin"]);
    }

    #[test]
    fn nothing_is_written_while_the_content_is_being_made() {
        let folder = tempdir().unwrap();
        let path = folder.path().join("a.bin");
        fs::write(&path, "old").unwrap();
        write_whole(&path, |output| {
            output.write_all(&vec![1; 2 * CAPACITY])?;
            assert_eq!(fs::read(&path).unwrap(), b"old");
            Ok(())
        })
        .unwrap();
    }

    #[test]
    fn impossible_targets_are_refused_with_a_reason() {
        let folder = tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "old").unwrap();
        let mut permissions = fs::metadata(&file).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&file, permissions).unwrap();
        let missing = folder.path().join("missing");
        let expected: [(PathBuf, io::ErrorKind, String); 4] = [
            (
                folder.path().to_owned(),
                io::ErrorKind::IsADirectory,
                "it is a folder".to_owned(),
            ),
            (
                missing.join("a"),
                io::ErrorKind::NotFound,
                format!("the folder `{}` does not exist", missing.display()),
            ),
            (
                file.join("a"),
                io::ErrorKind::NotADirectory,
                format!("`{}` is not a folder", file.display()),
            ),
            (
                file,
                io::ErrorKind::PermissionDenied,
                "the file is write-protected".to_owned(),
            ),
        ];
        for (path, kind, message) in expected {
            let error = write_whole(&path, |output| output.write_all(b"new")).unwrap_err();
            assert_eq!((error.kind(), error.to_string()), (kind, message));
        }
        assert_eq!(names(&folder), ["file"]);
        assert_eq!(fs::read(folder.path().join("file")).unwrap(), b"old");
    }

    #[cfg(unix)]
    #[test]
    fn permissions_are_those_of_an_ordinary_file_and_those_of_an_old_one_stay() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempdir().unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o7777;
        let (ordinary, ours) = (folder.path().join("ordinary"), folder.path().join("ours"));
        fs::write(&ordinary, "").unwrap();
        write_whole(&ours, |_| Ok(())).unwrap();
        assert_eq!(mode(&ours), mode(&ordinary));
        fs::set_permissions(&ours, Permissions::from_mode(0o640)).unwrap();
        write_whole(&ours, |_| Ok(())).unwrap();
        assert_eq!(mode(&ours), 0o640);
    }

    #[cfg(unix)]
    #[test]
    fn a_symbolic_link_stays_and_special_files_are_not_replaced() {
        let folder = tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_whole(&link, |output| output.write_all(b"new")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&file).unwrap(), b"new");
        let error = write_whole(Path::new("/dev/null"), |_| Ok(())).unwrap_err();
        assert_eq!(error.to_string(), "it is not an ordinary file");
    }

    #[cfg(unix)]
    #[test]
    fn a_path_is_resolved_through_links_and_beyond_what_exists() {
        use std::os::unix::fs::symlink;
        let folder = tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        fs::create_dir_all(root.join("a/b")).unwrap();
        symlink("a/b", root.join("relative")).unwrap();
        symlink(root.join("none/x"), root.join("dangling")).unwrap();
        symlink("circle", root.join("circle")).unwrap();
        for (path, expected) in [
            ("a/./b/../c", "a/c"),
            // The kernel goes up from the folder that the link leads to.
            ("relative/../c", "a/c"),
            ("relative/new/file", "a/b/new/file"),
            ("dangling", "none/x"),
            ("no/such/../file", "no/file"),
        ] {
            let found = resolve(&root.join(path)).unwrap();
            assert_eq!(found, root.join(expected), "{path}");
        }
        assert!(resolve(&root.join("circle")).is_err());
        assert_eq!(resolve(Path::new("/../..")).unwrap(), Path::new("/"));
        let relative = resolve(Path::new("no/such/../../../file")).unwrap();
        assert_eq!(relative, Path::new("../file"));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_that_leads_nowhere_yet_stays_and_its_file_is_made() {
        let folder = tempdir().unwrap();
        let link = folder.path().join("link");
        std::os::unix::fs::symlink("file", &link).unwrap();
        write_whole(&link, |output| output.write_all(b"new")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(folder.path().join("file")).unwrap(), b"new");
    }
}
