//! Calls of FMI 2.0.

use std::ptr::{null, null_mut};

use twinrig_rig::fmu::FmuState;

use super::{Master, rig2};
use crate::component::Component;
use crate::failure::Status;
use crate::fmi2::*;
use crate::fmi2_unsupported::*;
use crate::phase::Phase;

#[test]
fn instance_that_cannot_be_made_is_null_and_the_reason_is_logged() {
    let rig = rig2();
    let (name, token, place) = (c"a".as_ptr(), rig.token.as_ptr(), rig.resources.as_ptr());
    let nowhere = c"file:///nowhere%20at%20all/resources".as_ptr();
    let no_text = c"\xff\xfe".as_ptr();
    for (made, expected) in [
        (
            Master::of(null(), 1, token, place),
            "`instanceName` is a null",
        ),
        (Master::of(name, 0, token, place), "for co-simulation only"),
        (Master::of(name, 1, null(), place), "`fmuGUID` is a null"),
        (
            Master::of(name, 1, token, null()),
            "`fmuResourceLocation` is",
        ),
        (
            Master::of(name, 1, c"{0}".as_ptr(), place),
            "has the token {0}",
        ),
        (
            Master::of(name, 1, no_text, place),
            "`fmuGUID` is not UTF-8",
        ),
        (
            Master::of(name, 1, token, nowhere),
            "/nowhere at all/resources",
        ),
        // Escaped, as the logger of FMI 2.0 requires.
        (
            Master::of(name, 1, token, c"/no#where%d".as_ptr()),
            "/no##where%%d",
        ),
    ] {
        assert!(made.c.is_null());
        made.expect(expected);
    }
    // Without callbacks.
    // SAFETY: texts of this test, and null.
    let silent = unsafe { fmi2Instantiate(name, 1, no_text, place, null(), 0, 0) };
    assert!(silent.is_null());
}

#[test]
fn calls_in_a_wrong_state_are_refused_and_change_nothing() {
    let master = Master::new();
    let c = master.c;
    // SAFETY: a live instance.
    let step = |at: f64| unsafe { fmi2DoStep(c, at, 0.01, 1) };
    assert_eq!(step(0.0), Status::Error);
    master.expect("fmi2DoStep: it is not allowed before the initialization mode");
    // SAFETY: a live instance.
    unsafe {
        assert_eq!(fmi2ExitInitializationMode(c), Status::Error);
        assert_eq!(fmi2Terminate(c), Status::Error);
        let mut value = 0.0;
        assert_eq!(fmi2GetReal(c, &1, 1, &raw mut value), Status::Error);
    }
    master.begin();
    // SAFETY: a live instance.
    unsafe {
        assert_eq!(fmi2SetupExperiment(c, 0, 0.0, 0.0, 0, 0.0), Status::Error);
        assert_eq!(fmi2EnterInitializationMode(c), Status::Error);
    }
    master.expect("not allowed once steps have begun");
    assert_eq!(step(0.0), Status::Ok);
    // SAFETY: a live instance.
    let long = unsafe { fmi2DoStep(c, 0.01, 1.995, 1) };
    assert_eq!(long, Status::Error);
    master.expect("after the stop time of 2.0 s");
    assert_eq!(step(0.01), Status::Ok);
    // SAFETY: a live instance.
    unsafe { assert_eq!(fmi2Terminate(c), Status::Ok) };
    assert_eq!(step(0.02), Status::Error);
    let untroubled = Master::new();
    untroubled.begin();
    // SAFETY: a live instance.
    unsafe { assert_eq!(fmi2DoStep(untroubled.c, 0.0, 0.02, 1), Status::Ok) };
    assert_eq!(master.fingerprint(), untroubled.fingerprint());
    // After a reset it runs again, from the start.
    // SAFETY: a live instance.
    unsafe { assert_eq!(fmi2Reset(c), Status::Ok) };
    master.begin();
    // SAFETY: a live instance.
    unsafe { assert_eq!(fmi2DoStep(c, 0.0, 0.02, 1), Status::Ok) };
    assert_eq!(master.fingerprint(), untroubled.fingerprint());
}

#[test]
fn null_pointers_and_wrong_arguments_are_errors() {
    let none: *mut Component = null_mut();
    let master = Master::new();
    master.begin();
    let c = master.c;
    let (inputs, output) = ([1_u32, 2], rig2().reference("body/position[0]"));
    // SAFETY: null, or a live instance and places of this test.
    unsafe {
        fmi2FreeInstance(none);
        assert_eq!(fmi2DoStep(none, 0.0, 0.1, 0), Status::Error);
        assert_eq!(fmi2GetReal(c, null(), 1, null_mut()), Status::Error);
        master.expect("fmi2GetReal: `vr` is a null pointer");
        assert_eq!(
            fmi2GetReal(c, inputs.as_ptr(), 2, null_mut()),
            Status::Error
        );
        assert_eq!(fmi2GetReal(c, null(), 0, null_mut()), Status::Ok);
        let mut value = 0.0;
        let far = fmi2GetReal(c, inputs.as_ptr(), usize::MAX, &raw mut value);
        assert_eq!(far, Status::Error);
        master.expect("more than memory has");
        let odd = inputs.as_ptr().wrapping_byte_add(1);
        assert_eq!(fmi2GetReal(c, odd, 1, &raw mut value), Status::Error);
        master.expect("`vr` is not aligned to 4 bytes");
        // Time is a variable in FMI 3.0 only.
        assert_eq!(fmi2GetReal(c, &0, 1, &raw mut value), Status::Error);
        master.expect("no Real variable with the value reference 0");
        assert_eq!(
            fmi2SetReal(c, &raw const output, 1, &raw const value),
            Status::Error
        );
        master.expect("`body/position[0]` is no input");
        let number = f64::NAN;
        assert_eq!(
            fmi2SetReal(c, inputs.as_ptr(), 1, &raw const number),
            Status::Discard
        );
        master.expect("cannot be set to NaN");
        let mut integer = 0;
        assert_eq!(
            fmi2GetInteger(c, &raw const output, 1, &raw mut integer),
            Status::Error
        );
        master.expect("there is no Integer variable");
        assert_eq!(fmi2GetInteger(c, null(), 0, null_mut()), Status::Ok);
        assert_eq!(fmi2CancelStep(c), Status::Error);
        assert_eq!(fmi2GetStatus(c, 0, null_mut()), Status::Discard);
        assert_eq!(fmi2GetFMUstate(c, null_mut()), Status::Error);
        assert_eq!(fmi2SetFMUstate(c, null_mut()), Status::Error);
        assert_eq!(fmi2FreeFMUstate(c, null_mut()), Status::Ok);
        assert_eq!(fmi2DoStep(c, 0.0, 0.1, 0), Status::Ok);
        let mut time = 0.0;
        assert_eq!(fmi2GetRealStatus(c, 2, &raw mut time), Status::Ok);
        assert_eq!(time, 0.1);
    }
}

#[test]
fn states_can_be_kept_replaced_and_moved_to_another_instance() {
    let (one, other) = (Master::new(), Master::new());
    one.begin();
    let mut state: *mut FmuState = null_mut();
    // SAFETY: live instances, and places of this test.
    unsafe {
        assert_eq!(fmi2GetFMUstate(one.c, &raw mut state), Status::Ok);
        assert_eq!(fmi2DoStep(one.c, 0.0, 0.3, 0), Status::Ok);
        // Replaces the first one.
        assert_eq!(fmi2GetFMUstate(one.c, &raw mut state), Status::Ok);
        let mut size = 0;
        assert_eq!(
            fmi2SerializedFMUstateSize(one.c, state, &raw mut size),
            Status::Ok
        );
        let mut bytes = vec![0_u8; size];
        let short = fmi2SerializeFMUstate(one.c, state, bytes.as_mut_ptr(), size - 1);
        assert_eq!(short, Status::Error);
        one.expect("the buffer only");
        let whole = fmi2SerializeFMUstate(one.c, state, bytes.as_mut_ptr(), size);
        assert_eq!(whole, Status::Ok);
        assert_eq!(fmi2FreeFMUstate(one.c, &raw mut state), Status::Ok);
        assert!(state.is_null());
        // Another instance continues, without an initialization of its own. The pointer need not
        // be initialised.
        let cut = fmi2DeSerializeFMUstate(other.c, bytes.as_ptr(), size - 1, &raw mut state);
        assert_eq!((cut, state.is_null()), (Status::Error, true));
        other.expect("no state of this FMU");
        state = std::ptr::dangling_mut();
        let made = fmi2DeSerializeFMUstate(other.c, bytes.as_ptr(), size, &raw mut state);
        assert_eq!(made, Status::Ok);
        assert_eq!(fmi2SetFMUstate(other.c, state), Status::Ok);
        assert_eq!(fmi2FreeFMUstate(other.c, &raw mut state), Status::Ok);
        for master in [&one, &other] {
            assert_eq!(fmi2DoStep(master.c, 0.3, 0.2, 0), Status::Ok);
        }
    }
    assert_eq!(one.fingerprint(), other.fingerprint());
    assert_eq!(
        one.number("body/position[0]"),
        other.number("body/position[0]")
    );
}

#[test]
fn value_out_of_range_is_refused_by_name() {
    let master = Master::new();
    let duty = rig2().reference("duty_factor/fore");
    // SAFETY: a live instance, and places of this test.
    unsafe {
        let status = fmi2SetReal(master.c, &raw const duty, 1, &2.0);
        assert_eq!(status, Status::Discard);
    }
    master.expect("duty_factor/fore = 2 is not in");
}

#[test]
fn panic_is_fatal_for_its_instance_alone() {
    let (master, other) = (Master::new(), Master::new());
    master.begin();
    other.begin();
    // SAFETY: live instances.
    unsafe {
        let panicked = Component::call(master.c, "test", Phase::LIVE, |_| panic!("out of cheese"));
        assert_eq!(panicked, Status::Fatal);
        master.expect("test: twin panicked: out of cheese");
        assert_eq!(fmi2DoStep(master.c, 0.0, 0.1, 0), Status::Fatal);
        assert_eq!(fmi2Reset(master.c), Status::Fatal);
        assert_eq!(fmi2DoStep(other.c, 0.0, 0.1, 0), Status::Ok);
    }
}

#[test]
fn instances_on_threads_of_their_own_are_independent() {
    rig2();
    let run = || {
        let master = Master::new();
        master.begin();
        for n in 0..20 {
            // SAFETY: a live instance.
            let status = unsafe { fmi2DoStep(master.c, 0.05 * f64::from(n), 0.05, 1) };
            assert_eq!(status, Status::Ok);
        }
        master.fingerprint()
    };
    let alone = run();
    let threads: Vec<_> = (0..3)
        .map(|_| std::thread::Builder::new().spawn(run))
        .collect();
    for thread in threads {
        assert_eq!(thread.unwrap().join().unwrap(), alone);
    }
}
