//! Knees of compliant plants keep their side in drops onto few legs.

use std::fmt::Write as _;

use twinrig::kernel::SimTime;
use twinrig::{Assembly, Registry};
use twinrig_kernel::{Stream, signal, stream};

/// A robot, with the stiffness of its springs along diagonal and rod \[N/m\].
struct Robot {
    name: &'static str,
    file: &'static str,
    springs: [f64; 2],
}

const CHEETAH_CUB: Robot = Robot {
    name: "cheetah-cub",
    file: include_str!("../../robots/cheetah-cub.toml"),
    springs: [4400.0, 1800.0],
};
const ONCILLA: Robot = Robot {
    name: "oncilla",
    file: include_str!("../../robots/oncilla.toml"),
    springs: [12_230.0, 5005.0],
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

    /// Returns the least bend of a knee over the drop \[°\], and the fault that ended it, if any.
    fn least_bend(&self) -> (f64, Option<String>) {
        let (registry, text) = (Registry::standard(), self.scenario());
        let assembly = Assembly::of_texts(&registry, &text, self.robot.file, &[]);
        let assembly = assembly.unwrap_or_else(|error| panic!("{error}\n{text}"));
        let mut rig = assembly
            .rig()
            .unwrap_or_else(|error| panic!("{error}\n{text}"));
        let mut least = f64::INFINITY;
        for ms in (0..=600).step_by(2) {
            if let Err(fault) = rig.run_until(SimTime::from_nanos(ms * 1_000_000), &mut ()) {
                return (least, Some(fault.to_string()));
            }
            let state = rig.plant().state().expect("the plant has named states");
            for leg in self.legs {
                let angles = state.get(&signal::of_leg(leg, signal::ANGLES));
                let &[first, second, _] = angles.expect("angles") else {
                    panic!("a leg has three segments");
                };
                let bend = first - second;
                least = least.min(libm::atan2(libm::sin(bend), libm::cos(bend)).to_degrees());
            }
        }
        let balance = rig.plant().energy();
        let share = balance.residual / balance.exchanged;
        // Twice the worst balance of harsh drops between stops, at the default tolerance.
        assert!(share.abs() < 1e-3, "{share:e} not accounted for:\n{text}");
        (least, None)
    }
}

#[test]
fn knees_of_compliant_plants_keep_their_side() {
    let lcp = "model = \"lcp\"";
    let massless = "model = \"massless\"";
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
        let (least, fault) = drop.least_bend();
        assert_eq!(fault, None, "{}", drop.scenario());
        assert!(least > 1.0, "bent by {least}°:\n{}", drop.scenario());
    }
}

/// Springs of a tenth to a hundred times the stiffness, friction from 0 to 2, toes, subsets of
/// legs. Where a motion is too stiff for the method, the run may end with a fault of that; none of
/// a leg.
#[test]
fn slow_knees_keep_their_side_in_random_harsh_drops() {
    let drops = std::env::var("KNEES").map_or(DROPS, |number| number.parse().unwrap());
    let mut faults = 0;
    for seed in 0..drops {
        let drop = Drop::random(seed);
        let (least, fault) = drop.least_bend();
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
