//! Walking along a curve: prediction along the tangent, correction by Newton's method.
//!
//! The step is Euler's, the correction takes the shortest steps (the Moore-Penrose inverse), and
//! the length of the next step follows from what this one cost: the rate of contraction, the
//! distance of the prediction and the turning angle (Allgower and Georg, "Numerical Continuation
//! Methods", section 6.1). A step is accepted only if the curve between its ends is where they say
//! ([`Step::new`]) and, for compiled fields, if intervals prove that both lie on one branch
//! ([`connects`]); steps that have become very short are accepted without the proof, which there is
//! none of near singular points.
//!
//! At a crossing the direction of the equations turns round while the curve goes on (ibid., section
//! 8.1): the change of sign tells of it, bisection finds it, and the walk goes straight on. Where no
//! step succeeds, at a corner, a cusp or the end of the field's domain, the branches that leave a
//! small sphere are found, and the straightest new one is taken.

use glam::DVec3;

use super::proof::connects;
use super::step::{Place, Step};
use super::system::{Condition, System};
use crate::engine::CompiledField;
use crate::geometry::Bounds;
use crate::math::scalar;

/// The longest step, the first, the longest that needs no proof, and the shortest, as parts of the
/// diagonal.
const LONGEST: f64 = 1.0 / 32.0;
const FIRST: f64 = 1.0 / 256.0;
const UNPROVEN: f64 = 5e-4;
const SHORTEST: f64 = 1e-8;

/// What a step should cost: the contraction of Newton's method, the distance of the prediction as a
/// part of the step, and the turning angle; and what it may cost at the most.
const WANTED: [f64; 3] = [0.1, 0.06, 0.12];
const ACCEPTED: [f64; 3] = [0.4, 0.2, 0.3];

/// On a circle the two tangents deviate from the chord alike. The sine by which they may not.
const LARGEST_ASYMMETRY: f64 = 0.05;

/// At crossings, the asymmetry of a smooth branch is at most this multiple of the step, as a part of
/// the diagonal.
const CURVED: f64 = 30.0;

/// The sphere on which branches are looked for, in shortest steps.
const PROBE: f64 = 8.0;

/// The largest such sphere, as a part of the diagonal.
const LARGEST_PROBE: f64 = 1e-3;

/// A step is longer than the errors of its ends by this factor.
const PRECISION: f64 = 1e3;

/// Starts for the search on the sphere, in the plane and in space.
const PROBES: (u32, u32) = (48, 160);

/// The angle between consecutive points of a spiral that covers a sphere evenly: π (3 - √5).
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;

/// Branches closer than this part of the sphere's radius are one.
const SAME_BRANCH: f64 = 1e-4;

/// Beside a singular point, where the equations hold almost, Newton's method does not converge to
/// this part of the radius.
const LARGEST_NOISE: f64 = 1e-5;

/// The most steps of a walk.
const STEP_LIMIT: usize = 400_000;

/// Evaluations that may be made in vain, per coordinate beyond the first: a second's work or so. A
/// proven step accounts for so many; a walk may take this part of all.
const IN_VAIN: u64 = 3 << 18;
const FOR_A_STEP: u64 = 40;
const FOR_A_WALK: u64 = 4;

/// The border is moved outward by this part of the diagonal, so that a curve that only touches it is
/// not cut by rounding.
const SLACK: f64 = 1e-9;

/// Why a walk ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum End {
    /// Where it began.
    Closed,
    /// At the border of the box.
    Border,
    /// Inside: the field is undefined beyond, or other branches were there before.
    Inside,
    /// Nowhere: too many steps, or too many evaluations for them.
    Limit,
    /// On a curve that was walked before.
    Old,
}

/// What was met on the way.
#[derive(Clone, Debug, Default)]
pub(crate) struct Events {
    /// Where branches cross.
    pub(crate) crossings: Vec<DVec3>,
    /// Corners and cusps.
    pub(crate) corners: Vec<DVec3>,
    /// Ends inside the box.
    pub(crate) ends: Vec<DVec3>,
    /// Steps of which it is not proven that both ends are on one branch.
    pub(crate) unproven: u64,
    /// Steps.
    pub(crate) steps: u64,
    /// Walks that had to be given up.
    pub(crate) unfinished: u64,
}

impl Events {
    /// The same, with the counts of steps and walks of later ones.
    pub(crate) fn with_work_of(self, later: &Events) -> Events {
        Events {
            unproven: later.unproven,
            steps: later.steps,
            unfinished: later.unfinished,
            ..self
        }
    }

    /// Whether the point is one of the singular ones, up to a distance.
    pub(crate) fn is_near(&self, point: DVec3, distance: f64) -> bool {
        let all = self.crossings.iter().chain(&self.corners);
        all.chain(&self.ends)
            .any(|known| known.distance(point) <= distance)
    }
}

/// Adds a point to a list that does not have it yet.
fn note(list: &mut Vec<DVec3>, point: DVec3, same: f64) {
    if list.iter().all(|known| known.distance(point) > same) {
        list.push(point);
    }
}

/// What walks need to know.
pub(crate) struct Walker<'a> {
    pub(crate) system: &'a System<'a>,
    pub(crate) bounds: Bounds,
    /// Given if all fields are compiled.
    pub(crate) compiled: Option<Vec<&'a CompiledField>>,
}

/// A step that was accepted, and how long the next one should be.
struct Taken {
    step: Step,
    to: Place,
    next: f64,
    proven: bool,
}

impl Walker<'_> {
    /// Whether much more was evaluated than proven steps account for: the search then ends where it
    /// is, because the curve is singular all along, or finer than can be followed.
    pub(crate) fn is_exhausted(&self, events: &Events) -> bool {
        self.in_vain(events) > self.allowed()
    }

    fn allowed(&self) -> u64 {
        IN_VAIN * (self.system.dimension as u64).saturating_sub(1)
    }

    /// Evaluations that no proven step accounts for.
    fn in_vain(&self, events: &Events) -> u64 {
        let proven = events.steps.saturating_sub(events.unproven);
        self.system.counts().0.saturating_sub(FOR_A_STEP * proven)
    }

    /// Whether a point lies in the box or on its border.
    pub(crate) fn is_inside(&self, point: DVec3) -> bool {
        let mut slack = DVec3::splat(SLACK * self.system.diagonal);
        if self.system.dimension == 2 {
            slack.z = 0.0;
        }
        let inside = Bounds {
            min: self.bounds.min - slack,
            max: self.bounds.max + slack,
            ..self.bounds
        };
        inside.contains(point)
    }

    /// Walks from a place in the direction of its tangent. `is_old` tells of points on curves that
    /// were walked before.
    pub(crate) fn walk(
        &self,
        start: &Place,
        is_old: &dyn Fn(DVec3) -> bool,
        events: &mut Events,
    ) -> (Vec<Step>, End) {
        let diagonal = self.system.diagonal;
        let mut steps: Vec<Step> = Vec::new();
        let mut here = *start;
        let mut wanted = FIRST * diagonal;
        let most = self.in_vain(events) + self.allowed() / FOR_A_WALK;
        while steps.len() < STEP_LIMIT && self.in_vain(events) <= most {
            let Some(taken) = self.advance(&here, wanted) else {
                match self.leap(&here, &steps, is_old, events) {
                    Some((over, to)) => {
                        wanted = to.position.distance(here.position);
                        here = to;
                        steps.extend(over);
                        continue;
                    }
                    None => return self.dead_end(start, &here, steps),
                }
            };
            if let Some(last) = self.closing(start, &here, &taken.step, steps.len()) {
                steps.extend(last);
                return (steps, End::Closed);
            }
            if let Some(last) = self.leaving(&here, &taken.step) {
                steps.extend(last);
                return (steps, End::Border);
            }
            let crossing = match taken.to.sign != here.sign {
                true => Some(self.crossing(&taken.step, here.sign)),
                false if taken.proven => None,
                false => self.even_crossing(&taken.step),
            };
            if let Some(crossing) = crossing {
                note(&mut events.crossings, crossing, 1e-6 * diagonal);
            }
            // A start near a singular point is not known exactly, and may have been on an old curve.
            if taken.proven && is_old(taken.to.position) {
                return (steps, End::Old);
            }
            events.unproven += u64::from(!taken.proven);
            events.steps += 1;
            wanted = taken.next;
            here = taken.to;
            steps.push(taken.step);
        }
        events.unfinished += 1;
        (steps, End::Limit)
    }

    /// The end of a walk that does not go on: closed if the start is what is behind the corner.
    fn dead_end(&self, start: &Place, here: &Place, mut steps: Vec<Step>) -> (Vec<Step>, End) {
        let apart = here.position.distance(start.position);
        let near = 8.0 * PROBE * SHORTEST * self.system.diagonal;
        if steps.len() < 3 || apart > near {
            return (steps, End::Inside);
        }
        if apart > 1e-12 * self.system.diagonal {
            steps.extend(straight_over(here, start));
        }
        (steps, End::Closed)
    }

    /// The longest step that is accepted, at most so long; `None` if none is.
    fn advance(&self, here: &Place, wanted: f64) -> Option<Taken> {
        let diagonal = self.system.diagonal;
        let mut length = wanted.min(LONGEST * diagonal);
        while length >= SHORTEST * diagonal {
            if let Some(taken) = self.attempt(here, length) {
                return Some(taken);
            }
            length *= 0.5;
        }
        None
    }

    /// A step of this length, if it is good.
    fn attempt(&self, here: &Place, length: f64) -> Option<Taken> {
        let system = self.system;
        let predicted = here.position + length * here.tangent;
        let reach = ACCEPTED[1] * length;
        let found = system.solve(predicted, Condition::Nearest, reach)?;
        let to = Place::along(found.position, found.local, here.tangent)?;
        let angle = here.tangent.cross(to.tangent).length();
        // Contraction means nothing where the prediction is good to a few digits already.
        let contraction = match found.first > 1e-6 * length {
            true => found.contraction,
            false => 0.0,
        };
        let cost = [contraction, found.first / length, angle];
        if cost.iter().zip(ACCEPTED).any(|(cost, most)| *cost > most)
            || length < PRECISION * found.noise
            || here.tangent.dot(to.tangent) <= 0.0
        {
            return None;
        }
        let step = Step::new(system, here, &to)?;
        let middle = 0.5 * (here.tangent + to.tangent);
        let asymmetry = middle.cross(step.direction).length();
        let turned = to.sign != here.sign;
        let symmetric = match turned {
            false => asymmetry <= LARGEST_ASYMMETRY,
            // Near a cusp, there is a jump to the other branch, which has the other direction. That
            // is seen by the chord, except on a scale at which crossings are looked for in vain.
            true => asymmetry <= 0.1 * angle + CURVED * length / system.diagonal,
        };
        if !symmetric {
            return None;
        }
        let short = length <= UNPROVEN * system.diagonal;
        let proven = !turned
            && match &self.compiled {
                Some(fields) => connects(system, fields, &step),
                None => false,
            };
        if !short && (turned || (!proven && self.compiled.is_some())) {
            return None;
        }
        let slowing = (contraction / WANTED[0])
            .sqrt()
            .max((cost[1] / WANTED[1]).sqrt())
            .max(angle / WANTED[2]);
        Some(Taken {
            next: length / slowing.clamp(0.5, 2.0),
            step,
            to,
            proven,
        })
    }

    /// The last step, if this one passes the start; none where it would be too short.
    fn closing(
        &self,
        start: &Place,
        here: &Place,
        step: &Step,
        before: usize,
    ) -> Option<Option<Step>> {
        if before < 2 {
            return None;
        }
        let part = step.part_of(self.system, start.position)?;
        if step.direction.dot(start.tangent) < 0.5 || part <= 0.0 {
            return None;
        }
        Some(self.shorter(here, start))
    }

    /// The step between two places, unless they are the same.
    fn shorter(&self, from: &Place, to: &Place) -> Option<Step> {
        let apart = from.position.distance(to.position);
        if apart <= 1e-12 * self.system.diagonal {
            return None;
        }
        let straight = || Step::straight(from.position, to.position);
        Some(Step::new(self.system, from, to).unwrap_or_else(straight))
    }

    /// The last step, up to the border of the box, if this one leaves it; none where it would be
    /// too short.
    fn leaving(&self, here: &Place, step: &Step) -> Option<Option<Step>> {
        let nodes = step.all_nodes();
        let out = nodes.iter().position(|&(_, node)| !self.is_inside(node))?;
        if out == 0 {
            return Some(None);
        }
        let (mut inside, mut outside) = (nodes[out - 1].0, nodes[out].0);
        let mut beyond = nodes[out].1;
        for _ in 0..40 {
            let middle = 0.5 * (inside + outside);
            match step.at(self.system, middle) {
                Some(place) if self.is_inside(place.position) => inside = middle,
                Some(place) => {
                    outside = middle;
                    beyond = place.position;
                }
                None => break,
            }
        }
        let Some(near) = step.at(self.system, inside) else {
            return Some(None);
        };
        let last = self.on_border(&near, beyond).unwrap_or(near);
        Some(self.shorter(here, &last))
    }

    /// The point near a place that lies on the side of the box which another point is beyond.
    fn on_border(&self, near: &Place, beyond: DVec3) -> Option<Place> {
        let (min, max) = (self.bounds.min, self.bounds.max);
        let over = (min - beyond).max(beyond - max);
        let axis = (0..self.system.dimension).max_by(|&i, &j| over[i].total_cmp(&over[j]))?;
        let mut through = near.position;
        through[axis] = through[axis].clamp(min[axis], max[axis]);
        if beyond[axis] > max[axis] {
            through[axis] = max[axis];
        } else if beyond[axis] < min[axis] {
            through[axis] = min[axis];
        }
        let normal = DVec3::AXES[axis];
        let reach = 1e-3 * self.system.diagonal;
        let found = self
            .system
            .solve(through, Condition::Plane(through, normal), reach)?;
        let mut place = Place::along(found.position, found.local, near.tangent)?;
        // What lies beyond by a rounding is put back.
        place.position = place.position.clamp(min, max);
        Some(place)
    }

    /// Where on a step the direction of the equations turns round, by bisection.
    fn crossing(&self, step: &Step, sign: f64) -> DVec3 {
        let (mut before, mut behind) = (0.0, 1.0);
        while (behind - before) * step.chord > 1e-9 * self.system.diagonal {
            let middle = 0.5 * (before + behind);
            match step.at(self.system, middle) {
                Some(place) if place.sign == sign => before = middle,
                Some(_) => behind = middle,
                // It is here: the tangent is gone.
                None => break,
            }
        }
        step.from.lerp(step.to, 0.5 * (before + behind))
    }

    /// Where on a step the tangent is gone although the equations have the same direction on both
    /// sides, as where three branches cross: the minimum of the gradients' product, if that is 0.
    fn even_crossing(&self, step: &Step) -> Option<DVec3> {
        let strengths = step.strengths;
        let inner = strengths[1].min(strengths[2]).min(strengths[3]);
        let ends = strengths[0].min(strengths[4]);
        if inner >= ends {
            return None;
        }
        let (mut low, mut high) = (0.0, 1.0);
        let mut least = inner;
        for _ in 0..60 {
            let third = (high - low) / 3.0;
            let at = |part| Some(step.at(self.system, part)?.local.strength);
            // Without a tangent, this is it.
            let (Some(one), Some(other)) = (at(low + third), at(high - third)) else {
                least = 0.0;
                break;
            };
            least = least.min(one).min(other);
            if one < other {
                high -= third;
            } else {
                low += third;
            }
        }
        (least < 1e-6 * ends).then(|| step.from.lerp(step.to, 0.5 * (low + high)))
    }

    /// The way on from where no step succeeds: straight to the point at which the straightest new
    /// branch leaves a small sphere.
    fn leap(
        &self,
        here: &Place,
        steps: &[Step],
        is_old: &dyn Fn(DVec3) -> bool,
        events: &mut Events,
    ) -> Option<(Vec<Step>, Place)> {
        let diagonal = self.system.diagonal;
        let centre = here.position;
        let mut radius = PROBE * SHORTEST * diagonal;
        let mut others: Vec<DVec3> = Vec::new();
        while others.is_empty() && radius <= LARGEST_PROBE * diagonal {
            radius *= 4.0;
            let arrival = self.arrival(centre, radius, steps);
            others = self.branches(centre, radius);
            others.retain(|branch| match arrival {
                Some(arrival) => branch.distance(arrival) > 10.0 * SAME_BRANCH * radius,
                None => (*branch - centre).dot(here.tangent) > 0.0,
            });
        }
        let list = match others.len() {
            0 => &mut events.ends,
            1 => &mut events.corners,
            _ => &mut events.crossings,
        };
        note(list, centre, 10.0 * radius);
        let is_new = |point: &DVec3| {
            self.is_inside(*point)
                && !is_old(*point)
                && !steps.iter().any(|step| step.passes(self.system, *point))
        };
        let ahead = |point: &DVec3| (*point - centre).dot(here.tangent);
        let best = others
            .into_iter()
            .filter(is_new)
            .max_by(|one, other| ahead(one).total_cmp(&ahead(other)))?;
        let local = self.system.local(best)?;
        let to = Place::along(best, local, best - centre)?;
        Some((straight_over(here, &to), to))
    }

    /// Where the walk entered the sphere.
    fn arrival(&self, centre: DVec3, radius: f64, steps: &[Step]) -> Option<DVec3> {
        let is_out = |point: DVec3| point.distance(centre) >= radius;
        let step = steps.iter().rev().find(|step| is_out(step.from))?;
        let (mut outside, mut inside) = (0.0, 1.0);
        for _ in 0..50 {
            let middle = 0.5 * (outside + inside);
            match is_out(step.at(self.system, middle)?.position) {
                true => outside = middle,
                false => inside = middle,
            }
        }
        Some(step.at(self.system, outside)?.position)
    }

    /// The points at which branches leave a sphere, in the order of the starts that found them.
    fn branches(&self, centre: DVec3, radius: f64) -> Vec<DVec3> {
        let plane = self.system.dimension == 2;
        let count = if plane { PROBES.0 } else { PROBES.1 };
        let mut found: Vec<DVec3> = Vec::new();
        for probe in 0..count {
            let part = (f64::from(probe) + 0.5) / f64::from(count);
            let direction = match plane {
                true => {
                    let angle = std::f64::consts::TAU * part;
                    DVec3::new(scalar::cos(angle), scalar::sin(angle), 0.0)
                }
                // A spiral of equal areas (Vogel).
                false => {
                    let z = 1.0 - 2.0 * part;
                    let angle = GOLDEN_ANGLE * f64::from(probe);
                    let ring = (1.0 - z * z).sqrt();
                    DVec3::new(ring * scalar::cos(angle), ring * scalar::sin(angle), z)
                }
            };
            let start = centre + radius * direction;
            let condition = Condition::Sphere(centre, radius);
            if let Some(branch) = self.system.solve(start, condition, 0.5 * radius)
                && branch.noise <= LARGEST_NOISE * radius
                && found
                    .iter()
                    .all(|known| known.distance(branch.position) > SAME_BRANCH * radius)
            {
                found.push(branch.position);
            }
        }
        found
    }
}

/// Straight steps from one place to another, over the corner between them if there is one.
fn straight_over(from: &Place, to: &Place) -> Vec<Step> {
    let mut over = vec![from.position];
    over.extend(meeting(from, to));
    over.push(to.position);
    let pairs = over.windows(2);
    pairs.map(|pair| Step::straight(pair[0], pair[1])).collect()
}

/// The corner in which the tangents at two places meet, the first ahead and the second behind; none
/// if they are nearly parallel, as at a cusp.
fn meeting(before: &Place, behind: &Place) -> Option<DVec3> {
    let (t, u) = (before.tangent, behind.tangent);
    let apart = behind.position - before.position;
    let cosine = t.dot(u);
    let squared_sine = 1.0 - cosine * cosine;
    if squared_sine < 0.01 {
        return None;
    }
    // Where the lines are nearest: apart = s t + r u, up to what is normal to both.
    let ahead = (apart.dot(t) - cosine * apart.dot(u)) / squared_sine;
    let back = (apart.dot(u) - cosine * apart.dot(t)) / squared_sine;
    let corner = before.position + ahead * t;
    let tiny = 1e-3 * apart.length();
    (ahead > tiny && back > tiny && ahead.max(back) < 10.0 * apart.length()).then_some(corner)
}
