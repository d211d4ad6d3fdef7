//! Parameters of a robot, in SI units.

use twinrig_document::declaration::{Accepts, Optional, Shape, Type, quantity, record};
use twinrig_document::{Item, Reported, Table};
use twinrig_kernel::Unit;

use crate::payload::{Payload, PointMass};
use crate::ranges;
use crate::serial::SerialServo;
use crate::triangle::third_side;

/// Gravitational acceleration of all plants, and in quantities relative to a weight \[m/s²\].
pub const GRAVITY: f64 = 9.81;

/// A quadruped: trunk, legs and actuators.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// Name of the robot, as in the file.
    pub name: String,
    /// The trunk.
    pub trunk: Trunk,
    /// The legs, in the order of the file.
    pub legs: Vec<LegMount>,
    /// Hip and knee drives.
    pub actuators: Actuators,
    /// Motors of the hip and knee drives, if known.
    pub motors: Option<Motors>,
    /// Serial servos of hip and knee, if known.
    pub serial: Option<SerialServo>,
    /// Coulomb coefficient between foot and ground, which a scenario may override \[1\].
    pub friction: f64,
    /// Contact of trunk, knees and ankles with the ground, if known.
    pub contact: Option<Contact>,
}

impl Robot {
    /// Total mass of trunk, payloads and legs \[kg\].
    pub fn mass(&self) -> f64 {
        let legs: f64 = self.legs.iter().map(|mount| mount.leg.mass.total()).sum();
        let bare = self.trunk.mass + legs;
        self.trunk.payload().map_or(bare, |load| bare + load.mass)
    }

    /// Weight \[N\].
    pub fn weight(&self) -> f64 {
        GRAVITY * self.mass()
    }

    /// Returns the load of a leg with all legs on the ground and the feet below the hips, from the
    /// balance of moments about the centre of mass of the trunk \[N\]. Legs at the same end share
    /// its load equally; without legs at both ends all legs do.
    pub fn standing_load(&self, mount: &LegMount) -> f64 {
        let end = |fore: bool| {
            let places = self.legs.iter().map(|mount| mount.hip[0]);
            places.filter(move |x| (*x > 0.0) == fore)
        };
        let mean = |fore: bool| end(fore).sum::<f64>() / end(fore).count() as f64;
        let (fore, hind) = (mean(true), mean(false));
        let total = self.weight();
        if fore.is_nan() || hind.is_nan() {
            return total / self.legs.len() as f64;
        }
        let is_fore = mount.hip[0] > 0.0;
        let arm = if is_fore { -hind } else { fore };
        total * arm / (fore - hind) / end(is_fore).count() as f64
    }
}

record! {
    /// Trunk: the body that carries the legs.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Trunk = "[trunk]" {
        /// Mass without the legs \[kg\].
        pub mass: f64 = quantity(Unit::Kilogram, ranges::MASS),
        /// Principal moments of inertia about the centre of mass, body axes x, y, z \[kg·m²\].
        pub inertia: [f64; 3] = Type::new(
            Shape::list(&Shape::One(Accepts::Quantity {
                unit: Unit::KilogramSquareMeter, range: ranges::INERTIA,
            }), 3),
            inertia,
        ),
        /// Length, width and height of the box about the centre of mass, for display and contact
        /// \[m\].
        pub size: [f64; 3] = Type::new(
            Shape::list(&Shape::One(Accepts::Quantity {
                unit: Unit::Meter, range: ranges::LENGTH,
            }), 3),
            three,
        ),
    } and {
        /// Payloads, of a scenario; a robot file has none.
        pub payloads: Vec<PointMass>,
    }
}

impl Trunk {
    /// Returns the corners of the box, relative to the centre of mass \[m\]: fore before hind,
    /// left before right, the lower four before the upper ones.
    pub fn corners(&self) -> [[f64; 3]; 8] {
        let [length, width, height] = self.size.map(|size| 0.5 * size);
        let level = |z: f64| {
            [
                (length, width),
                (length, -width),
                (-length, width),
                (-length, -width),
            ]
            .map(|(x, y)| [x, y, z])
        };
        let [[a, b, c, d], [e, f, g, h]] = [-height, height].map(level);
        [a, b, c, d, e, f, g, h]
    }

    /// Returns all payloads as one; none without mass.
    pub fn payload(&self) -> Option<Payload> {
        Payload::of(&self.payloads)
    }
}

/// A leg and the position of its hip.
#[derive(Debug, Clone, PartialEq)]
pub struct LegMount {
    /// Name; `LF`, `RF`, `LH` or `RH` for the robots of this repository.
    pub name: String,
    /// Hip joint in the trunk frame: origin at the centre of mass, x forward, y left, z up \[m\].
    pub hip: [f64; 3],
    /// Name of the leg's table below `leg` in the robot file.
    pub kind: String,
    /// Parameters of the leg.
    pub leg: Leg,
}

/// Axis of abduction of a mounted leg; angles are positive to the left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AbductionAxis {
    /// Position in the trunk frame, left and up \[m\].
    pub place: [f64; 2],
    /// Least and greatest angle \[rad\].
    pub range: [f64; 2],
    /// Viscous friction \[N·m·s/rad\].
    pub friction: f64,
}

impl LegMount {
    /// Returns the axis of abduction, if the leg has such a joint.
    pub fn abduction_axis(&self) -> Option<AbductionAxis> {
        let joint = self.leg.abduction?;
        let [_, y, z] = self.hip;
        let (inward, range) = if y < 0.0 {
            (joint.offset, [-joint.abduction_max, joint.adduction_max])
        } else {
            (-joint.offset, [-joint.adduction_max, joint.abduction_max])
        };
        Some(AbductionAxis {
            place: [y + inward, z + joint.height],
            range,
            friction: joint.friction,
        })
    }
}

record! {
    /// The spring-loaded pantograph leg (thesis, section 2.1.1 and appendix A).
    #[derive(Debug, Clone, PartialEq)]
    pub struct Leg = "[leg.NAME]", checked by check_geometry {
        /// Length of the proximal segment, hip to knee \[m\].
        pub l1: f64 = quantity(Unit::Meter, ranges::LENGTH),
        /// Length of the middle segment, knee to ankle \[m\].
        pub l2: f64 = quantity(Unit::Meter, ranges::LENGTH),
        /// Length of the distal segment, parallel-spring end to foot \[m\].
        pub l3: f64 = quantity(Unit::Meter, ranges::LENGTH),
        /// Offset of the pantograph on the first and third segment \[m\].
        pub l_delta: f64 = quantity(Unit::Meter, ranges::LENGTH),
        /// Knee angle between the first two segments in the fully extended leg \[rad\]; positive.
        pub q2_ref: f64 = quantity(Unit::Radian, ranges::KNEE),
        /// Spring along the pantograph's diagonal; it extends the leg.
        pub diagonal: Spring = Spring::TYPE,
        /// Spring along the pantograph's parallel rod; it keeps the pantograph closed.
        pub parallel: Spring = Spring::TYPE,
        /// Greatest opening of the parallel rod beyond `l2` \[m\].
        pub parallel_travel: f64 = quantity(Unit::Meter, ranges::DEFLECTION),
        /// Shortest length of the diagonal, where the leg bottoms out \[m\].
        pub diagonal_min: f64 = quantity(Unit::Meter, ranges::LENGTH),
        /// Viscous friction of the joints.
        pub joint_friction: JointFriction = JointFriction::TYPE,
        /// Masses of the segments.
        pub mass: LegMass = LegMass::TYPE,
        /// Radius of the pulley that winds the knee cable \[m\].
        pub pulley_radius: f64 = quantity(Unit::Meter, ranges::LENGTH),
        /// Foot segment beyond the toe joint, if the robot has one.
        pub toe: Option<Toe> = Optional(Toe::TYPE),
        /// Joint of abduction between trunk and hip, if the robot has one.
        pub abduction: Option<Abduction> = Optional(Abduction::TYPE),
        /// Compliance of stops, cable and sole, if known; rigid constraints do not need it.
        pub compliance: Option<Compliance> = Optional(Compliance::TYPE),
    }
}

record! {
    /// Joint of hip abduction: the plane of the leg turns about an axis along the trunk.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Abduction = "abduction" {
        /// Distance of the axis from the hip towards the middle of the trunk \[m\].
        pub offset: f64 = quantity(Unit::Meter, ranges::PLACE),
        /// Height of the axis above the hip \[m\].
        pub height: f64 = quantity(Unit::Meter, ranges::PLACE),
        /// Greatest angle outwards \[rad\].
        pub abduction_max: f64 = quantity(Unit::Radian, ranges::ABDUCTION),
        /// Greatest angle inwards \[rad\].
        pub adduction_max: f64 = quantity(Unit::Radian, ranges::ABDUCTION),
        /// Viscous friction \[N·m·s/rad\].
        pub friction: f64 = quantity(Unit::NewtonMeterSecondPerRadian, ranges::JOINT_FRICTION),
    }
}

record! {
    /// Compliance of the constraints of a leg.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Compliance = "compliance" {
        /// Stops of the diagonal and of the parallel rod.
        pub stops: OneSided = OneSided::TYPE,
        /// Knee cable.
        pub cable: OneSided = OneSided::TYPE,
        /// Sole, along the normal of the ground.
        pub sole: OneSided = OneSided::TYPE,
        /// Deflection of the sole along the ground at the limit of friction \[m\].
        pub slip_deflection: f64 = quantity(Unit::Meter, ranges::DEFLECTION),
    }
}

impl Compliance {
    /// Returns the same with stiffness and damping of all elements scaled.
    #[must_use]
    pub fn scaled(self, stiffness: f64, damping: f64) -> Self {
        let scale = |side: OneSided| OneSided {
            stiffness: stiffness * side.stiffness,
            damping: damping * side.damping,
            ..side
        };
        Self {
            stops: scale(self.stops),
            cable: scale(self.cable),
            sole: scale(self.sole),
            ..self
        }
    }
}

record! {
    /// Spring with a damper that only pushes.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct OneSided = "one-sided" {
        /// Stiffness beyond the toe region \[N/m\].
        pub stiffness: f64 = quantity(Unit::NewtonPerMeter, ranges::STIFFNESS),
        /// Damping beyond the toe region \[N·s/m\].
        pub damping: f64 = quantity(Unit::NewtonSecondPerMeter, ranges::DAMPING),
        /// Depth over which stiffness and damping grow from zero \[m\].
        pub toe_region: f64 = quantity(Unit::Meter, ranges::DEFLECTION),
    }
}

record! {
    /// Contact of the corners of the trunk's box, of knees and of ankles with the ground.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Contact = "[contact]" {
        /// Stiffness along the normal of the ground, beyond the toe region \[N/m\].
        pub stiffness: f64 = quantity(Unit::NewtonPerMeter, ranges::STIFFNESS),
        /// Damping beyond the toe region \[N·s/m\].
        pub damping: f64 = quantity(Unit::NewtonSecondPerMeter, ranges::DAMPING),
        /// Depth over which stiffness and damping grow from zero \[m\].
        pub toe_region: f64 = quantity(Unit::Meter, ranges::DEFLECTION),
        /// Deflection along the ground at the limit of friction \[m\].
        pub slip_deflection: f64 = quantity(Unit::Meter, ranges::DEFLECTION),
    }
}

impl Contact {
    /// Returns the element along the normal of the ground.
    pub const fn element(&self) -> OneSided {
        OneSided {
            stiffness: self.stiffness,
            damping: self.damping,
            toe_region: self.toe_region,
        }
    }
}

record! {
    /// A linear spring.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Spring = "spring" {
        /// Stiffness \[N/m\].
        pub stiffness: f64 = quantity(Unit::NewtonPerMeter, ranges::STIFFNESS),
        /// Preload: deformation of the spring where it presses the leg against its stop; if
        /// negative, the distance to that stop at which it holds the leg \[m\].
        pub preload: f64 = quantity(Unit::Meter, ranges::PRELOAD),
    }
}

record! {
    /// Viscous friction of the joints \[N·m·s/rad\].
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct JointFriction = "joint_friction" {
        /// Between trunk and first segment.
        pub hip: f64 = quantity(Unit::NewtonMeterSecondPerRadian, ranges::JOINT_FRICTION),
        /// Between first and second segment.
        pub knee: f64 = quantity(Unit::NewtonMeterSecondPerRadian, ranges::JOINT_FRICTION),
        /// Between second and third segment.
        pub ankle: f64 = quantity(Unit::NewtonMeterSecondPerRadian, ranges::JOINT_FRICTION),
        /// Between third segment and foot.
        pub toe: f64 = quantity(Unit::NewtonMeterSecondPerRadian, ranges::JOINT_FRICTION),
    }
}

record! {
    /// Masses of a leg \[kg\].
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct LegMass = "mass", checked by check_mass {
        /// First segment.
        pub l1: f64 = quantity(Unit::Kilogram, ranges::MASS),
        /// Second segment.
        pub l2: f64 = quantity(Unit::Kilogram, ranges::MASS),
        /// Third segment.
        pub l3: f64 = quantity(Unit::Kilogram, ranges::MASS),
        /// Foot.
        pub foot: f64 = quantity(Unit::Kilogram, ranges::MASS),
        /// Mass at the foot of a massless leg; the rest of the leg's mass is added to the trunk.
        pub lumped_foot: f64 = quantity(Unit::Kilogram, ranges::MASS),
    }
}

impl LegMass {
    /// Total mass of the leg \[kg\].
    pub fn total(&self) -> f64 {
        self.l1 + self.l2 + self.l3 + self.foot
    }
}

record! {
    /// The foot segment and its torsion spring.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Toe = "toe" {
        /// Length of the foot segment \[m\].
        pub length: f64 = quantity(Unit::Meter, ranges::LENGTH),
        /// Torsional stiffness \[N·m/rad\].
        pub stiffness: f64 = quantity(Unit::NewtonMeterPerRadian, ranges::TORSIONAL_STIFFNESS),
        /// Angle of the unloaded foot against the third segment \[rad\].
        pub rest: f64 = quantity(Unit::Radian, ranges::REST),
    }
}

record! {
    /// Servos of a leg; equal for all legs.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Actuators = "[actuator]" {
        /// Protraction and retraction.
        pub hip: Servo = Servo::TYPE,
        /// Winding of the knee cable.
        pub knee: Servo = Servo::TYPE,
        /// Abduction of the hip, if the robot has a servo for it. While the joints are locked it
        /// runs without effect on the legs.
        pub abduction: Option<Servo> = Optional(Servo::TYPE),
    }
}

record! {
    /// Motors of a leg; equal for all legs.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Motors = "[motor]" {
        /// Protraction and retraction.
        pub hip: Motor = Motor::TYPE,
        /// Winding of the knee cable.
        pub knee: Motor = Motor::TYPE,
    }
}

record! {
    /// Direct-current motor, or brushless motor with equivalent commutation, behind a gear.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Motor = "motor" {
        /// Resistance of the winding \[Ω\].
        pub resistance: f64 = quantity(Unit::Ohm, ranges::RESISTANCE),
        /// Torque per current, and induced voltage per rate of the rotor \[N·m/A = V·s/rad\].
        pub torque_constant: f64 = quantity(Unit::NewtonMeterPerAmpere, ranges::TORQUE_CONSTANT),
        /// Gear ratio: turns of the rotor per turn of the output \[1\].
        pub gear: f64 = quantity(Unit::One, ranges::GEAR),
        /// Inertia of the rotor, before the gear \[kg·m²\].
        pub inertia: f64 = quantity(Unit::KilogramSquareMeter, ranges::INERTIA),
        /// Supply voltage, the limit of the bridge's voltage \[V\].
        pub voltage: f64 = quantity(Unit::Volt, ranges::VOLTAGE),
    }
}

record! {
    /// A position servo.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Servo = "servo" {
        /// Greatest torque \[N·m\].
        pub torque: f64 = quantity(Unit::NewtonMeter, ranges::TORQUE),
        /// Greatest speed \[rad/s\].
        pub speed: f64 = quantity(Unit::RadianPerSecond, ranges::SPEED),
        /// Delay behind a ramp \[s\].
        pub lag: f64 = quantity(Unit::Second, ranges::LAG),
        /// Half-width of the error that is ignored \[rad\].
        pub dead_band: f64 = quantity(Unit::Radian, ranges::DEAD_BAND),
        /// Inertia of rotor and gear at the output \[kg·m²\].
        pub inertia: f64 = quantity(Unit::KilogramSquareMeter, ranges::INERTIA),
    }
}

/// Validates that the pantograph can be built and moved.
fn check_geometry(table: &Table<'_>, leg: &Leg) -> Result<(), Reported> {
    let mm = |length: f64| {
        let fixed = format!("{:.2}", length * 1e3);
        format!("{} mm", fixed.trim_end_matches('0').trim_end_matches('.'))
    };
    let mut result = Ok(());
    for (key, length) in [("l1", leg.l1), ("l2", leg.l2), ("l3", leg.l3)] {
        if leg.l_delta >= length {
            let message = format!(
                "`l_delta` is not shorter than `{key}`: the pantograph does not fit on the leg"
            );
            let help = format!("l_delta must be less than {}", mm(length));
            result = Err(table.report("l_delta", message, help));
        }
    }
    result?;
    let diagonal_max = third_side(leg.l2, leg.l_delta, leg.q2_ref);
    let diagonal_flat = leg.l2 - leg.l_delta;
    if leg.diagonal_min <= diagonal_flat || leg.diagonal_min >= diagonal_max {
        let message = format!(
            "`diagonal_min` is {}, outside the range of the diagonal",
            mm(leg.diagonal_min)
        );
        let help = format!(
            "it must be between {} (folded flat) and {} (extended)",
            mm(diagonal_flat),
            mm(diagonal_max)
        );
        result = Err(table.report("diagonal_min", message, help));
    }
    // Triangle inequality for rod, diagonal and offset.
    let travel_max = diagonal_max + leg.l_delta - leg.l2;
    if leg.parallel_travel >= travel_max {
        let message = "`parallel_travel` is more than the parallel rod can open";
        let help = format!("it must be less than {}", mm(travel_max));
        result = Err(table.report("parallel_travel", message, help));
    }
    if leg.parallel.preload >= leg.l2 {
        let message =
            "the preload of `parallel` is not shorter than `l2`: the spring would have no length";
        let help = format!("it must be less than {}", mm(leg.l2));
        result = Err(report_preload(table, "parallel", message, help));
    }
    if leg.diagonal_min < diagonal_max && -leg.diagonal.preload > diagonal_max - leg.diagonal_min {
        let message = "the preload of `diagonal` makes the unloaded leg bottom out";
        let help = format!(
            "it must not be less than {}, the travel from extended to bottomed out",
            mm(leg.diagonal_min - diagonal_max)
        );
        result = Err(report_preload(table, "diagonal", message, help));
    }
    if -leg.parallel.preload > leg.parallel_travel {
        let message = "the preload of `parallel` opens the unloaded pantograph beyond its stop";
        let help = format!(
            "it must not be less than {}, its travel to the stop",
            mm(-leg.parallel_travel)
        );
        result = Err(report_preload(table, "parallel", message, help));
    }
    result
}

/// Reports a problem at the preload of a spring.
fn report_preload(table: &Table<'_>, spring: &str, message: &str, help: String) -> Reported {
    let preload = table.get(spring).and_then(|spring| spring.peek("preload"));
    let place = preload.map_or_else(|| table.key_place(spring), |preload| preload.place());
    table.report_at(&place, message, help)
}

/// Validates that the foot is a part of the leg.
fn check_mass(table: &Table<'_>, mass: &LegMass) -> Result<(), Reported> {
    if mass.lumped_foot <= mass.total() {
        return Ok(());
    }
    let message = "`lumped_foot` weighs more than the whole leg";
    let help = format!("the leg weighs {:.4} kg", mass.total());
    Err(table.report("lumped_foot", message, help))
}

fn inertia(item: &Item<'_>, shape: &Shape) -> Result<[f64; 3], Reported> {
    let inertia @ [x, y, z] = three(item, shape)?;
    // A moment of inertia never exceeds the sum of the two others.
    if x > y + z || y > z + x || z > x + y {
        let message =
            "these moments of inertia are impossible: one exceeds the sum of the two others";
        let help = "for a box: m/12 (w² + h²), m/12 (l² + h²), m/12 (l² + w²)";
        return Err(item.report(message, help));
    }
    Ok(inertia)
}

/// Reads a list of three quantities.
pub(crate) fn three(item: &Item<'_>, shape: &Shape) -> Result<[f64; 3], Reported> {
    let Shape::List {
        of: Shape::One(Accepts::Quantity { unit, range }),
        ..
    } = shape
    else {
        unreachable!("three quantities");
    };
    item.quantities(*unit, range, "three entries are required")
}
