//! Piezoresistive cell and its amplifier.

use serde::{Deserialize, Serialize};
use twinrig_document::declaration::{quantity, record};
use twinrig_kernel::Unit;

use crate::ranges;

/// Piezoresistive cell: layers of a conductive foil between two electrodes, whose conductance rises
/// with the load.
///
/// ```text
/// G(F, Ḟ, c) = G₀(F, Ḟ) (1 + share · c / load)        time · ċ = F − c
/// ```
///
/// with the characteristic G₀ and the creep c, a slow mean of the load. The influence of the
/// temperature is not modelled: the thesis did not vary it (section 4.2.2.2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PiezoresistiveCell {
    /// Conductance under a load of short duration.
    pub characteristic: Characteristic,
    /// Slow rise of the conductance under load.
    pub creep: Creep,
}

/// Conductance as a function of load and rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Characteristic {
    /// Linear with saturation. Describes a load that changes slowly.
    Saturating(Saturating),
    /// One sigmoid for rising and one for falling loads. Describes a load that changes as under a
    /// foot.
    Hysteretic(Hysteretic),
}

record! {
    /// Characteristic that is linear up to a saturation (thesis, eq. 4.4):
    /// `base + sensitivity · F`, at least 0 and at most its value at the saturation load.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Saturating = "saturating" {
        /// Sensitivity a₁ \[S/N\].
        pub sensitivity: f64 = quantity(Unit::SiemensPerNewton, ranges::SENSITIVITY),
        /// Base conductance a₂ \[S\]; negative for a cell that conducts from a certain load on.
        pub base: f64 = quantity(Unit::Siemens, ranges::BASE),
        /// Saturation load (a₃ − a₂)/a₁ (eq. 4.5) \[N\].
        pub saturation: f64 = quantity(Unit::Newton, ranges::FORCE),
    }
}

record! {
    /// Characteristic of two sigmoids, mixed by a sigmoid of the rate (eq. 4.21).
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Hysteretic = "hysteretic" {
        /// Branch of rising loads.
        pub loading: Branch = Branch::TYPE,
        /// Branch of falling loads.
        pub unloading: Branch = Branch::TYPE,
        /// Rate over which the mixing changes by a factor of e \[N/s\].
        pub switch: f64 = quantity(Unit::NewtonPerSecond, ranges::RATE),
    }
}

record! {
    /// Branch of a hysteretic characteristic: the sigmoid of eq. 4.20 with a = `rise`,
    /// b = −1/`width`, c = −`mid` and d = `base`.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Branch = "branch" {
        /// Conductance far below the middle \[S\].
        pub base: f64 = quantity(Unit::Siemens, ranges::BRANCH_BASE),
        /// Rise of the conductance from far below to far above the middle \[S\].
        pub rise: f64 = quantity(Unit::Siemens, ranges::CONDUCTANCE),
        /// Load in the middle of the rise \[N\].
        pub mid: f64 = quantity(Unit::Newton, ranges::MID),
        /// Load over which the distance from either end changes by a factor of e \[N\].
        pub width: f64 = quantity(Unit::Newton, ranges::FORCE),
    }
}

record! {
    /// Slow rise of the conductance under load.
    #[derive(Clone, Copy, Debug, PartialEq)]
    pub struct Creep = "creep" {
        /// Relative rise after a long time under `load`; 0 for none.
        pub share: f64 = quantity(Unit::One, ranges::SHARE),
        /// Load of the full rise \[N\].
        pub load: f64 = quantity(Unit::Newton, ranges::FORCE),
        /// Time constant \[s\].
        pub time: f64 = quantity(Unit::Second, ranges::TIME),
    }
}

record! {
    /// Non-inverting amplifier of a reference voltage with the cell in its gain (thesis, eq. 4.2):
    /// V = (1 + `feedback` · G) `reference`, up to the rail.
    #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
    pub struct ResistanceAmplifier = "amplifier" {
        /// Feedback resistor \[Ω\].
        pub feedback: f64 = quantity(Unit::Ohm, ranges::RESISTANCE),
        /// Reference voltage \[V\].
        pub reference: f64 = quantity(Unit::Volt, ranges::VOLTAGE),
        /// Maximum output voltage \[V\].
        pub rail: f64 = quantity(Unit::Volt, ranges::VOLTAGE),
    }
}

/// Returns 1/(1 + e^(−x)), without overflow.
fn sigmoid(x: f64) -> f64 {
    let e = libm::exp(-x.abs());
    if x >= 0.0 {
        1.0 / (1.0 + e)
    } else {
        e / (1.0 + e)
    }
}

impl Branch {
    /// Conductance at a load \[N\], \[S\].
    pub fn conductance(&self, force: f64) -> f64 {
        self.base + self.rise * sigmoid((force - self.mid) / self.width)
    }
}

impl Characteristic {
    /// Conductance at a load \[N\] and its rate \[N/s\], \[S\].
    pub fn conductance(&self, force: f64, rate: f64) -> f64 {
        match self {
            Self::Saturating(Saturating {
                sensitivity,
                base,
                saturation,
            }) => (base + sensitivity * force.min(*saturation)).max(0.0),
            Self::Hysteretic(Hysteretic {
                loading,
                unloading,
                switch,
            }) => {
                let rising = sigmoid(rate / switch);
                rising * loading.conductance(force) + (1.0 - rising) * unloading.conductance(force)
            }
        }
    }
}

impl PiezoresistiveCell {
    /// Conductance at a load \[N\], its rate \[N/s\] and a creep \[N\], \[S\].
    pub fn conductance(&self, force: f64, rate: f64, creep: f64) -> f64 {
        let crept = 1.0 + self.creep.share * creep / self.creep.load;
        self.characteristic.conductance(force, rate) * crept
    }
}

impl ResistanceAmplifier {
    /// Output voltage at a conductance \[S\], \[V\].
    pub fn volts(&self, conductance: f64) -> f64 {
        ((1.0 + self.feedback * conductance) * self.reference).min(self.rail)
    }
}
