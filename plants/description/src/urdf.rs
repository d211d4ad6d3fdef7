//! A robot as URDF, the robot description of ROS.
//!
//! Its links and joints are a tree, so that the loop of the pantograph cannot be expressed. The
//! tree is trunk, first, second and third segment, with a link without mass between trunk and hip
//! of a leg that abducts; the ankle mimics the knee, as the closed pantograph does: q3 = −q2.

use core::fmt::Write;

use twinrig_legged::Segment;
use twinrig_robot::leg::{Joints, LegError, Pantograph};
use twinrig_robot::{AbductionAxis, Leg, LegMount, Robot, Servo};

/// Axial moment of inertia of segments: a thin rod has none, but other programs require a positive
/// one \[kg·m²\].
const AXIAL_MOMENT: f64 = 1e-14;

/// Mass of links that abduct, which have none \[kg\].
const CARRIER_MASS: f64 = 1e-14;

/// Axis of hip, knee and ankle, which are positive forward.
const ACROSS: &str = "0 -1 0";

/// Radius of the cylinders that show segments \[m\].
const RADIUS: f64 = 0.003;

/// Adds a line to a text.
macro_rules! line {
    ($text:expr, $($what:tt)*) => {
        // Writing to a string cannot fail.
        let _ = writeln!($text, $($what)*);
    };
}

/// Returns the robot as URDF, in SI units and radians. Its root is the link `trunk`, whose frame is
/// at the centre of mass; the joints of the leg `LF` are `LF_hip`, `LF_knee` and `LF_ankle`, zero
/// in the reference pose and positive forward, and `LF_abduction`, positive to the left, of a leg
/// that abducts. The frames `LF_inner` and `LF_outer` are the ends of the parallel rod, `LF_foot`
/// is the contact point.
///
/// A thin rod has no inertia about its axis; its moment about it is 1e-14 kg·m² here. The link
/// `LF_abductor` has no mass, and 1e-14 kg here.
///
/// # Errors
/// [`LegError`] if a leg makes no pantograph.
pub fn urdf(robot: &Robot) -> Result<String, LegError> {
    let mut text = String::new();
    line!(text, "<?xml version=\"1.0\" encoding=\"utf-8\"?>");
    line!(text, "<robot name=\"{}\">", escaped(&robot.name));
    line!(text, "{LACKS}");
    trunk(robot, &mut text);
    for mount in &robot.legs {
        leg(robot, mount, &mut text)?;
    }
    line!(text, "</robot>");
    Ok(text)
}

/// Losses of the format, for readers of the file.
const LACKS: &str = "  <!-- SI units, x forward, y left, z up. Joints are zero in the reference pose: legs stretched, feet below the
       hips, pantographs closed; positive is forward, and to the left for abduction.
       This file has masses, inertia and kinematics. It lacks, as URDF has no words for them:
       - the parallel rod, which closes a loop: the ankle mimics the knee, as if the rod were rigid. A reader that
         ignores mimic joints has a free ankle;
       - the springs in the diagonal and in the rod, which carry the weight, and the stops;
       - the cable, which pulls the knee and does not push. Effort and velocity of the knee are those of its servo, at
         the pulley;
       - the toe segment: the foot is a point with the mass of the foot.
       Damping of joints is viscous friction. -->";

fn trunk(robot: &Robot, text: &mut String) {
    let trunk = &robot.trunk;
    let [ixx, iyy, izz] = trunk.inertia;
    line!(text, "  <link name=\"trunk\">");
    line!(text, "    <inertial>");
    line!(text, "      <mass value=\"{}\"/>", trunk.mass);
    line!(
        text,
        "      <inertia ixx=\"{ixx}\" ixy=\"0\" ixz=\"0\" iyy=\"{iyy}\" iyz=\"0\" izz=\"{izz}\"/>"
    );
    line!(text, "    </inertial>");
    let [x, y, z] = trunk.size;
    line!(
        text,
        "    <visual><geometry><box size=\"{x} {y} {z}\"/></geometry></visual>"
    );
    line!(text, "  </link>");
}

/// Writes the links and joints of a leg.
fn leg(robot: &Robot, mount: &LegMount, text: &mut String) -> Result<(), LegError> {
    let LegMount { name, hip, leg, .. } = mount;
    let pantograph = Pantograph::new(leg)?;
    let [upper, middle, lower] = Segment::of(leg);
    let segment = |part: &str| format!("{name}_{part}");
    let bottomed = pantograph.knee_bottomed()?;
    line!(text, "\n  <!-- {name}: {} -->", springs(leg));
    let [first, second, third] = pantograph.angles(0.0, Joints { q2: 0.0, q3: 0.0 });
    let friction = leg.joint_friction;
    let hip_servo = effort(&robot.actuators.hip);
    let knee_servo = effort(&robot.actuators.knee);
    let below = |segment: Segment| [0.0, 0.0, -segment.length];
    let axis = mount.abduction_axis();
    let (carrier, at) = match axis {
        None => ("trunk".to_owned(), *hip),
        Some(AbductionAxis { place: [y, z], .. }) => {
            (segment("abductor"), [0.0, hip[1] - y, hip[2] - z])
        }
    };
    if let Some(axis) = axis {
        let joint = Joint {
            name: segment("abduction"),
            kind: "revolute",
            ends: ["trunk".to_owned(), carrier.clone()],
            position: [hip[0], axis.place[0], axis.place[1]],
            axis: "1 0 0",
            angle: 0.0,
            limit: abduction_limit(&axis, robot.actuators.abduction.as_ref()),
            damping: axis.friction,
            mimic: String::new(),
        };
        joint.write(text);
        write_carrier(&carrier, text);
    }
    for (link, joint) in [
        (
            upper,
            Joint {
                name: segment("hip"),
                kind: "continuous",
                ends: [carrier, segment("upper")],
                position: at,
                axis: ACROSS,
                angle: first,
                limit: format!("<limit {hip_servo}/>"),
                damping: friction.hip,
                mimic: String::new(),
            },
        ),
        (
            middle,
            Joint {
                name: segment("knee"),
                kind: "revolute",
                ends: [segment("upper"), segment("middle")],
                position: below(upper),
                axis: ACROSS,
                angle: second - first,
                limit: format!("<limit lower=\"{bottomed}\" upper=\"0\" {knee_servo}/>"),
                damping: friction.knee,
                mimic: String::new(),
            },
        ),
        (
            lower,
            Joint {
                name: segment("ankle"),
                kind: "revolute",
                ends: [segment("middle"), segment("lower")],
                position: below(middle),
                axis: ACROSS,
                angle: third - second,
                limit: format!("<limit lower=\"0\" upper=\"{}\" {knee_servo}/>", -bottomed),
                damping: friction.ankle,
                mimic: format!("<mimic joint=\"{name}_knee\" multiplier=\"-1\" offset=\"0\"/>"),
            },
        ),
    ] {
        joint.write(text);
        write_segment(&joint.ends[1], link, text);
    }
    frame(
        &segment("inner"),
        &segment("upper"),
        leg.l_delta - upper.length,
        text,
    );
    frame(&segment("outer"), &segment("lower"), lower.above, text);
    frame(&segment("foot"), &segment("lower"), -lower.length, text);
    Ok(())
}

/// Returns the springs of a leg in words.
fn springs(leg: &Leg) -> String {
    let Leg {
        diagonal, parallel, ..
    } = leg;
    format!(
        "diagonal spring {} N/m, preload {} m; parallel spring {} N/m, preload {} m; pulley {} m",
        diagonal.stiffness,
        diagonal.preload,
        parallel.stiffness,
        parallel.preload,
        leg.pulley_radius
    )
}

/// Returns the limits of a joint of abduction; without a servo it has no torque.
fn abduction_limit(axis: &AbductionAxis, servo: Option<&Servo>) -> String {
    let [lower, upper] = axis.range;
    let servo = servo.map_or_else(|| "effort=\"0\" velocity=\"0\"".to_owned(), effort);
    format!("<limit lower=\"{lower}\" upper=\"{upper}\" {servo}/>")
}

fn effort(servo: &Servo) -> String {
    format!("effort=\"{}\" velocity=\"{}\"", servo.torque, servo.speed)
}

/// A hinge.
struct Joint {
    name: String,
    kind: &'static str,
    /// Names of parent and child link.
    ends: [String; 2],
    /// Position in the frame of the parent \[m\].
    position: [f64; 3],
    axis: &'static str,
    /// Angle of the child against the parent where the joint is zero, positive forward \[rad\].
    angle: f64,
    limit: String,
    /// Viscous friction \[N·m·s/rad\].
    damping: f64,
    mimic: String,
}

impl Joint {
    fn write(&self, text: &mut String) {
        let [x, y, z] = self.position;
        let [parent, child] = &self.ends;
        line!(
            text,
            "  <joint name=\"{}\" type=\"{}\">",
            self.name,
            self.kind
        );
        line!(
            text,
            "    <origin xyz=\"{x} {y} {z}\" rpy=\"0 {} 0\"/>",
            -self.angle
        );
        line!(text, "    <parent link=\"{parent}\"/>");
        line!(text, "    <child link=\"{child}\"/>");
        line!(text, "    <axis xyz=\"{}\"/>", self.axis);
        line!(text, "    {}", self.limit);
        line!(text, "    <dynamics damping=\"{}\"/>", self.damping);
        if !self.mimic.is_empty() {
            line!(text, "    {}", self.mimic);
        }
        line!(text, "  </joint>");
    }
}

/// Writes a link that turns and has no mass, of which other programs require some.
fn write_carrier(name: &str, text: &mut String) {
    line!(text, "  <link name=\"{name}\">");
    write_rod(CARRIER_MASS, 0.0, AXIAL_MOMENT, text);
    line!(text, "  </link>");
}

/// Writes the mass of a rod along z, its centre below the joint \[m\] and its moment across
/// \[kg·m²\].
fn write_rod(mass: f64, below: f64, moment: f64, text: &mut String) {
    line!(text, "    <inertial>");
    line!(text, "      <origin xyz=\"0 0 {}\"/>", -below);
    line!(text, "      <mass value=\"{mass}\"/>");
    line!(
        text,
        "      <inertia ixx=\"{moment}\" ixy=\"0\" ixz=\"0\" iyy=\"{moment}\" iyz=\"0\" izz=\"{AXIAL_MOMENT}\"/>"
    );
    line!(text, "    </inertial>");
}

/// Writes the link of a segment, which points down from its joint.
fn write_segment(name: &str, segment: Segment, text: &mut String) {
    let Segment {
        length,
        above,
        mass,
        centre,
        moment,
    } = segment;
    line!(text, "  <link name=\"{name}\">");
    write_rod(mass, centre, moment, text);
    line!(text, "    <visual>");
    line!(
        text,
        "      <origin xyz=\"0 0 {}\"/>",
        0.5 * (above - length)
    );
    line!(
        text,
        "      <geometry><cylinder radius=\"{RADIUS}\" length=\"{}\"/></geometry>",
        above + length
    );
    line!(text, "    </visual>");
    line!(text, "  </link>");
}

/// Writes a link without mass, at a height on the axis of its parent.
fn frame(name: &str, parent: &str, height: f64, text: &mut String) {
    line!(text, "  <link name=\"{name}\"/>");
    line!(text, "  <joint name=\"{name}_frame\" type=\"fixed\">");
    line!(text, "    <origin xyz=\"0 0 {height}\"/>");
    line!(text, "    <parent link=\"{parent}\"/>");
    line!(text, "    <child link=\"{name}\"/>");
    line!(text, "  </joint>");
}

/// Returns a name, escaped as the value of an attribute.
fn escaped(name: &str) -> String {
    let mut text = String::new();
    for letter in name.chars() {
        match letter {
            '&' => text.push_str("&amp;"),
            '<' => text.push_str("&lt;"),
            '>' => text.push_str("&gt;"),
            '"' => text.push_str("&quot;"),
            // XML has no other control characters, not even escaped.
            control if control.is_control() => text.push(' '),
            other => text.push(other),
        }
    }
    text
}
