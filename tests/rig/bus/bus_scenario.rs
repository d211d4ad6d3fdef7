//! Bus configurations with faults, formatted as a scenario.

use std::fmt;
use std::time::Duration;

use proptest::prelude::*;
use twinrig_kernel::{SimDuration, SimTime};
use twinrig_motordriver::{BusConfig, BusTopology, Following};
use twinrig_runtime::Timing;
use twinrig_sbcp::{ControllerConfig, ForwardingMode};
use twinrig_wire::{Fault, FaultKind, FaultSchedule, FaultSelection, UsbPreset, UsbTiming};

use crate::bus::harness::{Commands, ProcessConfig};
use crate::bus::probe_plant::LEGS;

/// Maximum duration of a fault.
pub const FAULT_MAX: SimDuration = SimDuration::from_millis(100);

/// Connection of the USB converter to the boards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Topology {
    Direct,
    CutThrough,
    StoreAndForward,
}

/// A fault, timed relative to the readiness of the boards.
#[derive(Clone, Debug, PartialEq)]
pub struct TimedFault {
    pub after: SimDuration,
    /// `wire/sbcp`, `wire/sbcp/link`, or the stub of a board.
    pub on: String,
    pub kind: FaultKind,
    pub lasts: SimDuration,
}

/// Complete configuration of a bus, its process and its faults.
#[derive(Clone, PartialEq)]
pub struct BusScenario {
    pub topology: Topology,
    pub preset: UsbPreset,
    pub latency_timer: SimDuration,
    pub turnaround: SimDuration,
    pub jitter: Timing,
    pub write_jitter: Timing,
    pub frame_offset: SimDuration,
    pub frame_rate_ppb: i64,
    pub rates_ppb: [i64; 4],
    pub phases: [SimDuration; 4],
    pub following: Following,
    pub free_running: bool,
    pub period: SimDuration,
    pub compute: Timing,
    pub timed_faults: Vec<TimedFault>,
    pub seed: u64,
    /// Time at which the boards are ready; zero if unknown.
    pub opened: SimTime,
}

pub const fn micros(n: u64) -> SimDuration {
    SimDuration::from_micros(n)
}

pub const fn millis(n: u64) -> SimDuration {
    SimDuration::from_millis(n)
}

/// Jitter of at most `max`.
pub fn jitter(max: SimDuration) -> BoxedStrategy<Timing> {
    let jitter_max = max.as_nanos();
    let duration = move || (0..=jitter_max).prop_map(SimDuration::from_nanos);
    prop_oneof![
        Just(Timing::ZERO),
        duration().prop_map(Timing::Constant),
        duration().prop_map(|max| Timing::Uniform {
            min: SimDuration::ZERO,
            max
        }),
        (duration(), 1_000..1_000_000_u64).prop_map(|(max, deviation)| Timing::Normal {
            mean: max / 4,
            deviation: SimDuration::from_nanos(deviation),
            min: SimDuration::ZERO,
            max,
        }),
    ]
    .boxed()
}

impl BusScenario {
    pub fn usb(&self) -> UsbTiming {
        UsbTiming {
            latency_timer: self.latency_timer,
            turnaround: self.turnaround,
            jitter: self.jitter.clone(),
            write_jitter: self.write_jitter.clone(),
            frame_offset: self.frame_offset,
            frame_rate_ppb: self.frame_rate_ppb,
            ..UsbTiming::preset(self.preset)
        }
    }

    /// Maximum duration of a transfer without faults, from its first write to its end, summed over
    /// microframes: for each round trip OUT, the bytes, IN, latency timer, completion, turnaround
    /// and both jitters.
    pub fn transfer_max(&self) -> SimDuration {
        let (trips, grid) = self.round_trips();
        let each = grid + self.host_delay_max();
        each * trips
    }

    /// Maximum delay of the host software in a round trip.
    pub fn host_delay_max(&self) -> SimDuration {
        self.turnaround + self.jitter.longest() + self.write_jitter.longest()
    }

    /// Returns the number of round trips per cycle, and the duration of each from the start of the
    /// microframe of its write to that of its completion: (4 + ⌈bus / microframe⌉) microframes
    /// with a latency timer of 0, plus the microframes of the timer beyond the first.
    pub fn round_trips(&self) -> (u64, SimDuration) {
        let usb = self.usb();
        // A request of 10 bytes, 10 µs, an answer of 22: 106 µs.
        let (trips, bus) = match self.topology {
            Topology::Direct => (4, 106),
            // Four of them and three gaps of 2 µs; four bytes until the address of the first
            // request is received, and one for the transmission of the last byte.
            Topology::CutThrough => (1, 4 * 106 + 3 * 2 + 12 + 3),
            // The whole first request before its transmission, the whole last answer before its
            // return.
            Topology::StoreAndForward => (1, 4 * 106 + 3 * 2 + 30 + 66),
        };
        // Frames are slow by at most a thousandth.
        let frame = usb.microframe + usb.microframe / 500;
        let bus = micros(bus).as_nanos().div_ceil(usb.microframe.as_nanos());
        let timer = usb
            .latency_timer
            .as_nanos()
            .div_ceil(usb.microframe.as_nanos())
            .max(1);
        // An answer of several packets of the converter: the last one waits for the full timer
        // after a full one.
        let full = trips == 1 && usb.payload < 4 * 22;
        (trips, frame * (4 + bus + timer - u64::from(!full)))
    }

    /// Time at which the last fault ends.
    pub fn last_fault(&self) -> SimTime {
        let ends = self
            .timed_faults
            .iter()
            .map(|timed_fault| timed_fault.after + timed_fault.lasts);
        self.opened + ends.max().unwrap_or_default()
    }

    pub fn schedule(&self) -> FaultSchedule {
        let faults = self.timed_faults.iter().map(|timed_fault| Fault {
            at: self.opened + timed_fault.after,
            on: timed_fault.on.clone(),
            kind: timed_fault.kind,
            lasts: timed_fault.lasts,
            select: FaultSelection::default(),
        });
        FaultSchedule {
            faults: faults.collect(),
            seed: self.seed,
        }
    }

    pub fn config(&self) -> BusConfig {
        let mut config = BusConfig {
            topology: match self.topology {
                Topology::Direct => BusTopology::Direct,
                Topology::CutThrough => BusTopology::Controller(ControllerConfig::default()),
                Topology::StoreAndForward => BusTopology::Controller(ControllerConfig {
                    passing: ForwardingMode::StoreAndForward,
                    ..ControllerConfig::default()
                }),
            },
            usb: self.usb(),
            faults: self.schedule(),
            seed: self.seed,
            ..BusConfig::default()
        };
        for (n, board) in config.boards.iter_mut().enumerate() {
            let clocked = board.clone().with_clock(self.rates_ppb[n], self.phases[n]);
            *board = clocked.unwrap();
            board.following = self.following;
        }
        let session = &mut config.session;
        session.period = Duration::from_nanos(self.period.as_nanos());
        session.error_threshold = -1;
        session.free_running = self.free_running;
        // With these gains the duty equals the set-point, and no step of the set-point is limited.
        session.gains.p = 4;
        (session.gains.i, session.gains.d) = (0, 0);
        session.gains.max_speed = u16::MAX;
        config
    }

    /// Random walk whose steps \[counts per cycle\] the boards do not clip.
    pub fn random_walk(&self) -> Commands {
        let ticks = self.period.as_nanos() / 1_000_000;
        // Nor does it leave the motor's range.
        Commands::Walk((30 * (ticks - 1)).min(190))
    }

    pub fn process_config(&self, commands: Commands) -> ProcessConfig {
        ProcessConfig {
            period: self.period,
            compute: self.compute.clone(),
            commands,
            seed: self.seed,
        }
    }
}

fn format_timing(timing: &Timing) -> String {
    match timing {
        Timing::Constant(duration) => format!("\"{} ns\"", duration.as_nanos()),
        Timing::Uniform { min, max } => {
            format!(
                "{{ min = \"{} ns\", max = \"{} ns\" }}",
                min.as_nanos(),
                max.as_nanos()
            )
        }
        Timing::Normal {
            mean,
            deviation,
            min,
            max,
        } => format!(
            "{{ mean = \"{} ns\", deviation = \"{} ns\", min = \"{} ns\", max = \"{} ns\" }}",
            mean.as_nanos(),
            deviation.as_nanos(),
            min.as_nanos(),
            max.as_nanos()
        ),
        Timing::Trace(_) => "\"0 ns\"".to_owned(),
    }
}

impl fmt::Display for BusScenario {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let each = |of: &dyn Fn(usize) -> String| {
            let of = LEGS
                .iter()
                .enumerate()
                .map(|(n, leg)| format!("{leg} = \"{}\"", of(n)));
            of.collect::<Vec<_>>().join(", ")
        };
        let end = self.last_fault() + millis(500);
        let duration = end.as_nanos().div_ceil(1_000_000);
        let (topology, passing) = match self.topology {
            Topology::Direct => ("direct", ""),
            Topology::CutThrough => ("controller", "passing = \"cut-through\"\n"),
            Topology::StoreAndForward => ("controller", "passing = \"store-and-forward\"\n"),
        };
        let following = match self.following {
            Following::Smooth => "smooth",
            Following::Plain => "plain",
        };
        write!(
            f,
            "name = \"found by a property\"\nrobot = \"oncilla\"\nduration = \"{duration} ms\"\nseed = {}\n\n\
             [plant]\nmodel = \"drives\"\nbase = \"fixed\"\n\n[actuator]\nkind = \"motor\"\n\n\
             [controller]\nkind = \"script\"\nperiod = \"{} ns\"\ncompute_time = {}\n\n\
             [bus]\nkind = \"sbcp\"\ntopology = \"{topology}\"\n{passing}\
             usb = {{ preset = \"{}\", latency_timer = \"{} ns\", turnaround = \"{} ns\", jitter = {}, write_jitter = {}, \
             frame_offset = \"{} ns\", frame_clock = {:?} }}\n\
             clock = {{ {} }}\nphase = {{ {} }}\nfollowing = \"{following}\"\n\
             gains = {{ p = 4, i = 0, d = 0 }}\nmax_speed = {}\nerror_threshold = -1\nfree_running = {}\n",
            self.seed,
            self.period.as_nanos(),
            format_timing(&self.compute),
            self.preset.name(),
            self.latency_timer.as_nanos(),
            self.turnaround.as_nanos(),
            format_timing(&self.jitter),
            format_timing(&self.write_jitter),
            self.frame_offset.as_nanos(),
            self.frame_rate_ppb as f64 * 1e-9,
            each(&|n| format!("{} ppm", self.rates_ppb[n] as f64 * 1e-3)),
            each(&|n| format!("{} ns", self.phases[n].as_nanos())),
            u16::MAX,
            self.free_running,
        )?;
        if !self.timed_faults.is_empty() {
            write!(f, "\n{}", self.schedule())?;
        }
        Ok(())
    }
}

/// Output of a failed property.
impl fmt::Debug for BusScenario {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "a scenario whose boards are ready at {}:\n\n{self}",
            self.opened
        )
    }
}
