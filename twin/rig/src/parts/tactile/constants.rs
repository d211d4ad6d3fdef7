//! Constants of both cells for a filter: of a calibration, or of the scenario.

use twinrig_estimate::{Calibration, ChargeAmplifier, Decay, ForceResponse, Hysteresis, Sigmoid};
use twinrig_kernel::SimDuration;
use twinrig_scenario::Options;

use crate::error::BuildError;

pub(super) const LINEAR: &str = "linear";
pub(super) const LOADING: &str = "loading";
pub(super) const UNLOADING: &str = "unloading";
const FLOOR: &str = "floor";
const SWITCH: &str = "switch";
const PIEZORESISTIVE: &str = "piezoresistive";
const PIEZOELECTRIC: &str = "piezoelectric";
const GAIN: &str = "gain";
const AMPLIFIER_TIME: &str = "amplifier_time";
const SILICONE_TIME: &str = "silicone_time";
const RATE: &str = "rate";
const ACCELERATION: &str = "acceleration";

/// Keys of constants, by table.
const CONSTANTS: [(&str, &[&str]); 2] = [
    (PIEZORESISTIVE, &[LINEAR, LOADING, UNLOADING, SWITCH, FLOOR]),
    (
        PIEZOELECTRIC,
        &[GAIN, AMPLIFIER_TIME, SILICONE_TIME, RATE, ACCELERATION],
    ),
];

/// Source of the constants of a filter.
pub(super) struct Constants<'a> {
    piezoelectric: Option<&'a Options>,
    piezoresistive: Option<&'a Options>,
    calibration: Option<&'a Calibration>,
    has_creep: bool,
}

impl<'a> Constants<'a> {
    /// Returns the constants of the filter `keys`.
    ///
    /// # Errors
    /// A constant beside a calibration, which has all of them.
    pub(super) fn of(
        keys: &'a Options,
        calibration: Option<&'a Calibration>,
    ) -> Result<Self, BuildError> {
        if calibration.is_some() {
            for (table, names) in CONSTANTS {
                let group = keys.group(table);
                let set = |name: &&&str| group.is_some_and(|group| group.get(name).is_some());
                if let Some(name) = names.iter().find(set) {
                    let why = format!(
                        "`{table}.{name}` is that of the calibration: remove one of the two"
                    );
                    return Err(why.into());
                }
            }
        }
        Ok(Self {
            piezoelectric: keys.group(PIEZOELECTRIC),
            piezoresistive: keys.group(PIEZORESISTIVE),
            calibration,
            has_creep: keys.text("model") == Some("F4"),
        })
    }

    /// Response of the piezoresistive cell, for its table in the scenario.
    pub(super) fn response(&self, group: &Options) -> Result<ForceResponse, BuildError> {
        match self.calibration {
            Some(calibration) => Ok(calibration.response(self.has_creep)),
            None => response(group),
        }
    }

    /// Voltage that does not creep \[V\].
    pub(super) fn floor(&self) -> Result<f64, BuildError> {
        match (self.calibration, self.piezoresistive) {
            (Some(calibration), _) => Ok(calibration.creep.floor),
            (None, Some(group)) => required(group, PIEZORESISTIVE, FLOOR),
            (None, None) => Err(missing(PIEZORESISTIVE, FLOOR)),
        }
    }

    /// Gain of the piezoelectric cell as a rate sensor \[V·s/N\].
    pub(super) fn rate_gain(&self) -> Result<f64, BuildError> {
        match self.calibration {
            Some(calibration) => Ok(calibration.rate_gain),
            None => self.electric(GAIN),
        }
    }

    /// Coefficient of the rate.
    pub(super) fn rate(&self) -> Result<Decay, BuildError> {
        match self.calibration {
            Some(calibration) => Ok(calibration.rate),
            None => self.decay(RATE),
        }
    }

    /// Coefficient of the acceleration.
    pub(super) fn acceleration(&self) -> Result<Decay, BuildError> {
        match self.calibration {
            Some(calibration) => Ok(calibration.acceleration),
            None => self.decay(ACCELERATION),
        }
    }

    /// Cell with charge amplifier.
    pub(super) fn amplifier(&self) -> Result<ChargeAmplifier, BuildError> {
        if let Some(calibration) = self.calibration {
            return Ok(calibration.amplifier);
        }
        let time = |name: &str| {
            let group = self.piezoelectric;
            let time = group.and_then(|group| group.duration(name));
            let time = time.map(SimDuration::as_secs_f64);
            time.ok_or_else(|| missing(PIEZOELECTRIC, name))
        };
        Ok(ChargeAmplifier {
            // The gain is that of the sensor; the amplifier inverts.
            sensitivity: -self.electric(GAIN)?,
            feedback_s: time(AMPLIFIER_TIME)?,
            lag_s: time(SILICONE_TIME)?,
        })
    }

    fn electric(&self, name: &str) -> Result<f64, BuildError> {
        let group = self.piezoelectric;
        let value = group.and_then(|group| group.number(name));
        value.ok_or_else(|| missing(PIEZOELECTRIC, name))
    }

    fn decay(&self, name: &str) -> Result<Decay, BuildError> {
        let decay = self.piezoelectric.and_then(|group| group.group(name));
        let decay = decay.ok_or_else(|| missing(PIEZOELECTRIC, name))?;
        Ok(Decay {
            value: required(decay, name, "value")?,
            scale_hz: required(decay, name, "scale")?,
        })
    }
}

fn missing(table: &str, name: &str) -> BuildError {
    format!("`{table}` has no `{name}`").into()
}

pub(super) fn required(group: &Options, table: &str, name: &str) -> Result<f64, BuildError> {
    group.number(name).ok_or_else(|| missing(table, name))
}

fn response(group: &Options) -> Result<ForceResponse, BuildError> {
    if let Some(linear) = group.group(LINEAR) {
        return Ok(ForceResponse::Linear {
            gain: required(linear, LINEAR, "per_newton")?,
            offset: required(linear, LINEAR, "offset")?,
        });
    }
    let sigmoid = |name: &str| {
        let branch = group.group(name);
        let branch = branch
            .ok_or_else(|| format!("`{PIEZORESISTIVE}` has neither `{LINEAR}` nor `{name}`"))?;
        Ok::<_, BuildError>(Sigmoid {
            a: required(branch, name, "rise")?,
            b: -1.0 / required(branch, name, "width")?,
            c: -required(branch, name, "mid")?,
            d: required(branch, name, "base")?,
        })
    };
    Ok(ForceResponse::Hysteresis(Hysteresis {
        loading: sigmoid(LOADING)?,
        unloading: sigmoid(UNLOADING)?,
        switch: 1.0 / required(group, PIEZORESISTIVE, SWITCH)?,
    }))
}
