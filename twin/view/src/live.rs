//! The robot of a run that goes on: poses and forces at an instant, of which a script draws it.

use std::ops::Range;

use serde::Serialize;
use twinrig_kernel::{Layout, SimDuration, SimTime, signal};
use twinrig_record::{EPOCH, FrameSampler, LegLinks, Skeleton};
use twinrig_report::page::{Script, document};
use twinrig_rig::Assembly;

use crate::figure::{JOINTS, NUMBERS, forward_angle, leftward_angle, offsets, position};
use crate::page::{STYLE, UPLOT};

/// Pose of the robot and forces on it at an instant.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiveFrame {
    /// Time \[s\].
    pub t: f64,
    /// Position x, y, z of the trunk \[m\] and its orientation as a quaternion x, y, z, w.
    pub trunk: [f64; NUMBERS],
    /// Angles of the segments of each leg relative to their parents, forward \[rad\].
    pub angles: Vec<[f64; JOINTS - 1]>,
    /// Angle of abduction of each leg, to the left \[rad\]; none if no leg has such a joint.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub abduction: Option<Vec<f64>>,
    /// Force of the ground on each foot \[N\]; its normal component if no other is known.
    pub force: Vec<[f64; 3]>,
    /// Force of pushes on the trunk \[N\].
    pub push: Option<[f64; 3]>,
    /// Force of the ground on the trunk \[N\].
    pub contact: Option<[f64; 3]>,
}

/// What does not change in the figure of a robot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiveFigure {
    /// Weight of the robot \[N\].
    pub weight: f64,
    /// Legs.
    pub legs: Vec<LiveLeg>,
}

/// A leg of a figure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiveLeg {
    /// Its name.
    pub name: String,
    /// Hip in the trunk, knee in the thigh, ankle in the shank, foot in the last segment \[m\].
    pub offsets: [[f64; 3]; JOINTS],
    /// Joint of abduction, if the leg has one.
    pub abduction: Option<LiveAbduction>,
}

/// Joint of abduction of a leg of a figure.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiveAbduction {
    /// Point of its axis in the trunk \[m\].
    pub axis: [f64; 3],
}

/// Scripts of the page, in the order in which they follow each other.
const MODULE: &[&str] = &[
    include_str!("../script/data.js"),
    include_str!("../script/live/protocol.js"),
    include_str!("../script/live/state.js"),
    include_str!("../script/figure.js"),
    include_str!("../script/plots.js"),
    include_str!("../script/live/sliders.js"),
    include_str!("../script/live/controls.js"),
    include_str!("../script/live/gamepad.js"),
    include_str!("../script/live/signals.js"),
    include_str!("../script/live/main.js"),
];

/// What the scripts of the page know from the start.
#[derive(Serialize)]
struct Data<'a> {
    socket: u16,
    title: &'a str,
    scenario: &'a str,
    plant: &'a str,
    end_s: f64,
    /// A text: not each of its digits is one of a number in a script.
    epoch_ns: String,
    hardware: bool,
    figure: Option<Figure>,
}

#[derive(Serialize)]
struct Figure {
    weight: f64,
    ground: Option<()>,
    legs: Vec<LiveLeg>,
}

/// Returns the page of a run that goes on, on `hardware` or in virtual time, whose visitors connect
/// to the WebSocket at the port `socket` of the same host.
pub fn page(
    assembly: &Assembly<'_>,
    socket: u16,
    hardware: bool,
    figure: Option<LiveFigure>,
) -> String {
    let scenario = assembly.scenario();
    let data = Data {
        socket,
        title: &scenario.name,
        scenario: &scenario.file,
        plant: &scenario.plant.model,
        end_s: assembly.end().as_secs_f64(),
        epoch_ns: EPOCH.as_nanos().to_string(),
        hardware,
        figure: figure.map(|LiveFigure { weight, legs }| Figure {
            weight,
            ground: None,
            legs,
        }),
    };
    // Numbers and texts can always be serialised.
    let data = serde_json::to_string(&data).unwrap_or_default();
    let style = [STYLE, include_str!("../script/live/live.css")].concat();
    let scripts = [
        Script::Data {
            id: "live-data",
            text: data,
        },
        Script::Library(UPLOT),
        Script::Module(MODULE.concat()),
    ];
    let body = include_str!("../script/live/live.html");
    document(&scenario.name, &style, body, &scripts)
}

/// Poses of a robot from the samples of its plant.
pub struct LivePoses {
    sampler: FrameSampler,
    weight: f64,
    /// Legs, by name, with the places of their forces, or of their normal components.
    legs: Vec<(String, Option<Range<usize>>)>,
    push: Option<Range<usize>>,
    /// Force of the ground on the trunk.
    contact: Option<Range<usize>>,
}

impl LivePoses {
    /// Returns the poses of a robot whose plant has samples of this layout; none without a robot.
    pub fn new(assembly: &Assembly<'_>, layout: &Layout) -> Option<Self> {
        let skeleton: Skeleton = assembly.skeleton();
        if skeleton.legs.is_empty() {
            return None;
        }
        layout.find(signal::BODY_POSITION)?;
        let place = |leg: &str| {
            let find = |name| layout.find(&signal::of_leg(leg, name));
            find(signal::FOOT_FORCE).or_else(|| find(signal::FOOT_LOAD))
        };
        let legs = skeleton.legs.iter();
        let legs = legs.map(|leg| (leg.name.clone(), place(&leg.name)));
        Some(Self {
            legs: legs.collect(),
            push: layout.find(signal::BODY_PUSH_FORCE),
            contact: layout.find(signal::BODY_CONTACT_FORCE),
            sampler: FrameSampler::new(&skeleton, layout, SimDuration::from_nanos(1)),
            weight: assembly.scene().weight,
        })
    }

    /// Returns the pose at a sample of the plant; none if it has no legs.
    pub fn at(&self, now: SimTime, values: &[f64]) -> Option<LiveFrame> {
        let (numbers, legs) = self.numbers(now, values)?;
        let part = |link: usize, n: usize| numbers[NUMBERS * link + n];
        let angles = legs.iter().map(|leg| {
            let links = [0, 1, 2].map(|joint| leg.upper + joint);
            links.map(|link| forward_angle(part(link, 4), part(link, 6)))
        });
        let abduction = |leg: &LegLinks| {
            let link = leg.abductor;
            link.map_or(0.0, |link| leftward_angle(part(link, 3), part(link, 6)))
        };
        let abducts = legs.iter().any(|leg| leg.abductor.is_some());
        let vector = |place: &Range<usize>| match values[place.clone()] {
            [x, y, z] => [x, y, z],
            [normal] => [0.0, 0.0, normal],
            _ => [0.0; 3],
        };
        let force =
            |(_, place): &(_, Option<Range<usize>>)| place.as_ref().map_or([0.0; 3], vector);
        let shown = |place: &Option<Range<usize>>| {
            let force = place.as_ref().map(vector);
            force.filter(|force| *force != [0.0; 3])
        };
        Some(LiveFrame {
            t: now.as_secs_f64(),
            trunk: numbers[..NUMBERS].try_into().ok()?,
            angles: angles.collect(),
            abduction: abducts.then(|| legs.iter().map(abduction).collect()),
            force: self.legs.iter().map(force).collect(),
            push: shown(&self.push),
            contact: shown(&self.contact),
        })
    }

    /// Returns what does not change in the figure, from any sample of the plant.
    pub fn figure(&self, values: &[f64]) -> Option<LiveFigure> {
        let (numbers, legs) = self.numbers(SimTime::ZERO, values)?;
        let legs = legs.into_iter().map(|leg| LiveLeg {
            offsets: offsets(&numbers, &leg),
            abduction: leg.abductor.map(|link| LiveAbduction {
                axis: position(&numbers, link),
            }),
            name: leg.name,
        });
        Some(LiveFigure {
            weight: self.weight,
            legs: legs.collect(),
        })
    }

    /// Returns the transforms of an instant, and the links of the legs; none if a leg has none.
    fn numbers(&self, now: SimTime, values: &[f64]) -> Option<(Vec<f64>, Vec<LegLinks>)> {
        let mut sampler = self.sampler.clone();
        sampler.sample(now, values);
        let series = sampler.finish();
        let legs = series.legs();
        (legs.len() == self.legs.len()).then_some((series.numbers, legs))
    }
}
