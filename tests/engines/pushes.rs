//! Pushes in the engines, compared with the full plant.

use twinrig::Assembly;
use twinrig_record::Fingerprint;
use twinrig_runtime::EnergyBalance;

use super::ENGINES;

const ROBOT: &str = include_str!("../../robots/cheetah-cub.toml");

/// Energy balance of a robot that falls and is pushed on trunk and foot.
fn pushed(model: &str) -> EnergyBalance {
    let text = format!(
        r#"
        robot = "cheetah-cub"
        duration = "60 ms"
        [plant]
        model = "{model}"
        step = "0.25 ms"
        [[push]]
        on = "body"
        at = "10.3 ms"
        for = "20 ms"
        impulse = "0.4 N·s"
        direction = [1, -2, 0.5]
        shape = "half-sine"
        point = ["3 cm", "1 cm", "-2 cm"]
        [[push]]
        on = "body"
        at = "15 ms"
        for = "20 ms"
        torque = "0.1 N·m"
        direction = "-z"
        [[push]]
        on = "leg/RF/foot"
        at = "20 ms"
        for = "15 ms"
        force = "3 N"
        direction = [-2, 1, 1]
        shape = "triangle"
        "#
    );
    let registry = twinrig::registry();
    let assembly = Assembly::builder(&registry).robot(ROBOT).recorded(&text);
    let assembly = assembly.unwrap_or_else(|error| panic!("{error}"));
    let mut rig = assembly.rig().unwrap_or_else(|error| panic!("{error}"));
    rig.run_until(assembly.end(), &mut Fingerprint::new())
        .unwrap();
    rig.plant().energy()
}

#[test]
fn engines_do_the_work_of_the_full_plant() {
    let reference = pushed("lcp");
    assert!(reference.external > 0.05, "{}", reference.external);
    for engine in ENGINES {
        let balance = pushed(engine);
        let work = balance.external / reference.external - 1.0;
        assert!(work.abs() < 0.01, "{engine}: {work:e}");
        let residual = (balance.residual / reference.external).abs();
        assert!(residual < 0.02, "{engine}: {residual:e}");
    }
}
