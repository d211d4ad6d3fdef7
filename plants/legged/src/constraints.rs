//! Formulations of the constraints of a plant.

/// Formulation of stops, cables and ground contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Constraints {
    /// Complementarity: impacts, and forces that satisfy the constraints exactly.
    #[default]
    Rigid,
    /// One-sided springs with dampers, and friction by bristles: a smooth system, integrated by a
    /// Runge–Kutta method with error control.
    Compliant,
}

impl Constraints {
    /// All formulations.
    pub const ALL: [Self; 2] = [Self::Rigid, Self::Compliant];

    /// Returns the name used in scenarios.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rigid => "rigid",
            Self::Compliant => "compliant",
        }
    }
}
