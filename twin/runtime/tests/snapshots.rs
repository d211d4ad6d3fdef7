//! Save at any event, restore, go on: bit for bit the same run.

mod toys;

use proptest::prelude::*;
use toys::{Log, any_scene};
use twinrig_kernel::{SimTime, Snapshot};
use twinrig_runtime::RigError;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn a_rig_restored_at_any_event_goes_on_bit_for_bit(scene in any_scene(), events in 0_usize..300) {
        let (mut rig, _) = scene.build();
        for _ in 0..events {
            rig.step(scene.duration, &mut ()).unwrap();
        }
        let snapshot = rig.save();
        let mut ahead = Log::default();
        rig.run_until(scene.duration, &mut ahead).unwrap();
        let end = rig.save();

        // Into a fresh rig, which has forgotten its scheduled changes and finds them in the snapshot …
        let mut forgetful = scene.clone();
        forgetful.changes.clear();
        let (mut fresh, _) = forgetful.build();
        fresh.restore(&snapshot).unwrap();
        prop_assert_eq!(&fresh.save(), &snapshot);
        let mut again = Log::default();
        fresh.run_until(scene.duration, &mut again).unwrap();
        prop_assert_eq!(&again, &ahead);
        prop_assert_eq!(&fresh.save(), &end);

        // … and into the one that has run to the end.
        rig.restore(&snapshot).unwrap();
        let mut back = Log::default();
        rig.run_until(scene.duration, &mut back).unwrap();
        prop_assert_eq!(&back, &ahead);
        prop_assert_eq!(&rig.save(), &end);
    }

    #[test]
    fn a_rig_of_another_make_refuses_the_snapshot(a in any_scene(), b in any_scene()) {
        prop_assume!(
            a.delays.len() != b.delays.len()
                || a.schedule.period() != b.schedule.period()
                || a.schedule.observe != b.schedule.observe
        );
        let (mut rig, _) = b.build();
        let before = rig.save();
        let error = rig.restore(&a.build().0.save()).unwrap_err();
        prop_assert!(matches!(error, RigError::Snapshot(_)));
        prop_assert_eq!(rig.save(), before, "nothing has changed");
        prop_assert_eq!(rig.run_until(SimTime::ZERO, &mut ()), Ok(()));
    }

    #[test]
    fn bytes_that_are_no_snapshot_are_refused(scene in any_scene(), cut in 0_usize..10_000, flip in any::<u8>()) {
        let (mut rig, _) = scene.build();
        let mut bytes = rig.save().0;
        bytes.truncate(cut % bytes.len());
        if let Some(byte) = bytes.last_mut() {
            *byte ^= flip;
        }
        prop_assert!(rig.restore(&Snapshot(bytes)).is_err());
    }
}
