//! Trunk, contact points and ground.

use nalgebra::Vector3;
use twinrig_contact::{Ground, Terrain};
use twinrig_robot::GRAVITY;

use crate::frame::{Rotation, cross, rotation};
use crate::friction::{Approach, Sole};
use crate::lanes::{LANES, Lanes, Quad, Simd};

/// Motion of the trunk.
#[derive(Debug, Clone, Copy)]
pub struct TrunkMotion {
    /// Attitude.
    pub rotation: Rotation,
    /// Position, world frame \[m\].
    pub position: [f64; 3],
    /// Velocity, trunk axes \[m/s\].
    pub velocity: [f64; 3],
    /// Angular velocity, trunk axes \[rad/s\].
    pub turning: [f64; 3],
    /// g − ω × v, trunk axes \[m/s²\].
    pub field: [f64; 3],
}

impl TrunkMotion {
    /// Computes the motion from position, attitude as a quaternion, velocity and angular velocity,
    /// each in the lanes of one number.
    #[inline(always)]
    pub fn new<L: Lanes>([position, attitude, velocity, turning]: [L; 4]) -> Self {
        let rotation = rotation(attitude.quad().0);
        let (velocity, turning) = (velocity.quad().three(), turning.quad().three());
        let turned = cross(turning, velocity);
        Self {
            position: position.quad().three(),
            velocity,
            turning,
            field: [
                -GRAVITY * rotation[2][0] - turned[0],
                -GRAVITY * rotation[2][1] - turned[1],
                -GRAVITY * rotation[2][2] - turned[2],
            ],
            rotation,
        }
    }
}

/// Contact point in trunk axes.
#[derive(Debug, Clone, Copy)]
pub struct Point<L> {
    /// Position relative to that of the trunk \[m\].
    pub place: [L; 3],
    /// Velocity \[m/s\].
    pub velocity: [L; 3],
}

/// Ground at a contact point.
#[derive(Debug, Clone, Copy)]
pub struct Below<L> {
    /// Distance \[m\].
    pub gap: L,
    /// Gradient of the distance, and the two tangents, trunk axes.
    directions: [[L; 3]; 3],
    /// The same in the world frame; none where they are up, ahead and left.
    in_world: Option<[[L; 3]; 3]>,
}

/// Force of the ground on a contact point.
#[derive(Debug, Clone, Copy)]
pub struct Footforce<L> {
    /// Trunk axes \[N\].
    pub force: [L; 3],
    /// World frame \[N\].
    pub force_in_world: [L; 3],
    /// Rate of the bristle \[m/s\].
    pub bristle_rate: [L; 2],
    /// Dissipated power \[W\].
    pub dissipated: L,
    /// Depth of the sole \[m\].
    pub depth: L,
}

/// Returns a vector in all lanes.
#[inline(always)]
pub fn broadcast<L: Lanes>(like: L, [x, y, z]: [f64; 3]) -> [L; 3] {
    [like.like(x), like.like(y), like.like(z)]
}

#[inline(always)]
fn combine<L: Lanes>([n, a, b]: &[[L; 3]; 3], normal: L, [ahead, left]: [L; 2]) -> [L; 3] {
    [
        normal * n[0] + ahead * a[0] + left * b[0],
        normal * n[1] + ahead * a[1] + left * b[1],
        normal * n[2] + ahead * a[2] + left * b[2],
    ]
}

#[inline(always)]
fn dot<L: Lanes>(a: [L; 3], b: [L; 3]) -> L {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

impl<L: Lanes> Below<L> {
    /// Returns the ground at a contact point.
    #[inline(always)]
    pub fn new<S: Simd<Lanes = L>>(
        simd: S,
        ground: &Ground,
        trunk: &TrunkMotion,
        point: &Point<L>,
    ) -> Self {
        if matches!(ground.terrain, Terrain::Flat) {
            return Self::level(&trunk.rotation, simd.splat(trunk.position[2]), point);
        }
        if matches!(ground.terrain, Terrain::Levels(_))
            && let Some(below) = Self::on_levels(simd, ground, trunk, point)
        {
            return below;
        }
        Self::shaped(simd, ground, &trunk.rotation, trunk.position, point)
    }

    /// Returns level ground at height zero.
    #[inline(always)]
    fn level(rotation: &Rotation, height: L, point: &Point<L>) -> Self {
        let [ahead, left, up] = *rotation;
        let [x, y, z] = point.place;
        Self {
            gap: height + x * up[0] + y * up[1] + z * up[2],
            directions: [
                broadcast(height, up),
                broadcast(height, ahead),
                broadcast(height, left),
            ],
            in_world: None,
        }
    }

    /// Returns level ground of any heights; none where an edge is nearer to a point than its level.
    /// Of such points the bits are those of [`Self::shaped`].
    #[inline(always)]
    fn on_levels<S: Simd<Lanes = L>>(
        simd: S,
        ground: &Ground,
        trunk: &TrunkMotion,
        point: &Point<L>,
    ) -> Option<Self> {
        let ([x, y, z], ahead) = (point.place, trunk.rotation[0]);
        let along = simd.splat(trunk.position[0]) + x * ahead[0] + y * ahead[1] + z * ahead[2];
        let level = Self::level(&trunk.rotation, simd.splat(trunk.position[2]), point);
        let (along, above) = (along.quad().0, level.gap.quad().0);
        let mut heights = [0.0; LANES];
        for lane in 0..LANES {
            heights[lane] = ground.level_alone(along[lane], above[lane])?;
        }
        let gap = level.gap - simd.load(Quad(heights));
        Some(Self { gap, ..level })
    }

    /// Returns shaped ground.
    fn shaped<S: Simd<Lanes = L>>(
        simd: S,
        ground: &Ground,
        rotation: &Rotation,
        position: [f64; 3],
        point: &Point<L>,
    ) -> Self {
        let place = point.place.map(|x| x.quad().0);
        let (mut gap, mut directions) = ([0.0; LANES], [[[0.0; LANES]; 3]; 3]);
        let mut in_world = directions;
        for lane in 0..LANES {
            let local = place.map(|x| x[lane]);
            let world: [f64; 3] = std::array::from_fn(|i| {
                let row = rotation[i];
                position[i] + row[0] * local[0] + row[1] * local[1] + row[2] * local[2]
            });
            let (surface, gradient) = ground.nearest(&Vector3::from(world));
            gap[lane] = surface.gap;
            let [ahead, left] = surface.tangents();
            for (k, world) in [gradient, ahead, left].into_iter().enumerate() {
                for i in 0..3 {
                    in_world[k][i][lane] = world[i];
                    directions[k][i][lane] = rotation[0][i] * world.x
                        + rotation[1][i] * world.y
                        + rotation[2][i] * world.z;
                }
            }
        }
        let load = |rows: [[[f64; LANES]; 3]; 3]| rows.map(|row| row.map(|x| simd.load(Quad(x))));
        Self {
            gap: simd.load(Quad(gap)),
            directions: load(directions),
            in_world: Some(load(in_world)),
        }
    }

    /// Returns the rate of the distance of a point with this velocity.
    #[inline(always)]
    pub fn gap_rate(&self, velocity: [L; 3]) -> L {
        dot(self.directions[0], velocity)
    }

    /// Returns the force on a point.
    #[inline(always)]
    pub fn force(&self, sole: &Sole<L>, velocity: [L; 3], bristle: [L; 2]) -> Footforce<L> {
        let [_, along, across] = self.directions;
        let grip = sole.grip(&Approach {
            gap: self.gap,
            gap_rate: self.gap_rate(velocity),
            slip: [dot(along, velocity), dot(across, velocity)],
            bristle,
        });
        let [ahead, left] = grip.tangential;
        let force_in_world = match &self.in_world {
            None => [ahead, left, grip.normal],
            Some(directions) => combine(directions, grip.normal, grip.tangential),
        };
        Footforce {
            force: combine(&self.directions, grip.normal, grip.tangential),
            force_in_world,
            bristle_rate: grip.bristle_rate,
            dissipated: grip.dissipated,
            depth: -self.gap,
        }
    }
}
