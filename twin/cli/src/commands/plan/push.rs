//! Pushes of a scenario in its plan.

use serde::Serialize;
use twinrig_document::print_quantity;
use twinrig_kernel::{Unit, signal};
use twinrig_scenario::{PulseShape, PushLoad, PushSite, PushSpec};

use twinrig_report::text::grid::{Cell, Grid, Left};
use twinrig_report::text::style::DIM;
use twinrig_rig::report::seconds;

#[derive(Serialize)]
pub(super) struct PlannedPush {
    name: String,
    on: String,
    at_s: f64,
    for_s: f64,
    shape: &'static str,
    /// Greatest force or torque, world axes.
    peak: [f64; 3],
    unit: &'static str,
    /// Place of a force on the trunk, trunk axes.
    point_m: Option<[f64; 3]>,
}

impl PlannedPush {
    pub(super) fn all(pushes: &[PushSpec]) -> Vec<Self> {
        pushes.iter().map(Self::of).collect()
    }

    fn of(push: &PushSpec) -> Self {
        let (unit, point) = match push.load {
            PushLoad::Force(point) => (Unit::Newton, Some(point)),
            PushLoad::Torque => (Unit::NewtonMeter, None),
        };
        Self {
            name: push.name.clone(),
            on: match &push.on {
                PushSite::Trunk => "body".to_owned(),
                PushSite::Foot(leg) => signal::of_leg(&leg.value, "foot"),
            },
            at_s: seconds(push.at.as_nanos()),
            for_s: seconds(push.lasts.as_nanos()),
            shape: match push.shape {
                PulseShape::Rectangle => "rectangle",
                PulseShape::HalfSine => "half-sine",
                PulseShape::Triangle => "triangle",
            },
            peak: push.peak,
            unit: unit.symbol(),
            point_m: point.filter(|_| push.on == PushSite::Trunk),
        }
    }

    /// Returns the lines of pushes.
    pub(super) fn grid(pushes: &[Self]) -> Grid {
        let mut grid = Grid::new(&[Left, Left, Left, Left, Left]);
        for push in pushes {
            let time = |at_s: f64| print_quantity(at_s, Unit::Second);
            let [x, y, z] = push.peak.map(|value| format!("{value:.3}"));
            grid.row([
                push.name.as_str().into(),
                push.on.as_str().into(),
                format!("({x}, {y}, {z}) {}", push.unit).into(),
                Cell::new(push.shape, DIM),
                format!("{} … {}", time(push.at_s), time(push.at_s + push.for_s)).into(),
            ]);
        }
        grid
    }
}
