//! Random drops, stands and walks. A case is determined by its seed and formats itself as a
//! scenario file; the seed suffices to repeat it.

mod harsh;

pub use harsh::Harsh;

use std::f64::consts::PI;
use std::fmt::Write as _;

use twinrig::robot::Robot;
use twinrig_kernel::{SimDuration, Stream, stream};
use twinrig_robot::leg::Pantograph;

/// Plants of the battery, by integration method.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Method {
    Rk4,
    Rodas4,
    Moreau,
    Massless,
    /// `lcp` with compliant constraints.
    Compliant,
    /// `massless` with compliant constraints.
    CompliantMassless,
}

impl Method {
    pub const RIGID: [Self; 4] = [Self::Rk4, Self::Rodas4, Self::Moreau, Self::Massless];
    pub const COMPLIANT: [Self; 2] = [Self::Compliant, Self::CompliantMassless];
    pub const ALL: [Self; 6] = [
        Self::Rk4,
        Self::Rodas4,
        Self::Moreau,
        Self::Massless,
        Self::Compliant,
        Self::CompliantMassless,
    ];

    /// Whether the constraints are compliant.
    pub const fn is_compliant(self) -> bool {
        matches!(self, Self::Compliant | Self::CompliantMassless)
    }

    /// Whether the legs have no mass but that of the foot.
    pub const fn is_massless(self) -> bool {
        matches!(self, Self::Massless | Self::CompliantMassless)
    }

    /// Whether the method locates events within a step.
    pub const fn locates_events(self) -> bool {
        matches!(self, Self::Rk4 | Self::Rodas4)
    }

    pub const fn name(self) -> &'static str {
        match self {
            Self::Rk4 => "rk4",
            Self::Rodas4 => "rodas4",
            Self::Moreau => "moreau",
            Self::Massless => "massless",
            Self::Compliant => "compliant",
            Self::CompliantMassless => "compliant-massless",
        }
    }

    /// Default step, which is also the observation period.
    pub const fn step(self) -> SimDuration {
        SimDuration::from_millis(match self {
            Self::Rk4 | Self::Rodas4 | Self::Compliant | Self::CompliantMassless => 2,
            Self::Moreau | Self::Massless => 1,
        })
    }
}

/// Degrees of freedom of the trunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Base {
    Free,
    Planar,
    Fixed,
}

/// Task of the robot.
#[derive(Clone, Debug, PartialEq)]
pub enum Task {
    /// Fall from a random pose, with or without servos.
    Drop,
    /// Controller that keeps the hips at this height \[m\].
    Stand { hip_height: f64 },
    /// Gait controller, as a scenario table.
    Walk { controller: String },
}

/// Initial joint angles \[rad\] and rates \[rad/s\] of all legs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    pub q: [f64; 3],
    pub rates: [f64; 3],
}

/// A case of the battery.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    pub seed: u64,
    pub task: Task,
    pub method: Method,
    pub base: Base,
    pub legs: Vec<&'static str>,
    pub friction: f64,
    pub restitution: f64,
    pub toe: bool,
    /// Distance of the ground below the lowest foot at the start \[m\].
    pub height: f64,
    /// Heights of uneven ground on a grid of 50 mm \[m\]; `None` for level ground.
    pub heights: Option<[[f64; 9]; 9]>,
    pub pose: Option<Pose>,
    /// Servo torque \[N·m\]; `None` for passive joints.
    pub servo: Option<f64>,
    /// Viscous friction of all joints that replaces that of the robot file \[N·m·s/rad\].
    pub joint_friction: Option<f64>,
    pub duration: SimDuration,
    /// Step that replaces the default of the method.
    pub step: Option<SimDuration>,
    /// Error tolerance of rk4 and rodas4 \[m\]; `None` for the default of the plant.
    pub tolerance: Option<f64>,
    /// Offset of the initial hip angle, or of the stance position of a walk as an angle of the leg
    /// \[rad\].
    pub perturbation: f64,
}

const LEGS: [&str; 4] = ["LF", "RF", "LH", "RH"];

/// Returns a uniform number in \[`low`, `high`).
fn uniform(stream: &mut Stream, low: f64, high: f64) -> f64 {
    low + (high - low) * stream.unit()
}

fn chance(stream: &mut Stream, probability: f64) -> bool {
    stream.unit() < probability
}

impl Case {
    /// Draws the case of a seed.
    pub fn random(seed: u64, robot: &Robot) -> Self {
        let mut stream = stream(seed, "battery/case");
        let method = match stream.between(0, 3) {
            0 => Method::Rk4,
            1 => Method::Rodas4,
            2 => Method::Moreau,
            _ => Method::Massless,
        };
        Self::of_method(seed, method, &mut stream, robot)
    }

    /// Draws the case of a seed for a plant with compliant constraints.
    pub fn random_compliant(seed: u64, method: Method, robot: &Robot) -> Self {
        let mut stream = stream(seed, "battery/compliant");
        Self::of_method(seed, method, &mut stream, robot).compliant(method)
    }

    fn of_method(seed: u64, method: Method, stream: &mut Stream, robot: &Robot) -> Self {
        let kind = stream.unit();
        let case = if kind < 0.6 {
            Self::drop(seed, method, stream, robot)
        } else if kind < 0.8 {
            Self::stand(seed, method, stream, robot)
        } else {
            Self::walk(seed, method, stream)
        };
        case.on_any_ground(stream)
    }

    /// Draws the nominal drop of a seed: the robot of the file with all legs, on level ground
    /// without restitution.
    pub fn nominal_drop(seed: u64, method: Method, robot: &Robot) -> Self {
        let mut stream = stream(seed, "battery/nominal");
        let drop = Self::drop(seed, method, &mut stream, robot);
        Self {
            base: Base::Free,
            legs: LEGS.to_vec(),
            joint_friction: None,
            servo: drop.servo.map(|_| 2.0),
            friction: uniform(&mut stream, 0.0, 2.0),
            ..drop
        }
    }

    fn drop(seed: u64, method: Method, stream: &mut Stream, robot: &Robot) -> Self {
        let legs = match stream.between(0, 9) {
            0 | 1 => 1,
            2 => 2,
            _ => 4,
        };
        let mut present = LEGS.to_vec();
        while present.len() > legs {
            let removed = stream.between(0, present.len() as u64 - 1);
            present.remove(usize::try_from(removed).unwrap_or(0));
        }
        let base = stream.unit();
        let share = stream.unit();
        let height = if chance(stream, 0.1) {
            0.0
        } else {
            0.2 * share * share
        };
        let fall = libm::sqrt(2.0 * height / 9.81);
        let standing = uniform(stream, 0.1, 0.3);
        Self {
            task: Task::Drop,
            base: match base {
                x if x < 0.6 => Base::Free,
                x if x < 0.85 => Base::Planar,
                _ => Base::Fixed,
            },
            legs: present,
            height,
            pose: Some(pose(stream, robot, method)),
            servo: chance(stream, 0.4).then(|| uniform(stream, 0.5, 5.0)),
            duration: whole_periods(fall + standing),
            ..Self::blank(seed, method)
        }
    }

    fn stand(seed: u64, method: Method, stream: &mut Stream, robot: &Robot) -> Self {
        let length = robot
            .legs
            .first()
            .and_then(|mount| Pantograph::new(&mount.leg).ok())
            .map_or(0.1, |leg| leg.length_max());
        Self {
            task: Task::Stand {
                hip_height: length * uniform(stream, 0.6, 0.99),
            },
            height: if chance(stream, 0.5) {
                0.0
            } else {
                uniform(stream, 0.0, 0.03)
            },
            pose: chance(stream, 0.5).then(|| pose(stream, robot, method)),
            servo: Some(uniform(stream, 0.5, 5.0)),
            duration: whole_periods(0.4),
            ..Self::blank(seed, method)
        }
    }

    fn walk(seed: u64, method: Method, stream: &mut Stream) -> Self {
        let gait =
            ["trot", "pace", "walk", "bound"][usize::try_from(stream.between(0, 3)).unwrap_or(0)];
        let controller = format!(
            "kind = \"cpg\"\ngait = \"{gait}\"\nperiod = \"2 ms\"\nfrequency = \"{} Hz\"\nstep_length = \"{} m\"\n\
             hip_height = {{ fore = \"{} m\", hind = \"{} m\" }}\nstep_height = \"{} m\"\nduty_factor = {}\n\
             ramp = \"0.1 s\"\n",
            uniform(stream, 1.0, 4.0),
            uniform(stream, 0.0, 0.14),
            uniform(stream, 0.11, 0.142),
            uniform(stream, 0.11, 0.142),
            uniform(stream, 0.005, 0.025),
            uniform(stream, 0.35, 0.7),
        );
        Self {
            task: Task::Walk { controller },
            servo: Some(uniform(stream, 2.0, 5.0)),
            duration: whole_periods(0.6),
            ..Self::blank(seed, method)
        }
    }

    fn blank(seed: u64, method: Method) -> Self {
        Self {
            seed,
            task: Task::Drop,
            method,
            base: Base::Free,
            legs: LEGS.to_vec(),
            friction: 0.6,
            restitution: 0.0,
            toe: false,
            height: 0.0,
            heights: None,
            pose: None,
            servo: None,
            joint_friction: None,
            duration: SimDuration::ZERO,
            step: None,
            tolerance: None,
            perturbation: 0.0,
        }
    }

    fn on_any_ground(self, stream: &mut Stream) -> Self {
        let friction = match stream.unit() {
            x if x < 0.1 => 0.0,
            x if x < 0.3 => 0.6,
            _ => uniform(stream, 0.0, 2.0),
        };
        let restitution = if chance(stream, 0.6) {
            0.0
        } else {
            stream.unit()
        };
        let heights = chance(stream, 0.1).then(|| {
            let mut field = [[0.0; 9]; 9];
            let heights = field.iter_mut().flatten();
            heights.for_each(|height| *height = uniform(stream, -0.01, 0.01));
            field
        });
        let joint_friction =
            chance(stream, 0.1).then(|| libm::pow(10.0, uniform(stream, -4.0, 0.0)));
        Self {
            friction,
            restitution,
            toe: !self.method.is_massless() && chance(stream, 0.4),
            heights,
            joint_friction,
            ..self
        }
    }

    /// Observation period: the step of the method, also if the plant has a shorter one.
    pub fn period(&self) -> SimDuration {
        self.step().max(self.method.step())
    }

    /// The same case with another method.
    #[must_use]
    pub fn by(&self, method: Method) -> Self {
        Self {
            method,
            ..self.clone()
        }
    }

    /// The same case with compliant constraints: without restitution, which they do not have;
    /// mass-less legs without toes and with servos.
    #[must_use]
    pub fn compliant(&self, method: Method) -> Self {
        let (toe, servo) = if method.is_massless() {
            (false, self.servo.or(Some(2.0)))
        } else {
            (self.toe, self.servo)
        };
        Self {
            restitution: 0.0,
            toe,
            servo,
            ..self.by(method)
        }
    }

    /// Step of the plant.
    pub fn step(&self) -> SimDuration {
        self.step.unwrap_or(self.method.step())
    }

    /// Whether no drive does work.
    pub fn is_passive(&self) -> bool {
        self.servo.is_none()
    }

    /// Formats the case as a scenario file.
    pub fn scenario(&self) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = self.write(&mut text);
        text
    }

    fn write(&self, to: &mut String) -> std::fmt::Result {
        writeln!(to, "name = \"battery-{}\"", self.seed)?;
        writeln!(to, "robot = \"cheetah-cub\"")?;
        writeln!(to, "duration = \"{} us\"", self.duration.as_nanos() / 1000)?;
        writeln!(to, "seed = {}\n", self.seed % (1 << 53))?;
        if let Some(friction) = self.joint_friction {
            writeln!(to, "[override.leg.aslp.joint_friction]")?;
            for joint in ["hip", "knee", "ankle", "toe"] {
                writeln!(to, "{joint} = \"{friction} N·m·s/rad\"")?;
            }
        }
        self.write_plant(to)?;
        match self.servo {
            None => writeln!(to, "\n[actuator]\nkind = \"none\"")?,
            Some(torque) => writeln!(
                to,
                "\n[actuator]\nkind = \"servo\"\nlag = \"5 ms\"\nspeed = \"20 rad/s\"\ndead_band = \"0 deg\"\ntorque = \"{torque} N·m\""
            )?,
        }
        // A hip angle corresponds to a foot displacement of this share of a leg length.
        let shift = 0.13 * self.perturbation;
        match &self.task {
            Task::Drop => {}
            Task::Stand { hip_height } => writeln!(
                to,
                "\n[controller]\nkind = \"stand\"\nperiod = \"2 ms\"\nhip_height = \"{hip_height} m\"\nmid_stance_offset = \"{shift} m\""
            )?,
            Task::Walk { controller } => writeln!(
                to,
                "\n[controller]\n{controller}mid_stance_offset = \"{shift} m\""
            )?,
        }
        let period = self.period().as_nanos() / 1000;
        writeln!(to, "\n[observe]\nperiod = \"{period} us\"")?;
        writeln!(
            to,
            "\n[record]\nsignals = [\"leg/*/foot/clearance\", \"leg/*/foot/force\", \"leg/*/foot/position\", \"body/position\", \"energy/*\"]"
        )
    }

    fn write_plant(&self, to: &mut String) -> std::fmt::Result {
        writeln!(to, "\n[plant]")?;
        match self.method {
            Method::Massless => writeln!(to, "model = \"massless\"\nconstraints = \"rigid\"")?,
            Method::CompliantMassless => {
                writeln!(to, "model = \"massless\"\nconstraints = \"compliant\"")?;
            }
            Method::Compliant => writeln!(
                to,
                "model = \"lcp\"\nconstraints = \"compliant\"\ntoe = {}",
                self.toe
            )?,
            method => writeln!(
                to,
                "model = \"lcp\"\nconstraints = \"rigid\"\nintegrator = \"{}\"\ntoe = {}",
                method.name(),
                self.toe
            )?,
        }
        if let (Some(tolerance), true) = (self.tolerance, self.method != Method::Massless) {
            writeln!(to, "tolerance = \"{tolerance} m\"")?;
        }
        let base = match self.base {
            Base::Free => "free",
            Base::Planar => "planar",
            Base::Fixed => "fixed",
        };
        writeln!(to, "base = \"{base}\"\nlegs = {:?}", self.legs)?;
        writeln!(to, "step = \"{} us\"", self.step().as_nanos() / 1000)?;
        let (friction, restitution) = (self.friction, self.restitution);
        write!(
            to,
            "ground = {{ friction = {friction}, restitution = {restitution}, "
        )?;
        match &self.heights {
            None => writeln!(
                to,
                "profile = \"step-down\", at = \"-10 m\", height = \"{} m\" }}",
                self.height
            )?,
            Some(heights) => {
                let row = |row: &[f64; 9]| {
                    let numbers = row.iter().map(|h| format!("\"{} m\"", h - self.height));
                    format!("[{}]", numbers.collect::<Vec<_>>().join(", "))
                };
                let rows: Vec<String> = heights.iter().map(row).collect();
                writeln!(
                    to,
                    "profile = \"heights\", spacing = \"50 mm\", values = [{}] }}",
                    rows.join(", ")
                )?;
            }
        }
        if let Some(Pose { q, rates }) = self.pose {
            let [q1, q2, q3] = q;
            let [r1, r2, r3] = rates;
            writeln!(
                to,
                "start = {{ q1 = \"{} rad\", q2 = \"{q2} rad\", q3 = \"{q3} rad\", q1_rate = \"{r1} rad/s\", q2_rate = \"{r2} rad/s\", q3_rate = \"{r3} rad/s\" }}",
                q1 + self.perturbation
            )?;
        }
        Ok(())
    }
}

/// Draws a pose within all joint stops, at rest or in motion. A mass-less leg has no pose with the
/// ankle folded up.
fn pose(stream: &mut Stream, robot: &Robot, method: Method) -> Pose {
    const FOLDED: f64 = 0.11;
    let leg = robot
        .legs
        .first()
        .and_then(|mount| Pantograph::new(&mount.leg).ok());
    let q2 = -uniform(stream, 1.0, 93.0).to_radians();
    let opening_max = leg
        .and_then(|leg| leg.opening_stop(q2).ok())
        .map_or(0.0, |stop| stop.value);
    let bent = robot.legs.first().map_or(0.0, |mount| mount.leg.q2_ref);
    let opening_max = if method.is_massless() {
        opening_max.min(PI - FOLDED - bent + q2)
    } else {
        opening_max
    };
    let opening = if chance(stream, 0.5) {
        0.0
    } else {
        0.999 * opening_max * stream.unit()
    };
    let q1 = uniform(stream, -50.0, 50.0).to_radians();
    let moves = chance(stream, 0.5);
    let rates = [10.0; 3].map(|most| {
        if moves {
            uniform(stream, -most, most)
        } else {
            0.0
        }
    });
    Pose {
        q: [q1, q2, opening - q2],
        rates,
    }
}

/// Rounds a duration up to whole observation periods.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a second or less, in milliseconds"
)]
fn whole_periods(seconds: f64) -> SimDuration {
    SimDuration::from_millis(2 * (500.0 * seconds).ceil() as u64)
}
