//! Where the energy of a trot goes.

use std::path::Path;

use twinrig::kernel::{SimDuration, SimTime};
use twinrig::robot::Robot;
use twinrig::runtime::EnergyBalance;
use twinrig::scenario::Setting;
use twinrig::{Assembly, PlantContext, PlantKind, Registry, lcp, massless};
use twinrig_tests::Scene;

#[test]
fn the_power_books_of_a_trot_close_to_a_millionth() {
    let registry = Registry::standard();
    for base in ["free", "planar", "fixed"] {
        let scene = Scene {
            duration_ms: 2000,
            base,
            ..Scene::default()
        };
        let mut rig = match scene.assembly(&registry).rig() {
            Ok(rig) => rig,
            Err(error) => panic!("{error}"),
        };
        let mut checked = 0;
        for ms in (100..=2000).step_by(100) {
            let to = SimTime::ZERO + SimDuration::from_millis(ms);
            if let Err(error) = rig.run_until(to, &mut ()) {
                panic!("{error}");
            }
            let balance = rig.plant().energy();
            let sum = balance.stored() + balance.dissipated + balance.impact - balance.actuator;
            assert!(sum.is_finite() && balance.dissipated >= 0.0);
            assert!(
                balance.residual.abs() < 1e-6 * balance.exchanged,
                "{base} at {ms} ms: {balance:?}"
            );
            checked += 1;
        }
        assert_eq!(checked, 20);
        assert!(rig.plant().energy().exchanged > 1.0, "it trotted");
    }
}

/// Passive legs of the full and of the mass-less plant, with stiff joints; how far the hips of the latter swing.
fn stiff_legs(plant: &str, friction: &str) -> (EnergyBalance, f64) {
    let registry = Registry::standard();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios/passive-legs.toml");
    let set = |key: &str, value: String| Setting {
        origin: "the test".to_owned(),
        key: key.to_owned(),
        value,
    };
    let each = ["hip", "knee", "ankle"].map(|joint| {
        let key = format!("override.leg.aslp.joint_friction.{joint}");
        set(&key, format!("{friction:?}"))
    });
    let mut settings = each.to_vec();
    settings.push(set("plant.model", format!("{plant:?}")));
    let assembly = match Assembly::of_file(&registry, &path, &settings) {
        Ok(assembly) => assembly,
        Err(error) => panic!("{error}"),
    };
    let mut rig = match assembly.rig() {
        Ok(rig) => rig,
        Err(error) => panic!("{error}"),
    };
    let mut most = 0.0_f64;
    for ms in (20..=3000).step_by(20) {
        let to = SimTime::ZERO + SimDuration::from_millis(ms);
        if let Err(error) = rig.run_until(to, &mut ()) {
            panic!("{plant}, {friction}: {error}");
        }
        let state = rig.plant().state();
        let angles = state.as_ref().and_then(|state| state.get("leg/LF/angles"));
        // From the start, where it is 10° in front of the reference.
        most = angles.map_or(most, |angles| most.max(angles[0].abs()));
    }
    (rig.plant().energy(), most)
}

/// What the springs hold and gravity gives, friction takes, whichever the plant: the segments, which only one of them has, have a
/// thirtieth of it.
#[test]
fn stiff_joints_take_the_same_energy_in_both_plants() {
    for friction in ["5e-3 N·m·s/rad", "2e-2 N·m·s/rad", "0.1 N·m·s/rad"] {
        let (full, swung) = stiff_legs("lcp", friction);
        let (massless, swings) = stiff_legs("massless", friction);
        assert!(
            (massless.dissipated / full.dissipated - 1.0).abs() < 5e-2,
            "{friction}: {massless:?}, not {full:?}"
        );
        assert!((swings - swung).abs() < 0.02, "{swings}, not {swung} rad");
        let least = 1e-6 * massless.exchanged;
        assert!(massless.residual.abs() < least, "{massless:?}");
    }
}

/// The plant of the scene with joints whose friction pushes. No robot file has such; a defect might.
fn with_pushing_joints() -> Registry {
    fn robot_of(context: &PlantContext<'_>) -> Robot {
        let mut robot = context.robot.clone();
        for mount in &mut robot.legs {
            let friction = &mut mount.leg.joint_friction;
            (friction.hip, friction.knee, friction.ankle) = (-2e-3, -2e-3, -2e-3);
        }
        robot
    }
    let massless = |context: &PlantContext<'_>| {
        let robot = robot_of(context);
        massless(&PlantContext {
            robot: &robot,
            ..*context
        })
    };
    let lcp = |context: &PlantContext<'_>| {
        let robot = robot_of(context);
        lcp(&PlantContext {
            robot: &robot,
            ..*context
        })
    };
    let about = "friction that pushes";
    Registry::standard()
        .with_plant(PlantKind::new("massless", about, massless))
        .with_plant(PlantKind::new("lcp", about, lcp))
}

#[test]
fn friction_that_gives_energy_ends_a_run_in_every_plant() {
    let registry = with_pushing_joints();
    for model in ["massless", "lcp"] {
        let scene = Scene {
            model,
            ..Scene::default()
        };
        let assembly = scene.assembly(&registry);
        let mut rig = match assembly.rig() {
            Ok(rig) => rig,
            Err(error) => panic!("{error}"),
        };
        let error = rig.run_until(assembly.end(), &mut ()).unwrap_err();
        let told = error.to_string();
        assert!(told.contains("friction has given"), "{model}: {told}");
    }
}
