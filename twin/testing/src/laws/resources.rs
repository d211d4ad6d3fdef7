use twinrig_kernel::{Direction, Layout, SimDuration, SimTime};
use twinrig_runtime::{Driver, PlantSignals};
use twinrig_wire::{Node, Piece};

use super::session::{Course, Session, host};
use super::stairs::Stairs;
use super::{Case, DeviceSetup, Violation};

/// Calls at one instant, beyond which there is no end.
const CALLS_MAX: usize = 1000;
/// Floods of bytes, and the fraction of a period from one to the next.
const FLOODS: usize = 200;
const FLOODS_PER_PERIOD: u64 = 7;
/// Frames in a flood.
const FRAMES: usize = 10;
/// Bursts of bytes within the deadline.
const BURSTS: u64 = 97;

/// Frames of an undisturbed run, and its last transfer.
struct Frames {
    /// Bytes that the driver has written, and transmissions of the devices.
    requests: Vec<Vec<u8>>,
    answers: Vec<Vec<u8>>,
    last: SimTime,
}

/// Course of the run in which the driver is opened.
fn opening() -> Course {
    Course {
        slots: 3,
        ..Course::default()
    }
}

impl Frames {
    fn of<D: Driver>(setup: &DeviceSetup<D>, law: &'static str) -> Result<Self, Violation> {
        let session = Session::open(setup, law, opening()).finish()?;
        let last = session.log.transfers.last().map(|transfer| transfer.at);
        let written = session.log.written.iter();
        let transmissions = session.tap.transmissions();
        Ok(Self {
            requests: written.map(|(_, bytes)| bytes.clone()).collect(),
            answers: transmissions.iter().map(|it| it.bytes.clone()).collect(),
            last: last.unwrap_or(session.now),
        })
    }
}

/// A driver, detached from its wire.
struct Detached<D> {
    law: &'static str,
    driver: D,
    now: SimTime,
    inputs: usize,
}

impl<D: Driver> Detached<D> {
    /// Opens a driver and lets it make some transfers.
    fn new(setup: &DeviceSetup<D>, law: &'static str, frames: &Frames) -> Result<Self, Violation> {
        let mut session = Session::open(setup, law, opening());
        session.run_until(frames.last)?;
        Ok(Self {
            law,
            now: session.now,
            inputs: Layout::of(&session.driver.ports(), Direction::Input).len(),
            driver: session.driver,
        })
    }

    fn violation(&self, what: impl Into<String>) -> Violation {
        Violation::new(self.law, self.now, what)
    }

    /// Handles the time-outs that are due, and reads what the driver writes.
    fn serve(&mut self) -> Result<(), Violation> {
        let now = host(self.now);
        for _ in 0..CALLS_MAX {
            self.drain()?;
            if self.driver.poll_timeout().is_none_or(|at| at > now) {
                return Ok(());
            }
            self.driver.handle_timeout(now);
        }
        Err(self.violation("a time-out that was handled is due again, and again"))
    }

    fn drain(&mut self) -> Result<(), Violation> {
        let mut bytes = Vec::new();
        for _ in 0..CALLS_MAX {
            if !self.driver.poll_transmit(&mut bytes) {
                return Ok(());
            }
        }
        Err(self.violation("the driver writes without end"))
    }

    fn begin(&mut self) {
        let inputs = vec![0.0; self.inputs];
        self.driver.begin(host(self.now), &inputs);
    }
}

/// Checks that the saved state of driver and devices stays within a bound, and the number of their
/// transmissions, too, while they are flooded with garbage, frames and parts of frames.
///
/// # Errors
/// [`Violation`] with the size.
pub fn queues_stay_bounded<D: Driver>(
    setup: &DeviceSetup<D>,
    case: &Case,
) -> Result<(), Violation> {
    const LAW: &str = "queues_stay_bounded";
    let frames = Frames::of(setup, LAW)?;
    let mut detached = Detached::new(setup, LAW, &frames)?;
    let before = detached.driver.save().0.len();
    for flood in 0..FLOODS {
        detached.now += setup.period / FLOODS_PER_PERIOD;
        let bytes = flood_bytes(&frames.answers, case, flood);
        detached.driver.handle_bytes(host(detached.now), &bytes);
        detached.serve()?;
        match detached.driver.is_busy() {
            Ok(true) => {}
            Ok(false) => detached.begin(),
            Err(_) => detached.driver.open(host(detached.now)),
        }
        detached.serve()?;
        let found = detached.driver.save().0.len();
        if found > before + setup.state_bytes {
            let what = format!("the state of the driver has grown from {before} to {found} bytes");
            return Err(detached.violation(what));
        }
    }
    let signals = PlantSignals::of(&setup.ports);
    let mut plant = Stairs::new(&signals, &setup.levels, setup.period);
    for mut node in (setup.nodes)() {
        node.connect("laws", &signals)
            .unwrap_or_else(|error| panic!("the plant of the setup: {error}"));
        flood_node(setup, case, &frames.requests, &mut *node, &mut plant)
            .map_err(|(now, what)| Violation::new(LAW, now, what))?;
    }
    Ok(())
}

/// Returns frames in turn and garbage, also within a frame.
fn flood_bytes(frames: &[Vec<u8>], case: &Case, flood: usize) -> Vec<u8> {
    let garbage = &case.garbage;
    let mut bytes = garbage[..flood % (garbage.len() + 1)].to_vec();
    if let Some(last) = frames.len().checked_sub(1) {
        for n in 0..FRAMES {
            bytes.extend(&frames[last - (flood + n) % frames.len().min(4)]);
        }
        bytes.truncate(bytes.len() - flood % 3);
    }
    bytes
}

fn flood_node<D: Driver>(
    setup: &DeviceSetup<D>,
    case: &Case,
    requests: &[Vec<u8>],
    node: &mut dyn Node,
    plant: &mut Stairs,
) -> Result<(), (SimTime, String)> {
    let before = node.save().0.len();
    let mut now = SimTime::ZERO;
    for flood in 0..FLOODS {
        let next = now + setup.period / FLOODS_PER_PERIOD;
        for call in 0.. {
            let wake = node.next_wake().filter(|at| *at <= next);
            now = wake.unwrap_or(next).max(now);
            plant.now = now;
            if wake.is_none() {
                let bytes = flood_bytes(requests, case, flood);
                node.receive(Piece {
                    first: now,
                    spacing: SimDuration::ZERO,
                    bytes: &bytes,
                    framing_error: false,
                });
            }
            let advanced = node.advance(now, plant);
            advanced.map_err(|error| (now, error.to_string()))?;
            let mut bytes = Vec::new();
            let count = (0..CALLS_MAX)
                .take_while(|_| node.poll_transmit(&mut bytes).is_some())
                .count();
            if count == CALLS_MAX || call == CALLS_MAX {
                let what = format!("the device {} transmits or wakes without end", node.name());
                return Err((now, what));
            }
            if wake.is_none() {
                break;
            }
        }
        let found = node.save().0.len();
        if found > before + setup.state_bytes {
            let name = node.name();
            let what = format!("the state of {name} has grown from {before} to {found} bytes");
            return Err((now, what));
        }
    }
    Ok(())
}

const DEADLINE: &str = "meets_the_deadline";

/// Phases that must end.
#[derive(Clone, Copy, Debug)]
enum Phase {
    Opening,
    Transfer,
    Closing,
}

/// What is on the line.
#[derive(Clone, Copy, Debug)]
enum Line {
    Silence,
    Garbage,
    OneByte,
    OldAnswers,
}

/// Checks that opening, a transfer and closing each end, with success or an error, within the
/// deadline, whatever is on the line: silence, garbage, the same byte again and again, old answers.
///
/// # Errors
/// [`Violation`] with the phase.
pub fn meets_the_deadline<D: Driver>(setup: &DeviceSetup<D>, case: &Case) -> Result<(), Violation> {
    let frames = Frames::of(setup, DEADLINE)?;
    for phase in [Phase::Opening, Phase::Transfer, Phase::Closing] {
        for line in [
            Line::Silence,
            Line::Garbage,
            Line::OneByte,
            Line::OldAnswers,
        ] {
            check_deadline(setup, case, &frames, (phase, line))?;
        }
    }
    Ok(())
}

fn check_deadline<D: Driver>(
    setup: &DeviceSetup<D>,
    case: &Case,
    frames: &Frames,
    (phase, line): (Phase, Line),
) -> Result<(), Violation> {
    let mut detached = Detached::new(setup, DEADLINE, frames)?;
    match phase {
        Phase::Opening => {
            detached.driver = (setup.driver)();
            detached.driver.open(host(detached.now));
        }
        Phase::Transfer => detached.begin(),
        Phase::Closing => detached.driver.close(host(detached.now)),
    }
    let deadline = match phase {
        Phase::Transfer => setup.transfer_deadline,
        Phase::Opening | Phase::Closing => setup.deadline,
    };
    let limit = detached.now + deadline;
    let interval = SimDuration::from_nanos(deadline.as_nanos() / BURSTS + 1);
    let (mut burst, mut count) = (detached.now + interval, 0);
    loop {
        detached.serve()?;
        if detached.driver.is_busy() != Ok(true) {
            return Ok(());
        }
        if detached.now > limit {
            let what = format!("{phase:?} has not ended within {deadline}, with {line:?}");
            return Err(detached.violation(what));
        }
        let timeout = detached.driver.poll_timeout();
        let timeout = timeout.map(|at| SimTime::from_nanos(at.as_nanos()));
        detached.now = timeout.map_or(burst, |at| at.min(burst)).max(detached.now);
        if detached.now == burst {
            let bytes = match line {
                Line::Silence => None,
                Line::Garbage => Some(case.garbage[count % case.garbage.len()..].to_vec()),
                Line::OneByte => Some(vec![case.garbage[0]; 16]),
                Line::OldAnswers => frames.answers.iter().cycle().nth(count).cloned(),
            };
            if let Some(bytes) = bytes {
                detached.driver.handle_bytes(host(detached.now), &bytes);
            }
            burst += interval;
            count += 1;
        }
    }
}
