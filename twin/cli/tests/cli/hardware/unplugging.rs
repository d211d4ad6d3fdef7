//! Loss of a device ends the run with a verdict and a readable recording.

use std::time::Duration;

use twinrig::runtime::{Device, DeviceError};
use twinrig_record::{Recording, VerdictMessage};
use twinrig_wire::{Pty, SerialPort};

use super::{
    EndReason, Pair, Running, STAND, WELL_RECORDED, endless, is_longer, wait_until, with_retries,
};
use crate::common::Folder;

/// Maximum age of the last sample at the error \[s\]; a transfer or the machine may hang for a
/// second.
const RECENT_S: f64 = 10.0;

#[test]
fn killed_twin_ends_run() {
    let folder = Folder::new("killed");
    let (scenario, link) = (endless(&folder), folder.join("bus"));
    Pair::under_way(&folder, &scenario, &link, |mut pair| {
        pair.served.signal("-KILL");
        let done = pair.run.end().in_time(GONE)?;
        ends_with_error(&done, &pair.recording, &[&link, GONE, UNPLUGGED]);
        is_recorded(&done, &pair.recording);
        Ok(())
    });
}

const GONE: &str = "the device is gone";
const UNPLUGGED: &str = "was it unplugged";

#[test]
fn unplugged_port_ends_run_but_not_the_boards() {
    let folder = Folder::new("unplugged");
    let (scenario, link) = (endless(&folder), folder.join("bus"));
    let recording = folder.join("out/endless-seed1.mcap");
    with_retries(|| {
        let _ = std::fs::remove_file(&recording);
        let mut served = Running::serve(&folder, &scenario, &link, &[]);
        let mut cable = Cable::to(&link);
        let port = cable.near.path().display().to_string();
        let mut run = Running::run(&folder, &scenario, &port, &["--json"]);
        wait_until("it is recorded", || {
            (0..50).for_each(|_| cable.transfer());
            is_longer(&recording, WELL_RECORDED) || run.has_ended()
        });
        let Cable { near, far, .. } = cable;
        drop(near);
        let done = run.end().in_time(GONE)?;
        ends_with_error(&done, &recording, &[&port, GONE, UNPLUGGED]);
        is_recorded(&done, &recording);
        assert!(!served.has_ended());
        drop(far);
        assert_eq!(served.end().code, Some(0));
        Ok(())
    });
}

/// Cable that transfers bytes between two PTYs.
struct Cable {
    near: Pty,
    far: SerialPort,
    /// Whether bytes from the near end are discarded.
    cut: bool,
}

impl Cable {
    fn to(link: &str) -> Self {
        Self {
            near: Pty::open().unwrap(),
            far: SerialPort::open(link.as_ref(), 3_333_333).unwrap(),
            cut: false,
        }
    }

    fn transfer(&mut self) {
        let mut bytes = Vec::new();
        match self.near.read(Duration::from_micros(200), &mut bytes) {
            // The near end is not open yet, or closed.
            Ok(()) | Err(DeviceError::HungUp { .. }) => {}
            Err(error) => panic!("{error}"),
        }
        // Bytes that cannot be written are discarded.
        if !self.cut {
            let _ = self.far.write(&bytes);
        }
        bytes.clear();
        self.far
            .read(Duration::from_micros(200), &mut bytes)
            .unwrap();
        let _ = self.near.write(&bytes);
    }
}

#[test]
fn port_unplugged_during_initialisation_ends_run() {
    let folder = Folder::new("early");
    let (scenario, recording) = (endless(&folder), folder.join("out/endless-seed1.mcap"));
    with_retries(|| {
        let mut pty = Pty::open().unwrap();
        let port = pty.path().display().to_string();
        let mut run = Running::run(&folder, &scenario, &port, &["--json"]);
        let mut received = Vec::new();
        wait_until("the run sends requests", || {
            let _ = pty.read(Duration::ZERO, &mut received);
            !received.is_empty()
        });
        drop(pty);
        let done = run.end().in_time(GONE)?;
        ends_with_error(&done, &recording, &[&port, GONE, UNPLUGGED]);
        Ok(())
    });
}

#[test]
fn port_without_boards_ends_run() {
    let folder = Folder::new("unanswered");
    let (scenario, recording) = (endless(&folder), folder.join("out/endless-seed1.mcap"));
    let pty = Pty::open().unwrap();
    let port = pty.path().display().to_string();
    let done = with_retries(|| {
        let mut run = Running::run(&folder, &scenario, &port, &["--json"]);
        run.end().in_time("does not answer")
    });
    let device = format!("`sbcp` is at {port}");
    let words = ["board LF", "does not answer", "powered", &device];
    ends_with_error(&done, &recording, &words);
}

#[test]
fn stopped_twin_ends_run() {
    let folder = Folder::new("stopped");
    let (scenario, link) = (endless(&folder), folder.join("bus"));
    Pair::under_way(&folder, &scenario, &link, |mut pair| {
        pair.served.signal("-STOP");
        let done = pair.run.end().in_time("took no more bytes")?;
        ends_with_error(&done, &pair.recording, &[&link, "took no more bytes"]);
        is_recorded(&done, &pair.recording);
        Ok(())
    });
}

/// The converter still accepts bytes, but the boards have lost their supply.
#[test]
fn silent_boards_end_run() {
    let folder = Folder::new("silent");
    let scenario = STAND.replace("error_threshold = -1", "error_threshold = 1000");
    let scenario = scenario.replace("\"1 s\"", "\"1000000 s\"");
    let (scenario, link) = (folder.file("endless.toml", &scenario), folder.join("bus"));
    let recording = folder.join("out/endless-seed1.mcap");
    let (done, port) = with_retries(|| {
        let _ = std::fs::remove_file(&recording);
        let _served = Running::serve(&folder, &scenario, &link, &[]);
        let mut cable = Cable::to(&link);
        let port = cable.near.path().display().to_string();
        let mut run = Running::run(&folder, &scenario, &port, &["--json"]);
        // On a busy machine the number of errors may be reached without the cut.
        wait_until("the run ends", || {
            (0..50).for_each(|_| cable.transfer());
            cable.cut |= is_longer(&recording, WELL_RECORDED);
            run.has_ended()
        });
        Ok((run.end().in_time("the bus is given up")?, port))
    });
    let given_up = "the bus is given up at 1000";
    let device = format!("`sbcp` is at {port}");
    ends_with_error(&done, &recording, &["board ", given_up, &device]);
}

/// Checks that the run ended with an error that contains `words` and the bus, in the report and in
/// the recording.
fn ends_with_error(done: &EndReason, recording: &str, words: &[&str]) {
    let report = done.report();
    assert_eq!(done.code, Some(2), "{done:?}");
    assert_eq!(report["verdict"], "error", "{done:?}");
    assert!(done.err.is_empty(), "the error is in the report: {done:?}");
    let error = report["error"].as_str().unwrap();
    for word in words.iter().chain(&["sbcp failed at "]) {
        assert!(error.contains(word), "`{word}` is not in {error}");
    }
    let recording = Recording::open(recording.as_ref()).unwrap();
    assert!(recording.is_complete());
    assert_eq!(recording.fingerprint(), report["fingerprint"].as_str());
    let verdicts = recording.messages::<VerdictMessage>().unwrap();
    let [(at, verdict)] = &verdicts[..] else {
        panic!("{verdicts:?}");
    };
    assert_eq!(Some(*at), recording.reached());
    assert_eq!(verdict.verdict, "error");
    assert_eq!(verdict.error.as_deref(), Some(error));
    assert!(!verdict.interrupted);
}

/// Checks that the recording extends to the end of the run.
fn is_recorded(done: &EndReason, recording: &str) {
    let recording = Recording::open(recording.as_ref()).unwrap();
    let commands = recording.group("process-outputs").unwrap();
    let last = recording.samples(commands).last().unwrap().time;
    let reached = recording.reached().unwrap();
    assert!(commands.len() > 100 && last <= reached);
    assert!((reached - last).as_secs_f64() < RECENT_S);
    assert_eq!(
        done.report()["simulated_s"].as_f64(),
        Some(reached.as_nanos() as f64 / 1e9)
    );
}
