//! The C functions, called as masters call them, well and badly.

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::ptr::{null, null_mut};
use std::sync::{Mutex, OnceLock};

use twinrig::Registry;
use twinrig::fmu::FmuState;

use crate::component::Component;
use crate::failure::Status;
use crate::fmi2::*;
use crate::fmi2_unsupported::*;
use crate::fmi3::*;
use crate::fmi3_unsupported::*;
use crate::logger::Log2;

/// An exported FMU, unpacked.
struct Unpacked {
    token: CString,
    resources: CString,
    description: String,
}

/// Exports a part of the trot, with the marker alone as the library: functions are called here.
fn unpacked(part: &str, fmi: &str) -> Unpacked {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/trot.toml");
    let program = std::env::current_exe().unwrap();
    let folder = program.with_file_name(format!("fmu-{part}{fmi}"));
    let out = folder.with_extension("fmu");
    let library = folder.with_extension("so");
    std::fs::write(&library, [b"\x7fELF", &crate::MARKER[..]].concat()).unwrap();
    let words = ["export", "fmu", "--part", part, "--fmi", fmi, "--out"].map(PathBuf::from);
    let files = [out.clone(), "--library".into(), library.clone(), scenario];
    let (mut printed, mut errors) = (Vec::new(), Vec::new());
    let words = words.into_iter().chain(files);
    let code = twinrig::run_with(&Registry::standard(), words, &mut printed, &mut errors);
    assert_eq!(code, 0, "{}", String::from_utf8_lossy(&errors));
    let archive = std::fs::File::open(&out).unwrap();
    let mut archive = zip::ZipArchive::new(archive).unwrap();
    archive.extract(&folder).unwrap();
    let mut description = String::new();
    let mut file = archive.by_name("modelDescription.xml").unwrap();
    file.read_to_string(&mut description).unwrap();
    std::fs::remove_file(out).unwrap();
    std::fs::remove_file(library).unwrap();
    let key = if fmi == "2" {
        "guid=\""
    } else {
        "instantiationToken=\""
    };
    let token = description.split_once(key).unwrap().1;
    let token = token.split('"').next().unwrap();
    let uri = match fmi {
        "2" => format!("file://{}/resources", folder.display()),
        _ => format!("{}/resources", folder.display()),
    };
    Unpacked {
        token: CString::new(token).unwrap(),
        resources: CString::new(uri).unwrap(),
        description,
    }
}

fn rig2() -> &'static Unpacked {
    static RIG: OnceLock<Unpacked> = OnceLock::new();
    RIG.get_or_init(|| unpacked("rig", "2"))
}

fn plant3() -> &'static Unpacked {
    static PLANT: OnceLock<Unpacked> = OnceLock::new();
    PLANT.get_or_init(|| unpacked("plant", "3"))
}

impl Unpacked {
    /// Returns the value reference of a variable.
    fn reference(&self, name: &str) -> u32 {
        let line = self.description.split_once(&format!("name=\"{name}\""));
        let rest = line.unwrap().1.split_once("valueReference=\"").unwrap().1;
        rest.split('"').next().unwrap().parse().unwrap()
    }
}

/// Messages that the master has received.
type Messages = Mutex<Vec<(c_int, String)>>;

extern "C" fn log2(
    environment: *mut c_void,
    _: *const c_char,
    status: c_int,
    category: *const c_char,
    message: *const c_char,
) {
    log3(environment, status, category, message);
}

extern "C" fn log3(
    environment: *mut c_void,
    status: c_int,
    _: *const c_char,
    message: *const c_char,
) {
    // SAFETY: the environment is the list of the test, the message a text of the call.
    let (messages, message) =
        unsafe { (&*environment.cast::<Messages>(), CStr::from_ptr(message)) };
    let message = message.to_str().unwrap().to_owned();
    messages.lock().unwrap().push((status, message));
}

/// A master with one instance of the rig by FMI 2.0.
struct Master {
    c: *mut Component,
    messages: Box<Messages>,
}

impl Master {
    fn new() -> Self {
        let rig = rig2();
        Self::of(
            c"rig".as_ptr(),
            1,
            rig.token.as_ptr(),
            rig.resources.as_ptr(),
        )
    }

    fn of(
        name: *const c_char,
        kind: c_int,
        token: *const c_char,
        resources: *const c_char,
    ) -> Self {
        let messages = Box::<Messages>::default();
        let environment = std::ptr::from_ref(&*messages).cast_mut().cast();
        // SAFETY: it is called without variable arguments, which are passed like others.
        let log: Log2 = unsafe { std::mem::transmute(log2 as *const ()) };
        let callbacks = fmi2CallbackFunctions::of(Some(log), environment);
        // SAFETY: null, or texts that live as long as the test.
        let c =
            unsafe { fmi2Instantiate(name, kind, token, resources, &raw const callbacks, 0, 0) };
        Self { c, messages }
    }

    /// Returns the last message, which contains `expected`.
    fn expect(&self, expected: &str) {
        let messages = self.messages.lock().unwrap();
        let last = messages.last().map_or("", |(_, message)| message);
        assert!(last.contains(expected), "{last:?} lacks {expected:?}");
    }

    fn begin(&self) {
        // SAFETY: a live instance.
        unsafe {
            assert_eq!(fmi2SetupExperiment(self.c, 0, 0.0, 0.0, 1, 2.0), Status::Ok);
            assert_eq!(fmi2EnterInitializationMode(self.c), Status::Ok);
            assert_eq!(fmi2ExitInitializationMode(self.c), Status::Ok);
        }
    }

    fn number(&self, name: &str) -> f64 {
        let reference = rig2().reference(name);
        let mut value = f64::NAN;
        // SAFETY: a live instance and places of this function.
        let status = unsafe { fmi2GetReal(self.c, &raw const reference, 1, &raw mut value) };
        assert_eq!(status, Status::Ok);
        value
    }

    fn fingerprint(&self) -> String {
        let reference = rig2().reference("fingerprint");
        let mut text = null();
        // SAFETY: a live instance and places of this function; the text lives until the next call.
        unsafe {
            let status = fmi2GetString(self.c, &raw const reference, 1, &raw mut text);
            assert_eq!(status, Status::Ok);
            CStr::from_ptr(text).to_str().unwrap().to_owned()
        }
    }
}

impl Drop for Master {
    fn drop(&mut self) {
        // SAFETY: the instance of this master, or null.
        unsafe { fmi2FreeInstance(self.c) };
    }
}

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
    assert_eq!(step(1.995), Status::Error);
    master.expect("after the stop time of 2 s");
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
        assert_eq!(
            fmi2SetReal(c, &raw const output, 1, &raw const value),
            Status::Error
        );
        master.expect("`body/position[0]` is no input");
        let number = f64::NAN;
        assert_eq!(
            fmi2SetReal(c, inputs.as_ptr(), 1, &raw const number),
            Status::Error
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
        // Another instance continues, without an initialization of its own.
        let cut = fmi2DeSerializeFMUstate(other.c, bytes.as_ptr(), size - 1, &raw mut state);
        assert_eq!((cut, state.is_null()), (Status::Error, true));
        other.expect("no state of this FMU");
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
        assert_eq!(status, Status::Error);
    }
    master.expect("duty_factor/fore = 2 is not in");
}

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
        "no event mode",
    ]) {
        assert!(text.contains(expected), "{text:?} lacks {expected:?}");
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
