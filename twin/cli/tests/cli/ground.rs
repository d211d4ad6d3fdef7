//! Grounds and pushes that a plant cannot have.

use crate::common::twin;

/// A wall is missing with rigid constraints, and a bar of a few millimetres is passed through.
#[test]
fn bar_that_is_no_obstacle_is_refused() {
    let trot = format!("{}/../../scenarios/trot.toml", env!("CARGO_MANIFEST_DIR"));
    let check = |plant: &str, profile: &str, length: &str, more: &str| {
        let sizes = format!("at = '1 m', height = '8 cm', length = '{length}'");
        let ground = format!("plant.ground={{ profile = '{profile}', {sizes} }}");
        let plant = format!("plant.model={plant}");
        let words = [
            "check", &trot, "--set", &plant, "--set", &ground, "--set", more,
        ];
        let done = twin(&words);
        (done.code, done.err)
    };
    for plant in ["massless", "lcp"] {
        let rigid = "plant.constraints=rigid";
        let (code, error) = check(plant, "bar", "5 cm", rigid);
        assert_eq!(code, 2, "{error}");
        assert!(
            error.contains("with rigid constraints feet pass through a bar"),
            "{error}"
        );
        assert!(
            error.contains("set `constraints = \"compliant\"`"),
            "{error}"
        );
        assert!(error.contains("plant.ground ="), "{error}");
        let (code, error) = check(plant, "bar", "1 cm", "seed=1");
        assert_eq!(code, 2, "{error}");
        // 2 · 1 m/s · √(1.1 kg / 4 / 10 kN/m) = 10.49 mm.
        assert!(error.contains("a bar of less than 0.0105 m"), "{error}");
        assert_eq!(check(plant, "bar", "11 mm", "seed=1").0, 0);
        assert_eq!(check(plant, "hole", "5 cm", rigid).0, 0);
    }
}

#[test]
fn push_on_a_leg_that_is_not_simulated_is_reported_at_its_place() {
    let push = format!("{}/../../scenarios/push.toml", env!("CARGO_MANIFEST_DIR"));
    for (set, leg) in [
        ("push.2.on=leg/LX/foot", "LX"),
        ("plant.legs=['RF', 'LH', 'RH']", "LF"),
    ] {
        let done = twin(&["check", &push, "--set", set]);
        assert_eq!(done.code, 2, "{done:?}");
        let expected = format!("the scene has no leg `{leg}`");
        assert!(done.err.contains(&expected), "{}", done.err);
        assert!(done.err.contains("on = \"leg/"), "{}", done.err);
    }
}
