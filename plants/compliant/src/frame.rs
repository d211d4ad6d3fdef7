//! Rotations and vectors of the trunk, which all lanes share.

/// Rotation from trunk to world.
pub type Rotation = [[f64; 3]; 3];

/// Returns the rotation of a quaternion w, x, y, z of any length other than zero.
#[inline(always)]
pub fn rotation([w, x, y, z]: [f64; 4]) -> Rotation {
    let two = 2.0 / (w * w + x * x + y * y + z * z);
    let (tx, ty, tz) = (two * x, two * y, two * z);
    let (wx, wy, wz) = (w * tx, w * ty, w * tz);
    let (xx, yy, zz) = (x * tx, y * ty, z * tz);
    let (xy, xz, yz) = (x * ty, x * tz, y * tz);
    [
        [1.0 - (yy + zz), xy - wz, xz + wy],
        [xy + wz, 1.0 - (xx + zz), yz - wx],
        [xz - wy, yz + wx, 1.0 - (xx + yy)],
    ]
}

/// Returns the rate of a quaternion under an angular velocity in trunk axes \[rad/s\].
#[inline(always)]
pub fn quaternion_rate([w, x, y, z]: [f64; 4], [p, q, r]: [f64; 3]) -> [f64; 4] {
    let (p, q, r) = (0.5 * p, 0.5 * q, 0.5 * r);
    [
        -(x * p + y * q + z * r),
        w * p + y * r - z * q,
        w * q + z * p - x * r,
        w * r + x * q - y * p,
    ]
}

/// Transforms a vector from trunk to world axes.
#[inline(always)]
pub fn into_world(rotation: &Rotation, v: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = rotation;
    [
        x[0] * v[0] + x[1] * v[1] + x[2] * v[2],
        y[0] * v[0] + y[1] * v[1] + y[2] * v[2],
        z[0] * v[0] + z[1] * v[1] + z[2] * v[2],
    ]
}

/// Transforms a vector from world to trunk axes.
#[inline(always)]
pub fn into_trunk(rotation: &Rotation, v: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = rotation;
    [
        x[0] * v[0] + y[0] * v[1] + z[0] * v[2],
        x[1] * v[0] + y[1] * v[1] + z[1] * v[2],
        x[2] * v[0] + y[2] * v[1] + z[2] * v[2],
    ]
}

/// Returns the vector product.
#[inline(always)]
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
