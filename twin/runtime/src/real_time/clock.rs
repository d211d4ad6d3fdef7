use twinrig_kernel::HostTime;

/// Clock of the real-time executors: [`MonotonicClock`](super::MonotonicClock), or a manual one in
/// tests.
pub trait Clock: Send + Sync {
    /// Returns the present time.
    fn now(&self) -> HostTime;

    /// Blocks until `at` or later; returns immediately if `at` is past.
    fn sleep_until(&self, at: HostTime);
}
