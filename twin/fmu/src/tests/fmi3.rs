//! Calls of FMI 3.0.

use std::ffi::CStr;
use std::ptr::null;

use super::{Messages, log3, plant3};
use crate::component::Component;
use crate::failure::Status;
use crate::fmi3::*;
use crate::fmi3_unsupported::*;

/// Returns an instance of the plant by FMI 3.0.
fn plant(messages: &Messages, token: &CStr, events: bool) -> *mut Component {
    let environment = std::ptr::from_ref(messages).cast_mut().cast();
    // SAFETY: texts that live as long as the test.
    unsafe {
        fmi3InstantiateCoSimulation(
            c"plant".as_ptr(),
            token.as_ptr(),
            plant3().resources.as_ptr(),
            false,
            false,
            events,
            false,
            null(),
            0,
            environment,
            Some(log3),
            null(),
        )
    }
}

#[test]
fn arrays_of_fmi_3_have_the_length_of_their_variables() {
    let messages = Messages::default();
    assert!(plant(&messages, c"", false).is_null());
    assert!(plant(&messages, &plant3().token, true).is_null());
    let instance = plant(&messages, &plant3().token, false);
    let position = plant3().reference("body/position");
    let references = [0, position];
    let mut values = [f64::NAN; 5];
    let (mut flags, mut reached) = ([true; 3], f64::NAN);
    // SAFETY: a live instance, and places of this test.
    unsafe {
        let [event, end, early] = flags.each_mut().map(std::ptr::from_mut);
        let begun = fmi3EnterInitializationMode(instance, false, 0.0, 5.0, false, 0.0);
        assert_eq!(begun, Status::Ok);
        assert_eq!(fmi3ExitInitializationMode(instance), Status::Ok);
        let stepped = fmi3DoStep(
            instance,
            5.0,
            0.25,
            true,
            event,
            end,
            early,
            &raw mut reached,
        );
        assert_eq!(stepped, Status::Ok);
        let mut get = |length| {
            fmi3GetFloat64(
                instance,
                references.as_ptr(),
                2,
                values.as_mut_ptr(),
                length,
            )
        };
        assert_eq!(get(3), Status::Error);
        assert_eq!(get(5), Status::Error);
        assert_eq!(get(4), Status::Ok);
        // The second element is no variable.
        let inner = position + 1;
        let mut value = 0.0;
        let status = fmi3GetFloat64(instance, &raw const inner, 1, &raw mut value, 1);
        assert_eq!(status, Status::Error);
        let status = fmi3SetFloat64(instance, &0, 1, &raw const value, 1);
        assert_eq!(status, Status::Error);
        assert_eq!(fmi3EnterEventMode(instance), Status::Error);
        fmi3FreeInstance(instance);
    }
    assert_eq!((flags, reached, values[0]), ([false; 3], 5.25, 5.25));
    assert!(values[1..4].iter().all(|value| value.is_finite()));
    let messages = messages.into_inner().unwrap();
    let text: Vec<&str> = messages.iter().map(|(_, text)| text.as_str()).collect();
    for (text, expected) in text.iter().zip([
        "has the token",
        "no event mode",
        "3 values for variables with 4 elements",
        "5 values for variables with 4 elements",
        "no Float64 variable",
        "`time` is no input",
        "no event mode",
    ]) {
        assert!(text.contains(expected), "{text:?} lacks {expected:?}");
    }
}
