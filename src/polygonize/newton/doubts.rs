//! What enclosures leave in doubt, examined by evaluations: what it seems to be, and the root that
//! is there to rounding.

use super::{Isolated, IsolatedRoot, Line, Part, Roots, sign};
use crate::graph::Interval;
use crate::polygonize::roots::{Reason, Undecided};

/// Doubts closer than this many floors of the width are one; those that were not looked at, than
/// this many of their widths.
const NEAR: f64 = 16.0;

/// Of a doubt with fewer numbers all are tried; of others some, and those around the best.
const TRIED: usize = 64;

/// Steps of the golden section, and the part that each leaves.
const SECTIONS: usize = 64;
const GOLDEN: f64 = 0.618_033_988_749_894_8;

/// How far beside a doubt F is compared with F at its ends, in floors of the width.
const BESIDE: f64 = 16.0;

/// Beside a pole, F has fallen to this part.
const FALLEN: f64 = 0.75;

/// A part of the interval that is not decided.
#[derive(Clone, Copy, Debug)]
pub(super) struct Doubt {
    low: f64,
    high: f64,
    signs: [i8; 2],
    continuous: bool,
    vanishes: bool,
    unfinished: bool,
    /// The root to rounding at an end of the interval.
    root: Option<f64>,
}

impl Doubt {
    /// A part at the floor of the width, or in which F cannot be told from 0.
    pub(super) fn of(part: &Part, continuous: bool) -> Doubt {
        Doubt {
            low: part.low,
            high: part.high,
            signs: part.signs,
            continuous,
            vanishes: false,
            unfinished: false,
            root: None,
        }
    }

    /// A part on which F is 0.
    pub(super) fn vanishing(part: &Part) -> Doubt {
        Doubt {
            vanishes: true,
            ..Doubt::of(part, true)
        }
    }

    /// A part that was not looked at.
    pub(super) fn unfinished(part: &Part) -> Doubt {
        Doubt {
            unfinished: true,
            ..Doubt::of(part, false)
        }
    }

    /// What Newton's operator leaves of a part at whose end the sign of F is not known.
    pub(super) fn at_end(part: &Part, side: Interval, root: f64) -> Doubt {
        Doubt {
            low: side.low,
            high: side.high,
            root: Some(root),
            ..Doubt::of(part, true)
        }
    }

    fn width(&self) -> f64 {
        self.high - self.low
    }
}

/// The roots and what is undecided, from what isolation came to.
pub(super) fn examine(line: &mut Line, isolated: Isolated) -> Roots {
    let Isolated { mut roots, doubts } = isolated;
    let mut undecided: Vec<Undecided> = Vec::new();
    for doubt in joined(line, doubts) {
        undecided.push(judge(line, &doubt));
    }
    // A root beside a doubt that has it too, as at an end that both share.
    undecided.retain(|doubt| match (doubt.reason, doubt.root) {
        (Reason::Touches | Reason::Multiple | Reason::End, Some(root)) => {
            !roots.iter().any(|own| own.proven && own.value == root)
        }
        _ => true,
    });
    for end in [line.side.0, line.side.1] {
        let near = BESIDE * line.floor(end, end);
        let known = roots.iter().map(|root| root.value);
        let known = known.chain(undecided.iter().filter_map(|doubt| doubt.root));
        let is_known = known.into_iter().any(|root| (root - end).abs() <= near);
        if !is_known && is_root_to_rounding(line, end) {
            undecided.push(Undecided {
                low: end,
                high: end,
                reason: Reason::End,
                root: Some(end),
            });
        }
    }
    roots.extend(undecided.iter().filter_map(|doubt| {
        doubt.root.map(|value| IsolatedRoot {
            value,
            enclosure: (doubt.low, doubt.high),
            proven: false,
        })
    }));
    roots.sort_by(|one, other| one.value.total_cmp(&other.value));
    roots.dedup_by(|one, other| one.value == other.value);
    undecided.sort_by(|one, other| one.low.total_cmp(&other.low));
    Roots { roots, undecided }
}

/// Neighbouring doubts as one, in their order.
fn joined(line: &Line, mut doubts: Vec<Doubt>) -> Vec<Doubt> {
    doubts.sort_by(|one, other| one.low.total_cmp(&other.low));
    let mut joined: Vec<Doubt> = Vec::new();
    for doubt in doubts {
        match joined.last_mut() {
            Some(last) if doubt.low - last.high <= reach(line, last, &doubt) => {
                last.high = last.high.max(doubt.high);
                last.signs[1] = doubt.signs[1];
                last.continuous &= doubt.continuous;
                last.vanishes |= doubt.vanishes;
                last.unfinished |= doubt.unfinished;
                last.root = last.root.or(doubt.root);
            }
            _ => joined.push(doubt),
        }
    }
    joined
}

/// How far apart two doubts may be that are one.
fn reach(line: &Line, one: &Doubt, other: &Doubt) -> f64 {
    if one.unfinished || other.unfinished {
        return NEAR * one.width().max(other.width());
    }
    let floor = NEAR * line.floor(one.low, other.high);
    floor.max(one.width()).max(other.width())
}

/// What a doubt seems to be.
fn judge(line: &mut Line, doubt: &Doubt) -> Undecided {
    let mut found = Undecided {
        low: doubt.low,
        high: doubt.high,
        reason: Reason::Unfinished,
        root: None,
    };
    if doubt.unfinished {
        found.root = change_of_sign(line, doubt);
        return found;
    }
    if doubt.vanishes {
        found.reason = Reason::Vanishes;
        return found;
    }
    if !doubt.continuous {
        (found.reason, found.root) = at_break(line, doubt);
        return found;
    }
    let [first, last] = doubt.signs;
    let changes = first * last < 0;
    let at_end = doubt.low == line.side.0 || doubt.high == line.side.1;
    found.reason = match (changes, at_end) {
        (true, _) => Reason::Multiple,
        (false, true) => Reason::End,
        (false, false) => Reason::Touches,
    };
    let best = doubt.root.unwrap_or_else(|| smallest(line, doubt));
    let level = line.enclose_points(&[best])[0];
    // Where F surely is not 0 at the best point, a change of sign still means a root.
    if changes || sign(&level) == 0 {
        found.root = Some(best);
    }
    found
}

/// Where F changes its sign between ends at which it has different ones, unless it is larger there
/// than at the ends, as at a pole.
fn change_of_sign(line: &mut Line, doubt: &Doubt) -> Option<f64> {
    let (mut low, mut high) = (doubt.low, doubt.high);
    let ends = line.values(&[low, high]);
    let changes = (ends[0] < 0.0) != (ends[1] < 0.0) && ends.iter().all(|end| end.is_finite());
    if !changes {
        return None;
    }
    loop {
        let middle = low.midpoint(high);
        if middle == low || middle == high {
            let level = line.values(&[middle])[0].abs();
            return (level <= 0.5 * ends[0].abs().min(ends[1].abs())).then_some(middle);
        }
        match (line.values(&[middle])[0] < 0.0) == (ends[0] < 0.0) {
            true => low = middle,
            false => high = middle,
        }
    }
}

/// Where |F| is smallest in a doubt.
fn smallest(line: &mut Line, doubt: &Doubt) -> f64 {
    let (mut low, mut high) = (doubt.low, doubt.high);
    for _ in 0..SECTIONS {
        let places = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)];
        let values = line.values(&places);
        // Of equal ones, as where F is 0 to rounding, both outer parts are left out.
        if values[0].abs() <= values[1].abs() {
            high = places[1];
        }
        if values[0].abs() >= values[1].abs() {
            low = places[0];
        }
        if high - low <= line.floor(low, high) {
            break;
        }
    }
    let middle = low.midpoint(high);
    let mut places = vec![middle, doubt.low, doubt.high];
    let (mut below, mut above) = (middle, middle);
    while places.len() < TRIED {
        (below, above) = (below.next_down(), above.next_up());
        places.extend([below, above]);
    }
    // Between two numbers of opposite signs there may be 0, at which nobody would look.
    places.push(0.0);
    places.retain(|&place| doubt.low <= place && place <= doubt.high);
    let values = line.values(&places);
    let numbers = places
        .iter()
        .zip(&values)
        .filter(|(_, value)| !value.is_nan());
    let best = numbers.min_by(|one, other| one.1.abs().total_cmp(&other.1.abs()));
    best.map_or(middle, |(place, _)| *place)
}

/// What a doubt is in which F may jump or is not defined everywhere, and the root that is there.
fn at_break(line: &mut Line, doubt: &Doubt) -> (Reason, Option<f64>) {
    let beside = BESIDE * line.floor(doubt.low, doubt.high).max(doubt.width());
    let (start, end) = line.side;
    let places = [
        (doubt.low - beside).max(start),
        doubt.low,
        doubt.high,
        (doubt.high + beside).min(end),
    ];
    let values = line.values(&places);
    let levels = [0, 1, 2, 3].map(|place| values[place].abs());
    let grows = |inner: usize, outer: usize| levels[outer] <= FALLEN * levels[inner];
    let defined = [values[0].is_finite(), values[3].is_finite()];
    if defined != [true, true] {
        let root = match defined {
            [true, false] => at_end_of_domain(line, places[0], places[3]),
            [false, true] => at_end_of_domain(line, places[3], places[0]),
            _ => None,
        };
        return (Reason::Undefined, root);
    }
    if grows(1, 0) || grows(2, 3) || !levels[1].is_finite() || !levels[2].is_finite() {
        return (Reason::Pole, None);
    }
    // Where F comes to 0 although it may jump, as at a kink of a function with cases.
    let best = smallest(line, doubt);
    let here = line.values(&[best])[0];
    let falls = here.abs() <= 0.5 * levels[0].min(levels[3]);
    if here == 0.0 || falls {
        return (Reason::Jump, Some(best));
    }
    let mut inner = vec![doubt.low, doubt.low.midpoint(doubt.high), doubt.high, 0.0];
    inner.retain(|&place| doubt.low <= place && place <= doubt.high);
    match line.values(&inner).iter().all(|value| value.is_finite()) {
        true => (Reason::Jump, None),
        false => (Reason::Undefined, None),
    }
}

/// The last number at which F is defined, between one where it is and one where it is not, if F is
/// 0 there to rounding: |F| / |F'| is, and |F| falls towards it.
fn at_end_of_domain(line: &mut Line, defined: f64, undefined: f64) -> Option<f64> {
    let (mut inside, mut outside) = (defined, undefined);
    loop {
        let middle = inside.midpoint(outside);
        if middle == inside || middle == outside {
            break;
        }
        match line.values(&[middle])[0].is_finite() {
            true => inside = middle,
            false => outside = middle,
        }
    }
    let (value, slope) = line.at(inside);
    let further = line.values(&[defined])[0];
    let rounding = BESIDE * line.floor(inside, inside);
    let small = value == 0.0 || (value / slope).abs() <= rounding;
    (small && value.abs() <= 0.5 * further.abs()).then_some(inside)
}

/// Whether an end of the interval is a root that may be beyond it by rounding.
fn is_root_to_rounding(line: &mut Line, end: f64) -> bool {
    let (value, slope) = line.at(end);
    let unit = end.abs() * f64::EPSILON;
    let middle = line.side.0.midpoint(line.side.1);
    let further = end + (middle - end).signum() * (BESIDE * unit).max(f64::MIN_POSITIVE);
    let beside = line.values(&[further])[0];
    let residual = (value / slope).abs();
    residual <= unit && value.abs() < beside.abs()
}
