//! Units of MuJoCo's quantities, if the model defines them.

use mujoco_rs::prelude::{MjModel, MjtBias, MjtDyn, MjtGain, MjtJoint, MjtSensor, MjtTrn};
use twinrig_kernel::Unit;

/// Units of a coordinate, its rate, its acceleration, and its generalised force.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CoordinateUnits {
    pub(crate) position: Unit,
    pub(crate) rate: Unit,
    pub(crate) acceleration: Unit,
    pub(crate) force: Unit,
}

const ROTATIONAL: CoordinateUnits = CoordinateUnits {
    position: Unit::Radian,
    rate: Unit::RadianPerSecond,
    acceleration: Unit::RadianPerSecondSquared,
    force: Unit::NewtonMeter,
};

const TRANSLATIONAL: CoordinateUnits = CoordinateUnits {
    position: Unit::Meter,
    rate: Unit::MeterPerSecond,
    acceleration: Unit::MeterPerSecondSquared,
    force: Unit::Newton,
};

/// Returns the units of a joint of one or three degrees of freedom; none for a free joint, whose
/// coordinates have different units.
pub(crate) fn of_joint(model: &MjModel, joint: usize) -> Option<CoordinateUnits> {
    match model.jnt_type().get(joint)? {
        MjtJoint::mjJNT_HINGE | MjtJoint::mjJNT_BALL => Some(ROTATIONAL),
        MjtJoint::mjJNT_SLIDE => Some(TRANSLATIONAL),
        MjtJoint::mjJNT_FREE => None,
    }
}

/// Returns the units of an actuator's coordinate; none if the model does not define them.
pub(crate) fn of_actuator(model: &MjModel, actuator: usize) -> Option<CoordinateUnits> {
    let joints = [MjtTrn::mjTRN_JOINT, MjtTrn::mjTRN_JOINTINPARENT];
    if !joints.contains(model.actuator_trntype().get(actuator)?) {
        return None;
    }
    of_joint(
        model,
        usize::try_from(model.actuator_trnid()[actuator][0]).ok()?,
    )
}

/// Quantity of an actuator's control.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Control {
    Position,
    Rate,
    Force,
    Other,
}

/// Returns the quantity of an actuator's control as far as its parameters show: a gain with a bias
/// of the same size is a servo, a gain of one without a bias is the force itself.
pub(crate) fn control(model: &MjModel, actuator: usize) -> Control {
    let (gain, bias) = (
        model.actuator_gainprm()[actuator],
        model.actuator_biasprm()[actuator],
    );
    let servo = model.actuator_gaintype()[actuator] == MjtGain::mjGAIN_FIXED
        && model.actuator_biastype()[actuator] == MjtBias::mjBIAS_AFFINE
        && gain[0] != 0.0;
    let integrated = model.actuator_dyntype()[actuator] == MjtDyn::mjDYN_INTEGRATOR;
    let direct = [
        MjtDyn::mjDYN_NONE,
        MjtDyn::mjDYN_FILTER,
        MjtDyn::mjDYN_FILTEREXACT,
    ]
    .contains(&model.actuator_dyntype()[actuator]);
    if servo && bias[1] == -gain[0] {
        return match (direct, integrated) {
            (true, _) => Control::Position,
            (_, true) => Control::Rate,
            _ => Control::Other,
        };
    }
    if servo && direct && bias[1] == 0.0 && bias[2] == -gain[0] {
        return Control::Rate;
    }
    let plain = model.actuator_gaintype()[actuator] == MjtGain::mjGAIN_FIXED
        && model.actuator_biastype()[actuator] == MjtBias::mjBIAS_NONE;
    if plain && direct && gain[0] == 1.0 {
        return Control::Force;
    }
    Control::Other
}

/// Returns the unit of an actuator's control; none if the model does not define it.
pub(crate) fn of_control(model: &MjModel, actuator: usize) -> Option<Unit> {
    let units = of_actuator(model, actuator)?;
    match control(model, actuator) {
        Control::Position => Some(units.position),
        Control::Rate => Some(units.rate),
        Control::Force => Some(units.force),
        Control::Other => None,
    }
}

/// Returns the unit of a sensor; none if the model does not define it.
pub(crate) fn of_sensor(model: &MjModel, sensor: usize) -> Option<Unit> {
    use MjtSensor as S;
    let object = || usize::try_from(model.sensor_objid()[sensor]).ok();
    let joint = |unit: fn(CoordinateUnits) -> Unit| of_joint(model, object()?).map(unit);
    let actuator = |unit: fn(CoordinateUnits) -> Unit| of_actuator(model, object()?).map(unit);
    match model.sensor_type().get(sensor)? {
        S::mjSENS_TOUCH | S::mjSENS_FORCE => Some(Unit::Newton),
        S::mjSENS_TORQUE => Some(Unit::NewtonMeter),
        S::mjSENS_ACCELEROMETER | S::mjSENS_FRAMELINACC => Some(Unit::MeterPerSecondSquared),
        S::mjSENS_VELOCIMETER | S::mjSENS_FRAMELINVEL | S::mjSENS_SUBTREELINVEL => {
            Some(Unit::MeterPerSecond)
        }
        S::mjSENS_GYRO | S::mjSENS_FRAMEANGVEL | S::mjSENS_BALLANGVEL => {
            Some(Unit::RadianPerSecond)
        }
        S::mjSENS_FRAMEANGACC => Some(Unit::RadianPerSecondSquared),
        S::mjSENS_RANGEFINDER
        | S::mjSENS_FRAMEPOS
        | S::mjSENS_SUBTREECOM
        | S::mjSENS_GEOMDIST
        | S::mjSENS_GEOMFROMTO => Some(Unit::Meter),
        S::mjSENS_BALLQUAT
        | S::mjSENS_FRAMEQUAT
        | S::mjSENS_FRAMEXAXIS
        | S::mjSENS_FRAMEYAXIS
        | S::mjSENS_FRAMEZAXIS
        | S::mjSENS_GEOMNORMAL
        | S::mjSENS_INSIDESITE => Some(Unit::One),
        S::mjSENS_JOINTPOS | S::mjSENS_JOINTLIMITPOS => joint(|units| units.position),
        S::mjSENS_JOINTVEL | S::mjSENS_JOINTLIMITVEL => joint(|units| units.rate),
        S::mjSENS_JOINTACTFRC | S::mjSENS_JOINTLIMITFRC => joint(|units| units.force),
        S::mjSENS_ACTUATORPOS => actuator(|units| units.position),
        S::mjSENS_ACTUATORVEL => actuator(|units| units.rate),
        S::mjSENS_ACTUATORFRC => actuator(|units| units.force),
        S::mjSENS_E_POTENTIAL | S::mjSENS_E_KINETIC => Some(Unit::Joule),
        S::mjSENS_CLOCK => Some(Unit::Second),
        _ => None,
    }
}
