//! Accepted values of a robot: every robot from 10 g to 1 t, but not what a slip of a unit or of an
//! exponent makes of it.

use std::f64::consts::PI;
use std::ops::Bound;

use twinrig_document::Range;

/// Mass of a trunk or a segment \[kg\].
pub(crate) const MASS: Range = Range::between(1e-6, 1e4);
/// Moment of inertia of a trunk, a rotor or a servo \[kg·m²\].
pub(crate) const INERTIA: Range = Range::between(1e-12, 1e4);
/// Length of a segment or of the trunk, radius of a pulley \[m\].
pub(crate) const LENGTH: Range = Range::between(1e-4, 10.0);
/// Travel of a spring, depth of a compliant contact \[m\].
pub(crate) const DEFLECTION: Range = Range::between(1e-7, 1.0);
/// Preload of a spring, as a deformation \[m\].
pub(crate) const PRELOAD: Range = Range::between(-10.0, 10.0);
/// Coordinates of a hip in the trunk frame \[m\].
pub(crate) const PLACE: Range = Range::between(-10.0, 10.0);
/// Stiffness of a spring or a contact \[N/m\].
pub(crate) const STIFFNESS: Range = Range::between(1e-3, 1e10);
/// Stiffness of a toe \[N·m/rad\].
pub(crate) const TORSIONAL_STIFFNESS: Range = Range::between(1e-6, 1e6);
/// Damping of a contact \[N·s/m\].
pub(crate) const DAMPING: Range = Range::between(0.0, 1e8);
/// Viscous friction of a joint \[N·m·s/rad\].
pub(crate) const JOINT_FRICTION: Range = Range::between(0.0, 1e3);
/// Greatest torque of a servo \[N·m\].
pub(crate) const TORQUE: Range = Range::between(1e-6, 1e5);
/// Greatest speed of a servo \[rad/s\].
pub(crate) const SPEED: Range = Range::between(1e-3, 1e5);
/// Lag of a servo \[s\].
pub(crate) const LAG: Range = Range::between(1e-6, 60.0);
/// Half-width of the ignored error of a servo \[rad\].
pub(crate) const DEAD_BAND: Range = Range::between(0.0, PI);
/// Angle of the knee of a stretched leg \[rad\].
pub(crate) const KNEE: Range = Range {
    min: Bound::Excluded(0.0),
    max: Bound::Excluded(PI),
};
/// Greatest angle of abduction \[rad\].
pub(crate) const ABDUCTION: Range = Range::between(0.0, PI / 2.0);
/// Angle of an unloaded foot \[rad\].
pub(crate) const REST: Range = Range::between(-PI, PI);
/// Coulomb coefficient \[1\].
pub(crate) const FRICTION: Range = Range::between(0.0, 100.0);
/// Resistance of a winding \[Ω\].
pub(crate) const RESISTANCE: Range = Range::between(1e-6, 1e6);
/// Torque per current \[N·m/A\].
pub(crate) const TORQUE_CONSTANT: Range = Range::between(1e-6, 1e3);
/// Gear ratio \[1\].
pub(crate) const GEAR: Range = Range::between(1e-3, 1e5);
/// Supply voltage \[V\].
pub(crate) const VOLTAGE: Range = Range::between(1e-3, 1e5);
