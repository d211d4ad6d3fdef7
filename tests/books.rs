//! Where the energy of a trot goes.

use twinrig::Registry;
use twinrig::kernel::{SimDuration, SimTime};
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
            let books = rig.plant().energy();
            let sum = books.stored() + books.dissipated + books.impact - books.actuator;
            assert!(sum.is_finite() && books.dissipated >= 0.0);
            assert!(
                books.residual.abs() < 1e-6 * books.exchanged,
                "{base} at {ms} ms: {books:?}"
            );
            checked += 1;
        }
        assert_eq!(checked, 20);
        assert!(rig.plant().energy().exchanged > 1.0, "it trotted");
    }
}
