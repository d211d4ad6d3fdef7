//! The C functions, called as masters call them, well and badly.

mod fmi2;
mod fmi3;

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::ptr::null;
use std::sync::{Mutex, OnceLock};

use twinrig::Registry;

use crate::component::Component;
use crate::failure::Status;
use crate::fmi2::*;
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
