//! DXF (AutoCAD 2000, AC1015): plane curves as light-weight polylines on layer 0, for computer-aided
//! design, laser cutters and mills. The drawing has no unit.
//!
//! A DXF file is a list of pairs of lines, a group code and a value. Polylines with a closed flag came
//! with AutoCAD 14, and since then a drawing has to have tables, blocks and a dictionary, with a handle
//! (a number in hexadecimal) for each thing. Those here are the least that is complete.

use std::io::{self, Write};

use glam::DVec3;

use crate::geometry::{Bounds, Curves, Polyline};

/// Handles. Those of entities follow on [`FIRST_ENTITY`].
const MODEL_SPACE: u64 = 0x1F;
const PAPER_SPACE: u64 = 0x1B;
const FIRST_ENTITY: u64 = 0x100;

/// The tables that have to be there, with their handles and entries: group codes with values.
const TABLES: &[(&str, u64, &[Entry])] = &[
    ("VPORT", 0x8, &[]),
    (
        "LTYPE",
        0x5,
        &[
            ("AcDbLinetypeTableRecord", 0x14, "ByBlock", LINE_TYPE),
            ("AcDbLinetypeTableRecord", 0x15, "ByLayer", LINE_TYPE),
            ("AcDbLinetypeTableRecord", 0x16, "Continuous", LINE_TYPE),
        ],
    ),
    (
        "LAYER",
        0x2,
        &[(
            "AcDbLayerTableRecord",
            0x10,
            "0",
            &[(70, "0"), (62, "7"), (6, "Continuous")],
        )],
    ),
    (
        "STYLE",
        0x3,
        &[(
            "AcDbTextStyleTableRecord",
            0x11,
            "Standard",
            &[
                (70, "0"),
                (40, "0.0"),
                (41, "1.0"),
                (50, "0.0"),
                (71, "0"),
                (42, "1.0"),
                (3, "txt"),
                (4, ""),
            ],
        )],
    ),
    ("VIEW", 0x6, &[]),
    ("UCS", 0x7, &[]),
    (
        "APPID",
        0x9,
        &[("AcDbRegAppTableRecord", 0x12, "ACAD", &[(70, "0")])],
    ),
    (
        "DIMSTYLE",
        0xA,
        &[("AcDbDimStyleTableRecord", 0x27, "Standard", &[(70, "0")])],
    ),
    (
        "BLOCK_RECORD",
        0x1,
        &[
            ("AcDbBlockTableRecord", MODEL_SPACE, "*Model_Space", &[]),
            ("AcDbBlockTableRecord", PAPER_SPACE, "*Paper_Space", &[]),
        ],
    ),
];

/// An entry of a table: its subclass, handle, name and further groups.
type Entry = (
    &'static str,
    u64,
    &'static str,
    &'static [(i32, &'static str)],
);

/// A line without dashes.
const LINE_TYPE: &[(i32, &str)] = &[(70, "0"), (3, ""), (72, "65"), (73, "0"), (40, "0.0")];

/// One polyline for each curve, closed if the curve is; a curve of one point is a point.
///
/// An error if a coordinate is not finite.
pub(super) fn write_curves(output: &mut dyn Write, curves: &Curves) -> io::Result<()> {
    let points = curves
        .polylines
        .iter()
        .flat_map(|polyline| &polyline.points);
    if !points.clone().all(|point| point.is_finite()) {
        let message = "a point of a curve is not finite";
        return Err(io::Error::new(io::ErrorKind::InvalidData, message));
    }
    let drawn = || {
        curves
            .polylines
            .iter()
            .filter(|polyline| !polyline.points.is_empty())
    };
    let next_handle = FIRST_ENTITY + drawn().count() as u64;
    let mut drawing = Drawing { output };
    drawing.header(next_handle, curves.bounds())?;
    drawing.section("CLASSES")?;
    drawing.end_section()?;
    drawing.tables()?;
    drawing.blocks()?;
    drawing.section("ENTITIES")?;
    for (polyline, handle) in drawn().zip(FIRST_ENTITY..) {
        drawing.entity(polyline, handle)?;
    }
    drawing.end_section()?;
    drawing.objects()?;
    drawing.text(0, "EOF")
}

/// A drawing as far as it is written.
struct Drawing<'a> {
    output: &'a mut dyn Write,
}

impl Drawing<'_> {
    fn text(&mut self, code: i32, value: &str) -> io::Result<()> {
        writeln!(self.output, "{code:>3}\n{value}")
    }

    fn handle(&mut self, code: i32, handle: u64) -> io::Result<()> {
        self.text(code, &format!("{handle:X}"))
    }

    /// With the fewest digits that read back as the same number.
    fn number(&mut self, code: i32, number: f64) -> io::Result<()> {
        self.text(code, &format!("{number:?}"))
    }

    fn section(&mut self, name: &str) -> io::Result<()> {
        self.text(0, "SECTION")?;
        self.text(2, name)
    }

    fn end_section(&mut self) -> io::Result<()> {
        self.text(0, "ENDSEC")
    }

    fn header(&mut self, next_handle: u64, bounds: Option<Bounds>) -> io::Result<()> {
        self.section("HEADER")?;
        self.text(9, "$ACADVER")?;
        self.text(1, "AC1015")?;
        self.text(9, "$HANDSEED")?;
        self.handle(5, next_handle)?;
        self.text(9, "$INSUNITS")?;
        self.text(70, "0")?;
        if let Some(bounds) = bounds {
            for (name, corner) in [("$EXTMIN", bounds.min), ("$EXTMAX", bounds.max)] {
                self.text(9, name)?;
                self.point(corner)?;
                self.number(30, 0.0)?;
            }
        }
        self.end_section()
    }

    fn point(&mut self, point: DVec3) -> io::Result<()> {
        self.number(10, point.x)?;
        self.number(20, point.y)
    }

    fn tables(&mut self) -> io::Result<()> {
        self.section("TABLES")?;
        for (name, handle, entries) in TABLES {
            self.text(0, "TABLE")?;
            self.text(2, name)?;
            self.handle(5, *handle)?;
            self.handle(330, 0)?;
            self.text(100, "AcDbSymbolTable")?;
            self.text(70, &entries.len().to_string())?;
            if *name == "DIMSTYLE" {
                self.text(100, "AcDbDimStyleTable")?;
            }
            for (subclass, entry, entry_name, groups) in *entries {
                self.text(0, name)?;
                // Handles of dimension styles have a code of their own.
                self.handle(if *name == "DIMSTYLE" { 105 } else { 5 }, *entry)?;
                self.handle(330, *handle)?;
                self.text(100, "AcDbSymbolTableRecord")?;
                self.text(100, subclass)?;
                self.text(2, entry_name)?;
                for (code, value) in *groups {
                    self.text(*code, value)?;
                }
            }
            self.text(0, "ENDTAB")?;
        }
        self.end_section()
    }

    fn blocks(&mut self) -> io::Result<()> {
        self.section("BLOCKS")?;
        let blocks = [
            ("*Model_Space", MODEL_SPACE, 0x20, 0x21),
            ("*Paper_Space", PAPER_SPACE, 0x1C, 0x1D),
        ];
        for (name, record, begin, end) in blocks {
            self.text(0, "BLOCK")?;
            self.in_layer(begin, record)?;
            self.text(100, "AcDbBlockBegin")?;
            self.text(2, name)?;
            self.text(70, "0")?;
            self.point(DVec3::ZERO)?;
            self.number(30, 0.0)?;
            self.text(3, name)?;
            self.text(1, "")?;
            self.text(0, "ENDBLK")?;
            self.in_layer(end, record)?;
            self.text(100, "AcDbBlockEnd")?;
        }
        self.end_section()
    }

    /// What every thing on layer 0 has.
    fn in_layer(&mut self, handle: u64, owner: u64) -> io::Result<()> {
        self.handle(5, handle)?;
        self.handle(330, owner)?;
        self.text(100, "AcDbEntity")?;
        self.text(8, "0")
    }

    fn entity(&mut self, polyline: &Polyline, handle: u64) -> io::Result<()> {
        if let [point] = polyline.points.as_slice() {
            self.text(0, "POINT")?;
            self.in_layer(handle, MODEL_SPACE)?;
            self.text(100, "AcDbPoint")?;
            self.point(*point)?;
            return self.number(30, 0.0);
        }
        self.text(0, "LWPOLYLINE")?;
        self.in_layer(handle, MODEL_SPACE)?;
        self.text(100, "AcDbPolyline")?;
        self.text(90, &polyline.points.len().to_string())?;
        self.text(70, if polyline.closed { "1" } else { "0" })?;
        polyline
            .points
            .iter()
            .try_for_each(|&point| self.point(point))
    }

    /// The root dictionary, with that of groups.
    fn objects(&mut self) -> io::Result<()> {
        self.section("OBJECTS")?;
        self.text(0, "DICTIONARY")?;
        self.handle(5, 0xC)?;
        self.handle(330, 0)?;
        self.text(100, "AcDbDictionary")?;
        self.text(281, "1")?;
        self.text(3, "ACAD_GROUP")?;
        self.handle(350, 0xD)?;
        self.text(0, "DICTIONARY")?;
        self.handle(5, 0xD)?;
        self.handle(330, 0xC)?;
        self.text(100, "AcDbDictionary")?;
        self.text(281, "1")?;
        self.end_section()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::super::test_values::{plane_curves, text};
    use super::*;

    /// The pairs of group codes and values.
    fn pairs(text: &str) -> Vec<(i32, &str)> {
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len() % 2, 0);
        lines
            .chunks(2)
            .map(|pair| (pair[0].trim().parse().unwrap(), pair[1]))
            .collect()
    }

    /// The pairs of each thing in a section.
    fn things<'a>(pairs: &[(i32, &'a str)], section: &str) -> Vec<Vec<(i32, &'a str)>> {
        let start = pairs.iter().position(|pair| *pair == (2, section)).unwrap() + 1;
        let length = pairs[start..]
            .iter()
            .position(|pair| *pair == (0, "ENDSEC"))
            .unwrap();
        let mut things: Vec<Vec<(i32, &str)>> = Vec::new();
        for &(code, value) in &pairs[start..start + length] {
            match code {
                0 => things.push(vec![(code, value)]),
                _ => things.last_mut().unwrap().push((code, value)),
            }
        }
        things
    }

    fn values<'a>(thing: &[(i32, &'a str)], code: i32) -> Vec<&'a str> {
        let own = thing.iter().filter(|(own, _)| *own == code);
        own.map(|(_, value)| *value).collect()
    }

    fn numbers(thing: &[(i32, &str)], code: i32) -> Vec<f64> {
        values(thing, code)
            .iter()
            .map(|word| word.parse().unwrap())
            .collect()
    }

    #[test]
    fn curves_read_back_exactly() {
        let curves = plane_curves();
        let text = text(write_curves, &curves);
        let pairs = pairs(&text);
        let entities = things(&pairs, "ENTITIES");
        let drawn = curves
            .polylines
            .iter()
            .filter(|polyline| !polyline.points.is_empty());
        assert_eq!(entities.len(), drawn.clone().count());
        for (entity, polyline) in entities.iter().zip(drawn) {
            let points = numbers(entity, 10).into_iter().zip(numbers(entity, 20));
            let points: Vec<DVec3> = points.map(|(x, y)| DVec3::new(x, y, 0.0)).collect();
            assert_eq!(points, polyline.points);
            if polyline.points.len() == 1 {
                assert_eq!(entity[0], (0, "POINT"));
                continue;
            }
            assert_eq!(entity[0], (0, "LWPOLYLINE"));
            assert_eq!(values(entity, 90), [polyline.points.len().to_string()]);
            assert_eq!(
                values(entity, 70),
                [if polyline.closed { "1" } else { "0" }]
            );
        }
    }

    #[test]
    fn handles_are_unique_and_lead_to_their_owners() {
        let text = text(write_curves, &plane_curves());
        let pairs = pairs(&text);
        assert_eq!(pairs.last(), Some(&(0, "EOF")));
        let handle = |word: &str| u64::from_str_radix(word, 16).unwrap();
        let seed = pairs
            .iter()
            .position(|pair| *pair == (9, "$HANDSEED"))
            .unwrap()
            + 1;
        let own = pairs
            .iter()
            .enumerate()
            .filter(|(index, (code, _))| *index != seed && (*code == 5 || *code == 105));
        let handles: Vec<u64> = own.map(|(_, (_, word))| handle(word)).collect();
        let known: BTreeSet<u64> = handles.iter().copied().chain([0]).collect();
        assert_eq!(known.len(), handles.len() + 1);
        assert_eq!(
            known.last().map(|last| last + 1),
            Some(handle(pairs[seed].1))
        );
        for (_, owner) in pairs
            .iter()
            .filter(|(code, _)| *code == 330 || *code == 350)
        {
            assert!(known.contains(&handle(owner)), "{owner}");
        }
    }

    #[test]
    fn no_curves_give_an_empty_drawing_and_infinite_points_an_error() {
        let mut curves = Curves {
            dimension: 2,
            polylines: Vec::new(),
        };
        let text = text(write_curves, &curves);
        assert!(things(&pairs(&text), "ENTITIES").is_empty());
        assert!(!text.contains("$EXTMIN"));
        curves.polylines.push(Polyline {
            points: vec![DVec3::ZERO, DVec3::INFINITY],
            closed: false,
        });
        let error = write_curves(&mut Vec::new(), &curves).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::InvalidData);
    }
}
