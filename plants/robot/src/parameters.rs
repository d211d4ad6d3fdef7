//! Parameters of a robot, in SI units.

use crate::payload::{Payload, PointMass};

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
    /// Coulomb coefficient between foot and ground, which a scenario may override \[1\].
    pub friction: f64,
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

/// Trunk: the body that carries the legs.
#[derive(Debug, Clone, PartialEq)]
pub struct Trunk {
    /// Mass without the legs \[kg\].
    pub mass: f64,
    /// Principal moments of inertia about the centre of mass, body axes x, y, z \[kg·m²\].
    pub inertia: [f64; 3],
    /// Length, width and height, for display \[m\].
    pub size: [f64; 3],
    /// Payloads, of a scenario; a robot file has none.
    pub payloads: Vec<PointMass>,
}

impl Trunk {
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

/// The spring-loaded pantograph leg (thesis, section 2.1.1 and appendix A).
#[derive(Debug, Clone, PartialEq)]
pub struct Leg {
    /// Length of the proximal segment, hip to knee \[m\].
    pub l1: f64,
    /// Length of the middle segment, knee to ankle \[m\].
    pub l2: f64,
    /// Length of the distal segment, parallel-spring end to foot \[m\].
    pub l3: f64,
    /// Offset of the pantograph on the first and third segment \[m\].
    pub l_delta: f64,
    /// Knee angle between the first two segments in the fully extended leg \[rad\]; positive.
    pub q2_ref: f64,
    /// Spring along the pantograph's diagonal; it extends the leg.
    pub diagonal: Spring,
    /// Spring along the pantograph's parallel rod; it keeps the pantograph closed.
    pub parallel: Spring,
    /// Greatest opening of the parallel rod beyond `l2` \[m\].
    pub parallel_travel: f64,
    /// Shortest length of the diagonal, where the leg bottoms out \[m\].
    pub diagonal_min: f64,
    /// Viscous friction of the joints.
    pub joint_friction: JointFriction,
    /// Masses of the segments.
    pub mass: LegMass,
    /// Radius of the pulley that winds the knee cable \[m\].
    pub pulley_radius: f64,
    /// Foot segment beyond the toe joint, if the robot has one.
    pub toe: Option<Toe>,
    /// Compliance of stops, cable and sole, if known; rigid constraints do not need it.
    pub compliance: Option<Compliance>,
}

/// Compliance of the constraints of a leg.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compliance {
    /// Stops of the diagonal and of the parallel rod.
    pub stops: OneSided,
    /// Knee cable.
    pub cable: OneSided,
    /// Sole, along the normal of the ground.
    pub sole: OneSided,
    /// Deflection of the sole along the ground at the limit of friction \[m\].
    pub slip_deflection: f64,
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

/// Spring with a damper that only pushes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OneSided {
    /// Stiffness beyond the toe region \[N/m\].
    pub stiffness: f64,
    /// Damping beyond the toe region \[N·s/m\].
    pub damping: f64,
    /// Depth over which stiffness and damping grow from zero \[m\].
    pub toe_region: f64,
}

/// A linear spring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// Stiffness \[N/m\].
    pub stiffness: f64,
    /// Preload: deformation of the spring where it presses the leg against its stop; if negative,
    /// the distance to that stop at which it holds the leg \[m\].
    pub preload: f64,
}

/// Viscous friction of the joints \[N·m·s/rad\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointFriction {
    /// Between trunk and first segment.
    pub hip: f64,
    /// Between first and second segment.
    pub knee: f64,
    /// Between second and third segment.
    pub ankle: f64,
    /// Between third segment and foot.
    pub toe: f64,
}

/// Masses of a leg \[kg\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LegMass {
    /// First segment.
    pub l1: f64,
    /// Second segment.
    pub l2: f64,
    /// Third segment.
    pub l3: f64,
    /// Foot.
    pub foot: f64,
    /// Mass at the foot of a massless leg; the rest of the leg's mass is added to the trunk.
    pub lumped_foot: f64,
}

impl LegMass {
    /// Total mass of the leg \[kg\].
    pub fn total(&self) -> f64 {
        self.l1 + self.l2 + self.l3 + self.foot
    }
}

/// The foot segment and its torsion spring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Toe {
    /// Length of the foot segment \[m\].
    pub length: f64,
    /// Torsional stiffness \[N·m/rad\].
    pub stiffness: f64,
    /// Angle of the unloaded foot against the third segment \[rad\].
    pub rest: f64,
}

/// Servos of a leg; equal for all legs.
#[derive(Debug, Clone, PartialEq)]
pub struct Actuators {
    /// Protraction and retraction.
    pub hip: Servo,
    /// Winding of the knee cable.
    pub knee: Servo,
    /// Abduction of the hip, if the robot has a servo for it. No plant's legs abduct yet; the servo
    /// runs without effect on them.
    pub abduction: Option<Servo>,
}

/// Motors of a leg; equal for all legs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motors {
    /// Protraction and retraction.
    pub hip: Motor,
    /// Winding of the knee cable.
    pub knee: Motor,
}

/// Direct-current motor, or brushless motor with equivalent commutation, behind a gear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motor {
    /// Resistance of the winding \[Ω\].
    pub resistance: f64,
    /// Torque per current, and induced voltage per rate of the rotor \[N·m/A = V·s/rad\].
    pub torque_constant: f64,
    /// Gear ratio: turns of the rotor per turn of the output \[1\].
    pub gear: f64,
    /// Inertia of the rotor, before the gear \[kg·m²\].
    pub inertia: f64,
    /// Supply voltage, the limit of the bridge's voltage \[V\].
    pub voltage: f64,
}

/// A position servo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Servo {
    /// Delay behind a ramp \[s\].
    pub lag: f64,
    /// Greatest speed \[rad/s\].
    pub speed: f64,
    /// Greatest torque \[N·m\].
    pub torque: f64,
    /// Half-width of the error that is ignored \[rad\].
    pub dead_band: f64,
    /// Inertia of rotor and gear at the output \[kg·m²\].
    pub inertia: f64,
}
