//! Knees of compliant plants keep their side in drops onto one leg.

use twinrig::kernel::SimTime;
use twinrig::{Assembly, Registry};
use twinrig_kernel::signal;

const CHEETAH_CUB: &str = include_str!("../../robots/cheetah-cub.toml");
const ONCILLA: &str = include_str!("../../robots/oncilla.toml");

/// A robot on one leg, with its hip and knee bent by these angles \[°\], which lands after falling
/// by a height \[mm\], or stands up by its own springs.
struct Drop {
    robot: (&'static str, &'static str),
    plant: &'static str,
    drives: &'static str,
    height_mm: u32,
    bend: [f64; 2],
}

impl Drop {
    fn scenario(&self) -> String {
        let [hip, knee] = self.bend;
        format!(
            "name = \"drop\"\nrobot = \"{}\"\nduration = \"600 ms\"\nseed = 1\n\n\
             [plant]\n{}\nbase = \"free\"\nlegs = [\"LF\"]\nstep = \"1 ms\"\nconstraints = \"compliant\"\n\
             ground = {{ friction = 1.0, profile = \"step-down\", at = \"-10 m\", height = \"{} mm\" }}\n\
             start = {{ q1 = \"{hip} deg\", q2 = \"-{knee} deg\", q3 = \"{knee} deg\" }}\n\n\
             [actuator]\nkind = \"{}\"\n\n[observe]\nperiod = \"1 ms\"\n",
            self.robot.0, self.plant, self.height_mm, self.drives
        )
    }

    /// Returns the least bend of the knee over the drop \[°\], or the fault that ends it.
    fn least_bend(&self) -> Result<f64, String> {
        let (registry, text) = (Registry::standard(), self.scenario());
        let assembly = Assembly::of_texts(&registry, &text, self.robot.1, &[]);
        let assembly = assembly.unwrap_or_else(|error| panic!("{error}\n{text}"));
        let mut rig = assembly.rig().unwrap_or_else(|error| panic!("{error}"));
        let mut least = f64::INFINITY;
        for ms in 0..=600 {
            let reached = rig.run_until(SimTime::from_nanos(ms * 1_000_000), &mut ());
            reached.map_err(|error| error.to_string())?;
            let state = rig.plant().state().expect("the plant has named states");
            let angles = state.get(&signal::of_leg("LF", signal::ANGLES));
            let &[first, second, _] = angles.expect("angles") else {
                panic!("a leg has three segments");
            };
            least = least.min((first - second).to_degrees());
        }
        let balance = rig.plant().energy();
        let share = balance.residual / balance.exchanged;
        // Twice the worst balance of harsh drops between stops, at the default tolerance.
        assert!(share.abs() < 1e-3, "{share:e} not accounted for");
        Ok(least)
    }
}

#[test]
fn knees_of_compliant_plants_keep_their_side() {
    let lcp = "model = \"lcp\"";
    let massless = "model = \"massless\"";
    let (small, large) = (("cheetah-cub", CHEETAH_CUB), ("oncilla", ONCILLA));
    for (robot, plant, drives, height_mm, bend) in [
        (small, lcp, "none", 0, [15.0, 63.0]),
        (small, lcp, "none", 0, [-20.0, 80.0]),
        (large, lcp, "servo", 330, [12.5, 59.0]),
        (large, massless, "servo", 330, [12.5, 59.0]),
    ] {
        let drop = Drop {
            robot,
            plant,
            drives,
            height_mm,
            bend,
        };
        let least = drop.least_bend();
        let least = least.unwrap_or_else(|error| panic!("{error}\n{}", drop.scenario()));
        assert!(least > 1.0, "bent by {least}°:\n{}", drop.scenario());
    }
}
