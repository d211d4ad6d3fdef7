//! Knees of compliant plants keep their side in drops onto few legs, and limits that the robot
//! exceeds there are noted.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use twinrig::kernel::SimTime;
use twinrig::{Assembly, Registry};
use twinrig_kernel::{Stream, signal, stream};

/// A robot, with the stiffness of its springs along diagonal and rod \[N/m\].
struct Robot {
    name: &'static str,
    file: &'static str,
    springs: [f64; 2],
    /// l₂, lΔ, least diagonal and travel of the rod \[m\]; the extended leg has a bend of 35°.
    lengths: [f64; 4],
}

const CHEETAH_CUB: Robot = Robot {
    name: "cheetah-cub",
    file: include_str!("../../robots/cheetah-cub.toml"),
    springs: [4400.0, 1800.0],
    lengths: [0.0714, 0.015, 0.06282, 0.01],
};
const ONCILLA: Robot = Robot {
    name: "oncilla",
    file: include_str!("../../robots/oncilla.toml"),
    springs: [12_230.0, 5005.0],
    lengths: [0.1191, 0.025, 0.1048, 0.0167],
};

/// Number of random drops; `KNEES=N` selects another.
const DROPS: u64 = 40;

/// A robot on some legs, with their hips and knees bent by these angles \[°\], which lands after
/// falling by a height \[mm\], or stands up by its own springs.
struct Drop {
    robot: &'static Robot,
    plant: &'static str,
    drives: &'static str,
    legs: &'static [&'static str],
    height_mm: f64,
    bend: [f64; 2],
    friction: f64,
    step_us: u64,
    /// Factors of the stiffness of both springs.
    springs: [f64; 2],
}

fn pick<T: Copy>(stream: &mut Stream, from: &[T]) -> T {
    let drawn = stream.between(0, from.len() as u64 - 1);
    from[usize::try_from(drawn).expect("an index")]
}

impl Drop {
    /// Draws a drop.
    fn random(seed: u64) -> Self {
        let mut stream = stream(seed, "knees");
        let uniform = |stream: &mut Stream, low: f64, high: f64| low + (high - low) * stream.unit();
        let legs: [&[&str]; 4] = [&["LF"], &["LF", "RH"], &["RF", "LH", "RH"], &["LF", "RF"]];
        let (massless, lcp) = ("model = \"massless\"", "model = \"lcp\"");
        let plants = [massless, lcp, lcp, "model = \"lcp\"\ntoe = true"];
        let plant = pick(&mut stream, &plants);
        Self {
            robot: [&CHEETAH_CUB, &ONCILLA][usize::from(stream.unit() < 0.5)],
            plant,
            // Legs without mass have drives.
            drives: ["none", "servo"][usize::from(plant == massless || stream.unit() < 0.5)],
            legs: pick(&mut stream, &legs),
            height_mm: uniform(&mut stream, 0.0, 500.0),
            bend: [
                uniform(&mut stream, -30.0, 40.0),
                uniform(&mut stream, 40.0, 90.0),
            ],
            friction: uniform(&mut stream, 0.0, 2.0),
            step_us: pick(&mut stream, &[500, 1000, 2000]),
            // From a tenth to a hundredfold.
            springs: [0, 1].map(|_| libm::pow(10.0, uniform(&mut stream, -1.0, 2.0))),
        }
    }

    fn scenario(&self) -> String {
        let ([hip, knee], [diagonal, rod]) = (self.bend, self.springs);
        let mut text = format!(
            "name = \"drop\"\nrobot = \"{}\"\nduration = \"600 ms\"\nseed = 1\n\n\
             [plant]\n{}\nbase = \"free\"\nlegs = {:?}\nstep = \"{} us\"\nconstraints = \"compliant\"\n\
             ground = {{ friction = {}, profile = \"step-down\", at = \"-10 m\", height = \"{} mm\" }}\n\
             start = {{ q1 = \"{hip} deg\", q2 = \"-{knee} deg\", q3 = \"{knee} deg\" }}\n\n\
             [actuator]\nkind = \"{}\"\n\n[observe]\nperiod = \"2 ms\"\n",
            self.robot.name,
            self.plant,
            self.legs,
            self.step_us,
            self.friction,
            self.height_mm,
            self.drives,
        );
        let [along, across] = self.robot.springs;
        let (along, across) = (along * diagonal, across * rod);
        writeln!(
            text,
            "\n[override]\nleg.aslp.diagonal.stiffness = \"{along} N/m\"\n\
             leg.aslp.parallel.stiffness = \"{across} N/m\""
        )
        .unwrap();
        text
    }

    /// Runs the drop.
    fn run(&self) -> Course {
        let (registry, text) = (Registry::standard(), self.scenario());
        let assembly = Assembly::builder(&registry)
            .robot(self.robot.file)
            .recorded(&text);
        let assembly = assembly.unwrap_or_else(|error| panic!("{error}\n{text}"));
        let mut rig = assembly
            .rig()
            .unwrap_or_else(|error| panic!("{error}\n{text}"));
        let mut course = Course::default();
        for ms in (0..=600).step_by(2) {
            let at = SimTime::from_nanos(ms * 1_000_000);
            if let Err(fault) = rig.run_until(at, &mut ()) {
                course.fault = Some(fault.to_string());
                return course;
            }
            let state = rig.plant().state().expect("the plant has named states");
            let position = state.get(signal::BODY_POSITION).expect("a position");
            course.beyond("body", at, -0.001 * self.height_mm - position[2], 0.0);
            for leg in self.legs {
                let angles = state.get(&signal::of_leg(leg, signal::ANGLES));
                let angles: [f64; 3] = angles.and_then(|it| it.try_into().ok()).expect("angles");
                let bend = angles[0] - angles[1];
                let bend = libm::atan2(libm::sin(bend), libm::cos(bend)).to_degrees();
                course.least_bend = course.least_bend.min(bend);
                let beyond_m = self.robot.beyond_stop(angles);
                course.beyond(&signal::leg_path(leg), at, beyond_m, 1e-3);
            }
        }
        let found = rig.plant().limit_violations().into_iter();
        course.found = found.map(|it| (it.part, it.first, it.worst_m)).collect();
        let balance = rig.plant().energy();
        let share = balance.residual / balance.exchanged;
        // Twice the worst balance of harsh drops between stops, at the default tolerance.
        assert!(share.abs() < 1e-3, "{share:e} not accounted for:\n{text}");
        course
    }
}

impl Robot {
    /// Returns the distance beyond the stops of diagonal and rod \[m\]: the sides of the polygon of
    /// knee, ankle and both ends of the rods.
    fn beyond_stop(&self, angles: [f64; 3]) -> f64 {
        let [l2, l_delta, diagonal_min, travel] = self.lengths;
        let along =
            |length: f64, angle: f64| [length * libm::sin(angle), length * libm::cos(angle)];
        let sum = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a + c, b + d];
        let norm = |[a, b]: [f64; 2]| libm::hypot(a, b);
        let extended = norm(sum(along(l_delta, 35f64.to_radians()), along(l2, 0.0)));
        let diagonal = sum(along(l_delta, angles[0]), along(l2, angles[1]));
        let rod = norm(sum(diagonal, along(-l_delta, angles[2])));
        let diagonal = norm(diagonal);
        [
            diagonal - extended,
            diagonal_min - diagonal,
            rod - l2 - travel,
            l2 - rod,
        ]
        .into_iter()
        .fold(0.0, f64::max)
    }
}

/// Course of a drop.
struct Course {
    /// Least bend of a knee \[°\].
    least_bend: f64,
    /// The fault that ended it.
    fault: Option<String>,
    /// Limits exceeded: part, first instant and greatest distance \[m\], by part.
    expected: BTreeMap<String, (SimTime, f64)>,
    /// The plant's own.
    found: Vec<(String, SimTime, f64)>,
}

impl Default for Course {
    fn default() -> Self {
        Self {
            least_bend: f64::INFINITY,
            fault: None,
            expected: BTreeMap::new(),
            found: Vec::new(),
        }
    }
}

impl Course {
    fn beyond(&mut self, part: &str, at: SimTime, by_m: f64, from_m: f64) {
        if by_m > from_m {
            let known = self.expected.entry(part.to_owned()).or_insert((at, by_m));
            known.1 = known.1.max(by_m);
        }
    }
}

#[test]
fn knees_of_compliant_plants_keep_their_side() {
    let lcp = "model = \"lcp\"";
    let massless = "model = \"massless\"";
    let mut beyond_stops = 0;
    for (robot, plant, drives, height_mm, bend) in [
        (&CHEETAH_CUB, lcp, "none", 0.0, [15.0, 63.0]),
        (&CHEETAH_CUB, lcp, "none", 0.0, [-20.0, 80.0]),
        (&ONCILLA, lcp, "servo", 330.0, [12.5, 59.0]),
        (&ONCILLA, massless, "servo", 330.0, [12.5, 59.0]),
    ] {
        let drop = Drop {
            robot,
            plant,
            drives,
            legs: &["LF"],
            height_mm,
            bend,
            friction: 1.0,
            step_us: 1000,
            springs: [1.0; 2],
        };
        let course = drop.run();
        assert_eq!(course.fault, None, "{}", drop.scenario());
        let least = course.least_bend;
        assert!(least > 1.0, "bent by {least}°:\n{}", drop.scenario());
        // All fall over, to below the ground.
        assert!(course.expected.contains_key("body"), "{}", drop.scenario());
        assert_eq!(
            course.found.len(),
            course.expected.len(),
            "{:?} {:?}",
            course.found,
            course.expected
        );
        for (part, first, worst_m) in course.found {
            let expected = course.expected[&part];
            assert_eq!(first, expected.0, "{part}");
            // Rounding of lengths by two formulas.
            assert!((worst_m - expected.1).abs() < 1e-12, "{part}: {worst_m}");
            beyond_stops += usize::from(part != "body");
        }
    }
    assert!(beyond_stops > 0);
}

/// Springs of a tenth to a hundred times the stiffness, friction from 0 to 2, toes, subsets of
/// legs. Where a motion is too stiff for the method, the run may end with a fault of that; none of
/// a leg.
#[test]
#[ignore = "slow"]
fn knees_keep_their_side_in_random_harsh_drops() {
    let drops = std::env::var("KNEES").map_or(DROPS, |number| number.parse().unwrap());
    let mut faults = 0;
    for seed in 0..drops {
        let drop = Drop::random(seed);
        let Course {
            least_bend: least,
            fault,
            ..
        } = drop.run();
        let of_leg = fault.as_ref().is_some_and(|why| why.contains("mechanism"));
        assert!(
            least > 0.0 && !of_leg,
            "drop {seed}: bent by {least}°, {fault:?}:\n{}",
            drop.scenario()
        );
        faults += u64::from(fault.is_some());
    }
    println!("{drops} drops, {faults} ended by a fault of the method");
    assert!(faults <= drops / 10, "{faults} of {drops}");
}
