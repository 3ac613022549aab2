//! How to polygonize: the methods, and what can be asked of all of them.

use glam::DVec3;

use super::PolygonizeError;
use crate::geometry::Bounds;

/// How a level set is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// R1: signs at the ends of equal cells (Hoff).
    Bracketing,
    /// R1: interval Newton isolation, which proves that no root is missed. Fields that are not
    /// compiled are left to `Bracketing`.
    Newton,
    /// R2: marching squares.
    Squares,
    /// R2: marching squares on an adaptive quadtree, pruned by enclosures.
    Quadtree,
    /// R3: marching cubes.
    Cubes,
    /// R3: marching cubes with vertices on sharp edges.
    Extended,
    /// R3: marching tetrahedra, in cells that are divided as [`Options::split`] says.
    Tetrahedra,
    /// R3: marching tetrahedra in an octree that is fine where the level set is curved.
    Octree,
    /// R2: curves followed by prediction and correction, from starts that enclosures find. R3:
    /// marching cubes in the cells that are reached from seeds along the level set.
    Continuation,
    /// R3: manifold dual contouring, which keeps sharp edges.
    Dual,
    /// R2 and R3: a triangulation that springs fit to the level set (Velho, Gomes, Terzopoulos).
    Springs,
    /// R3: the restricted Delaunay triangulation of samples.
    Delaunay,
    /// R2 and R3: a subdivision that proves the topology (after Plantinga and Vegter).
    Certified,
}

impl Method {
    /// All methods with their names and the dimensions they are for.
    pub const TABLE: &'static [(Method, &'static str, &'static [usize])] = &[
        (Method::Newton, "newton", &[1]),
        (Method::Bracketing, "bracketing", &[1]),
        (Method::Squares, "squares", &[2]),
        (Method::Quadtree, "quadtree", &[2]),
        (Method::Cubes, "cubes", &[3]),
        (Method::Extended, "extended", &[3]),
        (Method::Tetrahedra, "tetrahedra", &[3]),
        (Method::Octree, "octree", &[3]),
        (Method::Continuation, "continuation", &[2, 3]),
        (Method::Dual, "dual", &[3]),
        (Method::Springs, "springs", &[2, 3]),
        (Method::Delaunay, "delaunay", &[3]),
        (Method::Certified, "certified", &[2, 3]),
    ];

    /// The method that is taken in so many dimensions if none is asked for.
    pub fn usual(dimension: usize) -> Method {
        match dimension {
            1 => Method::Newton,
            2 => Method::Squares,
            _ => Method::Dual,
        }
    }

    /// The method of a name.
    pub fn named(name: &str) -> Option<Method> {
        let entry = Method::TABLE.iter().find(|(_, own, _)| *own == name)?;
        Some(entry.0)
    }

    /// Its name in scripts and files.
    pub fn name(self) -> &'static str {
        self.entry().map_or("", |(_, name, _)| *name)
    }

    /// The dimensions of the fields that it is for.
    pub fn dimensions(self) -> &'static [usize] {
        self.entry().map_or(&[], |(_, _, dimensions)| *dimensions)
    }

    /// The same in words, as in "R2 and R3".
    pub fn spaces(self) -> String {
        let spaces = self.dimensions().iter();
        let spaces: Vec<String> = spaces.map(|dimension| format!("R{dimension}")).collect();
        spaces.join(" and ")
    }

    /// The names of the methods for so many dimensions, in quotes and joined by commas.
    pub fn names_in(dimension: usize) -> String {
        let own = Method::TABLE.iter();
        let own = own.filter(|(_, _, dimensions)| dimensions.contains(&dimension));
        let names: Vec<String> = own.map(|(_, name, _)| format!("\"{name}\"")).collect();
        names.join(", ")
    }

    fn entry(self) -> Option<&'static (Method, &'static str, &'static [usize])> {
        Method::TABLE.iter().find(|(method, ..)| *method == self)
    }
}

/// What is done in a square with two opposite corners inside and the other two outside.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Ambiguity {
    /// The corners inside are joined if the bilinear interpolant is below the level at its saddle
    /// (the asymptotic decider of Nielson and Hamann, 1991).
    #[default]
    Saddle,
    /// They are joined.
    Join,
    /// They are separated.
    Separate,
    /// F itself decides: the square is subdivided until a path along the finer grid joins the
    /// corners inside, or those outside; at the last, the saddle does.
    Subdivide,
}

impl Ambiguity {
    /// All rules with their names.
    pub const NAMES: &'static [(Ambiguity, &'static str)] = &[
        (Ambiguity::Saddle, "saddle"),
        (Ambiguity::Join, "join"),
        (Ambiguity::Separate, "separate"),
        (Ambiguity::Subdivide, "subdivide"),
    ];
}

/// How cells are divided into tetrahedra.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Split {
    /// Into five, by turns in two ways: the fewest.
    Five,
    /// Into six around a diagonal, all cells alike (Freudenthal, Kuhn).
    #[default]
    Six,
    /// Into twelve: from the centre to the halves of the sides.
    Twelve,
    /// Into twenty-four: from the centre to the quarters of the sides around their centres.
    /// Symmetric in all axes.
    TwentyFour,
    /// Not the cells are divided, but their corners and centres are the body-centred cubic
    /// lattice, whose tetrahedra are alike and nearest to regular ones: twelve a cell.
    Centred,
}

impl Split {
    /// All splits with their names.
    pub const TABLE: &'static [(Split, &'static str)] = &[
        (Split::Five, "5"),
        (Split::Six, "6"),
        (Split::Twelve, "12"),
        (Split::TwentyFour, "24"),
        (Split::Centred, "bcc"),
    ];

    /// The split of a name.
    pub fn named(name: &str) -> Option<Split> {
        let entry = Split::TABLE.iter().find(|(_, own)| *own == name)?;
        Some(entry.0)
    }
}

/// How to polygonize.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The method; `None` for that which is usual for the dimension ([`Method::usual`]).
    pub method: Option<Method>,
    /// The box in which the level set is sought; of the field's dimension.
    pub bounds: Bounds,
    /// The greatest side length of a cell. Each axis is divided into equal cells, as few as
    /// that allows, so that cells fit the box exactly.
    pub cell: f64,
    /// Whether a level set that the box cuts is closed along the box, rather than left open.
    /// Means nothing in R1; usual in R3, where F < iso is a solid.
    pub cap: bool,
    /// The level: F = iso.
    pub iso: f64,
    /// The greatest |F − iso| / |F_x| at a vertex, relative to the diagonal of the box.
    pub tolerance: f64,
    /// Marching cubes: whether the roots nearest to the same grid point are merged into one vertex
    /// on the level set where that does not change the topology, which removes thin triangles.
    pub snap: bool,
    /// The greatest number of cells.
    pub cell_limit: usize,
    /// For `Squares`: what is done in ambiguous squares.
    pub ambiguity: Ambiguity,
    /// How "tetrahedra" divides cells.
    pub split: Split,
    /// How far, as a length, chords may be from the level set in cells that adaptive methods leave
    /// larger than they could. For "quadtree" `None` stands for a hundredth of `cell`. For "octree"
    /// it is about the field's linear interpolant, and `None` a 64th of `cell`: a curved surface is
    /// a radius of curvature R away from its chords by cell² / 8 R, so that cells as small as
    /// `cell` are reached where R is about 8 cells.
    pub error: Option<f64>,
    /// Where "continuation" begins in R3; with none, wherever the box is not proven to be empty.
    pub seeds: Vec<DVec3>,
    /// The points near the level set that "delaunay" makes vertices of; with none it makes floaters
    /// at distances of `cell`.
    pub samples: Vec<DVec3>,
}

impl Options {
    /// The usual options for a box: 64 cells along its longest side. Roots on a line cost so
    /// little that they are found to the last digits.
    pub fn new(bounds: Bounds) -> Self {
        let tolerance = if bounds.dimension == 1 { 1e-15 } else { 1e-9 };
        Options {
            method: None,
            bounds,
            cell: default_cell(&bounds),
            cap: bounds.dimension == 3,
            iso: 0.0,
            tolerance,
            snap: false,
            cell_limit: 1 << 30,
            ambiguity: Ambiguity::default(),
            split: Split::default(),
            error: None,
            seeds: Vec::new(),
            samples: Vec::new(),
        }
    }
}

impl Options {
    /// The distance that `error` stands for.
    pub(super) fn error(&self) -> f64 {
        self.error.unwrap_or(0.01 * self.cell)
    }
}

/// A 64th of the longest side.
pub fn default_cell(bounds: &Bounds) -> f64 {
    bounds.size().max_element() / 64.0
}

/// Whether the numbers among the options make sense.
pub(super) fn check_options(options: &Options) -> Result<(), PolygonizeError> {
    let demand = |well: bool, option, demand, value| {
        if well {
            Ok(())
        } else {
            Err(PolygonizeError::BadOption {
                option,
                demand,
                value,
            })
        }
    };
    let positive = |value: f64| value > 0.0 && value.is_finite();
    for (low, high) in options.bounds.sides() {
        let length = high - low;
        demand(
            low < high,
            "bounds",
            "have sides of positive length",
            length,
        )?;
    }
    // The square of a longer diagonal overflows, which also is the case for boxes so far from 0
    // that coordinates do.
    let diagonal = options.bounds.diagonal();
    let short = diagonal.is_finite();
    demand(
        short,
        "bounds",
        "have a diagonal shorter than 1e154",
        diagonal,
    )?;
    let size = "be positive and finite";
    demand(positive(options.cell), "cell", size, options.cell)?;
    let tolerance = options.tolerance;
    demand(positive(tolerance), "tolerance", size, tolerance)?;
    if let Some(error) = options.error {
        demand(positive(error), "error", size, error)?;
    }
    let longest = options.bounds.size().max_element();
    // A cell may exceed the box by what rounding makes of a side.
    if options.cell > longest * (1.0 + 1e-12) {
        let cell = options.cell;
        return Err(PolygonizeError::CellTooLarge { cell, longest });
    }
    let mut seeds = options.seeds.iter().copied();
    if let Some(seed) = seeds.find(|&seed| !options.bounds.contains(seed)) {
        return Err(PolygonizeError::SeedOutside { seed });
    }
    demand(options.iso.is_finite(), "iso", "be finite", options.iso)
}
