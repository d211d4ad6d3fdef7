//! An answer that could not be written is an error.

use std::fs::File;
use std::io::{Error, ErrorKind, Write};
use std::process::{Command, Stdio};

use twinrig::run_with;

use crate::common::{Folder, SOUND, registry, twin};

/// Takes nothing.
struct Refusing(ErrorKind);

impl Write for Refusing {
    fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
        Err(Error::from(self.0))
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn every_command_whose_answer_is_not_written_says_so_but_for_a_closed_pipe() {
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
            run_with(&registry(), words.iter().copied(), &mut Refusing(kind), err)
        };
        let mut err = Vec::new();
        assert_eq!(code(ErrorKind::StorageFull, &mut err), 2, "{words:?}");
        let told = String::from_utf8(err).unwrap();
        assert!(told.contains("cannot write to standard output"), "{told}");
        let mut err = Vec::new();
        assert_eq!(code(ErrorKind::BrokenPipe, &mut err), 0, "{words:?}");
        assert!(err.is_empty(), "{words:?}");
    }
}

/// The program itself, whose standard output keeps what is no whole line.
#[test]
fn the_program_ends_with_two_if_the_device_is_full() {
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
        let told = String::from_utf8(done.stderr).unwrap();
        assert_eq!(done.status.code(), Some(2), "{words:?}: {told}");
        assert!(told.contains("cannot write to standard output"), "{told}");
    }
}

#[test]
fn what_cannot_be_written_is_found_before_the_runs() {
    let folder = Folder::new("unwritable");
    let sound = folder.file("sound.toml", SOUND);
    let junit = folder.join("no/such/folder.xml");
    let done = twin(&["run", &sound, "--no-record", "--junit", &junit]);
    assert_eq!((done.code, done.out.as_str()), (2, ""), "{done:?}");
    assert!(done.err.contains("folder.xml"), "{done:?}");
    // What is refused for another reason leaves nothing behind.
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
