//! What entries say of distances: exact, exact outside, or a bound.
//!
//! Where |F_x| <= 1 everywhere, |F(p)| is at most the distance of p from the zero set; where also
//! F(p - F(p) F_x(p)) = 0, there is a zero at the distance |F(p)|. Together that is exactness,
//! without knowing the shape.

use imp::library::entries;

use super::points;
use super::{assert_none, failures, printed, promise};

/// A field at a point.
pub(crate) struct Probe {
    pub(crate) point: Vec<f64>,
    /// F, and F at the foot p - F F_x.
    pub(crate) values: [f64; 2],
    pub(crate) gradient: Vec<f64>,
    /// Whether the point was chosen because it may be singular.
    pub(crate) special: bool,
}

fn list(points: &[Vec<f64>]) -> String {
    format!("{points:?}")
}

fn number(value: &serde_json::Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

/// The values and gradients of a shape at test points.
pub(crate) fn probe(shape: &str) -> Result<Vec<Probe>, String> {
    let mut points = [2, 3].map(|dimension| {
        let random = points::random(dimension, 250);
        let special = points::special(dimension);
        let ways = points::ways(dimension).concat();
        (random.len(), [random, special, ways].concat())
    });
    let text = format!(
        "let f = {shape}\n\
         let g = grad(f)\n\
         print(dimension(f))\n\
         for p in (if dimension(f) == 2 then {} else {}) {{\n\
             print(json([f(p), f(p - f(p)*g(p)), g(p)]))\n\
         }}\n",
        list(&points[0].1),
        list(&points[1].1),
    );
    let lines = printed(&text).map_err(|error| format!("{shape}: {error}"))?;
    let flat = lines[0] == "2";
    let (random, points) = std::mem::take(&mut points[usize::from(!flat)]);
    assert_eq!(lines.len(), points.len() + 1, "{shape}");
    let probes = points.into_iter().zip(&lines[1..]).enumerate();
    Ok(probes
        .map(|(index, (point, line))| {
            let values: serde_json::Value = serde_json::from_str(line).unwrap();
            Probe {
                point,
                values: [number(&values[0]), number(&values[1])],
                gradient: values[2].as_array().unwrap().iter().map(number).collect(),
                special: index >= random,
            }
        })
        .collect())
}

#[derive(Clone, Copy, PartialEq)]
enum Claim {
    Exact,
    ExactOutside,
    Bound,
}

fn claims() -> Vec<(String, Claim)> {
    let mut all = Vec::new();
    for entry in entries() {
        let promise = promise(entry);
        let lists = [
            (promise.exact, Claim::Exact),
            (promise.exact_outside, Claim::ExactOutside),
            (promise.bound, Claim::Bound),
        ];
        for (shapes, claim) in lists {
            all.extend(shapes.into_iter().map(|shape| (shape, claim)));
        }
    }
    all
}

fn length(vector: impl IntoIterator<Item = f64>) -> f64 {
    vector
        .into_iter()
        .map(|part| part * part)
        .sum::<f64>()
        .sqrt()
}

fn check((shape, claim): &(String, Claim)) -> Result<(), String> {
    let probes = probe(shape)?;
    let regular: Vec<&Probe> = probes.iter().filter(|probe| !probe.special).collect();
    for probe in &probes {
        if !probe.values[0].is_finite() {
            return Err(format!(
                "{shape} is {} at {:?}",
                probe.values[0], probe.point
            ));
        }
    }
    for probe in &regular {
        let slope = length(probe.gradient.iter().copied());
        let [value, foot] = probe.values;
        let exact = match claim {
            Claim::Exact => true,
            Claim::ExactOutside => value > 0.0,
            Claim::Bound => false,
        };
        let wrong = if exact {
            (slope - 1.0).abs() > 1e-6
        } else {
            slope.is_nan() || slope > 1.0 + 1e-6
        };
        if wrong {
            return Err(format!(
                "{shape}: |F_x| = {slope}, F = {value} at {:?}",
                probe.point
            ));
        }
        if exact && foot.abs() > 1e-6 {
            let point = &probe.point;
            return Err(format!(
                "{shape}: F = {value}, but {foot} at the foot of {point:?}"
            ));
        }
    }
    for pair in probes.windows(2) {
        let way = length(pair[0].point.iter().zip(&pair[1].point).map(|(a, b)| a - b));
        let change = (pair[0].values[0] - pair[1].values[0]).abs();
        if change > way * (1.0 + 1e-9) + 1e-9 {
            let (a, b) = (&pair[0].point, &pair[1].point);
            return Err(format!(
                "{shape} changes by {change} from {a:?} to {b:?}, {way} away"
            ));
        }
    }
    Ok(())
}

/// The tests can fail: a wrong claim is found.
#[test]
fn wrong_claims_are_found() {
    let wrong = [
        ("ellipsoid([1.3, 0.7, 0.9])", Claim::Exact),
        ("sphere(1) | sphere(1, center = [1, 0, 0])", Claim::Exact),
        ("2*sphere(1)", Claim::Bound),
        ("repeat(sphere(1, center = [0.3, 0, 0]), 1)", Claim::Bound),
        ("sphere(1)^2", Claim::Bound),
    ];
    for (shape, claim) in wrong {
        assert!(check(&(shape.to_string(), claim)).is_err(), "{shape}");
    }
    let outside = (
        "sphere(1) | sphere(1, center = [1, 0, 0])".to_string(),
        Claim::ExactOutside,
    );
    assert_eq!(check(&outside), Ok(()));
}

#[test]
fn distances_are_what_they_say() {
    let claims = claims();
    assert!(claims.len() > 100, "only {} claims", claims.len());
    assert_none(&failures(&claims, check));
}
