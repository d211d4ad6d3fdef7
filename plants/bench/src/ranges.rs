//! Accepted values of a bench that fits on a table, but not what a slip of a unit makes of it.

use twinrig_document::Range;

/// Radius of cam or roller \[m\].
pub(crate) const RADIUS: Range = Range::between(1e-4, 1.0);
/// Lift of the cam \[m\].
pub(crate) const LIFT: Range = Range::between(0.0, 0.5);
/// Compression of the springs; negative: a gap \[m\].
pub(crate) const PRELOAD: Range = Range::between(-0.05, 0.05);
/// Inertia of the cam \[kg·m²\].
pub(crate) const INERTIA: Range = Range::between(1e-10, 10.0);
/// Friction of the cam's shaft \[N·m·s/rad\].
pub(crate) const SHAFT_FRICTION: Range = Range::between(0.0, 100.0);
/// Mass of the carriage \[kg\].
pub(crate) const MASS: Range = Range::between(1e-4, 100.0);
/// Friction of the carriage \[N·s/m\].
pub(crate) const FRICTION: Range = Range::between(0.0, 1e5);
/// Stiffness of the springs \[N/m\].
pub(crate) const STIFFNESS: Range = Range::between(1e-2, 1e8);
/// Range of the reference cell \[N\].
pub(crate) const FORCE: Range = Range::between(1e-3, 1e6);
/// Depth of a scratch \[m\].
pub(crate) const DEPTH: Range = Range::between(0.0, 1e-4);
/// Width of a scratch \[rad\]: narrower ones would fall between the points of the table of the
/// cam.
pub(crate) const WIDTH: Range = Range::between(0.08, 1.0);
