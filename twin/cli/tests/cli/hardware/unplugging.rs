//! A device that goes away ends the run, with a verdict and a recording that can be read.

use std::time::Duration;

use twinrig::runtime::{Device, DeviceError};
use twinrig_record::{Recording, VerdictMessage};
use twinrig_wire::{Pty, SerialPort};

use super::{
    BENCH, Ended, Pair, Running, WELL_RECORDED, endless, eventually, is_longer, patiently,
};
use crate::common::Folder;

/// The last sample is not much older than the error \[s\], though a transfer may hang for a second, and the machine, too.
const RECENT_S: f64 = 10.0;

#[test]
fn a_twin_that_dies_ends_the_run() {
    let folder = Folder::new("killed");
    let (scenario, link) = (endless(&folder), folder.join("bus"));
    Pair::under_way(&folder, &scenario, &link, |mut pair| {
        pair.served.signal("-KILL");
        let done = pair.run.end().in_time(GONE)?;
        is_given_up(&done, &pair.recording, &[&link, GONE, UNPLUGGED]);
        is_recorded(&done, &pair.recording);
        Ok(())
    });
}

const GONE: &str = "the device is gone";
const UNPLUGGED: &str = "was it unplugged";

#[test]
fn a_port_that_is_unplugged_ends_the_run_while_the_boards_live_on() {
    let folder = Folder::new("unplugged");
    let (scenario, link) = (endless(&folder), folder.join("bus"));
    let recording = folder.join("out/endless-seed1.mcap");
    patiently(|| {
        let _ = std::fs::remove_file(&recording);
        let mut served = Running::serve(&folder, &scenario, &link, &[]);
        let mut cable = Cable::to(&link);
        let port = cable.near.path().display().to_string();
        let mut run = Running::run(&folder, &scenario, &port, &["--json"]);
        eventually("it is recorded", || {
            (0..50).for_each(|_| cable.carry());
            is_longer(&recording, WELL_RECORDED) || run.has_ended()
        });
        let Cable { near, far, .. } = cable;
        drop(near);
        let done = run.end().in_time(GONE)?;
        is_given_up(&done, &recording, &[&port, GONE, UNPLUGGED]);
        is_recorded(&done, &recording);
        assert!(!served.has_ended());
        drop(far);
        assert_eq!(served.end().code, Some(0));
        Ok(())
    });
}

/// Carries bytes from one PTY to another.
struct Cable {
    near: Pty,
    far: SerialPort,
    /// Whether what comes from the near end goes nowhere.
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

    fn carry(&mut self) {
        let mut bytes = Vec::new();
        match self.near.read(Duration::from_micros(200), &mut bytes) {
            // Nobody is there yet, or nobody any more.
            Ok(()) | Err(DeviceError::HungUp { .. }) => {}
            Err(error) => panic!("{error}"),
        }
        // What nobody reads is lost.
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
fn a_port_that_is_unplugged_before_the_boards_are_ready_ends_the_run() {
    let folder = Folder::new("early");
    let (scenario, recording) = (endless(&folder), folder.join("out/endless-seed1.mcap"));
    patiently(|| {
        let mut pty = Pty::open().unwrap();
        let port = pty.path().display().to_string();
        let mut run = Running::run(&folder, &scenario, &port, &["--json"]);
        let mut heard = Vec::new();
        eventually("the run asks for boards", || {
            let _ = pty.read(Duration::ZERO, &mut heard);
            !heard.is_empty()
        });
        drop(pty);
        let done = run.end().in_time(GONE)?;
        is_given_up(&done, &recording, &[&port, GONE, UNPLUGGED]);
        Ok(())
    });
}

#[test]
fn a_port_with_nobody_at_it_ends_the_run() {
    let folder = Folder::new("nobody");
    let (scenario, recording) = (endless(&folder), folder.join("out/endless-seed1.mcap"));
    let pty = Pty::open().unwrap();
    let port = pty.path().display().to_string();
    let done = patiently(|| {
        let mut run = Running::run(&folder, &scenario, &port, &["--json"]);
        run.end().in_time("does not answer")
    });
    let device = format!("`sbcp` is at {port}");
    let words = ["board LF", "does not answer", "powered", &device];
    is_given_up(&done, &recording, &words);
}

#[test]
fn a_twin_that_stops_reading_ends_the_run() {
    let folder = Folder::new("stopped");
    let (scenario, link) = (endless(&folder), folder.join("bus"));
    Pair::under_way(&folder, &scenario, &link, |mut pair| {
        pair.served.signal("-STOP");
        let done = pair.run.end().in_time("took no more bytes")?;
        is_given_up(&done, &pair.recording, &[&link, "took no more bytes"]);
        is_recorded(&done, &pair.recording);
        Ok(())
    });
}

/// The converter goes on taking bytes, but the boards have lost their supply.
#[test]
fn boards_that_fall_silent_end_the_run() {
    let folder = Folder::new("silent");
    let scenario = BENCH.replace("error_threshold = -1", "error_threshold = 1000");
    let scenario = scenario.replace("\"1 s\"", "\"1000000 s\"");
    let (scenario, link) = (folder.file("endless.toml", &scenario), folder.join("bus"));
    let recording = folder.join("out/endless-seed1.mcap");
    let (done, port) = patiently(|| {
        let _ = std::fs::remove_file(&recording);
        let _served = Running::serve(&folder, &scenario, &link, &[]);
        let mut cable = Cable::to(&link);
        let port = cable.near.path().display().to_string();
        let mut run = Running::run(&folder, &scenario, &port, &["--json"]);
        // A busy machine alone may bring the errors together.
        eventually("the run ends", || {
            (0..50).for_each(|_| cable.carry());
            cable.cut |= is_longer(&recording, WELL_RECORDED);
            run.has_ended()
        });
        Ok((run.end().in_time("the bus is given up")?, port))
    });
    let given_up = "the bus is given up at 1000";
    let device = format!("`sbcp` is at {port}");
    is_given_up(&done, &recording, &["board ", given_up, &device]);
}

/// It ended with a verdict that says `words`, beside the bus, in the report and at the end of its recording.
fn is_given_up(done: &Ended, recording: &str, words: &[&str]) {
    let report = done.report();
    assert_eq!(done.code, Some(2), "{done:?}");
    assert_eq!(report["verdict"], "error", "{done:?}");
    assert!(done.err.is_empty(), "the report says it all: {done:?}");
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

/// Its recording goes on until it ended.
fn is_recorded(done: &Ended, recording: &str) {
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
