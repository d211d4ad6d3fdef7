//! Rotations between trunk and world.

use crate::model::real::Real;

/// Rotation from trunk to world.
pub(crate) type Rotation<T> = [[T; 3]; 3];

/// Returns the rotation of a quaternion of any length other than zero.
#[inline(always)]
pub(crate) fn rotation<T: Real>([w, x, y, z]: [T; 4]) -> Rotation<T> {
    let one = T::splat(1.0);
    let two = T::splat(2.0) / (w * w + x * x + y * y + z * z);
    let (wx, wy, wz) = (two * w * x, two * w * y, two * w * z);
    let (xx, yy, zz) = (two * x * x, two * y * y, two * z * z);
    let (xy, xz, yz) = (two * x * y, two * x * z, two * y * z);
    [
        [one - (yy + zz), xy - wz, xz + wy],
        [xy + wz, one - (xx + zz), yz - wx],
        [xz - wy, yz + wx, one - (xx + yy)],
    ]
}

/// Returns the rotation of trunk axes parallel to world axes.
#[inline(always)]
pub(crate) fn identity<T: Real>() -> Rotation<T> {
    let (zero, one) = (T::zero(), T::splat(1.0));
    [[one, zero, zero], [zero, one, zero], [zero, zero, one]]
}

/// Returns the rate of an attitude at this angular velocity \[rad/s\], trunk axes.
#[inline(always)]
pub(crate) fn quaternion_rate<T: Real>([w, x, y, z]: [T; 4], turning: [T; 3]) -> [T; 4] {
    let half = T::splat(0.5);
    let [p, q, r] = turning.map(|rate| half * rate);
    [
        -(x * p + y * q + z * r),
        w * p + y * r - z * q,
        w * q + z * p - x * r,
        w * r + x * q - y * p,
    ]
}

/// Transforms a vector from world to trunk axes.
#[inline(always)]
pub(crate) fn into_trunk<T: Real>(rotation: &Rotation<T>, world: [T; 3]) -> [T; 3] {
    std::array::from_fn(|i| {
        rotation[0][i] * world[0] + rotation[1][i] * world[1] + rotation[2][i] * world[2]
    })
}

/// Transforms a vector from trunk to world axes.
#[inline(always)]
pub(crate) fn into_world<T: Real>(rotation: &Rotation<T>, vector: [T; 3]) -> [T; 3] {
    rotation.map(|row| row[0] * vector[0] + row[1] * vector[1] + row[2] * vector[2])
}
