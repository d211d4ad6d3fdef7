//! Real time: limits of this process, governor of the processors, kernel.

use super::item::Item;
use super::system::{Limit, System};

/// Greatest priority that runs at real ports ask for.
const PRIORITY: u64 = 70;
/// Bits of the capabilities that stand above the limits: `CAP_SYS_NICE`, `CAP_IPC_LOCK`.
const NICE: u64 = 1 << 23;
const LOCK: u64 = 1 << 14;
/// Purpose of real time.
const RUNS: &str = "runs at real ports and `twin serve`; runs in virtual time do not need it";

pub(super) fn items(system: &dyn System) -> Vec<Item> {
    vec![
        priority(system),
        memory(system),
        governor(system),
        kernel(system),
    ]
}

/// Returns whether this process has a capability.
fn has(system: &dyn System, capability: u64) -> bool {
    let status = system.text("/proc/self/status").unwrap_or_default();
    let effective = status.lines().find_map(|line| line.strip_prefix("CapEff:"));
    let bits = effective.and_then(|bits| u64::from_str_radix(bits.trim(), 16).ok());
    bits.is_some_and(|bits| bits & capability != 0)
}

/// Returns a command that raises a limit at the next login.
fn raise(limit: &str, value: &str) -> String {
    format!(
        "echo \"$USER - {limit} {value}\" | sudo tee -a /etc/security/limits.d/twinrig.conf, \
         then log in again"
    )
}

fn priority(system: &dyn System) -> Item {
    const NAME: &str = "real-time priority";
    if has(system, NICE) {
        return Item::ok(NAME, "granted by capability");
    }
    match system.limit(Limit::RealTimePriority) {
        None => Item::ok(NAME, "unlimited"),
        Some(limit) if limit >= PRIORITY => Item::ok(NAME, format!("up to {limit}")),
        Some(limit) => Item::notice(NAME, format!("up to {limit}, {PRIORITY} is asked for"))
            .affecting(
                format!("other programs may delay {RUNS}"),
                raise("rtprio", &PRIORITY.to_string()),
            ),
    }
}

fn memory(system: &dyn System) -> Item {
    const NAME: &str = "locked memory";
    if has(system, LOCK) {
        return Item::ok(NAME, "granted by capability");
    }
    match system.limit(Limit::LockedMemory) {
        None => Item::ok(NAME, "unlimited"),
        Some(limit) => Item::notice(NAME, format!("up to {} MiB", limit >> 20)).affecting(
            format!("paging may delay {RUNS}"),
            raise("memlock", "unlimited"),
        ),
    }
}

fn governor(system: &dyn System) -> Item {
    const NAME: &str = "processor governor";
    const FOLDER: &str = "/sys/devices/system/cpu";
    let is_processor = |name: &String| {
        let number = name.strip_prefix("cpu").unwrap_or("");
        !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit())
    };
    let processors = system.names(FOLDER).into_iter().filter(is_processor);
    let governors = processors
        .filter_map(|name| system.text(&format!("{FOLDER}/{name}/cpufreq/scaling_governor")));
    let mut governors: Vec<_> = governors.collect();
    governors.sort();
    governors.dedup();
    match governors.as_slice() {
        [] => Item::ok(NAME, "none: the frequency is not the system's choice"),
        [one] if one == "performance" => Item::ok(NAME, one),
        found => Item::notice(NAME, found.join(", ")).affecting(
            format!("a processor that wakes up slowly delays {RUNS}"),
            "sudo cpupower frequency-set -g performance",
        ),
    }
}

fn kernel(system: &dyn System) -> Item {
    const NAME: &str = "kernel";
    let release = system
        .text("/proc/sys/kernel/osrelease")
        .unwrap_or_default();
    if system.text("/sys/kernel/realtime").as_deref() == Some("1") {
        return Item::ok(NAME, format!("{release}, PREEMPT_RT"));
    }
    Item::notice(NAME, format!("{release}, without PREEMPT_RT")).affecting(
        format!("seldom but long delays of {RUNS}"),
        "install your distribution's real-time kernel; Debian: sudo apt install linux-image-rt-amd64",
    )
}
