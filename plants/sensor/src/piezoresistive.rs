//! Piezoresistive cell and its amplifier.

use serde::{Deserialize, Serialize};

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
    /// Linear with saturation (thesis, eq. 4.4): `base + sensitivity · F`, at least 0 and at most
    /// its value at the saturation load. Describes a load that changes slowly.
    Saturating {
        /// Sensitivity a₁ \[S/N\].
        sensitivity: f64,
        /// Base conductance a₂ \[S\]; negative for a cell that conducts from a certain load on.
        base: f64,
        /// Saturation load (a₃ − a₂)/a₁ (eq. 4.5) \[N\].
        saturation: f64,
    },
    /// One sigmoid for rising and one for falling loads, mixed by a sigmoid of the rate (eq. 4.21).
    /// Describes a load that changes as under a foot.
    Hysteretic {
        /// Branch of rising loads.
        loading: Branch,
        /// Branch of falling loads.
        unloading: Branch,
        /// Rate over which the mixing changes by a factor of e \[N/s\].
        switch: f64,
    },
}

/// Branch of a hysteretic characteristic: the sigmoid of eq. 4.20 with a = `rise`, b = −1/`width`,
/// c = −`mid` and d = `base`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Branch {
    /// Conductance far below the middle \[S\].
    pub base: f64,
    /// Rise of the conductance from far below to far above the middle \[S\].
    pub rise: f64,
    /// Load in the middle of the rise \[N\].
    pub mid: f64,
    /// Load over which the distance from either end changes by a factor of e \[N\].
    pub width: f64,
}

/// Slow rise of the conductance under load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Creep {
    /// Relative rise after a long time under `load`; 0 for none.
    pub share: f64,
    /// Load of the full rise \[N\].
    pub load: f64,
    /// Time constant \[s\].
    pub time: f64,
}

/// Non-inverting amplifier of a reference voltage with the cell in its gain (thesis, eq. 4.2):
/// V = (1 + `feedback` · G) `reference`, up to the rail.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResistanceAmplifier {
    /// Feedback resistor \[Ω\].
    pub feedback: f64,
    /// Reference voltage \[V\].
    pub reference: f64,
    /// Maximum output voltage \[V\].
    pub rail: f64,
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
            Self::Saturating {
                sensitivity,
                base,
                saturation,
            } => (base + sensitivity * force.min(*saturation)).max(0.0),
            Self::Hysteretic {
                loading,
                unloading,
                switch,
            } => {
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
