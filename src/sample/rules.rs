//! The parameters of Witkin and Heckbert's floaters.

/// The paper's table of parameters (section 6), with its values as the default.
///
/// They rule adaptive repulsion, birth and death. β is taken in units of 1/σ, which makes the method
/// independent of the unit of length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rules {
    /// Δt: the time step.
    pub time_step: f64,
    /// φ: the feedback that keeps floaters on the surface (equation 5).
    pub phi: f64,
    /// ρ: the feedback that keeps them energized (equation 10).
    pub rho: f64,
    /// α: the amplitude of repulsion.
    pub alpha: f64,
    /// Ê / α: the desired energy. `None`: that of the ideal pattern, in which the nearest
    /// neighbours are 2 σ away, 6 e⁻² ≈ 0.8 on a surface and 2 e⁻² on a curve.
    pub energy: Option<f64>,
    /// β σ: keeps the radius of a floater without neighbours from running away (equation 12).
    pub beta: f64,
    /// γ: the speed, in radii a unit of time, below which a floater is near equilibrium.
    pub gamma: f64,
    /// ν: the part of Ê above which a floater is adequately energized and may split.
    pub nu: f64,
    /// δ: the part of σ̂ below which a floater may die.
    pub delta: f64,
    /// σ̂: the desired radius. `None`: 0.6 of the spacing. Only where the paper's method is
    /// followed to the end.
    pub sigma: Option<f64>,
    /// σ^max: the radius above which a floater splits, however it is. `None`: half the diameter, or
    /// 1.5 σ̂ if that is more; with a start from many floaters 1.5 σ̂.
    pub sigma_max: Option<f64>,
}

impl Default for Rules {
    fn default() -> Self {
        Rules {
            time_step: 0.03,
            phi: 15.0,
            rho: 15.0,
            alpha: 6.0,
            energy: None,
            beta: 10.0,
            gamma: 4.0,
            nu: 0.2,
            delta: 0.7,
            sigma: None,
            sigma_max: None,
        }
    }
}

impl Rules {
    /// The parameters by their names, those that have no value left out.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, f64)> {
        let always = [
            ("time_step", self.time_step),
            ("phi", self.phi),
            ("rho", self.rho),
            ("alpha", self.alpha),
            ("beta", self.beta),
            ("gamma", self.gamma),
            ("nu", self.nu),
            ("delta", self.delta),
        ];
        let optional = [
            ("energy", self.energy),
            ("sigma", self.sigma),
            ("sigma_max", self.sigma_max),
        ];
        let given = optional
            .into_iter()
            .filter_map(|(name, value)| Some((name, value?)));
        always.into_iter().chain(given)
    }

    /// The parameter of a name.
    pub fn get_mut(&mut self, name: &str) -> Option<&mut f64> {
        Some(match name {
            "time_step" => &mut self.time_step,
            "phi" => &mut self.phi,
            "rho" => &mut self.rho,
            "alpha" => &mut self.alpha,
            "beta" => &mut self.beta,
            "gamma" => &mut self.gamma,
            "nu" => &mut self.nu,
            "delta" => &mut self.delta,
            "energy" => self.energy.get_or_insert(0.0),
            "sigma" => self.sigma.get_or_insert(0.0),
            "sigma_max" => self.sigma_max.get_or_insert(0.0),
            _ => return None,
        })
    }

    /// The names of all parameters.
    pub const NAMES: [&'static str; 11] = [
        "sigma",
        "sigma_max",
        "time_step",
        "phi",
        "rho",
        "alpha",
        "energy",
        "beta",
        "gamma",
        "nu",
        "delta",
    ];
}
