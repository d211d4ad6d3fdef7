//! Elimination of the links from the equations of the trunk.
//!
//! A leg sees three components of the motion of the trunk, those in its plane: forward and up, of
//! the point of the trunk that lies in the plane beside its centre of mass, and pitch. With a, the
//! acceleration in these components, and H θ̈ + C a = τ, the links are eliminated from the last to
//! the first, H = Lᵀ D L, and add to the equations M a = f of the plane
//!
//! ```text
//! M ← M − Σ c cᵀ/d     f ← f − Σ c τ/d
//! ```
//!
//! A hip whose servo imposes its acceleration α is not eliminated: it adds −Hα and −Cα to the
//! right-hand sides.

use twinrig_compliant::lanes::Lanes;

/// Components of the motion in the plane of a leg: forward, up, pitch.
pub(crate) const PLANE: usize = 3;

/// Entries of a symmetric matrix of these components, row by row up to the diagonal.
pub(crate) const ENTRIES: usize = 6;

/// Equations of the links of a leg: H θ̈ + C a = τ.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LinkEquations<L, const N: usize> {
    /// H, of which the entries on and below the diagonal are used.
    pub(crate) inertia: [[L; N]; N],
    /// C, by link.
    pub(crate) columns: [[L; PLANE]; N],
    /// τ.
    pub(crate) torques: [L; N],
}

/// Contribution of a leg to the equations of its plane: M and f.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlaneShare<L> {
    pub(crate) matrix: [L; ENTRIES],
    pub(crate) force: [L; PLANE],
}

impl<L: Lanes, const N: usize> LinkEquations<L, N> {
    /// Moves the imposed acceleration of the first link to the right-hand sides.
    #[inline(always)]
    pub(crate) fn impose<const FREE: bool>(&mut self, acceleration: L, share: &mut PlaneShare<L>) {
        for i in 1..N {
            self.torques[i] -= self.inertia[i][0] * acceleration;
        }
        if FREE {
            for (force, column) in share.force.iter_mut().zip(self.columns[0]) {
                *force -= column * acceleration;
            }
        }
    }

    /// Returns the torque on the first link beyond that in its equation.
    #[inline(always)]
    pub(crate) fn first_torque<const FREE: bool>(
        &self,
        accelerations: &[L; N],
        plane: &[L; PLANE],
    ) -> L {
        let mut torque = self.inertia[0][0] * accelerations[0] - self.torques[0];
        for j in 1..N {
            torque += self.inertia[j][0] * accelerations[j];
        }
        if FREE {
            for a in 0..PLANE {
                torque += self.columns[0][a] * plane[a];
            }
        }
        torque
    }

    /// Eliminates the links from `FIRST` on.
    #[inline(always)]
    pub(crate) fn eliminate<const FIRST: usize, const FREE: bool>(
        mut self,
        share: &mut PlaneShare<L>,
    ) -> Eliminated<L, N> {
        let mut inverses = self.torques;
        for k in (FIRST..N).rev() {
            let inverse = self.inertia[k][k].reciprocal();
            inverses[k] = inverse;
            if FREE {
                let mut scaled = self.columns[k];
                for entry in &mut scaled {
                    *entry = *entry * inverse;
                }
                let mut entry = 0;
                for a in 0..PLANE {
                    for b in 0..=a {
                        share.matrix[entry] -= scaled[a] * self.columns[k][b];
                        entry += 1;
                    }
                    share.force[a] -= scaled[a] * self.torques[k];
                }
            }
            for i in FIRST..k {
                let factor = self.inertia[k][i] * inverse;
                for j in FIRST..=i {
                    let upper = self.inertia[k][j];
                    self.inertia[i][j] -= factor * upper;
                }
                if FREE {
                    for a in 0..PLANE {
                        let column = self.columns[k][a];
                        self.columns[i][a] -= factor * column;
                    }
                }
                let torque = self.torques[k];
                self.torques[i] -= factor * torque;
            }
        }
        Eliminated {
            equations: self,
            inverses,
        }
    }
}

/// Factors of the eliminated links.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Eliminated<L, const N: usize> {
    equations: LinkEquations<L, N>,
    inverses: [L; N],
}

impl<L: Lanes, const N: usize> Eliminated<L, N> {
    /// Returns the accelerations of the links from `FIRST` on, for the acceleration of the plane;
    /// those before keep the values of `imposed`.
    #[inline(always)]
    pub(crate) fn accelerations<const FIRST: usize, const FREE: bool>(
        &self,
        plane: &[L; PLANE],
        imposed: [L; N],
    ) -> [L; N] {
        let (equations, mut accelerations) = (&self.equations, imposed);
        for k in FIRST..N {
            let mut torque = equations.torques[k];
            if FREE {
                for a in 0..PLANE {
                    torque -= equations.columns[k][a] * plane[a];
                }
            }
            for i in FIRST..k {
                torque -= equations.inertia[k][i] * accelerations[i];
            }
            accelerations[k] = torque * self.inverses[k];
        }
        accelerations
    }
}
