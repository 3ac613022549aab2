//! OFF, the object file format of Geomview: text with vertices, then polygons of their numbers
//! from 0. What is written reads back exactly.

use std::io::{self, Write};

use super::assembly::Assembly;
use super::reading::{Lines, Wrong, counted, number, quoted_bytes, vector, whole};
use crate::geometry::Mesh;

/// `OFF`, the numbers of vertices, faces and edges (0: nobody counts them), then vertices and
/// triangles. Normals are left out, since many programs do not know the header `NOFF`.
pub(super) fn write_mesh(output: &mut dyn Write, mesh: &Mesh) -> io::Result<()> {
    writeln!(output, "OFF")?;
    writeln!(
        output,
        "{} {} 0",
        mesh.positions.len(),
        mesh.triangles.len()
    )?;
    for position in &mesh.positions {
        writeln!(output, "{:?} {:?} {:?}", position.x, position.y, position.z)?;
    }
    for [a, b, c] in &mesh.triangles {
        writeln!(output, "3 {a} {b} {c}")?;
    }
    Ok(())
}

/// The mesh of a text that begins with `OFF`, with `C`, `N` and `ST` before it where vertices have
/// colours, normals and texture coordinates; or with the three numbers at once. Colours and texture
/// coordinates are left aside. Costs time and memory in proportion to the content.
pub(super) fn read_mesh(content: &[u8]) -> Result<Mesh, Wrong> {
    let mut lines = Lines::new(content);
    let mut words = Vec::new();
    lines.next_words(&mut words, true);
    let with_normals = read_keyword(&mut words).map_err(|message| lines.wrong(message))?;
    if words.is_empty() {
        lines.next_words(&mut words, true);
    }
    let [vertices, faces] = counts(&words).map_err(|message| lines.wrong(message))?;
    // A vertex takes six bytes at least and a face two, with what separates them.
    let least = vertices
        .saturating_mul(6)
        .saturating_add(faces.saturating_mul(2));
    let there = lines.rest().len() as u64 + 1;
    if least > there {
        return Err(lines.wrong(format!(
            "{vertices} vertices and {faces} faces take at least {least} bytes, but after this \
             line there are {}",
            there - 1
        )));
    }
    let mut mesh = Assembly::default();
    for _ in 0..vertices {
        require(&mut lines, &mut words, vertices, "vertices")?;
        read_vertex(&words, with_normals, &mut mesh).map_err(|message| lines.wrong(message))?;
    }
    let mut corners = Vec::new();
    for _ in 0..faces {
        require(&mut lines, &mut words, faces, "faces")?;
        read_face(&words, &mut corners)
            .and_then(|()| mesh.polygon(&corners, mesh.vertices()))
            .map_err(|message| lines.wrong(message))?;
    }
    if lines.next_words(&mut words, true) {
        let message = "more after the last face; expected the end of the file";
        return Err(lines.wrong(message));
    }
    mesh.finish().map_err(|message| lines.wrong(message))
}

/// Takes the keyword from the words, if there is one; tells whether vertices have normals.
fn read_keyword(words: &mut Vec<&[u8]>) -> Result<bool, String> {
    let Some(&first) = words.first() else {
        return Err("the file is empty; expected `OFF`".into());
    };
    if first[0].is_ascii_digit() {
        return Ok(false);
    }
    let unknown = || format!("{}; expected `OFF`", quoted_bytes(first));
    let rest = first.strip_prefix(b"ST").unwrap_or(first);
    let rest = rest.strip_prefix(b"C").unwrap_or(rest);
    let (with_normals, rest) = match rest.strip_prefix(b"N") {
        Some(rest) => (true, rest),
        None => (false, rest),
    };
    let rest = rest.strip_prefix(b"OFF").ok_or_else(unknown)?;
    if words.get(1).is_some_and(|word| *word == b"BINARY") {
        return Err("binary OFF, which is not read; expected a text".into());
    }
    // Collections exist whose files lack the line break after the keyword.
    match rest.first() {
        None => drop(words.remove(0)),
        Some(byte) if byte.is_ascii_digit() => words[0] = rest,
        Some(_) => return Err(unknown()),
    }
    Ok(with_normals)
}

/// The numbers of vertices and faces; that of edges may be missing.
fn counts(words: &[&[u8]]) -> Result<[u64; 2], String> {
    match words {
        [vertices, faces] | [vertices, faces, _] => Ok([whole(vertices)?, whole(faces)?]),
        _ => Err(format!(
            "{}; expected the numbers of vertices, faces and edges",
            counted(words.len(), "word")
        )),
    }
}

/// Goes to the next line, of which there have to be so many.
fn require<'a>(
    lines: &mut Lines<'a>,
    words: &mut Vec<&'a [u8]>,
    count: u64,
    what: &str,
) -> Result<(), Wrong> {
    match lines.next_words(words, true) {
        true => Ok(()),
        false => Err(lines.wrong(format!("the file ends; expected {count} lines of {what}"))),
    }
}

/// A position, a normal if there are normals, and further numbers.
fn read_vertex(words: &[&[u8]], with_normals: bool, mesh: &mut Assembly) -> Result<(), String> {
    mesh.vertex(vector(words)?)?;
    let rest = &words[3..];
    let rest = match with_normals {
        true => {
            mesh.normal(vector(rest)?)?;
            &rest[3..]
        }
        false => rest,
    };
    rest.iter().try_for_each(|word| number(word).map(drop))
}

/// The number of corners, the corners, and perhaps a colour.
fn read_face(words: &[&[u8]], corners: &mut Vec<u32>) -> Result<(), String> {
    corners.clear();
    let [count, rest @ ..] = words else {
        return Ok(());
    };
    let count: usize = whole(count)?;
    if count > rest.len() {
        let found = counted(rest.len(), "number");
        return Err(format!(
            "{found} after the number of corners; expected at least {count}"
        ));
    }
    for corner in &rest[..count] {
        corners.push(whole(corner)?);
    }
    rest[count..]
        .iter()
        .try_for_each(|word| number(word).map(drop))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::reading::Place;
    use super::super::test_values::{bytes, mesh_without_normals, text};
    use super::*;

    #[track_caller]
    fn refuses(content: &str, line: u64, words: &str) {
        let wrong = read_mesh(content.as_bytes()).unwrap_err();
        assert_eq!(wrong.place, Place::Line(line), "{}", wrong.message);
        assert!(wrong.message.contains(words), "{}", wrong.message);
    }

    #[test]
    fn what_is_written_reads_back_exactly() {
        let mesh = mesh_without_normals();
        assert_eq!(read_mesh(&bytes(write_mesh, &mesh)).unwrap(), mesh);
        let text = text(write_mesh, &mesh);
        assert!(text.starts_with("OFF\n5 3 0\n0.1 ") && text.ends_with("\n3 3 4 0\n"));
        assert_eq!(text.lines().count(), 2 + 5 + 3);
    }

    #[test]
    fn keywords_comments_and_colours_are_understood() {
        let corners = "0 0 0 _\n1 0 0 _ # b\n\n1 1 0 _\n0 1 0 _\n# c\n4 0 1 2 3 255 0 0\n";
        for (head, vertex) in [
            ("OFF\n4 1 4\n", ""),
            ("# a\nOFF # a\n\n4 1\n", ""),
            ("OFF 4 1 4\n", ""),
            ("OFF4 1 4\n", ""),
            ("4 1 4\n", ""),
            ("COFF\n4 1 4\n", "255 0 0 255"),
            ("NOFF\n4 1 4\n", "0 0 2"),
            ("STCNOFF\n4 1 4\n", "0 0 2 1 0 0 1 0.5 0.5"),
        ] {
            let text = format!("{head}{}", corners.replace('_', vertex));
            let mesh = read_mesh(text.as_bytes()).unwrap();
            assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
            assert_eq!(mesh.positions[2], DVec3::new(1.0, 1.0, 0.0));
            let normals = if head.contains('N') {
                vec![DVec3::Z; 4]
            } else {
                Vec::new()
            };
            assert_eq!(mesh.normals, normals);
        }
    }

    #[test]
    fn wrong_lines_are_named() {
        let points = "0 0 0\n1 0 0\n0 1 0\n";
        refuses("", 1, "the file is empty; expected `OFF`");
        refuses("PLY\n", 1, "`PLY`; expected `OFF`");
        refuses("4OFF\n", 1, "1 word; expected the numbers");
        refuses("OFFx\n", 1, "`OFFx`; expected `OFF`");
        refuses("OFF BINARY\n", 1, "binary OFF, which is not read");
        refuses("OFF\n", 1, "0 words; expected the numbers");
        refuses("OFF\n3 -1 0\n", 2, "`-1` is not an index");
        refuses(
            "OFF\n4000000000 0 0\n",
            2,
            "take at least 24000000000 bytes",
        );
        let most = u64::MAX;
        refuses(
            &format!("OFF\n{most} {most} 0\n"),
            2,
            "after this line there are 0",
        );
        refuses(
            &format!("OFF\n3 1 0\n{points}3 0 1 3\n"),
            6,
            "at vertex 3, counted from 0",
        );
        refuses(
            &format!("OFF\n3 1 0\n{points}3 0 1\n"),
            6,
            "2 numbers after the number",
        );
        refuses(
            &format!("OFF\n3 1 0\n{points}3 0 1 -2\n"),
            6,
            "`-2` is not an index",
        );
        refuses(&format!("OFF\n3 1 0\n{points}2 0 1 2\n"), 6, "of 2 corners");
        refuses(
            &format!("OFF\n3 1 0\n{points}3 0 1 2 x\n"),
            6,
            "`x` is not a number",
        );
        refuses(
            &format!("OFF\n3 1 0\n{points}3 0 1 2\n0\n"),
            7,
            "more after the last face",
        );
        refuses(
            &format!("OFF\n3 1 0\n{points}# 3 0 1 2\n"),
            6,
            "expected 1 lines of faces",
        );
        refuses(
            &format!("OFF\n3 0 0\n{points}"),
            5,
            "3 points and no polygon",
        );
        refuses(
            &format!("OFF\n3 1 0\n0 0 nan\n{points}"),
            3,
            "`nan` is not finite",
        );
        refuses("NOFF\n1 0 0\n0 0 0 1 2\n", 3, "2 numbers; expected three");
    }
}
