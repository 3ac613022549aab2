//! What can be written on the command line. What is not understood here is wrong usage; what can
//! only be judged with the file at hand is an error of the language.

use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum, value_parser};

use crate::engine::Tier;
use crate::language::Limits;
use crate::picture::View;

/// Imp: a language for implicit geometry.
#[derive(Parser, Debug)]
#[command(
    name = "imp",
    version,
    about = "Imp: a small language for implicit geometry",
    after_help = "Examples:\n  imp run examples/blobs.imp --out build\n  imp eval examples/torus.imp \"grad(torus)(1.3, 0, 0.1)\"\n  imp mesh examples/heart.imp -o heart.stl --cell 0.02\n\n`imp FILE` is short for `imp run FILE`; `-` is standard input.\nExit codes: 0 well, 1 the script is wrong or an assertion or test failed, 2 usage, 3 input or output, 4 no surface."
)]
pub(super) struct Arguments {
    #[command(subcommand)]
    pub(super) command: Command,
}

#[derive(Subcommand, Debug)]
pub(super) enum Command {
    /// Runs a file's script
    #[command(after_help = "Example:\n  imp run examples/blobs.imp --set b=0.4 --out build")]
    Run(Run),
    /// Runs a file's script, and again whenever one of its files is saved
    #[command(after_help = "Example:\n  imp watch examples/blobs.imp --out build")]
    Watch(Run),
    /// Checks files without running their statements
    #[command(after_help = "Example:\n  imp check examples/blobs.imp examples/torus.imp")]
    Check(Check),
    /// Runs the `test` blocks of files
    #[command(
        after_help = "Examples:\n  imp test examples/*.imp\n  imp test parts.imp --filter thread --json\n\nOf the rest of a file only what its tests need is run; what it prints and writes is left out."
    )]
    Test(Test),
    /// Formats files in place, all in one style
    #[command(
        after_help = "Examples:\n  imp fmt scene.imp\n  imp fmt examples --check\n  imp fmt - --diff < scene.imp\n\nThe meaning and the comments stay. `-` is standard input, formatted to standard output."
    )]
    Fmt(Fmt),
    /// Prints the values of expressions
    #[command(
        after_help = "Examples:\n  imp eval \"2^10\"\n  imp eval examples/torus.imp \"grad(torus)(1.3, 0, 0.1)\" --json\n\nAn expression that begins with a dash goes behind `--`:\n  imp eval -- \"-pi/2\""
    )]
    Eval(Eval),
    /// Polygonizes a field: triangles in R3, curves in R2, roots in R1
    #[command(
        after_help = "Examples:\n  imp mesh examples/torus.imp -o torus.stl\n  imp mesh scene.imp \"a & !b\" -o cut.obj --cell 0.02 --bounds \"[-1..1, -1..1, 0..2]\" --cap\n  imp mesh examples/gyroid.imp gyroid -o gyroid.ply --resolution 1024 --bricks 256"
    )]
    Mesh(Mesh),
    /// Proves again the topology that a certificate claims
    #[command(
        after_help = "Examples:\n  imp mesh examples/torus.imp --method certified -o torus.ply --certificate torus.certificate\n  imp verify torus.certificate\n\nThe certificate holds the field, the box and its cells; all of them are proven again with intervals.\nExit codes: 0 it is accepted, 1 it is not, 3 it cannot be read."
    )]
    Verify(Verify),
    /// Samples a field's zero set with particles
    #[command(
        after_help = "Examples:\n  imp sample examples/blobs.imp -o blobs.ply --spacing 0.05\n  imp sample examples/blobs.imp -o blobs.ply --count 10000 --seed 1\n  imp sample examples/blobs.imp -o blobs.ply --spacing \"p -> 0.03 + 0.05*norm(p)\"\n  imp sample examples/blobs.imp -o blobs.ply --adapt curvature --contrast 4\n  imp sample examples/torus.imp -o part.ply --bounds \"[0..2, -2..2, -1..1]\" --timings\n  imp sample examples/cassini.imp -o ovals.csv --method trace --spacing 0.01\n  imp sample examples/heart.imp -o heart.ply --method dynamic --count 3000 --friction 0.1\n  imp sample examples/heart.imp --method rays --count 100000 --json"
    )]
    Sample(Box<Sample>),
    /// Makes a picture of a field: a graph in R1, a map in R2, a lit solid in R3
    #[command(
        after_help = "Examples:\n  imp render examples/csg.imp part -o part.png --occlusion\n  imp render examples/torus.imp -o torus.png --view 30,20 --perspective 35 --size 800x600\n  imp render examples/cassini.imp -o ovals.png --size 1024\n  imp render scene.imp \"a & !b\" -o cut.png --bounds \"[-1..1, -1..1, 0..2]\" --view top --transparent\n\nThe box, from the field's `over` or from `--bounds`, cuts solids: cuts are shown flat and orange.\nGrey is where the field is not a number, or jumps below 0 without a zero."
    )]
    Render(Render),
    /// Prints the reference of the language and its library as Markdown, or what it says of a name
    #[command(
        after_help = "Examples:\n  imp doc > reference.md\n  imp doc smooth_union\n  imp doc algebraic"
    )]
    Doc(Doc),
    /// Lists a file's fields, parameters and settings
    #[command(after_help = "Example:\n  imp info examples/blobs.imp --json")]
    Info(Info),
    /// Begins a session: what is typed is run at once
    #[command(
        after_help = "Examples:\n  imp repl\n  imp repl examples/torus.imp --set r=0.3\n  echo \"2^10\" | imp\n\n`imp` alone does the same at a terminal; there `:help` lists the commands.\nWhat comes through a pipe is run without a greeting, and its first error ends it with exit code 1.\nIMP_HISTORY names the file for what was typed; IMP_GRAPHICS (kitty, sixel, blocks, none) says how pictures are shown."
    )]
    Repl(Repl),
    /// Says what the code of a message means, with an example and its repair
    #[command(after_help = "Examples:\n  imp explain E0105\n  imp explain")]
    Explain(Explain),
    /// Serves an editor: speaks the language server protocol over standard input and output
    #[command(
        after_help = "Example:\n  imp lsp\n\nAn editor starts it. In Helix's languages.toml, for example:\n  [language-server.imp]\n  command = \"imp\"\n  args = [\"lsp\"]\n\nIt ends with 0 after `shutdown` and `exit`, else with 1."
    )]
    Lsp(Lsp),
    /// Prints the script that completes words of the command line in a shell
    #[command(
        after_help = "Examples:\n  imp completions bash > ~/.local/share/bash-completion/completions/imp\n  imp completions zsh > ~/.zfunc/_imp\n  imp completions fish > ~/.config/fish/completions/imp.fish"
    )]
    Completions(Completions),
    /// Prints the manual page of the program or of a command
    #[command(after_help = "Examples:\n  imp man | man -l -\n  imp man mesh > imp-mesh.1")]
    Man(Manual),
    /// Prints the intermediate forms of a field
    #[command(after_help = "Example:\n  imp dump examples/torus.imp torus --graph")]
    Dump(Dump),
}

/// What every command understands that reads a file.
#[derive(Args, Debug, Clone)]
pub(super) struct Common {
    /// Gives a parameter or setting another value; may be repeated
    #[arg(long, value_name = "NAME=EXPR", value_parser = setting)]
    pub(super) set: Vec<Setting>,
    /// Prints exactly one JSON object on standard output
    #[arg(long)]
    pub(super) json: bool,
    /// How many threads work, at most 1024; 0 is one for each core
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = value_parser!(u16).range(0..=1024))]
    pub(super) threads: u16,
    /// What evaluates fields; for comparisons, the results are the same
    #[arg(long, value_name = "TIER", default_value = "automatic", value_parser = tier())]
    pub(super) tier: Tier,
    /// No progress and no warnings
    #[arg(short, long)]
    pub(super) quiet: bool,
    /// Raises or lowers a limit (recursion, nodes, elements, characters, steps, cells, particles, seconds, bytes, input); may be repeated
    #[arg(long, value_name = "NAME=N", value_parser = limit)]
    pub(super) limit: Vec<Limit>,
    /// Whether messages are coloured
    #[arg(long, value_enum, value_name = "WHEN", default_value_t = Color::Auto)]
    pub(super) color: Color,
    /// How errors and warnings are written to standard error [default: human]
    #[arg(long, value_enum, value_name = "FORM")]
    pub(super) message_format: Option<MessageFormat>,
    /// Where files go, made when the first one is written [default: the present directory]
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// Another directory from which files may be imported; may be repeated
    #[arg(long, value_name = "DIR")]
    pub(super) allow_read: Vec<PathBuf>,
    /// Another directory in which the script may write; may be repeated
    #[arg(long, value_name = "DIR")]
    pub(super) allow_write: Vec<PathBuf>,
}

/// `--set NAME=EXPR`: a parameter's name and the text of its value.
#[derive(Clone, Debug)]
pub(super) struct Setting {
    pub(super) name: String,
    pub(super) text: String,
}

/// `--limit NAME=N`: the name of a limit that there is, and its value.
#[derive(Clone, Debug)]
pub(super) struct Limit {
    pub(super) name: String,
    pub(super) value: u64,
}

#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Color {
    Auto,
    Always,
    Never,
}

/// How diagnostics are written to standard error.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MessageFormat {
    /// With the lines they are about and with help
    Human,
    /// `file:line:column: error[E0201]: message`, one line each
    Short,
    /// A JSON object on one line each, and nothing else
    Json,
}

#[derive(Args, Debug)]
pub(super) struct Run {
    /// The file; `-` is standard input
    pub(super) file: PathBuf,
    /// Runs again whenever the file, or one that it imports, is saved
    #[arg(long, conflicts_with = "json")]
    pub(super) watch: bool,
    /// Tells, at the end, what parsing, evaluation, samplers, polygonizers and files took
    #[arg(long)]
    pub(super) timings: bool,
    #[command(flatten)]
    pub(super) common: Common,
}

#[derive(Args, Debug)]
pub(super) struct Check {
    /// The files; `-` is standard input
    #[arg(required = true)]
    pub(super) files: Vec<PathBuf>,
    #[command(flatten)]
    pub(super) common: Common,
}

#[derive(Args, Debug)]
pub(super) struct Test {
    /// The files; `-` is standard input
    #[arg(required = true)]
    pub(super) files: Vec<PathBuf>,
    /// Runs only tests whose names contain this
    #[arg(long, value_name = "TEXT")]
    pub(super) filter: Option<String>,
    #[command(flatten)]
    pub(super) common: Common,
}

#[derive(Args, Debug)]
pub(super) struct Fmt {
    /// The files, and folders whose `.imp` files are meant; `-` is standard input
    #[arg(required = true, value_name = "FILE")]
    pub(super) files: Vec<PathBuf>,
    /// Changes nothing: names the files that are not formatted, and fails if there is one
    #[arg(long)]
    pub(super) check: bool,
    /// Changes nothing: shows what would change
    #[arg(long)]
    pub(super) diff: bool,
    #[command(flatten)]
    pub(super) common: Common,
}

#[derive(Args, Debug)]
pub(super) struct Eval {
    /// A file whose definitions are used (it ends with `.imp`, or is `-`), then expressions
    #[arg(
        required = true,
        value_name = "[FILE] EXPR",
        allow_negative_numbers = true
    )]
    pub(super) words: Vec<String>,
    #[command(flatten)]
    pub(super) common: Common,
}

#[derive(Args, Debug)]
pub(super) struct Mesh {
    #[command(flatten)]
    pub(super) subject: Subject,
    /// The method: in R3 dual (the usual one: sharp edges), cubes, extended (cubes with sharp edges),
    /// tetrahedra, octree, springs, continuation, delaunay or certified (proven topology, without a
    /// resolution); in R2 squares, quadtree, springs, continuation or certified; in R1 newton or bracketing
    #[arg(long, value_name = "NAME")]
    pub(super) method: Option<String>,
    /// The side of a cell
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub(super) cell: Option<String>,
    /// Cells along the longest side of the box, where no `--cell` is given
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub(super) resolution: Option<String>,
    /// The level: the set where the field has this value
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub(super) iso: Option<String>,
    /// Whether what the box cuts is closed along it [default: true in R3, else false]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, require_equals = true, default_missing_value = "true")]
    pub(super) cap: Option<String>,
    /// Marching cubes: merges vertices near grid points, which makes better triangles
    #[arg(long)]
    pub(super) snap: bool,
    /// The greatest |F|/|F_x|, relative to the box's diagonal
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub(super) tolerance: Option<String>,
    /// For squares with opposite corners inside: saddle, join, separate or subdivide
    #[arg(long, value_name = "NAME")]
    pub(super) ambiguity: Option<String>,
    /// With tetrahedra, into how many a cell is cut: 5, 6, 12, 24 or bcc (the body-centred lattice)
    #[arg(long, value_name = "NAME")]
    pub(super) split: Option<String>,
    /// With quadtree and octree, how far from flat, as a length, the level set may be in a larger cell
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub(super) error: Option<String>,
    /// With continuation, points near the components that are wanted, as in "[[0, 0, 1]]"
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub(super) seeds: Option<String>,
    /// With cubes, writes the mesh in bricks of N cells along each side, one file for each that has
    /// surface (name-0-0-0.ply and so on), so that grids larger than memory can be polygonized
    #[arg(
        long,
        value_name = "N",
        allow_hyphen_values = true,
        requires = "output",
        conflicts_with = "report"
    )]
    pub(super) bricks: Option<String>,
    /// Prints all measures of the mesh: topology, quality of the triangles, self-intersections, and
    /// how far it is from the field's surface
    #[arg(long)]
    pub(super) report: bool,
    /// With certified, a file for the proof, which `imp verify` checks
    #[arg(long, value_name = "FILE", conflicts_with = "report")]
    pub(super) certificate: Option<PathBuf>,
    #[command(flatten)]
    pub(super) common: Common,
}

#[derive(Args, Debug)]
pub(super) struct Verify {
    /// The certificate; `-` is standard input
    #[arg(value_name = "FILE")]
    pub(super) file: PathBuf,
    #[command(flatten)]
    pub(super) common: Common,
}

#[derive(Args, Debug)]
pub(super) struct Sample {
    #[command(flatten)]
    pub(super) subject: Subject,
    /// The method: floaters (evenly spread), kinematic or dynamic (random), trace (from point to
    /// point), relax (Turk's), rays (random lines), poisson (random, at a distance) or grid
    #[arg(long, value_name = "NAME")]
    pub(super) method: Option<String>,
    /// The distance between neighbouring points, or the side of the grid's cells; for floaters also a
    /// function, as in "p -> 0.02 + 0.1*norm(p)"
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub(super) spacing: Option<String>,
    /// How many points, or how many particles are released
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub(super) count: Option<String>,
    /// What the spacing of floaters follows: curvature
    #[arg(long, value_name = "NAME")]
    pub(super) adapt: Option<String>,
    /// With --adapt, the widest spacing over the narrowest, at most [default: 8]
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub(super) contrast: Option<String>,
    /// A field: where it is negative floaters are closer, as in "p -> norm(p - [1, 0, 0]) - 0.2"
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub(super) focus: Option<String>,
    /// With --focus, how many times closer [default: 3]
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub(super) finer: Option<String>,
    /// Points from which floaters start, as in "[[0, 0, 1]]" [default: some on every component]
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub(super) seeds: Option<String>,
    /// Where randomness starts
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub(super) seed: Option<String>,
    /// Floaters follow Witkin and Heckbert's algorithm to the letter, from one seed on each component
    #[arg(long)]
    pub(super) exact: bool,
    /// A parameter of floaters: sigma, sigma_max, time_step, phi, rho, alpha, energy, beta, gamma, nu
    /// or delta; may be repeated
    #[arg(long, value_name = "NAME=EXPR", value_parser = setting)]
    pub(super) rule: Vec<Setting>,
    /// The part of their velocity that friction takes from dynamic particles in a step, up to 1
    /// [default: 0.05]
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub(super) friction: Option<String>,
    /// What kinematic and dynamic particles move down: absolute, |F|, or square, F² [default: absolute]
    #[arg(long, value_name = "NAME")]
    pub(super) potential: Option<String>,
    /// The direction of rays, as in "[0, 0, 1]"; without it they have all directions
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub(super) direction: Option<String>,
    /// The greatest |F|/|F_x|, relative to the box's diagonal
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub(super) tolerance: Option<String>,
    /// Tells, at the end, what each part of the work and each phase of the sampler took
    #[arg(long)]
    pub(super) timings: bool,
    #[command(flatten)]
    pub(super) common: Common,
}

#[derive(Args, Debug)]
pub(super) struct Render {
    #[command(flatten)]
    pub(super) subject: Subject,
    /// Pixels: of the longer side, or WIDTHxHEIGHT [default: 512]
    #[arg(long, value_name = "SIZE", allow_hyphen_values = true, value_parser = size)]
    pub(super) size: Option<Pixels>,
    /// In the plane: shaded, with contour lines, or fill, inside and outside only [default: shaded]
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(["shaded", "fill"]))]
    pub(super) style: Option<String>,
    /// In the plane: the difference between contour lines
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub(super) step: Option<String>,
    /// In space: isometric, front, back, left, right, top, bottom, or AZIMUTH,ELEVATION in degrees
    /// [default: isometric]
    #[arg(long, value_name = "VIEW", allow_hyphen_values = true, value_parser = direction)]
    pub(super) view: Option<Direction>,
    /// In space: the angle of view, instead of parallel rays
    #[arg(long, value_name = "DEGREES", allow_hyphen_values = true, value_parser = perspective)]
    pub(super) perspective: Option<f64>,
    /// In space: shows the whole box, not only the part of it where something is
    #[arg(long)]
    pub(super) whole: bool,
    /// In space: darkens corners that little light reaches
    #[arg(long)]
    pub(super) occlusion: bool,
    /// In space: rays along each side of a pixel, 1 to 8; more make smoother edges [default: 2]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = value_parser!(u8).range(1..=8))]
    pub(super) samples: Option<u8>,
    /// Leaves out what is outside: the picture is transparent there
    #[arg(long)]
    pub(super) transparent: bool,
    #[command(flatten)]
    pub(super) common: Common,
}

/// The size of a picture.
#[derive(Clone, Copy, Debug)]
pub(super) enum Pixels {
    Longest(u32),
    Exact(u32, u32),
}

/// From where a solid is seen: the name of a view, or azimuth and elevation in degrees.
#[derive(Clone, Debug)]
pub(super) enum Direction {
    Named(String),
    Angles(f64, f64),
}

/// The field that a command works on, and where the result goes.
#[derive(Args, Debug)]
pub(super) struct Subject {
    /// The file; `-` is standard input
    pub(super) file: PathBuf,
    /// The field, or any expression that gives one; may be left out where the file has one field
    pub(super) field: Option<String>,
    /// The file to write, below `--out` if that is given; its extension names the format
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
    /// The box: one interval for all axes, or a list of one for each
    #[arg(long, value_name = "EXPR", allow_hyphen_values = true)]
    pub(super) bounds: Option<String>,
}

#[derive(Args, Debug)]
pub(super) struct Doc {
    /// A function, a definition of the library, or one of its namespaces
    pub(super) name: Option<String>,
    #[command(flatten)]
    pub(super) common: Common,
}

#[derive(Args, Debug)]
pub(super) struct Info {
    /// The file; `-` is standard input
    pub(super) file: PathBuf,
    #[command(flatten)]
    pub(super) common: Common,
}

#[derive(Args, Debug)]
pub(super) struct Repl {
    /// A file whose definitions the session begins with
    pub(super) file: Option<PathBuf>,
    #[command(flatten)]
    pub(super) common: Common,
}

#[derive(Args, Debug)]
pub(super) struct Explain {
    /// The code, such as E0105; without one, all codes are listed
    pub(super) code: Option<String>,
    /// Prints exactly one JSON object on standard output
    #[arg(long)]
    pub(super) json: bool,
}

#[derive(Args, Debug)]
pub(super) struct Lsp {
    /// Changes nothing: there is no other way to speak, but some editors ask for this one
    #[arg(long)]
    pub(super) stdio: bool,
}

#[derive(Args, Debug)]
pub(super) struct Completions {
    /// The shell
    #[arg(value_enum)]
    pub(super) shell: clap_complete::Shell,
}

#[derive(Args, Debug)]
pub(super) struct Manual {
    /// The command; without one, the page is about the program
    pub(super) command: Option<String>,
}

#[derive(Args, Debug)]
pub(super) struct Dump {
    /// The file; `-` is standard input
    pub(super) file: PathBuf,
    /// The field, or any expression that gives one
    pub(super) field: Option<String>,
    #[command(flatten)]
    pub(super) form: Form,
    #[command(flatten)]
    pub(super) common: Common,
}

/// Which intermediate form is printed.
#[derive(Args, Debug)]
#[group(required = true, multiple = false)]
pub(super) struct Form {
    /// The expression graph
    #[arg(long)]
    pub(super) graph: bool,
    /// Cranelift's intermediate representation
    #[arg(long)]
    pub(super) clif: bool,
}

impl Command {
    /// What every command understands that reads a file.
    pub(super) fn common(&self) -> Option<&Common> {
        Some(match self {
            Command::Run(command) | Command::Watch(command) => &command.common,
            Command::Check(command) => &command.common,
            Command::Test(command) => &command.common,
            Command::Fmt(command) => &command.common,
            Command::Eval(command) => &command.common,
            Command::Mesh(command) => &command.common,
            Command::Verify(command) => &command.common,
            Command::Sample(command) => &command.common,
            Command::Render(command) => &command.common,
            Command::Doc(command) => &command.common,
            Command::Info(command) => &command.common,
            Command::Dump(command) => &command.common,
            Command::Repl(command) => &command.common,
            Command::Explain(_) | Command::Lsp(_) | Command::Completions(_) | Command::Man(_) => {
                return None;
            }
        })
    }
}

fn setting(text: &str) -> Result<Setting, String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() => Ok(Setting {
            name: name.trim().to_string(),
            text: value.to_string(),
        }),
        _ => Err("it is not of the form NAME=EXPR".into()),
    }
}

fn size(text: &str) -> Result<Pixels, String> {
    let number = |text: &str| match text.parse() {
        Ok(0) | Err(_) => Err("write a whole number of pixels, or WIDTHxHEIGHT".to_owned()),
        Ok(number) => Ok(number),
    };
    match text.split_once(['x', 'X']) {
        Some((width, height)) => Ok(Pixels::Exact(number(width)?, number(height)?)),
        None => number(text).map(Pixels::Longest),
    }
}

fn direction(text: &str) -> Result<Direction, String> {
    if View::named(text).is_some() {
        return Ok(Direction::Named(text.to_owned()));
    }
    let angle = |text: &str| {
        text.trim()
            .parse()
            .ok()
            .filter(|angle: &f64| angle.is_finite())
    };
    text.split_once(',')
        .and_then(|(azimuth, elevation)| {
            Some(Direction::Angles(angle(azimuth)?, angle(elevation)?))
        })
        .ok_or_else(|| {
            let names: Vec<&str> = View::names().collect();
            format!(
                "the views are {}, or AZIMUTH,ELEVATION in degrees, as in 30,20",
                names.join(", ")
            )
        })
}

fn perspective(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(degrees) if degrees > 0.0 && degrees < 170.0 => Ok(degrees),
        _ => Err("write an angle in degrees, greater than 0 and less than 170".into()),
    }
}

fn tier() -> impl TypedValueParser<Value = Tier> {
    let value = |(name, _)| PossibleValue::new(name).aliases(Tier::short(name));
    PossibleValuesParser::new(Tier::ALL.map(value))
        .map(|name| Tier::named(&name).unwrap_or_default())
}

fn limit(text: &str) -> Result<Limit, String> {
    let (name, value) = text.split_once('=').ok_or("it is not of the form NAME=N")?;
    let name = name.trim().to_string();
    if !Limits::NAMES.contains(&&*name) {
        return Err(format!("the limits are {}", Limits::NAMES.join(", ")));
    }
    match value.trim().parse() {
        Ok(value) => Ok(Limit { name, value }),
        Err(_) => Err("N must be a whole number, 0 or greater".into()),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::*;

    /// The words of a command line up to what a shell does with its output or input.
    fn words(line: &str) -> Vec<String> {
        let quoted = line.split('"').enumerate();
        let mut words = Vec::new();
        for (index, part) in quoted {
            match index % 2 {
                0 => words.extend(part.split_whitespace().map(str::to_owned)),
                _ => words.push(part.to_owned()),
            }
        }
        let end = words
            .iter()
            .position(|word| matches!(&word[..], "|" | ">" | "<"));
        words.truncate(end.unwrap_or(words.len()));
        words
    }

    #[test]
    fn the_help_of_every_command_shows_examples_that_are_understood() {
        let program = Arguments::command();
        for command in program.get_subcommands() {
            let name = command.get_name();
            let help = command.get_after_help().map(ToString::to_string);
            let help = help.unwrap_or_else(|| panic!("`imp {name}` has no example"));
            let examples = help.lines().filter(|line| line.starts_with("  imp "));
            let mut own = 0;
            for line in examples {
                let words = words(line);
                let parsed = Arguments::try_parse_from(&words);
                assert!(parsed.is_ok(), "{line}: {}", parsed.unwrap_err());
                own += usize::from(words[1] == name);
            }
            assert!(own > 0, "`imp {name}` has no example");
        }
    }
}
