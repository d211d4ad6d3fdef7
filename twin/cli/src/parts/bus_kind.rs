//! What kinds of buses are made of.

use twinrig_kernel::{Port, SimDuration, SimTime};
use twinrig_robot::Robot;
use twinrig_runtime::{Driver, PartKind, Wire, in_part};
use twinrig_scenario::{FaultSpec, Kind, OptionSpec, Options};
use twinrig_wire::{Fault, FaultSchedule, Faulty, Line, WireError};

use crate::error::BuildError;

type BuildDriver =
    Box<dyn Fn(&BusContext<'_>) -> Result<Box<dyn Driver>, BuildError> + Send + Sync>;
type BuildWire = Box<dyn Fn(&BusContext<'_>) -> Result<Box<dyn Wire>, BuildError> + Send + Sync>;
type Measured = Box<dyn Fn(&Options) -> Vec<String> + Send + Sync>;

/// Bits a second of a serial port whose bus does not say otherwise.
const BAUD: u32 = 115_200;

/// What a driver and its wire are built from.
#[derive(Clone, Copy)]
pub struct BusContext<'a> {
    /// What the scenario calls the bus.
    pub name: &'a str,
    /// The robot, with what the scenario overrides.
    pub robot: &'a Robot,
    /// The legs of the scene, in the robot's order.
    pub legs: &'a [&'a str],
    /// Inputs and outputs of the controller.
    pub process_ports: &'a [Port],
    /// Time between two iterations of the controller.
    pub period: SimDuration,
    /// The options that the kind declares, as the scenario's `[bus]` table has them.
    pub options: &'a Options,
    /// What goes wrong on the bus, with the place on it: empty for the whole bus, or one of [`BusKind::with_place`].
    pub faults: &'a [(&'a str, &'a FaultSpec)],
    /// Seed of the run.
    pub seed: u64,
}

impl BusContext<'_> {
    /// What goes wrong on the bus, for [`twinrig_wire::Faulty`] and its like, which want the place `wire/NAME` or
    /// `wire/NAME/PLACE`.
    pub fn fault_schedule(&self) -> FaultSchedule {
        let fault = |(place, fault): &(&str, &FaultSpec)| Fault {
            at: fault.at,
            on: match *place {
                "" => format!("wire/{}", self.name),
                place => format!("wire/{}/{place}", self.name),
            },
            kind: fault.kind,
            lasts: fault.lasts.unwrap_or(SimTime::MAX - fault.at),
        };
        FaultSchedule {
            faults: self.faults.iter().map(fault).collect(),
            seed: self.seed,
        }
    }

    /// `line`, whose bytes take `byte_time` each, with what goes wrong on the whole bus.
    ///
    /// # Errors
    /// [`WireError`] if a fault cannot be.
    pub fn faulty<L: Line>(&self, byte_time: SimDuration, line: L) -> Result<Faulty<L>, WireError> {
        let place = format!("wire/{}", self.name);
        Faulty::new(&place, byte_time, &self.fault_schedule(), line)
    }
}

/// A kind of bus: the driver that runs on the robot, and the wire with the boards at its far end that stands in for
/// hardware.
pub struct BusKind {
    name: String,
    about: String,
    options: Vec<OptionSpec>,
    /// Whether its wire heeds faults.
    faults: bool,
    places: Vec<String>,
    measured: Measured,
    baud: u32,
    driver: BuildDriver,
    wire: BuildWire,
}

impl BusKind {
    /// A kind that scenarios call `name`; `about` is a line for `twin list`; `driver` makes what runs on the robot, `wire`
    /// what stands in for everything beyond.
    pub fn new<D: Driver + 'static, W: Wire + 'static>(
        name: impl Into<String>,
        about: impl Into<String>,
        driver: impl Fn(&BusContext<'_>) -> Result<D, BuildError> + Send + Sync + 'static,
        wire: impl Fn(&BusContext<'_>) -> Result<W, BuildError> + Send + Sync + 'static,
    ) -> Self {
        Self {
            name: name.into(),
            about: about.into(),
            options: Vec::new(),
            faults: false,
            places: Vec::new(),
            measured: Box::new(|_| Vec::new()),
            baud: BAUD,
            driver: Box::new(move |context| Ok(Box::new(driver(context)?))),
            wire: Box::new(move |context| Ok(Box::new(wire(context)?))),
        }
    }

    /// Accepts another key in its table, which [`BusContext::options`] brings.
    #[must_use]
    pub fn with_option(mut self, option: OptionSpec) -> Self {
        self.options.push(option);
        self
    }

    /// Can have faults on the whole of it, `wire/NAME`: its wire heeds [`BusContext::fault_schedule`].
    #[must_use]
    pub fn with_faults(mut self) -> Self {
        self.faults = true;
        self
    }

    /// Can have faults at `place`, `wire/NAME/PLACE`; `*` stands for every leg of the scene.
    #[must_use]
    pub fn with_place(mut self, place: impl Into<String>) -> Self {
        self.places.push(place.into());
        self
    }

    /// Its boards measure the plant's signals that match one of the patterns which `measured` makes of the options, whether
    /// anybody reads what they report or not.
    #[must_use]
    pub fn measuring(
        mut self,
        measured: impl Fn(&Options) -> Vec<String> + Send + Sync + 'static,
    ) -> Self {
        self.measured = Box::new(measured);
        self
    }

    /// Talks to serial ports at `baud` bits a second.
    #[must_use]
    pub fn at_baud(mut self, baud: u32) -> Self {
        self.baud = baud;
        self
    }

    /// What scenarios call it.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// What scenarios may say of it.
    pub(crate) fn offer(&self) -> Kind {
        Kind {
            options: self.options.clone(),
            ..Kind::new(&self.name, &self.about)
        }
    }

    /// Bits a second of its serial port.
    pub(crate) fn baud(&self) -> u32 {
        self.baud
    }

    /// Patterns of the plant's signals that its boards measure.
    pub(crate) fn measured(&self, options: &Options) -> Vec<String> {
        (self.measured)(options)
    }

    /// Whether there can be faults on the whole of it.
    pub(crate) fn has_faults(&self) -> bool {
        self.faults
    }

    /// The places of faults, of a scene with these legs.
    pub(crate) fn places(&self, legs: &[&str]) -> Vec<String> {
        let places = self.places.iter().flat_map(|place| match place.as_str() {
            "*" => legs.iter().map(|&leg| leg.to_owned()).collect(),
            place => vec![place.to_owned()],
        });
        places.collect()
    }

    pub(crate) fn driver(&self, context: &BusContext<'_>) -> Result<Box<dyn Driver>, BuildError> {
        in_part(PartKind::Driver, context.name, || (self.driver)(context))
    }

    pub(crate) fn wire(&self, context: &BusContext<'_>) -> Result<Box<dyn Wire>, BuildError> {
        in_part(PartKind::Wire, context.name, || (self.wire)(context))
    }
}
