//! The characterised cells.

/// Factor of the design.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum CellFactor {
    /// Conductive glue between electrodes and foil: −1 without, +1 with.
    Glue,
    /// Number of layers of the foil: −1 for 2, +1 for 6.
    Layer,
    /// Shape of the electrodes: −1 for type A, +1 for type B.
    Shape,
    /// Length l: −1 for 8 mm, +1 for 29 mm.
    Length,
    /// Width w: −1 for 5 mm, +1 for 29 mm.
    Width,
}

impl CellFactor {
    /// All factors, in the order of table 4.4.
    pub const ALL: [Self; 5] = [
        Self::Glue,
        Self::Layer,
        Self::Shape,
        Self::Length,
        Self::Width,
    ];

    /// Name in table 4.5.
    pub fn name(self) -> &'static str {
        match self {
            Self::Glue => "Glue",
            Self::Layer => "Layer",
            Self::Shape => "Shape",
            Self::Length => "Length",
            Self::Width => "Width",
        }
    }
}

/// Shape of the electrodes (figure 4.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Electrode {
    /// Type A: a strip at each of two opposite sides.
    A,
    /// Type B: interleaved strips over the whole area.
    B,
}

/// Dimensions of a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellDesign {
    /// Shape of the electrodes.
    pub electrode: Electrode,
    /// Number of layers of the foil.
    pub layers: u32,
    /// Whether the electrodes are held by conductive glue.
    pub glue: bool,
    /// Length l, in the direction between the main conductors \[m\].
    pub length: f64,
    /// Width w, along the main conductors \[m\].
    pub width: f64,
}

/// Tested levels (table 4.3): layers, length \[m\] and width \[m\].
pub(super) const LAYERS: [f64; 2] = [2.0, 6.0];
pub(super) const LENGTH: [f64; 2] = [8e-3, 29e-3];
pub(super) const WIDTH: [f64; 2] = [5e-3, 29e-3];

/// Returns −1 at the lower and +1 at the upper level, linear between and beyond.
fn coded(value: f64, [low, high]: [f64; 2]) -> f64 {
    ((value - low) - (high - value)) / (high - low)
}

impl CellDesign {
    /// Coded factors, in the order of [`CellFactor::ALL`].
    pub fn coded(&self) -> [f64; 5] {
        let sign = |upper| if upper { 1.0 } else { -1.0 };
        [
            sign(self.glue),
            coded(f64::from(self.layers), LAYERS),
            sign(self.electrode == Electrode::B),
            coded(self.length, LENGTH),
            coded(self.width, WIDTH),
        ]
    }
}

/// Response of the design: a parameter of the characteristic of a cell (eq. 4.4).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellResponse {
    /// Sensitivity a₁ \[S/N\].
    Sensitivity,
    /// Base conductance a₂ \[S\].
    Base,
    /// Saturation load (a₃ − a₂)/a₁ \[N\].
    Saturation,
}

impl CellResponse {
    /// All responses, in the order of table 4.4.
    pub const ALL: [Self; 3] = [Self::Sensitivity, Self::Base, Self::Saturation];

    /// Name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sensitivity => "sensitivity",
            Self::Base => "base conductance",
            Self::Saturation => "saturation load",
        }
    }

    /// Symbol of the SI unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Sensitivity => "S/N",
            Self::Base => "S",
            Self::Saturation => "N",
        }
    }

    /// Values of the sixteen cells, in the order of [`CELLS`].
    pub fn values(self) -> [f64; 16] {
        CELLS.map(|cell| match self {
            Self::Sensitivity => cell.sensitivity,
            Self::Base => cell.base,
            Self::Saturation => cell.saturation,
        })
    }
}

/// Characterised cell: a row of table 4.4.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TestedCell {
    /// Coded factors, each ±1, in the order of [`CellFactor::ALL`].
    pub coded: [f64; 5],
    /// Sensitivity a₁ \[S/N\].
    pub sensitivity: f64,
    /// Base conductance a₂ \[S\].
    pub base: f64,
    /// Saturation load (a₃ − a₂)/a₁ \[N\].
    pub saturation: f64,
    /// Coefficient of determination of the fit of eq. 4.4 (appendix B).
    pub r_squared: f64,
}

impl TestedCell {
    /// Dimensions.
    pub fn design(&self) -> CellDesign {
        let [glue, layer, shape, length, width] = self.coded.map(|level| level > 0.0);
        let at = |upper, [low, high]: [f64; 2]| if upper { high } else { low };
        CellDesign {
            electrode: if shape { Electrode::B } else { Electrode::A },
            layers: if layer { 6 } else { 2 },
            glue,
            length: at(length, LENGTH),
            width: at(width, WIDTH),
        }
    }
}

const fn tested(
    coded: [f64; 5],
    sensitivity: f64,
    base: f64,
    saturation: f64,
    r_squared: f64,
) -> TestedCell {
    TestedCell {
        coded,
        sensitivity,
        base,
        saturation,
        r_squared,
    }
}

/// The sixteen cells (table 4.4; R² of figures B.1 to B.16). Every response has five significant
/// digits.
#[rustfmt::skip]
pub const CELLS: [TestedCell; 16] = [
    tested([1.0, 1.0, 1.0, 1.0, 1.0], 1.3982e-5, 2.9882e-5, 26.919, 0.997_367),
    tested([1.0, 1.0, -1.0, 1.0, -1.0], 1.1016e-6, 7.8661e-6, 14.358, 0.996_566),
    tested([1.0, 1.0, 1.0, -1.0, -1.0], 1.2232e-6, 9.0181e-6, 16.719, 0.993_491),
    tested([1.0, 1.0, -1.0, -1.0, 1.0], 5.5699e-7, 1.0786e-5, 54.284, 0.988_849),
    tested([1.0, -1.0, 1.0, -1.0, -1.0], 1.3968e-7, 2.8418e-6, 39.206, 0.998_323),
    tested([1.0, -1.0, -1.0, -1.0, 1.0], 1.6838e-6, 5.2261e-6, 5.499, 0.999_435),
    tested([1.0, -1.0, 1.0, 1.0, 1.0], 1.3655e-5, 3.9793e-5, 23.556, 0.997_088),
    tested([1.0, -1.0, -1.0, 1.0, -1.0], 4.1681e-7, 2.0652e-6, 20.194, 0.996_530),
    tested([-1.0, 1.0, 1.0, -1.0, 1.0], 1.8126e-5, 9.8095e-5, 69.953, 0.996_604),
    tested([-1.0, 1.0, -1.0, -1.0, -1.0], 3.4456e-6, -3.8753e-5, 25.433, 0.996_591),
    tested([-1.0, 1.0, 1.0, 1.0, -1.0], 5.5612e-6, 6.1428e-5, 70.625, 0.992_912),
    tested([-1.0, 1.0, -1.0, 1.0, 1.0], 3.3149e-6, 1.4522e-5, 8.065, 0.995_463),
    tested([-1.0, -1.0, 1.0, 1.0, -1.0], 9.7197e-6, 1.5654e-5, 31.604, 0.998_476),
    tested([-1.0, -1.0, -1.0, 1.0, 1.0], 5.4386e-6, 4.7005e-6, 3.507, 0.998_049),
    tested([-1.0, -1.0, 1.0, -1.0, 1.0], 1.3452e-5, 2.4862e-5, 34.412, 0.995_355),
    tested([-1.0, -1.0, -1.0, -1.0, -1.0], 7.3956e-7, -5.0260e-6, 19.597, 0.999_156),
];
