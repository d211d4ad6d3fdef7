use std::sync::Arc;
use std::time::Duration;

use twinrig_kernel::{HostTime, SimDuration};

use super::clock::{Clock, later};
use crate::{Device, DeviceError, Driver, Phase, TaskError, Transfer};

/// A driver with its device: executes the phases opening, transfer and closing, independent of the
/// thread.
pub(super) struct DriverSession {
    pub(super) driver: Box<dyn Driver>,
    device: Box<dyn Device>,
    clock: Arc<dyn Clock>,
    bytes: Vec<u8>,
}

/// Direction of bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Heading {
    Out,
    In,
}

/// Callbacks of a session.
pub(super) trait SessionObserver {
    /// Reports bytes that were just written or read.
    fn passed(&mut self, at: HostTime, way: Heading, bytes: &[u8]);

    /// Returns whether to cancel the phase.
    fn is_called_off(&self) -> bool;
}

/// End of a phase without failure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SessionEnd {
    Done(HostTime),
    CalledOff,
}

/// Longest wait for bytes between two checks for cancellation.
const PATIENCE_MAX: Duration = Duration::from_millis(20);

impl DriverSession {
    pub(super) fn new(
        driver: Box<dyn Driver>,
        device: Box<dyn Device>,
        clock: Arc<dyn Clock>,
    ) -> Self {
        Self {
            driver,
            device,
            clock,
            bytes: Vec::with_capacity(4096),
        }
    }

    /// Returns the location of the device.
    pub(super) fn place(&self) -> &str {
        self.device.place()
    }

    /// Opens the devices.
    pub(super) fn open(
        &mut self,
        limit: SimDuration,
        side: &mut dyn SessionObserver,
    ) -> Result<SessionEnd, TaskError> {
        self.driver.open(self.clock.now());
        self.go_on(Phase::Opening, limit, side)
    }

    /// Runs one transfer. Bytes received since the last one are passed to the driver first.
    pub(super) fn transfer(
        &mut self,
        from_process: &[f64],
        limit: SimDuration,
        side: &mut dyn SessionObserver,
    ) -> Result<SessionEnd, TaskError> {
        self.hear(Duration::ZERO, side)?;
        self.driver.begin(self.clock.now(), from_process);
        self.go_on(Phase::Transfer, limit, side)
    }

    /// Puts the devices into a safe state.
    pub(super) fn close(
        &mut self,
        limit: SimDuration,
        side: &mut dyn SessionObserver,
    ) -> Result<SessionEnd, TaskError> {
        self.driver.close(self.clock.now());
        self.go_on(Phase::Closing, limit, side)
    }

    /// Handles the driver's timeout between transfers, if it is due; returns the next one.
    pub(super) fn attend(
        &mut self,
        limit: SimDuration,
        side: &mut dyn SessionObserver,
    ) -> Result<Option<HostTime>, TaskError> {
        let due = |driver: &dyn Driver, now| driver.poll_timeout().is_some_and(|at| at <= now);
        let began = self.clock.now();
        if due(&*self.driver, began) {
            self.hear(Duration::ZERO, side)?;
            let now = self.clock.now();
            if due(&*self.driver, now) {
                self.driver.handle_timeout(now);
            }
            self.write(Phase::Transfer, limit, later(began, duration(limit)), side)?;
        }
        Ok(self.driver.poll_timeout())
    }

    /// Exchanges bytes between driver and device until the driver reports the end of the phase.
    fn go_on(
        &mut self,
        what: Phase,
        limit: SimDuration,
        side: &mut dyn SessionObserver,
    ) -> Result<SessionEnd, TaskError> {
        let deadline = later(self.clock.now(), duration(limit));
        loop {
            self.write(what, limit, deadline, side)?;
            let progress = self.driver.poll_transfer();
            let progress = progress.map_err(|error| TaskError::Device { why: error.why })?;
            let now = self.clock.now();
            if progress == Transfer::Done {
                return Ok(SessionEnd::Done(now));
            }
            if now >= deadline {
                return Err(self.too_long(what, limit));
            }
            if side.is_called_off() && what != Phase::Closing {
                return Ok(SessionEnd::CalledOff);
            }
            let until = self.driver.poll_timeout().unwrap_or(deadline).min(deadline);
            self.hear(until.since(now).min(PATIENCE_MAX), side)?;
            let now = self.clock.now();
            if self.driver.poll_timeout().is_some_and(|at| at <= now) {
                self.driver.handle_timeout(now);
            }
        }
    }

    /// Writes all pending bytes of the driver.
    fn write(
        &mut self,
        what: Phase,
        limit: SimDuration,
        deadline: HostTime,
        side: &mut dyn SessionObserver,
    ) -> Result<(), TaskError> {
        loop {
            self.bytes.clear();
            if !self.driver.poll_transmit(&mut self.bytes) {
                return Ok(());
            }
            // Time before the write, so that no answer is stamped earlier than its request.
            let now = self.clock.now();
            if now >= deadline {
                return Err(self.too_long(what, limit));
            }
            self.device.write(&self.bytes)?;
            side.passed(now, Heading::Out, &self.bytes);
        }
    }

    /// Reads the bytes that are available or arrive within `patience`.
    fn hear(
        &mut self,
        patience: Duration,
        side: &mut dyn SessionObserver,
    ) -> Result<(), DeviceError> {
        self.bytes.clear();
        self.device.read(patience, &mut self.bytes)?;
        if !self.bytes.is_empty() {
            let now = self.clock.now();
            self.driver.handle_bytes(now, &self.bytes);
            side.passed(now, Heading::In, &self.bytes);
        }
        Ok(())
    }

    fn too_long(&self, what: Phase, limit: SimDuration) -> TaskError {
        TaskError::TimeLimit {
            what,
            place: self.place().into(),
            limit,
        }
    }
}

/// Converts to [`Duration`].
pub(super) fn duration(of: SimDuration) -> Duration {
    Duration::from_nanos(of.as_nanos())
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use twinrig_kernel::{Port, Snapshot, SnapshotError};

    use super::*;
    use crate::DriverError;

    type Notes = Arc<Mutex<Vec<String>>>;

    /// Driver that logs its calls; has one timeout, sends two requests per transfer, and is done
    /// after two answers.
    struct Talkative {
        notes: Notes,
        timeout: Option<HostTime>,
        answers: usize,
        requests: usize,
    }

    impl Talkative {
        fn note(&self, what: &str, now: HostTime) {
            let note = format!("{what} at {}", now.as_nanos());
            self.notes.lock().unwrap().push(note);
        }
    }

    impl Driver for Talkative {
        fn name(&self) -> &'static str {
            "talkative"
        }
        fn ports(&self) -> Vec<Port> {
            Vec::new()
        }
        fn open(&mut self, now: HostTime) {
            self.note("open", now);
        }
        fn begin(&mut self, now: HostTime, _: &[f64]) {
            self.note("begin", now);
            self.requests = 2;
        }
        fn close(&mut self, now: HostTime) {
            self.note("close", now);
        }
        fn handle_bytes(&mut self, now: HostTime, bytes: &[u8]) {
            self.note(&format!("hears {bytes:?}"), now);
            self.answers += bytes.len();
        }
        fn handle_timeout(&mut self, now: HostTime) {
            self.note("timeout", now);
            self.timeout = None;
            self.requests = 1;
        }
        fn poll_timeout(&self) -> Option<HostTime> {
            self.timeout
        }
        fn poll_transmit(&mut self, bytes: &mut Vec<u8>) -> bool {
            let any = self.requests > 0;
            self.requests = self.requests.saturating_sub(1);
            bytes.extend(any.then_some(7));
            any
        }
        fn poll_transfer(&mut self) -> Result<Transfer, DriverError> {
            Ok(if self.answers < 2 {
                Transfer::Busy
            } else {
                Transfer::Done
            })
        }
        fn to_process(&self) -> &[f64] {
            &[]
        }
        fn save(&self) -> Snapshot {
            Snapshot::default()
        }
        fn restore(&mut self, _: &Snapshot) -> Result<(), SnapshotError> {
            Ok(())
        }
    }

    /// Device with bytes at given times; its clock advances while they are awaited.
    struct Post {
        comes: Vec<(u64, u8)>,
        now: Arc<Mutex<u64>>,
        notes: Notes,
    }

    #[derive(Clone)]
    struct Hand(Arc<Mutex<u64>>);

    impl Clock for Hand {
        fn now(&self) -> HostTime {
            HostTime::from_nanos(*self.0.lock().unwrap())
        }
        fn sleep_until(&self, at: HostTime) {
            *self.0.lock().unwrap() = at.as_nanos();
        }
    }

    impl Device for Post {
        fn place(&self) -> &'static str {
            "a letter box"
        }
        fn write(&mut self, bytes: &[u8]) -> Result<(), DeviceError> {
            self.notes.lock().unwrap().push(format!("writes {bytes:?}"));
            Ok(())
        }
        fn read_up_to(
            &mut self,
            _: usize,
            patience: Duration,
            bytes: &mut Vec<u8>,
        ) -> Result<(), DeviceError> {
            let mut now = self.now.lock().unwrap();
            let until = *now + u64::try_from(patience.as_nanos()).unwrap();
            match self.comes.first() {
                Some(&(at, byte)) if at <= until => {
                    *now = at.max(*now);
                    bytes.push(byte);
                    self.comes.remove(0);
                }
                _ => *now = until,
            }
            Ok(())
        }
    }

    struct Nobody;

    impl SessionObserver for Nobody {
        fn passed(&mut self, _: HostTime, _: Heading, _: &[u8]) {}
        fn is_called_off(&self) -> bool {
            false
        }
    }

    fn exchange(timeout: Option<u64>, comes: &[(u64, u8)]) -> (DriverSession, Hand, Notes) {
        let (hand, notes) = (Hand(Arc::new(Mutex::new(100))), Notes::default());
        let driver = Talkative {
            notes: notes.clone(),
            timeout: timeout.map(HostTime::from_nanos),
            answers: 0,
            requests: 0,
        };
        let device = Post {
            comes: comes.to_vec(),
            now: hand.0.clone(),
            notes: notes.clone(),
        };
        let exchange =
            DriverSession::new(Box::new(driver), Box::new(device), Arc::new(hand.clone()));
        (exchange, hand, notes)
    }

    #[test]
    fn what_came_before_a_transfer_is_heard_before_it_and_every_wish_is_met_at_its_time() {
        let limit = SimDuration::from_secs(1);
        let (mut exchange, _, notes) = exchange(Some(300), &[(50, 1), (500, 2)]);
        let ending = exchange.transfer(&[], limit, &mut Nobody).unwrap();
        assert_eq!(ending, SessionEnd::Done(HostTime::from_nanos(500)));
        let expected = [
            "hears [1] at 100",
            "begin at 100",
            "writes [7]",
            "writes [7]",
            "timeout at 300",
            "writes [7]",
            "hears [2] at 500",
        ];
        assert_eq!(*notes.lock().unwrap(), expected);
    }

    #[test]
    fn a_driver_is_attended_to_between_transfers_when_it_wants_to_and_not_before() {
        let limit = SimDuration::from_secs(1);
        let (mut exchange, hand, notes) = exchange(Some(300), &[(200, 9)]);
        let next = exchange.attend(limit, &mut Nobody).unwrap();
        assert_eq!(
            (next, notes.lock().unwrap().len()),
            (Some(HostTime::from_nanos(300)), 0)
        );
        hand.sleep_until(HostTime::from_nanos(310));
        assert_eq!(exchange.attend(limit, &mut Nobody).unwrap(), None);
        let expected = ["hears [9] at 310", "timeout at 310", "writes [7]"];
        assert_eq!(*notes.lock().unwrap(), expected);
    }

    #[test]
    fn a_limit_is_kept_whatever_the_driver_waits_for() {
        let limit = SimDuration::from_millis(50);
        let (mut exchange, hand, _) = exchange(None, &[]);
        let error = exchange.open(limit, &mut Nobody).unwrap_err();
        assert!(
            error
                .to_string()
                .starts_with("a letter box: opening took more than 50.000 ms"),
            "{error}"
        );
        assert_eq!(hand.now(), HostTime::from_nanos(50_000_100));
    }
}
