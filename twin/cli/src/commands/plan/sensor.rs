//! Sensors of the controller's inputs in a plan.

use serde::Serialize;
use twinrig_document::print_quantity;
use twinrig_kernel::Unit;
use twinrig_runtime::{SensorModel, Timing};

use super::format::ms;
use twinrig_kernel::signal::folded;
use twinrig_report::text::grid::{Cell, Grid, Left};
use twinrig_report::text::style::DIM;
use twinrig_rig::assembly::Assembly;
use twinrig_rig::report::seconds;

/// A sensor of one signal; effects that it does not have are 0 or absent.
#[derive(Serialize)]
pub(super) struct Sensor {
    name: String,
    signal: String,
    /// Unit of the errors.
    unit: &'static str,
    period_s: Option<f64>,
    bias: f64,
    random_walk: f64,
    noise: f64,
    range: Option<(f64, f64)>,
    resolution: f64,
    drop_out: f64,
    delay_max_s: f64,
    /// Effects in the order in which a sample passes them.
    #[serde(skip)]
    effects: Vec<String>,
}

impl Sensor {
    /// Returns the sensors of a scene.
    pub(super) fn all(assembly: &Assembly<'_>) -> Vec<Self> {
        let sensed = assembly.scene().sensed.iter();
        let sensors = assembly.sensors().zip(sensed);
        sensors
            .map(|((name, signal, model), sensed)| Self::new(name, signal, model, sensed.unit))
            .collect()
    }

    fn new(name: &str, signal: &str, model: &SensorModel, unit: Unit) -> Self {
        Self {
            name: name.to_owned(),
            signal: signal.to_owned(),
            unit: unit.symbol(),
            period_s: model.period.map(|period| seconds(period.as_nanos())),
            bias: model.bias,
            random_walk: model.random_walk,
            noise: model.noise,
            range: model.range,
            resolution: model.resolution,
            drop_out: model.drop_out,
            delay_max_s: seconds(model.delay.longest().as_nanos()),
            effects: effects(model, unit),
        }
    }
}

fn effects(model: &SensorModel, unit: Unit) -> Vec<String> {
    let quantity = |value: f64| print(value, unit);
    let duration = |nanos: u64| ms(seconds(nanos));
    let mut effects = Vec::new();
    if let Some(period) = model.period {
        effects.push(format!("every {}", duration(period.as_nanos())));
    }
    let mut errors = Vec::new();
    if model.bias != 0.0 {
        errors.push(format!("bias {}", quantity(model.bias)));
    }
    if model.random_walk > 0.0 {
        errors.push(format!(
            "random walk {} in 1 s",
            quantity(model.random_walk)
        ));
    }
    if model.noise > 0.0 {
        errors.push(format!("noise {}", quantity(model.noise)));
    }
    if !errors.is_empty() {
        effects.push(errors.join(" + "));
    }
    if let Some((least, greatest)) = model.range {
        effects.push(format!("{} … {}", quantity(least), quantity(greatest)));
    }
    if model.resolution > 0.0 {
        effects.push(format!("resolution {}", quantity(model.resolution)));
    }
    if model.drop_out > 0.0 {
        effects.push(format!("drop-out {}", model.drop_out));
    }
    let longest = model.delay.longest();
    if !longest.is_zero() {
        let at_most = match model.delay {
            Timing::Constant(_) => "",
            _ => "up to ",
        };
        effects.push(format!("delay {at_most}{}", duration(longest.as_nanos())));
    }
    effects
}

/// Formats a value to the digits that files have, angles in degrees.
fn print(value: f64, unit: Unit) -> String {
    let rounded = |value: f64| (1e6 * value).round() / 1e6;
    match unit {
        Unit::Radian => format!("{} deg", rounded(value.to_degrees())),
        _ => print_quantity(value, unit),
    }
}

/// Returns a row for each signal of the controller that has a sensor; those that differ in the leg
/// only are merged.
pub(super) fn sensed(sensors: &[Sensor], legs: &[String]) -> Grid {
    let mut grid = Grid::new(&[Left, Left, Left]);
    let mut rows = Vec::new();
    for sensor in sensors {
        let effects = match &sensor.effects[..] {
            [] => "no effect".to_owned(),
            effects => effects.join(" → "),
        };
        let unit = format!("[{}]", sensor.unit);
        let row = (folded(&sensor.signal, legs), unit, effects);
        if !rows.contains(&row) {
            rows.push(row);
        }
    }
    for (signal, unit, effects) in rows {
        grid.row([signal.into(), Cell::new(unit, DIM), effects.into()]);
    }
    grid
}
