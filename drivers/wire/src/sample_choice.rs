/// Sample that a transfer returns, of a device that sends without requests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SampleChoice {
    /// The newest one available: the transfer takes no time.
    #[default]
    Newest,
    /// The next one received, within two periods of the device; after that the newest one
    /// available.
    Fresh,
}
