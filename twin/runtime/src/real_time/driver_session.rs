use std::sync::Arc;
use std::time::Duration;

use twinrig_kernel::{HostTime, SimDuration};

use super::clock::Clock;
use crate::{Device, DeviceError, Driver, Phase, TaskError};

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
pub(super) enum ByteDirection {
    Out,
    In,
}

/// Callbacks of a session.
pub(super) trait SessionObserver {
    /// Reports bytes that were just written or read.
    fn on_bytes(&mut self, at: HostTime, direction: ByteDirection, bytes: &[u8]);

    /// Returns whether to cancel the phase.
    fn is_cancelled(&self) -> bool;
}

/// Longest wait for bytes between two checks for cancellation.
const READ_TIMEOUT_MAX: Duration = Duration::from_millis(20);

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

    /// Opens the devices. Returns the time of the end, none if cancelled.
    pub(super) fn open(
        &mut self,
        limit: SimDuration,
        observer: &mut dyn SessionObserver,
    ) -> Result<Option<HostTime>, TaskError> {
        self.driver.open(self.clock.now());
        self.run_phase(Phase::Opening, limit, observer)
    }

    /// Runs one transfer. Bytes received since the last one are passed to the driver first. Returns
    /// the time of the end, none if cancelled.
    pub(super) fn transfer(
        &mut self,
        from_process: &[f64],
        limit: SimDuration,
        observer: &mut dyn SessionObserver,
    ) -> Result<Option<HostTime>, TaskError> {
        self.receive(Duration::ZERO, observer)?;
        self.driver.begin(self.clock.now(), from_process);
        self.run_phase(Phase::Transfer, limit, observer)
    }

    /// Puts the devices into a safe state.
    pub(super) fn close(
        &mut self,
        limit: SimDuration,
        observer: &mut dyn SessionObserver,
    ) -> Result<Option<HostTime>, TaskError> {
        self.driver.close(self.clock.now());
        self.run_phase(Phase::Closing, limit, observer)
    }

    /// Handles the driver's timeout between transfers, if it is due; returns the next one.
    pub(super) fn handle_idle_timeout(
        &mut self,
        limit: SimDuration,
        observer: &mut dyn SessionObserver,
    ) -> Result<Option<HostTime>, TaskError> {
        let due = |driver: &dyn Driver, now| driver.poll_timeout().is_some_and(|at| at <= now);
        let began = self.clock.now();
        if due(&*self.driver, began) {
            self.receive(Duration::ZERO, observer)?;
            let now = self.clock.now();
            if due(&*self.driver, now) {
                self.driver.handle_timeout(now);
            }
            self.write(Phase::Transfer, limit, began + duration(limit), observer)?;
        }
        Ok(self.driver.poll_timeout())
    }

    /// Exchanges bytes between driver and device until the driver reports the end of the phase, and
    /// returns the time of it; none if the phase is cancelled.
    fn run_phase(
        &mut self,
        phase: Phase,
        limit: SimDuration,
        observer: &mut dyn SessionObserver,
    ) -> Result<Option<HostTime>, TaskError> {
        let deadline = self.clock.now() + duration(limit);
        loop {
            self.write(phase, limit, deadline, observer)?;
            let busy = self.driver.is_busy();
            let busy = busy.map_err(|error| TaskError::Device { why: error.why })?;
            let now = self.clock.now();
            if !busy {
                return Ok(Some(now));
            }
            if now >= deadline {
                return Err(self.limit_exceeded(phase, limit));
            }
            if observer.is_cancelled() && phase != Phase::Closing {
                return Ok(None);
            }
            let until = self.driver.poll_timeout().unwrap_or(deadline).min(deadline);
            self.receive(until.since(now).min(READ_TIMEOUT_MAX), observer)?;
            let now = self.clock.now();
            if self.driver.poll_timeout().is_some_and(|at| at <= now) {
                self.driver.handle_timeout(now);
            }
        }
    }

    /// Writes all pending bytes of the driver.
    fn write(
        &mut self,
        phase: Phase,
        limit: SimDuration,
        deadline: HostTime,
        observer: &mut dyn SessionObserver,
    ) -> Result<(), TaskError> {
        loop {
            self.bytes.clear();
            if !self.driver.poll_transmit(&mut self.bytes) {
                return Ok(());
            }
            // Time before the write, so that no answer is stamped earlier than its request.
            let now = self.clock.now();
            if now >= deadline {
                return Err(self.limit_exceeded(phase, limit));
            }
            self.device.write(&self.bytes)?;
            observer.on_bytes(now, ByteDirection::Out, &self.bytes);
        }
    }

    /// Reads the bytes that are available or arrive within `timeout`.
    fn receive(
        &mut self,
        timeout: Duration,
        observer: &mut dyn SessionObserver,
    ) -> Result<(), DeviceError> {
        self.bytes.clear();
        self.device.read(timeout, &mut self.bytes)?;
        if !self.bytes.is_empty() {
            let now = self.clock.now();
            self.driver.handle_bytes(now, &self.bytes);
            observer.on_bytes(now, ByteDirection::In, &self.bytes);
        }
        Ok(())
    }

    fn limit_exceeded(&self, phase: Phase, limit: SimDuration) -> TaskError {
        TaskError::TimeLimit {
            what: phase,
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

    type Log = Arc<Mutex<Vec<String>>>;

    /// Driver that logs its calls; has one timeout, sends two requests per transfer, and is done
    /// after two answers.
    struct RecordingDriver {
        log: Log,
        timeout: Option<HostTime>,
        answers: usize,
        requests: usize,
    }

    impl RecordingDriver {
        fn record(&self, call: &str, now: HostTime) {
            let record = format!("{call} at {}", now.as_nanos());
            self.log.lock().unwrap().push(record);
        }
    }

    impl Driver for RecordingDriver {
        fn name(&self) -> &'static str {
            "recording"
        }
        fn ports(&self) -> Vec<Port> {
            Vec::new()
        }
        fn open(&mut self, now: HostTime) {
            self.record("open", now);
        }
        fn begin(&mut self, now: HostTime, _: &[f64]) {
            self.record("begin", now);
            self.requests = 2;
        }
        fn close(&mut self, now: HostTime) {
            self.record("close", now);
        }
        fn handle_bytes(&mut self, now: HostTime, bytes: &[u8]) {
            self.record(&format!("received {bytes:?}"), now);
            self.answers += bytes.len();
        }
        fn handle_timeout(&mut self, now: HostTime) {
            self.record("timeout", now);
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
        fn is_busy(&self) -> Result<bool, DriverError> {
            Ok(self.answers < 2)
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
    struct ScriptedDevice {
        arrivals: Vec<(u64, u8)>,
        now: Arc<Mutex<u64>>,
        log: Log,
    }

    #[derive(Clone)]
    struct ManualClock(Arc<Mutex<u64>>);

    impl Clock for ManualClock {
        fn now(&self) -> HostTime {
            HostTime::from_nanos(*self.0.lock().unwrap())
        }
        fn sleep_until(&self, at: HostTime) {
            *self.0.lock().unwrap() = at.as_nanos();
        }
    }

    impl Device for ScriptedDevice {
        fn place(&self) -> &'static str {
            "scripted device"
        }
        fn write(&mut self, bytes: &[u8]) -> Result<(), DeviceError> {
            self.log.lock().unwrap().push(format!("write {bytes:?}"));
            Ok(())
        }
        fn read_up_to(
            &mut self,
            _: usize,
            timeout: Duration,
            bytes: &mut Vec<u8>,
        ) -> Result<(), DeviceError> {
            let mut now = self.now.lock().unwrap();
            let until = *now + u64::try_from(timeout.as_nanos()).unwrap();
            match self.arrivals.first() {
                Some(&(at, byte)) if at <= until => {
                    *now = at.max(*now);
                    bytes.push(byte);
                    self.arrivals.remove(0);
                }
                _ => *now = until,
            }
            Ok(())
        }
    }

    struct IgnoreBytes;

    impl SessionObserver for IgnoreBytes {
        fn on_bytes(&mut self, _: HostTime, _: ByteDirection, _: &[u8]) {}
        fn is_cancelled(&self) -> bool {
            false
        }
    }

    fn session(timeout: Option<u64>, arrivals: &[(u64, u8)]) -> (DriverSession, ManualClock, Log) {
        let (clock, log) = (ManualClock(Arc::new(Mutex::new(100))), Log::default());
        let driver = RecordingDriver {
            log: log.clone(),
            timeout: timeout.map(HostTime::from_nanos),
            answers: 0,
            requests: 0,
        };
        let device = ScriptedDevice {
            arrivals: arrivals.to_vec(),
            now: clock.0.clone(),
            log: log.clone(),
        };
        let session =
            DriverSession::new(Box::new(driver), Box::new(device), Arc::new(clock.clone()));
        (session, clock, log)
    }

    #[test]
    fn earlier_bytes_precede_the_transfer_and_timeouts_are_handled_on_time() {
        let limit = SimDuration::from_secs(1);
        let (mut session, _, log) = session(Some(300), &[(50, 1), (500, 2)]);
        let end = session.transfer(&[], limit, &mut IgnoreBytes).unwrap();
        assert_eq!(end, Some(HostTime::from_nanos(500)));
        let expected = [
            "received [1] at 100",
            "begin at 100",
            "write [7]",
            "write [7]",
            "timeout at 300",
            "write [7]",
            "received [2] at 500",
        ];
        assert_eq!(*log.lock().unwrap(), expected);
    }

    #[test]
    fn timeout_between_transfers_is_handled_when_due_and_not_before() {
        let limit = SimDuration::from_secs(1);
        let (mut session, clock, log) = session(Some(300), &[(200, 9)]);
        let next = session
            .handle_idle_timeout(limit, &mut IgnoreBytes)
            .unwrap();
        assert_eq!(
            (next, log.lock().unwrap().len()),
            (Some(HostTime::from_nanos(300)), 0)
        );
        clock.sleep_until(HostTime::from_nanos(310));
        assert_eq!(
            session
                .handle_idle_timeout(limit, &mut IgnoreBytes)
                .unwrap(),
            None
        );
        let expected = ["received [9] at 310", "timeout at 310", "write [7]"];
        assert_eq!(*log.lock().unwrap(), expected);
    }

    #[test]
    fn phase_limit_applies_without_driver_timeout() {
        let limit = SimDuration::from_millis(50);
        let (mut session, clock, _) = session(None, &[]);
        let error = session.open(limit, &mut IgnoreBytes).unwrap_err();
        assert!(
            error
                .to_string()
                .starts_with("scripted device: opening took more than 50.000 ms"),
            "{error}"
        );
        assert_eq!(clock.now(), HostTime::from_nanos(50_000_100));
    }
}
