//! Errors of writing the output.

use std::fs::File;
use std::io::{Error, ErrorKind, Write};
use std::process::{Command, Stdio};

use twinrig::run_with;

use crate::common::{Folder, SOUND, registry, twin};

/// Stream whose writes fail.
struct FailingStream(ErrorKind);

impl Write for FailingStream {
    fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
        Err(Error::from(self.0))
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn commands_report_write_errors_except_closed_pipes() {
    let folder = Folder::new("unwritten");
    let sound = folder.file("sound.toml", SOUND);
    let commands: [&[&str]; 8] = [
        &["--help"],
        &["schema"],
        &["run", &sound, "--no-record", "--json"],
        &["run", &sound, "--no-record"],
        &["check", &sound],
        &["plan", &sound, "--json"],
        &["list"],
        &["devices"],
    ];
    for words in commands {
        let code = |kind, err: &mut Vec<u8>| {
            let mut out = FailingStream(kind);
            run_with(&registry(), words.iter().copied(), &mut out, err)
        };
        let mut err = Vec::new();
        assert_eq!(code(ErrorKind::StorageFull, &mut err), 2, "{words:?}");
        let message = String::from_utf8(err).unwrap();
        assert!(
            message.contains("cannot write to standard output"),
            "{message}"
        );
        let mut err = Vec::new();
        assert_eq!(code(ErrorKind::BrokenPipe, &mut err), 0, "{words:?}");
        assert!(err.is_empty(), "{words:?}");
    }
}

/// Tests the program itself, whose standard output is line-buffered.
#[test]
fn program_exits_with_error_if_device_is_full() {
    let commands: [&[&str]; 4] = [
        &["list"],
        &["list", "--json"],
        &["run", "--help"],
        &["--version"],
    ];
    for words in commands {
        let full = File::options().write(true).open("/dev/full").unwrap();
        let mut twin = Command::new(env!("CARGO_BIN_EXE_twin"));
        let done = twin.args(words).stdout(Stdio::from(full)).output().unwrap();
        let message = String::from_utf8(done.stderr).unwrap();
        assert_eq!(done.status.code(), Some(2), "{words:?}: {message}");
        assert!(
            message.contains("cannot write to standard output"),
            "{message}"
        );
    }
}

#[test]
fn unwritable_outputs_are_detected_before_runs() {
    let folder = Folder::new("unwritable");
    let sound = folder.file("sound.toml", SOUND);
    let junit = folder.join("no/such/folder.xml");
    let done = twin(&["run", &sound, "--no-record", "--junit", &junit]);
    assert_eq!((done.code, done.out.as_str()), (2, ""), "{done:?}");
    assert!(done.err.contains("folder.xml"), "{done:?}");
    // A command refused for another reason leaves no files behind.
    let (junit, out) = (folder.join("junit.xml"), folder.join("deep/out"));
    let absent = ["run", &sound, "--plant", "absent", "--plant", "toy"];
    let done = twin(&[&absent[..], &["--out", &out]].concat());
    assert_eq!(done.code, 2, "{done:?}");
    assert!(!std::fs::exists(folder.join("deep")).unwrap());
    let done = twin(&["run", &sound, "--no-record", "--junit", &junit]);
    assert_eq!(done.code, 0, "{done:?}");
    assert!(
        std::fs::read_to_string(&junit)
            .unwrap()
            .starts_with("<?xml")
    );
    // A folder below a file.
    let out = format!("{sound}/out");
    let done = twin(&["run", &sound, "--out", &out]);
    assert_eq!((done.code, done.out.as_str()), (2, ""), "{done:?}");
}
