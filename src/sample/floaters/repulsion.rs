//! Repulsion between floaters: equations 9 to 13 of Witkin and Heckbert, "Using particles to
//! sample and control implicit surfaces".
//!
//! ```text
//! E^ij = α exp(-|r^ij|² / 2 (σ^i)²)                              r^ij = p^i - p^j
//! P^i  = Σ_j r^ij E^ij + (σ^i/σ^j)² r^ij E^ji                    (9)
//! D^i  = Σ_j E^ij                                                (with 10)
//! D^i_σ = Σ_j |r^ij|² E^ij / (σ^i)³                              (13)
//! σ̇^i  = -ρ (D^i - Ê) / (D^i_σ + β/σ^i)                          (10, 12)
//! ```
//!
//! Both terms of (9) repel, and i = j is left out of the sums. β is divided by σ, which makes
//! the method independent of the unit of length. Each pair counts with a weight between 0 and 1
//! that tells whether the two lie on the same sheet of the surface.

use std::ops::Range;

use glam::DVec3;

use super::neighbours::Neighbours;
use crate::math::scalar;
use crate::sample::Rules;

/// Floaters farther apart than so many radii do not see each other; E has fallen to α/1000.
/// In the ideal pattern the second nearest are at √12 and the third at 4 radii: the cut passes
/// between. (One at 3 would leave floaters trembling.)
pub(super) const CUTOFF: f64 = 3.75;

/// Floaters see about so many others.
const USUAL_NEIGHBOURS: usize = 16;

/// What repels: a place with its normal and its radius σ.
#[derive(Clone, Copy)]
pub(super) struct Source {
    pub(super) position: DVec3,
    pub(super) normal: DVec3,
    pub(super) radius: f64,
    /// Whether it is on a crease, where its normal is that of either side and tells nothing.
    pub(super) on_crease: bool,
}

/// What two floaters of different radii do to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pairing {
    /// Equation 9: the energies of both.
    Energies,
    /// As two on a curve whose radius is the mean σ of theirs, with a force that depends on
    /// |r|/σ alone: it is the same all along a curve on which neighbours are two radii apart, so
    /// that a spacing which changes from place to place is an equilibrium. By (9) the smaller one
    /// pushes harder.
    OnCurve,
    /// The same on a surface. There the force per length of a line across which floaters push has
    /// to be the same everywhere, and the line meets 1/σ of them: the force grows with σ.
    OnSurface,
}

impl Pairing {
    /// How much of a floater's own energy pushes it.
    fn part_of_own(self) -> f64 {
        match self {
            Pairing::Energies => 1.0,
            Pairing::OnCurve | Pairing::OnSurface => 0.0,
        }
    }

    /// The factor of the mutual energy where both radii are the same.
    fn factor_of_equals(self) -> f64 {
        2.0 - self.part_of_own()
    }

    /// -1/2σ² of the mutual energy of two radii, and its factor.
    fn mutual(self, own: f64, other: f64) -> (f64, f64) {
        let mean = 0.5 * (own + other);
        match self {
            Pairing::Energies => (-0.5 / (other * other), (own / other) * (own / other)),
            Pairing::OnCurve => (-0.5 / (mean * mean), 2.0 * own / mean),
            Pairing::OnSurface => (-0.5 / (mean * mean), 2.0),
        }
    }

    /// By which a spacing that varies is an equilibrium.
    pub(super) fn of_mean_radius(dimension: usize) -> Self {
        if dimension == 2 {
            Pairing::OnCurve
        } else {
            Pairing::OnSurface
        }
    }
}

/// What a floater feels.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Repulsion {
    /// P^i: the desired velocity.
    pub(super) velocity: DVec3,
    /// D^i / α: the repulsion energy that its own radius decides.
    pub(super) energy: f64,
    /// D^i_σ / α
    energy_slope: f64,
}

impl Repulsion {
    /// σ̇^i
    pub(super) fn radius_rate(&self, radius: f64, desired: f64, rules: &Rules) -> f64 {
        let change = -rules.rho * rules.alpha * (self.energy - desired);
        change / (rules.alpha * self.energy_slope + rules.beta / radius)
    }
}

/// What the sources of a range feel, in order; their neighbours are listed.
///
/// The exponentials of all pairs are taken in one call, which is vector code: that is where the
/// time goes.
pub(super) fn repulsions(
    sources: &[Source],
    range: Range<usize>,
    neighbours: &Neighbours,
    pairing: Pairing,
    (alpha, cutoff): (f64, f64),
) -> Vec<Repulsion> {
    let mut pairs = Pairs::for_floaters(range.len());
    let ends: Vec<usize> = range
        .clone()
        .map(|index| {
            let others = neighbours.of(index).iter();
            let others = others.map(|&other| &sources[other as usize]);
            pairs.meet(&sources[index], others, pairing, cutoff);
            pairs.seen.len()
        })
        .collect();
    pairs.evaluate();
    let mut start = 0;
    let felt = range.zip(ends).map(|(index, end)| {
        let felt = pairs.sum(start..end, sources[index].radius, pairing, alpha);
        start = end;
        felt
    });
    felt.collect()
}

/// Pairs of floaters that see each other.
#[derive(Default)]
struct Pairs {
    seen: Vec<Pair>,
    /// -|r|²/2σ² with the floater's own radius, and the exponential of it.
    own_exponents: Vec<f64>,
    own: Vec<f64>,
    /// The same with the radius that decides the push, and the factor of that. Empty if all radii
    /// are equal.
    mutual_exponents: Vec<f64>,
    mutual: Vec<f64>,
    factors: Vec<f64>,
    /// Whether two radii differ.
    differ: bool,
}

/// A pair.
struct Pair {
    /// r^ij
    offset: DVec3,
    /// |r^ij|²
    square: f64,
    /// How much they count as neighbours.
    weight: f64,
}

impl Pairs {
    /// Room for the pairs of so many floaters.
    fn for_floaters(number: usize) -> Pairs {
        Pairs {
            seen: Vec::with_capacity(USUAL_NEIGHBOURS * number),
            own_exponents: Vec::with_capacity(USUAL_NEIGHBOURS * number),
            ..Pairs::default()
        }
    }

    /// Adds the pairs of one floater.
    fn meet<'a>(
        &mut self,
        own: &Source,
        others: impl Iterator<Item = &'a Source>,
        pairing: Pairing,
        cutoff: f64,
    ) {
        let own_rate = -0.5 / (own.radius * own.radius);
        let own_reach = (cutoff * own.radius) * (cutoff * own.radius);
        for other in others {
            let offset = own.position - other.position;
            let square = offset.length_squared();
            let is_equal = own.radius == other.radius;
            let reach = if is_equal {
                own_reach
            } else {
                let longer = cutoff * own.radius.max(other.radius);
                longer * longer
            };
            if square > reach {
                continue;
            }
            let weight = if own.on_crease || other.on_crease {
                1.0
            } else {
                same_sheet(own.normal, other.normal, offset, square)
            };
            if weight == 0.0 {
                continue;
            }
            if !is_equal && !self.differ {
                self.differ = true;
                self.mutual_exponents.clone_from(&self.own_exponents);
                let equals = self.own_exponents.len();
                self.factors.resize(equals, pairing.factor_of_equals());
            }
            self.seen.push(Pair {
                offset,
                square,
                weight,
            });
            self.own_exponents.push(square * own_rate);
            if self.differ {
                let (rate, factor) = pairing.mutual(own.radius, other.radius);
                self.mutual_exponents.push(square * rate);
                self.factors.push(factor);
            }
        }
    }

    fn evaluate(&mut self) {
        self.own.resize(self.own_exponents.len(), 0.0);
        scalar::exp_of_each(&mut self.own, &self.own_exponents);
        self.mutual.resize(self.mutual_exponents.len(), 0.0);
        scalar::exp_of_each(&mut self.mutual, &self.mutual_exponents);
    }

    /// What a floater feels of its pairs.
    fn sum(&self, range: Range<usize>, radius: f64, pairing: Pairing, alpha: f64) -> Repulsion {
        let mut sum = Repulsion::default();
        let pairs = self.seen[range.clone()]
            .iter()
            .zip(&self.own[range.clone()]);
        for (place, (pair, own)) in range.zip(pairs) {
            let energy = pair.weight * own;
            let push = if self.differ {
                let mutual = self.factors[place] * pair.weight * self.mutual[place];
                pairing.part_of_own() * energy + mutual
            } else {
                2.0 * energy
            };
            sum.velocity += push * pair.offset;
            sum.energy += energy;
            sum.energy_slope += pair.square * energy;
        }
        sum.velocity *= alpha;
        sum.energy_slope /= radius * radius * radius;
        sum
    }
}

/// Ê / α: the energy in the ideal pattern, in which the nearest neighbours are 2 σ away: six of
/// them on a surface (the paper's .8), two on a curve.
pub(super) fn desired_energy(dimension: usize) -> f64 {
    let neighbours = if dimension == 2 { 2.0 } else { 6.0 };
    neighbours * scalar::exp(-2.0)
}

/// The density of floaters (per area or, on a curve, per length) that an energy D/α among
/// floaters of one radius means.
///
/// A sum of Gaussians of standard deviation σ over points is their density times the Gaussian's
/// integral. In the pattern with nearest neighbours at 2 σ this is 0.7 % too much (1.4 % on a
/// curve), the first terms of Poisson's summation formula, by which the sum is divided.
pub(super) fn density(dimension: usize, energy: f64, radius: f64) -> f64 {
    let with_itself = 1.0 + energy;
    if dimension == 2 {
        with_itself / (1.0139 * SQUARE_ROOT_OF_TAU * radius)
    } else {
        with_itself / (1.0072 * std::f64::consts::TAU * radius * radius)
    }
}

const SQUARE_ROOT_OF_TAU: f64 = 2.506_628_274_631_000_5;

/// How much two floaters count as neighbours on the surface: 1 if they plainly are, 0 if one
/// lies on the back of a thin sheet, or above the other.
///
/// Where two sheets are close their normals are opposite, because F changes its sign between.
/// The ramp is wide, so that no pair is switched on or off while the two move.
fn same_sheet(normal: DVec3, other: DVec3, offset: DVec3, square: f64) -> f64 {
    let cosine = normal.dot(other);
    let (above, below) = (offset.dot(normal), offset.dot(other));
    let aside = 0.5 * (above * above + below * below);
    if cosine >= 0.0 && aside <= 0.587 * square {
        // Most pairs: the same as below, without a division.
        return 1.0;
    }
    let facing = ((cosine + 0.5) * 2.0).clamp(0.0, 1.0);
    if facing == 0.0 {
        return 0.0;
    }
    // From 1 at 50 degrees above the tangent planes to 0 at 70.
    let level = ((0.883 * square - aside) / (0.296 * square)).clamp(0.0, 1.0);
    if square == 0.0 {
        facing
    } else {
        facing * level
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(x: f64, y: f64) -> Source {
        Source {
            position: DVec3::new(x, y, 0.0),
            normal: DVec3::Z,
            radius: 0.5,
            on_crease: false,
        }
    }

    /// What a source feels of others.
    fn felt_by(own: Source, others: impl Iterator<Item = Source>, pairing: Pairing) -> Repulsion {
        let sources: Vec<Source> = std::iter::once(own).chain(others).collect();
        let neighbours = Neighbours::of_first(sources.len());
        let alpha = Rules::default().alpha;
        repulsions(&sources, 0..1, &neighbours, pairing, (alpha, CUTOFF))[0]
    }

    /// The hexagonal lattice of spacing 1 around the origin, without the origin.
    fn lattice() -> impl Iterator<Item = Source> {
        (-6..=6)
            .flat_map(|i| (-6..=6).map(move |j| (f64::from(i), f64::from(j))))
            .filter(|&place| place != (0.0, 0.0))
            .map(|(i, j)| source(i + 0.5 * j, j * 0.75_f64.sqrt()))
    }

    #[test]
    fn the_lattice_is_in_equilibrium_and_its_density_is_known() {
        let felt = felt_by(source(0.0, 0.0), lattice(), Pairing::Energies);
        assert!(felt.velocity.length() < 1e-14);
        // Six at 2 σ, six at √12 σ.
        let expected = 6.0 * ((-2.0_f64).exp() + (-6.0_f64).exp());
        assert!((felt.energy - expected).abs() < 1e-12);
        let density = density(3, felt.energy, 0.5) * 0.75_f64.sqrt();
        assert!((density - 1.0).abs() < 1e-3, "{density}");
        let line = [-2.0, -1.0, 1.0, 2.0].map(|x| source(x, 0.0));
        let felt = felt_by(source(0.0, 0.0), line.into_iter(), Pairing::Energies);
        let density = super::density(2, felt.energy, 0.5);
        assert!((density - 1.0).abs() < 1e-3, "{density}");
    }

    #[test]
    fn the_velocity_is_minus_the_gradient_of_the_energy_times_the_square_of_the_radius() {
        // Equation 9, by central differences of E^i = Σ (E^ij + E^ji).
        let others = [source(0.6, 0.1), source(-0.2, 0.7), source(0.3, -0.5)];
        let others = others.map(|other| Source {
            radius: 0.3 + other.position.x.abs(),
            ..other
        });
        let energy = |p: DVec3| {
            let pair = |other: &Source| {
                let square = (p - other.position).length_squared();
                6.0 * ((-square / 0.5).exp()
                    + (-square / (2.0 * other.radius * other.radius)).exp())
            };
            others.iter().map(pair).sum::<f64>()
        };
        let felt = felt_by(source(0.0, 0.0), others.into_iter(), Pairing::Energies);
        for axis in [DVec3::X, DVec3::Y] {
            let h = 1e-5;
            let slope = (energy(h * axis) - energy(-h * axis)) / (2.0 * h);
            assert!((felt.velocity.dot(axis) + 0.25 * slope).abs() < 1e-8);
        }
    }

    #[test]
    fn a_graded_line_is_in_equilibrium() {
        let at = |x: f64, radius: f64| Source {
            radius,
            ..source(x, 0.0)
        };
        let others = || [at(-0.95, 0.45), at(1.05, 0.55)].into_iter();
        let felt = felt_by(at(0.0, 0.5), others(), Pairing::OnCurve);
        assert!(felt.velocity.length() < 1e-15);
        let felt = felt_by(at(0.0, 0.5), others(), Pairing::Energies);
        assert!(felt.velocity.x > 0.1);
    }

    #[test]
    fn a_graded_lattice_is_in_equilibrium() {
        // The image of the lattice under the conformal map w = exp(k z) / k, scaled by |dw/dz|.
        let k = 0.05;
        let image = |point: Source| {
            let (growth, turn) = ((k * point.position.x).exp(), k * point.position.y);
            let position = DVec3::new(growth * turn.cos() - 1.0, growth * turn.sin(), 0.0) / k;
            Source {
                position,
                radius: 0.5 * growth,
                ..point
            }
        };
        let felt = |pairing| felt_by(image(source(0.0, 0.0)), lattice().map(image), pairing);
        let push = 2.0 * Rules::default().alpha * (-2.0_f64).exp();
        let rest = felt(Pairing::OnSurface).velocity.length();
        assert!(rest < 0.2 * k * push, "{rest}");
        assert!(felt(Pairing::Energies).velocity.length() > 5.0 * rest);
    }

    #[test]
    fn the_back_of_a_sheet_and_what_lies_above_do_not_repel() {
        let back = Source {
            normal: -DVec3::Z,
            ..source(0.3, 0.0)
        };
        let above = Source {
            position: 0.3 * DVec3::Z,
            ..source(0.0, 0.0)
        };
        let felt = felt_by(
            source(0.0, 0.0),
            [back, above].into_iter(),
            Pairing::Energies,
        );
        assert_eq!(felt.velocity, DVec3::ZERO);
        assert_eq!(felt.energy, 0.0);
    }

    #[test]
    fn a_lonely_radius_grows_and_a_crowded_one_shrinks_in_any_unit() {
        let rules = Rules::default();
        let lonely = Repulsion::default();
        let rate = lonely.radius_rate(0.5, desired_energy(3), &rules);
        assert!(rate > 0.0);
        assert_eq!(
            lonely.radius_rate(512.0, desired_energy(3), &rules),
            1024.0 * rate
        );
        let crowd = lattice().map(|other| Source {
            position: 0.5 * other.position,
            ..other
        });
        let crowded = felt_by(source(0.0, 0.0), crowd, Pairing::Energies);
        assert!(crowded.radius_rate(0.5, desired_energy(3), &rules) < 0.0);
    }
}
