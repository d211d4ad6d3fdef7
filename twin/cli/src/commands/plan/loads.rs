//! Payloads of the trunk and surfaces of the ground in a plan.

use serde::Serialize;
use twinrig_scenario::{PayloadSpec, PlantSpec, SurfaceSpec};

use super::format::section;
use twinrig_report::text::grid::{Cell, Grid, Left};
use twinrig_report::text::style::DIM;
use twinrig_rig::report::seconds;

/// Payloads and surfaces of a scenario; not in the JSON object of a scenario without them.
#[derive(Serialize)]
pub(super) struct Loads {
    #[serde(skip_serializing_if = "Vec::is_empty")]
    payloads: Vec<Payload>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    surfaces: Vec<Surface>,
}

#[derive(Serialize)]
struct Payload {
    name: String,
    mass_kg: f64,
    at_m: [f64; 3],
}

/// Surface; a limit that is absent is infinite.
#[derive(Serialize)]
struct Surface {
    friction: f64,
    from_m: Option<f64>,
    to_m: Option<f64>,
    begin_s: f64,
    end_s: Option<f64>,
}

impl Loads {
    pub(super) fn of(plant: &PlantSpec) -> Self {
        let surfaces = plant.ground.iter().flat_map(|ground| &ground.surfaces);
        Self {
            payloads: plant.payloads.iter().map(Payload::of).collect(),
            surfaces: surfaces.map(Surface::of).collect(),
        }
    }

    /// Writes a section for payloads and one for surfaces, if there are any.
    pub(super) fn sections(&self, lines: &mut Vec<String>) {
        let mut payloads = Grid::new(&[Left, Left]);
        for Payload {
            name,
            mass_kg,
            at_m: [x, y, z],
        } in &self.payloads
        {
            let text = format!("{mass_kg} kg at ({x}, {y}, {z}) m from the centre of the trunk");
            payloads.row([name.as_str().into(), Cell::new(text, DIM)]);
        }
        section(lines, "payloads", &payloads);
        let mut surfaces = Grid::new(&[Left, Left]);
        for surface in &self.surfaces {
            let name = format!("friction {}", surface.friction);
            surfaces.row([name.into(), Cell::new(surface.describe(), DIM)]);
        }
        section(lines, "surfaces", &surfaces);
    }
}

impl Payload {
    fn of(spec: &PayloadSpec) -> Self {
        Self {
            name: spec.name.clone(),
            mass_kg: spec.mass,
            at_m: spec.at,
        }
    }
}

impl Surface {
    fn of(spec: &SurfaceSpec) -> Self {
        let finite = |limit: f64| Some(limit).filter(|limit| limit.is_finite());
        Self {
            friction: spec.friction,
            from_m: finite(spec.extent.start),
            to_m: finite(spec.extent.end),
            begin_s: seconds(spec.begin.as_nanos()),
            end_s: spec.end.map(|end| seconds(end.as_nanos())),
        }
    }

    /// Describes place and time: `x from 1 m to 1.4 m, from 3 s to 5 s`.
    fn describe(&self) -> String {
        let place = match (self.from_m, self.to_m) {
            (None, None) => "everywhere".to_owned(),
            (Some(from), None) => format!("x from {from} m"),
            (None, Some(to)) => format!("x to {to} m"),
            (Some(from), Some(to)) => format!("x from {from} m to {to} m"),
        };
        let time = match (self.begin_s, self.end_s) {
            (0.0, None) => String::new(),
            (begin, None) => format!(", from {begin} s"),
            (begin, Some(end)) => format!(", from {begin} s to {end} s"),
        };
        place + &time
    }
}
