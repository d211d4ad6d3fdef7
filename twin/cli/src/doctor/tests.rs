//! Every finding of the check, on systems made for it.

use std::collections::BTreeMap;

use super::system::{Access, Limit, Output};
use super::*;

/// A system of files, programs and limits.
#[derive(Clone)]
struct Fake {
    files: BTreeMap<&'static str, &'static str>,
    programs: BTreeMap<&'static str, Output>,
    access: Access,
    priority: Option<u64>,
    memory: Option<u64>,
    space: Option<u64>,
    is_linux: bool,
    is_writable: bool,
    is_terminal: bool,
    variables: BTreeMap<&'static str, &'static str>,
}

fn line(text: &str) -> Output {
    Output::Line(text.to_owned())
}

impl Fake {
    /// Returns a system on which everything is as it should be.
    fn sound() -> Self {
        let files = [
            ("/dev/ttyUSB0", ""),
            ("/sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "1"),
            (
                "/proc/self/status",
                "Name:\ttwin\nCapEff:\t0000000000000000",
            ),
            ("/proc/sys/kernel/osrelease", "6.1.0-rt"),
            ("/sys/kernel/realtime", "1"),
            (
                "/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor",
                "performance",
            ),
            ("/sys/devices/system/cpu/cpufreq/policy0", ""),
        ];
        let programs = [
            ("cargo", line("cargo 1.89.0 (0a1b2c3d4 2026-01-01)")),
            ("rustc", line("rustc 1.99.0-nightly (0a1b2c3d4 2026-01-01)")),
            ("python3", line(env!("CARGO_PKG_VERSION"))),
        ];
        Self {
            files: files.into(),
            programs: programs.into(),
            access: Access {
                is_granted: true,
                group: Some("dialout".to_owned()),
            },
            priority: Some(95),
            memory: None,
            space: Some(50_000_000_000),
            is_linux: true,
            is_writable: true,
            is_terminal: true,
            variables: [("LANG", "en_GB.UTF-8")].into(),
        }
    }

    fn with(self, change: impl Fn(&mut Self)) -> Self {
        let mut changed = self;
        change(&mut changed);
        changed
    }
}

impl System for Fake {
    fn is_linux(&self) -> bool {
        self.is_linux
    }

    fn text(&self, path: &str) -> Option<String> {
        self.files.get(path).map(|text| (*text).to_owned())
    }

    fn names(&self, folder: &str) -> Vec<String> {
        let below = format!("{folder}/");
        let names = self
            .files
            .keys()
            .filter_map(|path| path.strip_prefix(&below));
        let mut names: Vec<_> = names
            .filter_map(|path| path.split('/').next())
            .map(str::to_owned)
            .collect();
        names.dedup();
        names
    }

    fn access(&self, _: &str) -> Access {
        self.access.clone()
    }

    fn output(&self, program: &str, _: &[&str]) -> Output {
        let output = self.programs.get(program);
        output.cloned().unwrap_or(Output::Missing)
    }

    fn limit(&self, limit: Limit) -> Option<u64> {
        match limit {
            Limit::RealTimePriority => self.priority,
            Limit::LockedMemory => self.memory,
        }
    }

    fn free_space(&self) -> Option<u64> {
        self.space
    }

    fn is_writable(&self) -> bool {
        self.is_writable
    }

    fn variable(&self, name: &str) -> Option<String> {
        self.variables.get(name).map(|value| (*value).to_owned())
    }

    fn is_terminal(&self) -> bool {
        self.is_terminal
    }
}

/// Returns the findings about the system, without those about this build.
fn examined(system: &Fake) -> Vec<Item> {
    let of_build = build::items(&Registry::standard()).len();
    examine(&Registry::standard(), system).split_off(of_build)
}

#[test]
fn sound_system_has_neither_notices_nor_problems() {
    for item in examined(&Fake::sound()) {
        assert_eq!(
            (item.state, item.remedy.as_str()),
            (State::Ok, ""),
            "{item:?}"
        );
    }
}

type Change = fn(&mut Fake);

/// Changes of a sound system, each with the item that reports it, its state, and a part of finding
/// and remedy.
const CHANGES: &[(Change, &str, State, &str, &str)] = &[
    (
        |s| s.programs.clear(),
        "cargo",
        State::Notice,
        "not found",
        "rustup.rs",
    ),
    (
        |s| {
            s.programs
                .insert("rustc", line("rustc 1.88.1 (x 2025-01-01)"));
        },
        "rustc",
        State::Notice,
        "1.88.1, older than 1.89",
        "rustup update stable",
    ),
    (
        |s| {
            s.programs
                .insert("cargo", Output::Failed("no toolchain".to_owned()));
        },
        "cargo",
        State::Notice,
        "fails: no toolchain",
        "rustup.rs",
    ),
    (
        |s| {
            s.programs.remove("python3");
        },
        "Python package",
        State::Notice,
        "there is no python3",
        "Python 3.10",
    ),
    (
        |s| {
            s.programs.insert("python3", line("0.0.9"));
        },
        "Python package",
        State::Problem,
        "version 0.0.9, this program is",
        "pip install .",
    ),
    (
        |s| {
            let error = "ModuleNotFoundError: No module named 'twinrig'";
            s.programs
                .insert("python3", Output::Failed(error.to_owned()));
        },
        "Python package",
        State::Notice,
        "not installed",
        "pip install .",
    ),
    (
        |s| {
            s.programs
                .insert("python3", Output::Failed("ImportError: x".to_owned()));
        },
        "Python package",
        State::Problem,
        "cannot be imported: ImportError: x",
        "--force-reinstall",
    ),
    (
        |s| s.access.is_granted = false,
        "/dev/ttyUSB0",
        State::Problem,
        "its group dialout may",
        "sudo usermod -aG dialout $USER",
    ),
    (
        |s| {
            s.access = Access {
                is_granted: false,
                group: Some("root".to_owned()),
            };
        },
        "/dev/ttyUSB0",
        State::Problem,
        "may not be read and written",
        "sudo chmod a+rw /dev/ttyUSB0",
    ),
    (
        |s| {
            s.files
                .insert("/sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "16");
        },
        "latency timer of ttyUSB0",
        State::Notice,
        "16 ms",
        "echo 1 | sudo tee /sys/bus/usb-serial/devices/ttyUSB0/latency_timer",
    ),
    (
        |s| {
            s.files
                .insert("/sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "?");
        },
        "latency timer of ttyUSB0",
        State::Notice,
        "`?` is not a number",
        "cat /sys",
    ),
    (
        |s| s.priority = Some(0),
        "real-time priority",
        State::Notice,
        "up to 0, 70 is asked for",
        "rtprio 70",
    ),
    (
        |s| s.memory = Some(8 << 20),
        "locked memory",
        State::Notice,
        "up to 8 MiB",
        "memlock unlimited",
    ),
    (
        |s| {
            let file = "/sys/devices/system/cpu/cpu1/cpufreq/scaling_governor";
            s.files.insert(file, "powersave");
        },
        "processor governor",
        State::Notice,
        "performance, powersave",
        "cpupower frequency-set -g performance",
    ),
    (
        |s| {
            s.files.remove("/sys/kernel/realtime");
        },
        "kernel",
        State::Notice,
        "6.1.0-rt, without PREEMPT_RT",
        "real-time kernel",
    ),
    (
        |s| s.is_writable = false,
        "present folder",
        State::Problem,
        "files cannot be created",
        "--out DIR",
    ),
    (
        |s| s.space = Some(9_900_000_000),
        "space for recordings",
        State::Notice,
        "9.9 GB",
        "--no-record",
    ),
    (
        |s| s.space = Some(100_000_000),
        "space for recordings",
        State::Problem,
        "0.1 GB",
        "--no-record",
    ),
    (
        |s| s.space = None,
        "space for recordings",
        State::Notice,
        "does not say",
        "yourself",
    ),
    (
        |s| s.variables.clear(),
        "terminal",
        State::Notice,
        "locale C, not UTF-8",
        "C.UTF-8",
    ),
    (
        |s| s.is_linux = false,
        "serial ports, real time",
        State::Notice,
        "not checked on",
        "virtual time",
    ),
];

#[test]
fn every_fault_is_reported_alone_with_its_remedy() {
    for (change, name, state, finding, remedy) in CHANGES {
        let items = examined(&Fake::sound().with(change));
        let item = items.iter().find(|item| item.name == *name);
        let item = item.unwrap_or_else(|| panic!("{name}: {items:?}"));
        assert_eq!(item.state, *state, "{item:?}");
        assert!(item.finding.contains(finding), "{item:?}");
        assert!(item.remedy.contains(remedy), "{item:?}");
        assert!(!item.affects.is_empty() && !item.is_fatal(), "{item:?}");
        // Without programs, three items are missing.
        let others = items.iter().filter(|item| item.state != State::Ok).count();
        assert!(
            others == 1 || *finding == "not found" && others == 3,
            "{items:?}"
        );
    }
}

#[test]
fn what_is_absent_or_granted_otherwise_is_no_fault() {
    let without_ports = Fake::sound().with(|s| {
        s.files.remove("/dev/ttyUSB0");
    });
    // CAP_SYS_NICE and CAP_IPC_LOCK stand above the limits.
    let root = Fake::sound().with(|s| {
        s.files
            .insert("/proc/self/status", "CapEff:\t000001ffffffffff");
        (s.priority, s.memory) = (Some(0), Some(0));
    });
    let piped = Fake::sound().with(|s| {
        s.is_terminal = false;
        s.variables.clear();
    });
    let other = "/sys/devices/system/cpu/cpu0/cpufreq/scaling_governor";
    let virtual_machine = Fake::sound().with(|s| {
        s.files.remove(other);
    });
    let plain = Fake::sound().with(|s| {
        s.variables.insert("NO_COLOR", "1");
    });
    for system in [without_ports, root, piped, virtual_machine, plain] {
        let items = examined(&system);
        assert!(
            items.iter().all(|item| item.state == State::Ok),
            "{items:?}"
        );
    }
}

#[test]
fn plants_of_other_builds_are_notices_and_robots_are_read() {
    let registry = Registry::standard();
    let items = build::items(&registry);
    for kind in registry.catalogue(None).plants {
        let item = items
            .iter()
            .find(|item| item.name == format!("plant {}", kind.name));
        assert_eq!(item.is_some(), kind.remedy.is_some(), "{}", kind.name);
        assert_eq!(item.map(|item| item.remedy.clone()), kind.remedy);
    }
    let robots = items.iter().find(|item| item.name == "robots").unwrap();
    assert!(robots.finding.contains("cheetah-cub") && robots.finding.contains("oncilla"));
    assert!(!items.iter().any(Item::is_fatal), "{items:?}");
}
