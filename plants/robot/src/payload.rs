//! Payloads of a trunk.

/// A point mass that is fixed to the trunk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointMass {
    /// \[kg\]
    pub mass: f64,
    /// Place in trunk axes, from the trunk's centre of mass \[m\].
    pub at: [f64; 3],
}

/// Moments of all payloads of a trunk, in trunk axes, about the trunk's centre of mass.
///
/// Trunk and payloads are one rigid body. Its position remains that of the centre of mass of the
/// trunk alone, the point from which hips and payloads are measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Payload {
    /// Σ m \[kg\].
    pub mass: f64,
    /// Σ m r \[kg·m\].
    pub moment: [f64; 3],
    /// Σ m x², m y², m z², m x y, m x z and m y z \[kg·m²\].
    pub spread: [f64; 6],
}

impl Payload {
    /// Sums point masses; none without mass.
    pub fn of(payloads: &[PointMass]) -> Option<Self> {
        let mut sum = Self {
            mass: 0.0,
            moment: [0.0; 3],
            spread: [0.0; 6],
        };
        for PointMass { mass, at } in payloads {
            let [x, y, z] = *at;
            let squares = [x * x, y * y, z * z, x * y, x * z, y * z];
            sum.mass += mass;
            sum.moment
                .iter_mut()
                .zip(at)
                .for_each(|(s, r)| *s += mass * r);
            let spread = sum.spread.iter_mut().zip(&squares);
            spread.for_each(|(s, square)| *s += mass * square);
        }
        (sum.mass > 0.0).then_some(sum)
    }

    /// Returns the inertia about the trunk's centre of mass \[kg·m²\].
    pub fn inertia(&self) -> [[f64; 3]; 3] {
        let [xx, yy, zz, xy, xz, yz] = self.spread;
        [
            [yy + zz, -xy, -xz],
            [-xy, xx + zz, -yz],
            [-xz, -yz, xx + yy],
        ]
    }
}
