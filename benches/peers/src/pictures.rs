//! Pictures: bitmaps of plane fields at 1024² and height maps of solids at 512³.
//!
//! Both programs see [−1, 1]² or, from above, [−1, 1]³, prove with intervals what they can and
//! evaluate the rest; fidget looks at the corners of pixels where Imp looks at their middles. A
//! first picture decides whether fidget's compiler or its interpreter is the faster one.

use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use fidget::jit::JitFunction;
use fidget::raster::{pixel, voxel};
use fidget::render::{RenderHints, ThreadPool};
use fidget::shape::{BoundShape, Shape};
use fidget::vm::VmFunction;
use imp::engine::{CompiledField, Silent};
use imp::geometry::Bounds;
use imp::picture::{self, Aim, Camera, Hit, Side, View};

use crate::measure::{Contender, Task, compete};
use crate::own;
use crate::peer::{self, Peer};
use crate::subjects::Subject;
use crate::{Goal, Options, PEERS, Row};

/// Pixels of a bitmap in a row.
const BITMAP: usize = 1024;

/// Pixels of a height map in a row, and voxels behind each.
const HEIGHT_MAP: usize = 512;

/// What is made of a field.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Bitmap,
    HeightMap,
}

/// The pictures of a field, if there are any of it.
pub fn pictures(subject: &Subject, threads: usize, options: &Options) -> Result<(), String> {
    match subject.name {
        "prospero" => {
            picture(subject, Kind::Bitmap, Some(5.0), threads, options)?;
            let solid = subject.extruded(0.3)?;
            picture(&solid, Kind::HeightMap, None, threads, options)
        }
        "CSG of 100 spheres" => picture(subject, Kind::HeightMap, Some(4.0), threads, options),
        "14 Gaussians" | "gyroid" => {
            picture(subject, Kind::HeightMap, Some(50.0), threads, options)
        }
        _ => Ok(()),
    }
}

fn picture(
    subject: &Subject,
    kind: Kind,
    goal: Option<f64>,
    threads: usize,
    options: &Options,
) -> Result<(), String> {
    let pool = || pool(threads);
    let mut compiled = draw::<JitFunction>(subject, kind, threads)?;
    let mut interpreted = draw::<VmFunction>(subject, kind, threads)?;
    let is_compiled_faster = time(&mut compiled) < time(&mut interpreted);
    let (label, task) = match is_compiled_faster {
        true => (PEERS[0], compiled),
        false => (PEERS[1], interpreted),
    };
    let own = own_picture(subject, kind, options, pool()?)?;
    // The contender's task runs on the threads of its pool.
    let outcome = compete(
        vec![
            Contender::single("Imp", own),
            Contender::single(label, task),
        ],
        options.rounds,
    );
    let name = match kind {
        Kind::Bitmap => format!("bitmap {BITMAP}², a second"),
        Kind::HeightMap => format!("height map {HEIGHT_MAP}³, a second"),
    };
    let row = Row::new(subject, threads, &outcome);
    row.print(&name, "Imp", Goal::Peer(goal));
    Ok(())
}

fn time(task: &mut Task) -> Duration {
    let begun = Instant::now();
    task();
    begun.elapsed()
}

/// So many threads.
pub fn pool(threads: usize) -> Result<rayon::ThreadPool, String> {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
    builder.build().map_err(|error| error.to_string())
}

/// Imp's picture.
fn own_picture(
    subject: &Subject,
    kind: Kind,
    options: &Options,
    pool: rayon::ThreadPool,
) -> Result<Task, String> {
    let program = Arc::new(own::program(subject, options.tier));
    let q = subject.q.clone();
    let bounds = cube(subject.dimension)?;
    // A new field each time, as for a new picture; its program is kept.
    let field = move || CompiledField::new(Arc::clone(&program), q.clone());
    Ok(Box::new(move || {
        let field = field();
        pool.install(|| match kind {
            Kind::Bitmap => {
                drop(black_box(picture::bitmap(
                    &field,
                    &bounds,
                    [BITMAP; 2],
                    &Silent,
                )));
            }
            Kind::HeightMap => {
                drop(black_box(picture::height_map(
                    &field,
                    &from_above(bounds),
                    &Silent,
                )));
            }
        });
    }))
}

fn cube(dimension: usize) -> Result<Bounds, String> {
    Bounds::from_sides(&vec![(-1.0, 1.0); dimension]).ok_or_else(|| "no box".to_owned())
}

fn from_above(bounds: Bounds) -> Camera {
    Camera::new(&Aim {
        bounds,
        view: View {
            azimuth: 0.0,
            elevation: std::f64::consts::FRAC_PI_2,
        },
        perspective: None,
        size: [HEIGHT_MAP; 2],
    })
}

fn bound<F: Peer>(subject: &Subject) -> Result<BoundShape<'static, F, f32>, String> {
    let shape: Shape<F> = peer::shape(subject);
    BoundShape::try_from(shape).map_err(|error| error.to_string())
}

/// fidget's picture.
fn draw<F: Peer + RenderHints>(
    subject: &Subject,
    kind: Kind,
    threads: usize,
) -> Result<Task, String> {
    let shape = bound::<F>(subject)?;
    let pool = match threads {
        1 => None,
        _ => Some(ThreadPool::Custom(pool(threads)?)),
    };
    Ok(Box::new(move || match kind {
        Kind::Bitmap => {
            let config = pixel::RenderConfig::from_size((BITMAP as u32).into());
            let threads = pixel::EvalConfig {
                threads: pool.as_ref(),
                ..Default::default()
            };
            black_box(pixel::render(shape.clone(), &config, &threads).is_some());
        }
        Kind::HeightMap => {
            let config = voxel::RenderConfig::from_size((HEIGHT_MAP as u32).into());
            let threads = voxel::EvalConfig {
                threads: pool.as_ref(),
                ..Default::default()
            };
            black_box(voxel::render(shape.clone(), &config, &threads).is_some());
        }
    }))
}

/// Says in how many pixels the two programs' pictures of a field differ.
pub fn compare(subject: &Subject, options: &Options) -> Result<(), String> {
    let field = || {
        let program = Arc::new(own::program(subject, options.tier));
        CompiledField::new(program, subject.q.clone())
    };
    let bounds = cube(subject.dimension)?;
    let (own, other): (Vec<bool>, Vec<bool>) = match subject.name {
        "prospero" => {
            let own = picture::bitmap(&field(), &bounds, [BITMAP; 2], &Silent)
                .map_err(|error| error.to_string())?;
            let config = pixel::RenderConfig::from_size((BITMAP as u32).into());
            let other = config.run(bound::<VmFunction>(subject)?);
            (
                own.sides.iter().map(|&side| side == Side::Inside).collect(),
                other.iter().map(|pixel| pixel.inside()).collect(),
            )
        }
        "CSG of 100 spheres" => {
            let own = picture::height_map(&field(), &from_above(bounds), &Silent)
                .map_err(|error| error.to_string())?;
            let config = voxel::RenderConfig::from_size((HEIGHT_MAP as u32).into());
            let other = config.run(bound::<VmFunction>(subject)?);
            (
                own.hits.iter().map(|&hit| hit != Hit::Nothing).collect(),
                other.iter().map(|pixel| pixel.depth > 0).collect(),
            )
        }
        _ => return Ok(()),
    };
    let differ = own.iter().zip(&other).filter(|(a, b)| a != b).count();
    println!(
        "{}: its pictures differ in {differ} of {} pixels",
        subject.name,
        own.len()
    );
    Ok(())
}
