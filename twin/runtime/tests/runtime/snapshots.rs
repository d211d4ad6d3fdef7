//! A rig that is saved at any event and restored continues bit for bit.

use crate::toys::{Log, any_fixture};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use twinrig_kernel::{Port, SimTime, Snapshot};
use twinrig_runtime::{Plant, PlantFault, RigError};

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn restored_rig_continues_bit_for_bit(fixture in any_fixture(), events in 0_usize..300) {
        let (mut rig, _) = fixture.build();
        for _ in 0..events {
            rig.step(fixture.duration, &mut ()).unwrap();
        }
        let snapshot = rig.save();
        let mut expected = Log::default();
        rig.run_until(fixture.duration, &mut expected).unwrap();
        let end = rig.save();

        // Into a new rig without scheduled changes, which are part of the snapshot,
        let mut without_changes = fixture.clone();
        without_changes.changes.clear();
        let (mut fresh, _) = without_changes.build();
        fresh.restore(&snapshot).unwrap();
        prop_assert_eq!(&fresh.save(), &snapshot);
        let mut again = Log::default();
        fresh.run_until(fixture.duration, &mut again).unwrap();
        prop_assert_eq!(&again, &expected);
        prop_assert_eq!(&fresh.save(), &end);

        // and into the one that has run to the end.
        rig.restore(&snapshot).unwrap();
        let mut back = Log::default();
        rig.run_until(fixture.duration, &mut back).unwrap();
        prop_assert_eq!(&back, &expected);
        prop_assert_eq!(&rig.save(), &end);
    }

    #[test]
    fn rig_of_another_configuration_refuses_the_snapshot(a in any_fixture(), b in any_fixture()) {
        prop_assume!(
            a.delays.len() != b.delays.len()
                || a.schedule.period() != b.schedule.period()
                || a.schedule.observe != b.schedule.observe
        );
        let (mut rig, _) = b.build();
        let before = rig.save();
        let error = rig.restore(&a.build().0.save()).unwrap_err();
        prop_assert!(matches!(error, RigError::Snapshot(_)));
        prop_assert_eq!(rig.save(), before, "refusal changes nothing");
        prop_assert_eq!(rig.run_until(SimTime::ZERO, &mut ()), Ok(()));
    }

    #[test]
    fn corrupt_snapshot_is_refused(fixture in any_fixture(), cut in 0_usize..10_000, flip in any::<u8>()) {
        let (mut rig, _) = fixture.build();
        let mut bytes = rig.save().0;
        bytes.truncate(cut % bytes.len());
        if let Some(byte) = bytes.last_mut() {
            *byte ^= flip;
        }
        prop_assert!(rig.restore(&Snapshot(bytes)).is_err());
    }
}

/// A flipped bit may well be the state of another motion: nothing but the hash tells.
#[test]
fn single_bit_flips_are_refused_and_change_nothing() {
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let fixture = any_fixture().new_tree(&mut runner).unwrap().current();
    let (mut rig, _) = fixture.build();
    for _ in 0..100 {
        rig.step(fixture.duration, &mut ()).unwrap();
    }
    let mut state = rig.save();
    let bits = 8 * state.0.len();
    let flip = |state: &mut Snapshot, bit: usize| state.0[bit / 8] ^= 1 << (bit % 8);
    // All bits in an order without pattern, several times.
    for n in 0..100_000 {
        let bit = n * 48_271 % bits;
        flip(&mut state, bit);
        let refused = rig.restore(&state);
        assert!(matches!(refused, Err(RigError::Snapshot(_))), "bit {bit}");
        flip(&mut state, bit);
    }
    assert_eq!(rig.save(), state);
}

/// A plant that does not implement `save` and `restore`.
struct Forgetful;

impl Plant for Forgetful {
    fn name(&self) -> &'static str {
        "forgetful"
    }
    fn ports(&self) -> Vec<Port> {
        Vec::new()
    }
    fn advance(&mut self, _: SimTime, _: &[f64]) -> Result<(), PlantFault> {
        Ok(())
    }
    fn observe(&mut self, _: &mut [f64]) {}
}

#[test]
fn plant_without_saved_state_cannot_be_restored() {
    let saved = Forgetful.save();
    let error = Forgetful.restore(&saved).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("forgetful cannot be restored")
    );
}
