//! Time-outs of the bus master.

use std::time::Duration;

use twinrig_kernel::SimDuration;
use twinrig_sbcp::{MasterConfig, OVERHEAD, Topology};

use crate::config::{BoardConfig, BusConfig, BusTopology, Generation};
use crate::reply::{COMMAND_LEN, REPLY_LEN};

/// Microframe for which the default time-outs of the protocol's master are chosen.
const MICROFRAME: Duration = Duration::from_micros(125);
/// ASSUMED: maximum response time of a board with the first firmware: its main loop, plus 10 % for
/// its clock.
const FIRST_FIRMWARE: Duration = Duration::from_micros(1_100);
/// Maximum response time of a board with the final firmware (thesis, section 5.3.2).
const REACTION: SimDuration = SimDuration::from_micros(10);
/// Microframes by which the host may exceed its configured timing in a direct cycle before an
/// answer is given up.
const LATENESS: u64 = 2;

/// Returns the time-out of a request directly on the bus, from its write.
///
/// A request takes (4 + ⌈bus time / microframe⌉) microframes, the turnaround and the jitters;
/// [`LATENESS`] is added as a margin. The margin is small because a silent board costs the time-out
/// in every cycle. The time-out is a whole number of microframes after the turnaround: with the
/// defaults 895 µs, so that the next request leaves 7 microframes after the unanswered one, and
/// three boards of 5 microframes with one that is silent are polled at 364 Hz.
fn direct_timeout(config: &BusConfig) -> SimDuration {
    let usb = &config.usb;
    let bytes = COMMAND_LEN + REPLY_LEN + 2 * OVERHEAD;
    let bus = config.byte_time * bytes as u64 + REACTION;
    let frames = 4 + bus.as_nanos().div_ceil(usb.microframe.as_nanos().max(1));
    let late = usb.turnaround + usb.jitter.longest() + usb.write_jitter.longest();
    usb.microframe * (frames + LATENESS) + late
}

/// Returns the configuration of the bus master: its time-outs allow for USB as configured and for
/// boards with the first firmware, which answer late.
pub(crate) fn master_config(config: &BusConfig) -> MasterConfig {
    let topology = match config.topology {
        BusTopology::Direct => Topology::Direct,
        BusTopology::Controller(_) => Topology::Controller,
    };
    let defaults = MasterConfig::new(topology);
    let nanos = |duration: SimDuration| Duration::from_nanos(duration.as_nanos());
    let frames = nanos(config.usb.microframe)
        .as_nanos()
        .div_ceil(MICROFRAME.as_nanos());
    let frames = u32::try_from(frames).unwrap_or(u32::MAX).max(1);
    let timer = nanos(config.usb.latency_timer) * 2 + nanos(config.usb.inn.hold_max());
    let late = |board: &&BoardConfig| board.firmware.generation == Generation::First;
    let late = config.boards.iter().filter(late).count();
    let late = u32::try_from(match topology {
        Topology::Direct => late.min(1),
        Topology::Controller => late,
    });
    let slow = timer + FIRST_FIRMWARE * late.unwrap_or(u32::MAX);
    let longest = defaults.cycle_timeout * frames;
    let shortest = match topology {
        Topology::Direct => longest.min(nanos(direct_timeout(config))),
        Topology::Controller => longest,
    };
    let (cycle_timeout, grace) = match config.session.cycle_timeout {
        Some(timeout) => (timeout, defaults.grace),
        // A shorter time-out does not shorten the time in which an answer may arrive late.
        None => (
            shortest + slow,
            defaults.grace + longest.saturating_sub(shortest),
        ),
    };
    MasterConfig {
        // A host that reads answers late in a cycle reads those of single requests as late.
        lazy_timeout: (defaults.lazy_timeout + timer).max(cycle_timeout),
        cycle_timeout,
        grace,
        error_threshold: config.session.error_threshold,
        ..defaults
    }
}
