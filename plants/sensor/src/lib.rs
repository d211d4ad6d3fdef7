//! Tactile sensors for the load of a leg (thesis, chapter 4): a piezoresistive cell for the load, a
//! piezoelectric cell for its changes, each with its amplifier. [`TactileSensor`] is one such
//! sensor; [`SensedPlant`] mounts sensors at loads of any plant. Parameters are read from files
//! ([`SensorFile`]), of one design or of a drawn cell ([`TactileParameters::drawn`]), or predicted
//! from the dimensions of a cell ([`design`]).
//!
//! ```
//! use twinrig_sensor::{PiezoelectricCell, SensorFile};
//!
//! let file = SensorFile::find("tactile", "".as_ref())?.ok_or("no sensor")?;
//! let sensor = file.sensor()?;
//! // Voltage of the piezoelectric cell under a sinusoidal load of 2 Hz: a Ḟ + b F̈.
//! let [a, b] = sensor.piezoelectric.coefficients(2.0 * core::f64::consts::TAU);
//! assert!(a > 0.0 && b < 0.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Not modelled: the influence of temperature, moisture and wear; the compliance of the sensor,
//! which would act on the plant; noise, which the emulated acquisition cards add.

pub mod design;
mod drawn_cell;
mod error;
mod low_pass;
mod piezoelectric;
mod piezoresistive;
mod ranges;
mod read;
mod sensed_plant;
mod sensor;

pub use error::SensorError;
pub use piezoelectric::PiezoelectricCell;
pub use piezoresistive::{
    Branch, Characteristic, Creep, Hysteretic, PiezoresistiveCell, ResistanceAmplifier, Saturating,
};
pub use read::{BENCHES, SensorFile};
pub use sensed_plant::SensedPlant;
pub use sensor::{TactileParameters, TactileSensor, TactileState};
