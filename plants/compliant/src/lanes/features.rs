//! Choice of an implementation of lanes.

#[cfg(target_arch = "x86_64")]
use super::x86;
use super::{Kernel, portable};

/// Choice of an implementation of [`Lanes`](super::Lanes).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Features {
    /// The widest registers that this processor has.
    #[default]
    Detected,
    /// Registers of 128 bits, which every processor has.
    Portable,
}

impl Features {
    /// Returns the name of the implementation on this processor.
    pub fn name(self) -> &'static str {
        #[cfg(target_arch = "x86_64")]
        if self == Self::Detected && x86::is_available() {
            return "avx2";
        }
        portable::NAME
    }
}

/// Runs a computation with the chosen implementation.
#[inline]
pub fn dispatch<K: Kernel>(features: Features, kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    if features == Features::Detected {
        return x86::dispatch(kernel);
    }
    let _ = features;
    portable::dispatch(kernel)
}
