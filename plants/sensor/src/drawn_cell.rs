//! Cells of one design that differ, as those of a workshop do.

use twinrig_document::{Placed, Problem};
use twinrig_kernel::{Stream, stream};

use crate::piezoresistive::{Branch, Characteristic, Hysteretic, Saturating};
use crate::sensor::TactileParameters;

/// Name of the random stream of the constants of a cell. Its seed is the number of the cell, not
/// the seed of a run: runs with other seeds are runs of the same cell.
const STREAM: &str = "sensor/cell";

impl TactileParameters {
    /// Returns cell `number` of this design: every constant of both cells and both amplifiers has a
    /// factor of its own, uniform within 1 ± `spread` \[1\]. A constant that is zero stays zero.
    ///
    /// The branches of a hysteretic characteristic are those of one foil: each constant of the
    /// loading branch has a factor, which the unloading branch shares, and the distance of the two
    /// has another. Independent factors would reverse the loop of some cells.
    ///
    /// ```
    /// use twinrig_sensor::SensorFile;
    ///
    /// let design = SensorFile::find("tactile", "".as_ref())?.ok_or("no sensor")?.sensor()?;
    /// let cell = design.drawn(0.1, 7);
    /// assert_eq!(cell, design.drawn(0.1, 7));
    /// assert_ne!(cell, design.drawn(0.1, 8));
    /// assert!((cell.piezoelectric.gain / design.piezoelectric.gain - 1.0).abs() <= 0.1);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn drawn(&self, spread: f64, number: u64) -> Self {
        let mut factors = Factors {
            numbers: stream(number, STREAM),
            spread,
        };
        let mut cell = *self;
        match &mut cell.piezoresistive.characteristic {
            Characteristic::Saturating(Saturating {
                sensitivity,
                base,
                saturation,
            }) => factors.apply([sensitivity, base, saturation]),
            Characteristic::Hysteretic(Hysteretic {
                loading,
                unloading,
                switch,
            }) => {
                for constant in BRANCH {
                    let (common, apart) = (factors.next(), factors.next());
                    let (first, second) = (constant(loading), constant(unloading));
                    let distance = *second - *first;
                    *first *= common;
                    *second = *first + common * apart * distance;
                }
                factors.apply([switch]);
            }
        }
        let creep = &mut cell.piezoresistive.creep;
        factors.apply([&mut creep.share, &mut creep.load, &mut creep.time]);
        let amplifier = &mut cell.amplifier;
        factors.apply([
            &mut amplifier.feedback,
            &mut amplifier.reference,
            &mut amplifier.rail,
        ]);
        let charge = &mut cell.piezoelectric;
        factors.apply([
            &mut charge.gain,
            &mut charge.amplifier_time,
            &mut charge.silicone_time,
            &mut charge.rail,
            &mut charge.offset,
        ]);
        cell
    }

    /// Returns the cell `number` of a design with a spread, or the design itself without a
    /// number.
    ///
    /// # Errors
    /// At the number, if the design has no spread: its cells would not differ.
    pub fn numbered(&self, number: Option<&Placed<u64>>) -> Result<Self, Problem> {
        match (self.spread, number) {
            (_, None) => Ok(*self),
            (Some(spread), Some(number)) => Ok(self.drawn(spread, number.value)),
            (None, Some(number)) => Err(Problem::at(
                &number.place,
                "the sensor has no `spread`: its cells do not differ",
                "add `spread = \"10 %\"` to the [sensor] of its file, or remove `cell`",
            )),
        }
    }
}

/// Constants of a branch.
const BRANCH: [fn(&mut Branch) -> &mut f64; 4] = [
    |branch| &mut branch.base,
    |branch| &mut branch.rise,
    |branch| &mut branch.mid,
    |branch| &mut branch.width,
];

/// Factors of the constants of a cell.
struct Factors {
    numbers: Stream,
    spread: f64,
}

impl Factors {
    fn next(&mut self) -> f64 {
        1.0 + self.spread * (2.0 * self.numbers.unit() - 1.0)
    }

    fn apply<'v>(&mut self, constants: impl IntoIterator<Item = &'v mut f64>) {
        for constant in constants {
            *constant *= self.next();
        }
    }
}
