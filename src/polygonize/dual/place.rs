//! Where the vertices of cells go: onto F = iso, and onto its sharp edges and corners.
//!
//! A vertex starts in the middle of the roots on the edges that its loop goes through. If the
//! normals there agree, Newton's method takes it to the surface, within the cell. Otherwise the
//! surface may have a sharp edge or a corner in the cell. The point nearest to the tangent planes
//! (`quadric`) is then a guess, which is improved without knowing the faces: the roots are drawn
//! together around it, by a factor of ten each time, put back on the surface, and their tangent
//! planes give the next guess. On a curved surface their normals draw together, too, and it is no
//! edge after all; at an edge they do not, and the error falls with the square of the distance.
//!
//! All steps are done for many vertices at a time, in columns.

use std::ops::Range;

use glam::DVec3;

use super::quadric::{Nearest, Quadric};
use crate::polygonize::columns::{Columns, Evaluate};
use crate::polygonize::edge_roots::first_order_distance;

/// Normals whose cosine is below this may belong to two sides of a sharp edge: 10 degrees.
const ALIKE: f64 = 0.985;

/// Normals that differ may still be those of one curved surface, if no two have a cosine below
/// this: 60 degrees.
const CURVED: f64 = 0.5;

/// On a sphere the chord between two points is at right angles to the sum of their normals, and on
/// any smooth surface but for terms of third order. The greatest cosine that is put down to these.
const CHORD: f64 = 0.02;

/// How far roots are drawn together around the guess, round by round.
const ROUNDS: [f64; 3] = [0.1, 0.01, 0.001];

/// How a vertex slides along a sharp edge to where it may be: the length of a step, in cells, and
/// how many it takes at most.
const SLIDE: f64 = 0.1;
const SLIDES: i32 = 15;

/// Steps of Newton's method before a vertex is given up: enough for linear convergence, as at
/// multiple zeros.
const STEPS: usize = 64;

/// After every so many steps the residual must have halved: at a kink steps go to and fro.
const TRIAL: usize = 4;

/// The part of a cell at its border that smooth vertices keep out of, so that those of two cells
/// do not coincide.
const MARGIN: f64 = 0.05;

/// How far beyond its cell, as a part of it, a vertex may be where the surface only grazes it.
const BEYOND: f64 = 0.5;

/// A vertex that is to be placed.
#[derive(Clone, Debug)]
pub(super) struct Site {
    /// The cell's corners.
    pub(super) low: DVec3,
    /// See `low`.
    pub(super) high: DVec3,
    /// Where it starts.
    pub(super) middle: DVec3,
    /// Its roots, as a range of the list. Without any it stays where it starts.
    pub(super) roots: Range<usize>,
    /// Of a flat cell, the outward normal of the box; else 0.
    pub(super) outward: DVec3,
}

impl Site {
    /// The vertex of a site that stays where it is: one on a side of the box, away from the
    /// surface.
    fn given(&self) -> Option<Vertex> {
        self.roots.is_empty().then_some(Vertex {
            position: self.middle,
            normal: self.outward.normalize_or_zero(),
            residual: 0.0,
            rank: 2,
        })
    }

    /// Whether a point is in the cell, but for rounding.
    pub(super) fn holds(&self, point: DVec3) -> bool {
        let slack = 1e-9 * (self.high - self.low);
        point.cmpge(self.low - slack).all() && point.cmple(self.high + slack).all()
    }

    /// A direction without what leads out of a flat cell.
    pub(super) fn within(&self, direction: DVec3) -> DVec3 {
        DVec3::select(self.low.cmplt(self.high), direction, DVec3::ZERO)
    }
}

/// A root on an edge, with the normal there; 0 if there is none.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contact {
    /// Where.
    pub(super) position: DVec3,
    /// F_x / |F_x|, without what leads out of a flat cell.
    pub(super) normal: DVec3,
}

/// A vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Vertex {
    /// Where.
    pub(super) position: DVec3,
    /// The outward normal, of length 1; at sharp edges the mean of the sides', 0 if unknown.
    pub(super) normal: DVec3,
    /// |F − iso| / |F_x|.
    pub(super) residual: f64,
    /// 1 on a smooth part, 2 on a sharp edge or a side of the box, 3 at a corner.
    pub(super) rank: u8,
}

/// What vertices are placed with.
pub(super) struct Placer<'a, E> {
    /// The field, near the sites.
    pub(super) field: &'a mut E,
    /// The level.
    pub(super) iso: f64,
    /// The residual at which a vertex is on the surface, a length.
    pub(super) tolerance: f64,
    /// Scratch.
    pub(super) columns: &'a mut Columns,
    /// Points at which F and F_x were taken so far.
    pub(super) evaluations: usize,
}

impl<E: Evaluate> Placer<'_, E> {
    /// Places a vertex for each site. Tells which sites, by their numbers, may be at a sharp edge.
    pub(super) fn place(
        &mut self,
        sites: &[Site],
        contacts: &[Contact],
    ) -> (Vec<Vertex>, Vec<usize>) {
        let mut placed: Vec<Option<Vertex>> = sites.iter().map(Site::given).collect();
        let bent = self.bent(sites, contacts);
        let sharp = (bent.iter())
            .map(|&place| Guess::new(place, &sites[place], contacts))
            .collect();
        let is_inside = |place: usize, point: DVec3| sites[place].holds(point);
        self.place_on_edges(sharp, sites, contacts, &mut placed, &is_inside);
        self.place_on_surface(sites, MARGIN, &mut placed);
        self.place_on_surface(sites, 0.0, &mut placed);
        self.place_on_surface(sites, -BEYOND, &mut placed);
        self.leave_the_rest(sites, contacts, &mut placed);
        (placed.into_iter().flatten().collect(), bent)
    }

    /// The sites whose roots have different normals that are not those of a smooth surface.
    fn bent(&mut self, sites: &[Site], contacts: &[Contact]) -> Vec<usize> {
        let own = |place: usize| &contacts[sites[place].roots.clone()];
        let differ = |&place: &usize| !are_alike(own(place).iter().map(|contact| contact.normal));
        let mut bent: Vec<usize> = (0..sites.len()).filter(differ).collect();
        self.evaluate(bent.iter().map(|&place| sites[place].middle));
        let mut next = 0;
        bent.retain(|&place| {
            let (_, gradient) = self.columns.result(next);
            next += 1;
            !is_curved(own(place), sites[place].within(gradient))
        });
        bent
    }

    /// Gives the sites without a vertex one where they start, with the residual there.
    fn leave_the_rest(
        &mut self,
        sites: &[Site],
        contacts: &[Contact],
        placed: &mut [Option<Vertex>],
    ) {
        let open: Vec<usize> = (0..sites.len())
            .filter(|&place| placed[place].is_none())
            .collect();
        self.evaluate(open.iter().map(|&place| sites[place].middle));
        for (index, &place) in open.iter().enumerate() {
            let (value, gradient) = self.columns.result(index);
            placed[place] = Some(Vertex {
                position: sites[place].middle,
                normal: mean_normal(&contacts[sites[place].roots.clone()]),
                residual: first_order_distance(value, gradient),
                rank: 1,
            });
        }
    }

    fn evaluate(&mut self, points: impl ExactSizeIterator<Item = DVec3>) {
        self.evaluations += points.len();
        self.columns.set_points(points);
        self.columns.evaluate(self.field, self.iso);
    }

    /// Newton's method for the sites without a vertex, inside their cells but for a margin.
    fn place_on_surface(&mut self, sites: &[Site], margin: f64, placed: &mut [Option<Vertex>]) {
        let open = (0..sites.len()).filter(|&place| placed[place].is_none());
        let mut open: Vec<(usize, DVec3, f64)> = open
            .map(|place| {
                let (low, high) = shrunk(&sites[place], margin);
                (place, sites[place].middle.clamp(low, high), f64::INFINITY)
            })
            .collect();
        for number in 0..STEPS {
            if open.is_empty() {
                return;
            }
            self.evaluate(open.iter().map(|(_, point, _)| *point));
            let mut next = 0;
            open.retain_mut(|(place, point, residual)| {
                let (value, gradient) = self.columns.result(next);
                next += 1;
                let length = gradient.length();
                if value.abs() <= self.tolerance * length {
                    let is_flat = sites[*place].outward != DVec3::ZERO;
                    placed[*place] = Some(Vertex {
                        position: *point,
                        normal: gradient / length,
                        residual: value.abs() / length,
                        rank: 1 + u8::from(is_flat),
                    });
                    return false;
                }
                if number % TRIAL == 0 {
                    let before = std::mem::replace(residual, value.abs() / length);
                    if *residual > 0.5 * before {
                        return false;
                    }
                }
                let (low, high) = shrunk(&sites[*place], margin);
                match step_within(value, gradient, *point, (low, high)) {
                    Some(to) => {
                        *point = to;
                        true
                    }
                    None => false,
                }
            });
        }
    }

    /// Looks for a sharp edge or corner near each site, by guesses from its roots; a point is
    /// taken where `is_fit` says so for the number of the site.
    pub(super) fn find_sharp(
        &mut self,
        sites: &[Site],
        contacts: &[Contact],
        is_fit: &dyn Fn(usize, DVec3) -> bool,
    ) -> Vec<Option<Vertex>> {
        let mut placed = vec![None; sites.len()];
        let guesses = sites.iter().enumerate();
        let guesses = guesses.map(|(place, site)| Guess::new(place, site, contacts));
        self.place_on_edges(guesses.collect(), sites, contacts, &mut placed, is_fit);
        placed
    }

    /// Looks for a sharp edge or corner at each guess, and gives those sites a vertex.
    fn place_on_edges(
        &mut self,
        mut guesses: Vec<Guess>,
        sites: &[Site],
        contacts: &[Contact],
        placed: &mut [Option<Vertex>],
        is_fit: &dyn Fn(usize, DVec3) -> bool,
    ) {
        // A second attempt for those whose first edge point lies outside the cell.
        for attempt in 0..2 {
            for scale in ROUNDS {
                self.improve(&mut guesses, sites, contacts, scale);
            }
            self.evaluate(guesses.iter().map(|guess| guess.position));
            let mut next = 0;
            guesses.retain_mut(|guess| {
                let (value, gradient) = self.columns.result(next);
                next += 1;
                let site = &sites[guess.place];
                if !is_fit(guess.place, guess.position) {
                    let place = guess.place;
                    return attempt == 0 && guess.slide(site, |point| is_fit(place, point));
                }
                let residual = value.abs() / gradient.length();
                if residual <= 8.0 * self.tolerance && guess.rank >= 2 {
                    placed[guess.place] = Some(Vertex {
                        position: guess.position,
                        normal: guess.normal,
                        residual,
                        rank: guess.rank as u8,
                    });
                }
                false
            });
        }
    }

    /// One round: draws the roots together around each guess, puts them on the surface and finds
    /// the next guess. Guesses at which the surface turns out to be smooth are dropped.
    fn improve(
        &mut self,
        guesses: &mut Vec<Guess>,
        sites: &[Site],
        contacts: &[Contact],
        scale: f64,
    ) {
        let mut samples: Vec<DVec3> = Vec::new();
        for guess in guesses.iter() {
            let roots = &contacts[sites[guess.place].roots.clone()];
            let drawn =
                |contact: &Contact| guess.position + scale * (contact.position - guess.position);
            samples.extend(roots.iter().map(drawn));
        }
        self.evaluate(samples.iter().copied());
        let owners = guesses.iter().flat_map(|guess| {
            let site = &sites[guess.place];
            std::iter::repeat_n(site, site.roots.len())
        });
        for ((index, sample), site) in samples.iter_mut().enumerate().zip(owners) {
            let (value, gradient) = self.columns.result(index);
            let gradient = site.within(gradient);
            let step = gradient * (value / gradient.length_squared());
            if step.is_finite() {
                *sample -= step;
            }
        }
        self.evaluate(samples.iter().copied());
        let (mut next, mut normals) = (0, Vec::new());
        guesses.retain_mut(|guess| {
            let site = &sites[guess.place];
            let range = next..next + site.roots.len();
            next = range.end;
            let mut quadric = Quadric::default();
            normals.clear();
            for index in range {
                let (value, gradient) = self.columns.result(index);
                let gradient = site.within(gradient);
                let length = gradient.length();
                let normal = gradient / length;
                if !(normal.is_finite() && value.is_finite()) {
                    continue;
                }
                normals.push(normal);
                let distance = normal.dot(samples[index] - guess.position) - value / length;
                quadric.add(normal, distance);
            }
            let nearest = quadric.nearest(guess.most);
            let reach = (site.high - site.low).length();
            guess.take(&nearest, &normals);
            !are_alike(normals.iter().copied()) && nearest.offset.length() <= reach
        });
    }
}

/// A guess of a point on a sharp edge.
struct Guess {
    /// The number of the site.
    place: usize,
    position: DVec3,
    normal: DVec3,
    rank: usize,
    free: DVec3,
    /// The greatest rank that is looked for.
    most: usize,
}

impl Guess {
    /// The point nearest to the tangent planes at the roots.
    fn new(place: usize, site: &Site, contacts: &[Contact]) -> Guess {
        let mut guess = Guess {
            place,
            position: site.middle,
            normal: DVec3::ZERO,
            rank: 0,
            free: DVec3::ZERO,
            most: 3,
        };
        let mut quadric = Quadric::default();
        for contact in &contacts[site.roots.clone()] {
            let distance = contact.normal.dot(contact.position - site.middle);
            quadric.add(contact.normal, distance);
        }
        let nearest = quadric.nearest(3);
        // A guess far away from the cell is none: it stays among the roots.
        let reach = (site.high - site.low).length();
        if nearest.offset.length() <= reach {
            guess.take(&nearest, &[]);
        }
        guess
    }

    fn take(&mut self, nearest: &Nearest, normals: &[DVec3]) {
        self.position += nearest.offset;
        self.rank = nearest.rank;
        self.free = nearest.free;
        self.normal = normals.iter().copied().sum::<DVec3>().normalize_or_zero();
    }

    /// Starts anew at the nearest point of the sharp edge, as far as it is known, that fits; false
    /// if there is none.
    fn slide(&mut self, site: &Site, is_fit: impl Fn(DVec3) -> bool) -> bool {
        if self.rank > 2 {
            // The corner is elsewhere, but an edge that leads to it may be here.
            self.position = site.middle;
            self.most = 2;
            return true;
        }
        let step = self.free * (SLIDE * (site.high - site.low).min_element());
        let at = |steps: i32| self.position + f64::from(steps) * step;
        let nearest = (1..=SLIDES).flat_map(|steps| [steps, -steps]);
        let Some(steps) = nearest.into_iter().find(|&steps| is_fit(at(steps))) else {
            return false;
        };
        // A little further, if that fits, too: a curved edge may be elsewhere than its tangent.
        let further = at(steps + steps.signum());
        self.position = if is_fit(further) { further } else { at(steps) };
        true
    }
}

/// Whether the normals, those of length 0 aside, point in nearly the same direction.
pub(super) fn are_alike(normals: impl Iterator<Item = DVec3> + Clone) -> bool {
    let known = normals.filter(|normal| *normal != DVec3::ZERO);
    let Some(first) = known.clone().next() else {
        return true;
    };
    // Most often all agree with the first; only otherwise all pairs are compared.
    let close = 1.0 - (1.0 - ALIKE) / 4.0;
    known.clone().all(|normal| normal.dot(first) >= close)
        || known
            .clone()
            .all(|one| known.clone().all(|other| one.dot(other) >= ALIKE))
}

/// Whether the roots are like those on a smooth surface, given F_x in their middle. One may see a
/// sharp edge from equal distances on both sides, and all chords then are as on a cylinder; but F_x
/// is that of one side or the other, and not the mean.
pub(super) fn is_curved(contacts: &[Contact], gradient: DVec3) -> bool {
    let mut widest: f64 = 1.0;
    for (number, one) in contacts.iter().enumerate() {
        for other in &contacts[..number] {
            let chord = other.position - one.position;
            let lean = (one.normal + other.normal).dot(chord).abs();
            if one.normal == DVec3::ZERO || lean > CHORD * chord.length() {
                return false;
            }
            widest = widest.min(one.normal.dot(other.normal));
        }
    }
    // A quarter of the widest angle at most, which has a 16th of its versine.
    let away = 1.0 - gradient.normalize_or_zero().dot(mean_normal(contacts));
    widest >= CURVED && away <= (1.0 - widest) / 16.0
}

fn mean_normal(contacts: &[Contact]) -> DVec3 {
    let normals = contacts.iter().map(|contact| contact.normal);
    normals.sum::<DVec3>().normalize_or_zero()
}

/// The cell without a margin, a part of its sides. A flat cell stays flat.
fn shrunk(site: &Site, margin: f64) -> (DVec3, DVec3) {
    let inset = margin * (site.high - site.low);
    (site.low + inset, site.high - inset)
}

/// The point after a step of Newton's method that stays in the box: along axes on whose ends the
/// point is and beyond which the step would lead it does not move. `None` if there is none.
pub(super) fn step_within(
    value: f64,
    gradient: DVec3,
    point: DVec3,
    (low, high): (DVec3, DVec3),
) -> Option<DVec3> {
    let mut free = low.cmplt(high);
    for _ in 0..3 {
        let along = DVec3::select(free, gradient, DVec3::ZERO);
        let step = along * (value / along.length_squared());
        if !step.is_finite() {
            return None;
        }
        let to = point - step;
        let held = (to.cmplt(low) & point.cmple(low)) | (to.cmpgt(high) & point.cmpge(high));
        if !(held & free).any() {
            let to = to.clamp(low, high);
            return (to != point).then_some(to);
        }
        free &= !held;
    }
    None
}
