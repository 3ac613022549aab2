//! Points at equal distances along curves.

use glam::DVec3;

use crate::continuation::{Component, Place, System};
use crate::sample::{Options, SampleError, refuse_too_fine};

/// Points on a curve without `count` and `spacing`.
const DEFAULT_COUNT: u64 = 500;

/// How many points each component gets. They are equally far apart along each: on a closed one
/// there are as many distances as points, on an open one, with points at both ends, one less.
///
/// With a spacing, the nearest number whose distances fill the component; with a count, numbers in
/// proportion to the lengths with that sum, but at least one for each.
pub(super) fn counts(components: &[Component], options: &Options) -> Result<Vec<u64>, SampleError> {
    let lengths = components.iter().map(|component| component.length);
    let total: f64 = lengths.sum();
    if let Some(spacing) = options.spacing {
        let wanted = total / spacing;
        refuse_too_fine(spacing, wanted, options.count_limit)?;
        let number = |component: &Component| {
            let gaps = (component.length / spacing).round().max(1.0) as u64;
            gaps + u64::from(!component.closed)
        };
        return Ok(components.iter().map(number).collect());
    }
    let count = options.count.unwrap_or(DEFAULT_COUNT);
    let open = components.iter().filter(|component| !component.closed);
    let gaps = count.saturating_sub(open.count() as u64) as f64;
    let mut counts: Vec<u64> = components
        .iter()
        .map(|component| {
            let gaps = (gaps * component.length / total).floor() as u64;
            (gaps + u64::from(!component.closed)).max(1)
        })
        .collect();
    let mut sum: u64 = counts.iter().sum();
    let spacing = |place: usize, count: u64| gap(&components[place], count);
    while sum < count {
        let widest = (0..counts.len()).max_by(|&one, &other| {
            spacing(one, counts[one]).total_cmp(&spacing(other, counts[other]))
        });
        let Some(widest) = widest else { break };
        counts[widest] += 1;
        sum += 1;
    }
    while sum > count {
        let narrowest =
            (0..counts.len())
                .filter(|&place| counts[place] > 1)
                .min_by(|&one, &other| {
                    spacing(one, counts[one] - 1).total_cmp(&spacing(other, counts[other] - 1))
                });
        let Some(narrowest) = narrowest else { break };
        counts[narrowest] -= 1;
        sum -= 1;
    }
    Ok(counts)
}

/// The distance along a component between so many points.
fn gap(component: &Component, count: u64) -> f64 {
    let gaps = if component.closed { count } else { count - 1 };
    component.length / (gaps as f64).max(0.5)
}

/// So many points on a component, in its order.
pub(super) fn places(system: &System, component: &Component, count: u64) -> Vec<Place> {
    let mut places = Vec::with_capacity(count as usize);
    let mut steps = component.steps.iter();
    let mut step = steps.next();
    let mut passed = 0.0;
    for number in 0..count {
        let part = match (component.closed, count) {
            (true, _) => number as f64 / count as f64,
            (false, 1) => 0.5,
            (false, _) => number as f64 / (count - 1) as f64,
        };
        let wanted = part * component.length;
        while let Some(present) = step
            && passed + present.length < wanted
            && !steps.as_slice().is_empty()
        {
            passed += present.length;
            step = steps.next();
        }
        let Some(present) = step else { break };
        let part = present.part_at_length(wanted - passed);
        let found = present.at(system, part).or_else(|| {
            // At a singular point there is no tangent to solve by; an end is close.
            let ends: [DVec3; 2] = [present.from, present.to];
            let end = ends[usize::from(part > 0.5)];
            Place::along(end, system.local(end)?, present.direction)
        });
        places.extend(found);
    }
    places
}
