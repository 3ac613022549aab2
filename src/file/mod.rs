//! Files: one format a file, all written whole or not at all.
//!
//! The last step of the way: meshes, curves, samples and pictures leave the program here,
//! and fields and meshes that other programs made come in. The extension of the file name chooses the format from one table,
//! [`FORMATS`]; each format turns a value into bytes, or bytes into one, and knows nothing of
//! paths. Text formats print every number with the fewest digits that read back as the same f64.

mod format;
mod write;

mod csv;
mod dxf;
mod font;
mod glb;
mod obj;
mod off;
mod ply;
mod png;
mod stl;
mod svg;
mod threemf;
mod vm;
mod vtk;

mod assembly;
mod reading;
mod sample_columns;

#[cfg(test)]
mod test_values;

use std::fs::File;
use std::io::{self, BufReader, Read, Write};
use std::path::{Path, PathBuf};

use thiserror::Error;

use crate::geometry::{Animation, Curves, Image, Mesh, Samples, Solid};
use crate::graph::{Graph, NodeId};
pub use font::Outline;
pub use format::{FORMATS, Format};
use format::{Reader, Writer};
pub use reading::Place;
use reading::{ReadError, Wrong};
pub use vm::FieldRoot;
pub use write::{Abandoned, abandon, resolve};

/// Why a file was not written or not read.
#[derive(Debug, Error)]
pub enum FileError {
    /// The file system refused; nothing is left behind and an older file is untouched.
    #[error("cannot write `{}`: {source}", path.display())]
    CannotWrite {
        /// The file that was asked for.
        path: PathBuf,
        /// What the system said, or what is wrong with the path.
        source: io::Error,
    },
    /// The file system refused to give the content.
    #[error("cannot read `{}`: {source}", path.display())]
    CannotRead {
        /// The file that was asked for.
        path: PathBuf,
        /// What the system said, or what is wrong with the path.
        source: io::Error,
    },
    /// The content is not what the format says.
    #[error("`{}`, {place}: {message}", path.display())]
    BadContent {
        /// The file that was asked for.
        path: PathBuf,
        /// The line or byte that is wrong.
        place: Place,
        /// What is wrong there and what was expected.
        message: String,
    },
    /// The content has more lines than are allowed.
    #[error("`{}` has more than {limit} lines", path.display())]
    TooLong {
        /// The file that was asked for.
        path: PathBuf,
        /// The most lines that it may have.
        limit: u64,
    },
    /// The content has more bytes than are allowed.
    #[error("`{}` has more than {limit} bytes, the most that is read", path.display())]
    TooMuch {
        /// The file that was asked for.
        path: PathBuf,
        /// The most bytes that it may have.
        limit: u64,
    },
    /// The file would have more bytes than are allowed.
    #[error("`{}` would have more than {limit} bytes", path.display())]
    TooLarge {
        /// The file that was asked for.
        path: PathBuf,
        /// The most bytes that it may have.
        limit: u64,
    },
    /// The extension of the file name belongs to no format.
    #[error("{}; known are {known}", describe_extension(extension))]
    UnknownFormat {
        /// The extension without its dot; empty if there is none.
        extension: String,
        /// The extensions that are known.
        known: String,
    },
    /// The format cannot hold such a value.
    #[error("the format {format} cannot hold {value}; {suitable} can")]
    WrongFormat {
        /// The name of the format.
        format: &'static str,
        /// The kind of values that it was to hold.
        value: &'static str,
        /// The extensions of the formats that can.
        suitable: String,
    },
    /// The format cannot be read.
    #[error("the format {format} is only written; {suitable} can be read")]
    OnlyWritten {
        /// The name of the format.
        format: &'static str,
        /// The extensions of the formats that can be read.
        suitable: String,
    },
}

/// Whether a file could be written, as far as the disk tells before the work; `made` is a folder
/// that will be made for it. Leaves nothing behind.
pub fn check_writable(path: &Path, made: Option<&Path>) -> Result<(), FileError> {
    write::check_writable(path, made).map_err(|source| FileError::CannotWrite {
        path: path.to_owned(),
        source,
    })
}

/// A picture as the bytes of a PNG file.
pub fn png_bytes(image: &Image) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    png::write_image(&mut bytes, image)?;
    Ok(bytes)
}

/// Writes a text, such as a script, to a file as it is, whatever the extension: whole, or not at all.
pub fn write_text(path: &Path, text: &str) -> Result<(), FileError> {
    write::write_whole(path, |output| output.write_all(text.as_bytes())).map_err(|source| {
        FileError::CannotWrite {
            path: path.to_owned(),
            source,
        }
    })
}

/// Makes a folder and those above it, unless it is there.
pub fn create_folder(path: &Path) -> Result<(), FileError> {
    std::fs::create_dir_all(path).map_err(|source| FileError::CannotWrite {
        path: path.to_owned(),
        source: io::Error::new(
            source.kind(),
            format!("the folder cannot be made: {source}"),
        ),
    })
}

fn describe_extension(extension: &str) -> String {
    if extension.is_empty() {
        "the file name has no extension that tells the format".to_owned()
    } else {
        format!("no file format is called `.{extension}`")
    }
}

/// Writes a mesh in the format that the extension names.
///
/// The file appears whole, with at most `limit` bytes, and their number is given; or an error
/// says why not and nothing has changed on the disk.
pub fn write_mesh(path: &Path, mesh: &Mesh, limit: u64) -> Result<u64, FileError> {
    write_value(path, mesh, limit, "meshes", |format| format.mesh)
}

/// Writes a solid as tetrahedra or triangles in the format that the extension names.
///
/// The file appears whole, with at most `limit` bytes, and their number is given; or an error
/// says why not and nothing has changed on the disk.
pub fn write_solid(path: &Path, solid: &Solid, limit: u64) -> Result<u64, FileError> {
    write_value(path, solid, limit, "solids", |format| format.solid)
}

/// Writes curves in the format that the extension names.
///
/// The file appears whole, with at most `limit` bytes, and their number is given; or an error
/// says why not and nothing has changed on the disk.
pub fn write_curves(path: &Path, curves: &Curves, limit: u64) -> Result<u64, FileError> {
    if curves.dimension == 2 {
        write_value(path, curves, limit, "plane curves", |format| {
            format.plane_curves
        })
    } else {
        write_value(path, curves, limit, "curves in space", |format| {
            format.space_curves
        })
    }
}

/// Writes samples in the format that the extension names.
///
/// The file appears whole, with at most `limit` bytes, and their number is given; or an error
/// says why not and nothing has changed on the disk.
pub fn write_samples(path: &Path, samples: &Samples, limit: u64) -> Result<u64, FileError> {
    write_value(path, samples, limit, "samples", |format| format.samples)
}

/// Writes a picture in the format that the extension names.
///
/// The file appears whole, with at most `limit` bytes, and their number is given; or an error
/// says why not and nothing has changed on the disk.
pub fn write_image(path: &Path, image: &Image, limit: u64) -> Result<u64, FileError> {
    write_value(path, image, limit, "pictures", |format| format.image)
}

/// Writes an animation in the format that the extension names.
///
/// The file appears whole, with at most `limit` bytes, and their number is given; or an error
/// says why not and nothing has changed on the disk.
pub fn write_animation(path: &Path, animation: &Animation, limit: u64) -> Result<u64, FileError> {
    write_value(path, animation, limit, "animations", |format| {
        format.animation
    })
}

/// The largest font that is read, in bytes.
const LARGEST_FONT: u64 = 1 << 26;

/// The outlines of a text in the letters of a font file, as closed polygons of which inner ones are
/// holes; the first letter begins at the origin, and the font's em is `size` long.
pub fn read_outlines(path: &Path, text: &str, size: f64) -> Result<Vec<Outline>, FileError> {
    let failed = |source| FileError::CannotRead {
        path: path.to_owned(),
        source,
    };
    let wrong = |message: String| failed(io::Error::new(io::ErrorKind::InvalidData, message));
    check_regular(path).map_err(failed)?;
    let mut data = Vec::new();
    let file = File::open(path).map_err(failed)?;
    let mut start = file.take(LARGEST_FONT + 1);
    start.read_to_end(&mut data).map_err(failed)?;
    if data.len() as u64 > LARGEST_FONT {
        return Err(wrong(format!("it has more than {LARGEST_FONT} bytes")));
    }
    font::outlines(&data, text, size).map_err(wrong)
}

/// Whether a path leads to what has an end: pipes and devices could keep a script waiting for ever.
fn check_regular(path: &Path) -> io::Result<()> {
    let data = std::fs::metadata(path)?;
    let wrong = |kind, message: &str| Err(io::Error::new(kind, message));
    match data.is_dir() {
        true => wrong(io::ErrorKind::IsADirectory, "it is a folder"),
        false if data.is_file() => Ok(()),
        false => wrong(io::ErrorKind::InvalidInput, "it is not a regular file"),
    }
}

/// What a file holds.
#[derive(Debug)]
pub enum Loaded {
    /// A field, in nodes of the graph.
    Field(FieldRoot),
    /// A mesh.
    Mesh(Mesh),
}

/// How much of a file is read.
#[derive(Clone, Copy, Debug)]
pub struct Allowed {
    /// The most lines of a field.
    pub lines: u64,
    /// The most bytes of a mesh.
    pub bytes: u64,
}

/// Reads a file in the format that the extension names. A field is put into the graph over the
/// nodes that stand for x, y and z.
///
/// An error names the line or byte that is wrong. The graph may then hold nodes of the lines before.
pub fn load(
    path: &Path,
    graph: &mut Graph,
    coordinates: [NodeId; 3],
    allowed: Allowed,
) -> Result<Loaded, FileError> {
    let reader = Format::reader(path)?;
    let path = path.to_owned();
    let content = check_regular(&path).and_then(|()| File::open(&path));
    let file = match content {
        Ok(file) => file,
        Err(source) => return Err(FileError::CannotRead { path, source }),
    };
    let result = match reader {
        Reader::Field(read) => {
            let mut input = BufReader::new(file);
            read(&mut input, graph, coordinates, allowed.lines).map(Loaded::Field)
        }
        Reader::Mesh(read) => {
            read_content(file, allowed.bytes).and_then(|content| Ok(Loaded::Mesh(read(&content)?)))
        }
    };
    result.map_err(|error| match error {
        ReadError::Failed(source) => FileError::CannotRead { path, source },
        ReadError::Wrong(Wrong { place, message }) => FileError::BadContent {
            path,
            place,
            message,
        },
        ReadError::TooLong => FileError::TooLong {
            path,
            limit: allowed.lines,
        },
        ReadError::TooMuch => FileError::TooMuch {
            path,
            limit: allowed.bytes,
        },
    })
}

/// All bytes of a file, of which there are so many at most.
fn read_content(file: File, limit: u64) -> Result<Vec<u8>, ReadError> {
    let mut content = Vec::new();
    let mut input = file.take(limit.saturating_add(1));
    input.read_to_end(&mut content).map_err(ReadError::Failed)?;
    match content.len() as u64 > limit {
        true => Err(ReadError::TooMuch),
        false => Ok(content),
    }
}

/// Writes a value with the writer that the format has for values of its kind.
fn write_value<T>(
    path: &Path,
    value: &T,
    limit: u64,
    kind: &'static str,
    writer: impl Fn(&Format) -> Option<Writer<T>>,
) -> Result<u64, FileError> {
    let format = Format::of_path(path)?;
    let Some(write_content) = writer(format) else {
        return Err(format.cannot_hold(kind));
    };
    let mut written = 0;
    let result = write::write_whole(path, |output| {
        let mut counted = Counted {
            output,
            written: &mut written,
            limit,
        };
        write_content(&mut counted, value)
    });
    let path = path.to_owned();
    match result {
        Ok(()) => Ok(written),
        Err(_) if written > limit => Err(FileError::TooLarge { path, limit }),
        Err(source) => Err(FileError::CannotWrite { path, source }),
    }
}

/// Counts the bytes on their way, and lets no more through than the limit.
struct Counted<'a> {
    output: &'a mut dyn Write,
    written: &'a mut u64,
    limit: u64,
}

impl Write for Counted<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        *self.written = self.written.saturating_add(bytes.len() as u64);
        if *self.written > self.limit {
            return Err(io::ErrorKind::FileTooLarge.into());
        }
        self.output.write_all(bytes)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.output.flush()
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn every_format_writes_what_it_holds_and_refuses_the_rest() {
        let folder = tempfile::tempdir().unwrap();
        type Written = fn(&Path) -> Result<u64, FileError>;
        let values: [(&str, Written); 7] = [
            ("animations", |path| {
                write_animation(path, &test_values::animation(), u64::MAX)
            }),
            ("meshes", |path| {
                write_mesh(path, &test_values::single_precision_mesh(), u64::MAX)
            }),
            ("plane curves", |path| {
                write_curves(path, &test_values::plane_curves(), u64::MAX)
            }),
            ("curves in space", |path| {
                write_curves(path, &test_values::space_curves(), u64::MAX)
            }),
            ("samples", |path| {
                write_samples(path, &test_values::samples(), u64::MAX)
            }),
            ("solids", |path| {
                write_solid(path, &test_values::solid(), u64::MAX)
            }),
            ("pictures", |path| {
                write_image(path, &test_values::image(), u64::MAX)
            }),
        ];
        let mut written = Vec::new();
        for format in FORMATS {
            for (kind, write) in values {
                let path = folder
                    .path()
                    .join(kind)
                    .with_extension(format.extensions[0]);
                let result = write(&path);
                if let Ok(bytes) = result {
                    assert_eq!(bytes, fs::metadata(&path).unwrap().len());
                }
                assert_eq!(result.is_ok(), format.holds().contains(&kind));
                assert_eq!(path.exists(), result.is_ok());
                match result {
                    Ok(_) => written.push(format!("{} {kind}", format.name)),
                    Err(error) => assert!(matches!(error, FileError::WrongFormat { .. })),
                }
            }
        }
        let expected = "OBJ meshes, OBJ plane curves, OBJ curves in space, OBJ samples, \
                        STL meshes, PLY meshes, PLY samples, OFF meshes, GLB meshes, 3MF meshes, \
                        VTP meshes, VTP plane curves, VTP curves in space, VTP samples, VTU meshes, \
                        VTU solids, CSV plane curves, CSV curves in space, CSV samples, SVG plane curves, \
                        DXF plane curves, \
                        PNG animations, PNG pictures";
        assert_eq!(written.join(", "), expected);
    }

    #[test]
    fn capitals_in_the_extension_do_not_matter() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("Mesh.v2.StL");
        write_mesh(&path, &test_values::mesh(), u64::MAX).unwrap();
        let expected = test_values::bytes(stl::write_mesh, &test_values::mesh());
        assert_eq!(fs::read(path).unwrap(), expected);
    }

    #[test]
    fn what_is_too_large_is_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.stl");
        let mesh = test_values::mesh();
        let bytes = write_mesh(&path, &mesh, u64::MAX).unwrap();
        assert_eq!(write_mesh(&path, &mesh, bytes).unwrap(), bytes);
        let other = folder.path().join("b.stl");
        let error = write_mesh(&other, &mesh, bytes - 1).unwrap_err();
        assert!(matches!(error, FileError::TooLarge { .. }), "{error}");
        assert!(!other.exists());
    }

    #[test]
    fn messages_name_what_is_wrong_and_what_would_do() {
        let message = |result: Result<u64, FileError>| result.unwrap_err().to_string();
        let mesh = test_values::mesh();
        let known = "known are .obj, .stl, .ply, .off, .glb, .3mf, .vtp, .vtu, .csv, .svg, .dxf, \
                     .png, .vm";
        assert_eq!(
            message(write_mesh(Path::new("a.xyz"), &mesh, u64::MAX)),
            format!("no file format is called `.xyz`; {known}")
        );
        for without in ["a", "", ".obj", "a.", "folder.obj/a"] {
            assert_eq!(
                message(write_mesh(Path::new(without), &mesh, u64::MAX)),
                format!("the file name has no extension that tells the format; {known}")
            );
        }
        assert_eq!(
            message(write_mesh(Path::new("a.csv"), &mesh, u64::MAX)),
            "the format CSV cannot hold meshes; .obj, .stl, .ply, .off, .glb, .3mf, .vtp, .vtu can"
        );
        assert_eq!(
            message(write_curves(
                Path::new("a.svg"),
                &test_values::space_curves(),
                u64::MAX
            )),
            "the format SVG cannot hold curves in space; .obj, .vtp, .csv can"
        );
        assert_eq!(
            message(write_mesh(
                Path::new("no/such/folder/a.obj"),
                &mesh,
                u64::MAX
            )),
            "cannot write `no/such/folder/a.obj`: the folder `no/such/folder` does not exist"
        );
    }

    fn read(path: &Path, bytes: u64) -> Result<Loaded, FileError> {
        let mut graph = Graph::new();
        let coordinates = [0, 1, 2].map(|axis| graph.coordinate(axis));
        load(path, &mut graph, coordinates, Allowed { lines: 9, bytes })
    }

    #[test]
    fn files_are_loaded_by_their_extension_and_within_limits() {
        let folder = tempfile::tempdir().unwrap();
        let place = |name: &str| folder.path().join(name);
        let mesh = test_values::mesh();
        let bytes = write_mesh(&place("a.PLY"), &mesh, u64::MAX).unwrap();
        let loaded = read(&place("a.PLY"), bytes).unwrap();
        assert!(matches!(loaded, Loaded::Mesh(found) if found == mesh));
        let error = read(&place("a.PLY"), bytes - 1).unwrap_err().to_string();
        assert!(error.ends_with(&format!(
            "more than {} bytes, the most that is read",
            bytes - 1
        )));
        fs::write(place("a.vm"), "a var-x\n").unwrap();
        assert!(matches!(read(&place("a.vm"), 0), Ok(Loaded::Field(_))));
        fs::write(place("a.obj"), "v 0 0 0\nf 1 2 3\n").unwrap();
        let error = read(&place("a.obj"), 99).unwrap_err().to_string();
        assert!(
            error.contains("a.obj`, line 2: the vertex 2, of 1 so far"),
            "{error}"
        );
        fs::write(place("a.stl"), [0; 90]).unwrap();
        let error = read(&place("a.stl"), 99).unwrap_err().to_string();
        assert!(
            error.contains("a.stl`, byte 80: a binary STL file"),
            "{error}"
        );
        let known = ".obj, .stl, .ply, .off, .vm";
        assert_eq!(
            read(&place("a.png"), 99).unwrap_err().to_string(),
            format!("the format PNG is only written; {known} can be read")
        );
        assert_eq!(
            read(&place("a.xyz"), 99).unwrap_err().to_string(),
            format!("no file format is called `.xyz`; known are {known}")
        );
    }

    /// Numbers by Marsaglia's xorshift, with the shifts 13, 7 and 17.
    struct Dice(u64);

    impl Dice {
        fn below(&mut self, end: usize) -> usize {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 % end as u64) as usize
        }
    }

    /// Files that were cut off, changed or overwritten in places give a sound mesh or an error.
    #[test]
    fn no_damage_to_a_file_makes_a_reader_panic() {
        let mesh = test_values::single_precision_mesh();
        let text_of = |bytes: &str| bytes.as_bytes().to_vec();
        let ascii = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                     property float z\nelement face 1\nproperty list uchar int vertex_index\n\
                     end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
        let solid = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
                     vertex 0 1 0\nendloop\nendfacet\nendsolid a\n";
        let little = test_values::bytes(ply::write_mesh, &mesh);
        let big = [
            &b"ply\nformat binary_big_endian 1.0\nelement face 2\nproperty list int uint vertex_index\n\
               element vertex 3\nproperty char x\nproperty char y\nproperty char z\nend_header\n"[..],
            &[0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 2],
            &[0, 0, 0, 3, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 0],
            &[0, 0, 0, 1, 0, 0, 0, 1, 0],
        ]
        .concat();
        type Read = fn(&[u8]) -> Result<Mesh, Wrong>;
        let files: [(Read, Vec<u8>); 7] = [
            (ply::read_mesh, text_of(ascii)),
            (ply::read_mesh, little),
            (ply::read_mesh, big),
            (stl::read_mesh, text_of(solid)),
            (stl::read_mesh, test_values::bytes(stl::write_mesh, &mesh)),
            (obj::read_mesh, test_values::bytes(obj::write_mesh, &mesh)),
            (off::read_mesh, test_values::bytes(off::write_mesh, &mesh)),
        ];
        let spice: &[u8] = b"0123456789 \n\r-+.eE/#\\\0\xff\x7f\x80nifOFFNCvpl";
        let mut dice = Dice(1994);
        let (mut good, mut bad) = (0, 0);
        for (read, content) in &files {
            let mut judge = |content: &[u8]| match read(content) {
                Ok(mesh) => {
                    let vertices = mesh.positions.len();
                    let corners = mesh.triangles.as_flattened();
                    assert!(corners.iter().all(|&corner| (corner as usize) < vertices));
                    assert!(mesh.positions.iter().all(|position| position.is_finite()));
                    assert!(mesh.normals.is_empty() || mesh.normals.len() == vertices);
                    good += 1;
                }
                Err(wrong) => {
                    assert!(!wrong.message.is_empty());
                    bad += 1;
                }
            };
            judge(content);
            (0..content.len()).for_each(|end| judge(&content[..end]));
            for _ in 0..2000 {
                let mut content = content.clone();
                for _ in 0..1 + dice.below(4) {
                    let at = dice.below(content.len());
                    match dice.below(4) {
                        0 => content[at] ^= 1 << dice.below(8),
                        1 => content[at] = spice[dice.below(spice.len())],
                        2 => content.insert(at, spice[dice.below(spice.len())]),
                        _ => drop(content.remove(at)),
                    }
                }
                judge(&content);
            }
        }
        assert!(good > 1000 && bad > 1000, "{good} were read, {bad} refused");
    }
}
