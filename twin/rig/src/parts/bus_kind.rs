//! Kinds of buses and the context for building them.

use std::fmt::Debug;
use std::path::Path;

use twinrig_devices::FramedDevice;
use twinrig_document::{DocumentError, Placed};
use twinrig_estimate::Calibration;
use twinrig_kernel::{Port, SimDuration, SimTime};
use twinrig_robot::Robot;
use twinrig_runtime::{Driver, PartKind, Wire, in_part};
use twinrig_scenario::{Accepts, ActuatorSpec, FaultSpec, Kind, OptionSpec, Options};
use twinrig_sensor::SensorFile;
use twinrig_wire::{
    Emulation, Fault, FaultSchedule, FrameReader, Node, Protocol, device_wire, usb_device_wire,
};

use crate::error::BuildError;
use crate::parts::decoder::{Decoder, Direction, framed};
use crate::parts::option::option;
use crate::parts::usb;

type BuildDriver =
    Box<dyn Fn(&BusContext<'_>) -> Result<Box<dyn Driver>, BuildError> + Send + Sync>;
type BuildWire = Box<dyn Fn(&BusContext<'_>) -> Result<Box<dyn Wire>, BuildError> + Send + Sync>;
type Mount = Box<dyn Fn(&Options) -> Option<SensorMount> + Send + Sync>;
type Calibrations = Box<dyn Fn(&Options) -> Vec<Placed<String>> + Send + Sync>;
type Measured = Box<dyn Fn(&Options) -> Vec<String> + Send + Sync>;
type Baud = Box<dyn Fn(&Options) -> u32 + Send + Sync>;
type Frames = Box<dyn Fn(&Options) -> FrameReader + Send + Sync>;
type Decoders = Box<dyn Fn(&Options, Direction) -> Decoder + Send + Sync>;

/// Key of the table with the timing of a USB converter.
const USB: &str = "usb";
/// Default baud rate of a serial port \[bit/s\].
const BAUD: u32 = 115_200;

/// Context for building a driver and its wire.
#[derive(Clone, Copy)]
pub struct BusContext<'a> {
    /// Name of the bus in the scenario.
    pub name: &'a str,
    /// Robot, including overrides of the scenario; `None` for a standalone plant without one.
    pub robot: Option<&'a Robot>,
    /// Legs of the scene, in the robot's order.
    pub legs: &'a [&'a str],
    /// Motors on free shafts, in the order of the plant.
    pub motors: &'a [&'a str],
    /// Inputs and outputs of the controller.
    pub process_ports: &'a [Port],
    /// Period of the controller.
    pub period: SimDuration,
    /// Drives of the robot.
    pub actuator: &'a ActuatorSpec,
    /// Values of the declared options, from the `[bus]` table of the scenario.
    pub options: &'a Options,
    /// Faults with their places on the bus: empty for the whole bus, or one of
    /// [`BusKind::with_place`].
    pub faults: &'a [(&'a str, &'a FaultSpec)],
    /// Seed of the run.
    pub seed: u64,
    /// Calibrations that the options name.
    pub(crate) calibrations: &'a [(String, Calibration)],
}

impl BusContext<'_> {
    /// Returns the fault schedule of the bus for [`twinrig_wire::Faulty`] and similar wrappers,
    /// whose places are `wire/NAME` or `wire/NAME/PLACE`.
    pub fn fault_schedule(&self) -> FaultSchedule {
        let fault = |(place, fault): &(&str, &FaultSpec)| Fault {
            at: fault.at,
            on: match *place {
                "" => format!("wire/{}", self.name),
                place => format!("wire/{}/{place}", self.name),
            },
            kind: fault.kind,
            select: fault.select.clone(),
            lasts: fault.lasts.unwrap_or(SimTime::MAX - fault.at),
        };
        FaultSchedule {
            faults: self.faults.iter().map(fault).collect(),
            seed: self.seed,
        }
    }

    /// Returns the wire of a device at a serial port of its own, where a byte takes `byte_time`,
    /// with the faults of the scenario ([`BusKind::with_faults`]): behind a USB converter if the
    /// scenario has the key `usb` ([`BusKind::with_usb`]), else at a UART of the host.
    ///
    /// # Errors
    /// [`BuildError`] if a fault or the timing of USB is invalid.
    pub fn device_wire<N: Node + 'static>(
        &self,
        byte_time: SimDuration,
        device: N,
    ) -> Result<Box<dyn Wire>, BuildError> {
        let faults = self.fault_schedule();
        Ok(match self.options.group(USB) {
            Some(options) => {
                let timing = usb::timing(Some(options))?;
                Box::new(usb_device_wire(timing, byte_time, &faults, device)?)
            }
            None => Box::new(device_wire(byte_time, &faults, device)?),
        })
    }
}

/// Tactile sensor that a bus mounts at a load of the plant.
pub(crate) struct SensorMount {
    /// Signal of the load.
    pub(crate) signal: String,
    /// Name or path of the file with the sensor.
    pub(crate) sensor: Placed<String>,
    /// Number of the cell, drawn within the spread of the file.
    pub(crate) cell: Option<u64>,
}

impl SensorMount {
    /// Finds the file of the sensor for a scenario in `folder`.
    pub(crate) fn find(&self, folder: &Path) -> Result<SensorFile, DocumentError> {
        let name = &self.sensor.value;
        SensorFile::find(name, folder)?.ok_or_else(|| {
            let help = SensorFile::suggestion(name, folder);
            self.sensor
                .error(format!("there is no sensor `{name}`"), help)
        })
    }

    /// Returns the number of the cell, with the place of the sensor for messages.
    pub(crate) fn cell(&self) -> Option<Placed<u64>> {
        let place = self.sensor.place.clone();
        self.cell.map(|value| Placed { value, place })
    }

    /// Returns the file that a recording keeps as `name`.
    pub(crate) fn of_recording(
        &self,
        name: &str,
        kept: &[(String, Vec<u8>)],
    ) -> Result<SensorFile, DocumentError> {
        let found = kept.iter().find(|(known, _)| known == name);
        let message = format!("the recording does not contain `{name}`");
        let (_, bytes) = found.ok_or_else(|| self.sensor.error(message, ""))?;
        SensorFile::parse(name, &String::from_utf8_lossy(bytes))
    }
}

/// Kind of bus: the driver that runs on the robot, and the emulated wire with the boards at its far
/// end.
pub struct BusKind {
    name: String,
    about: String,
    options: Vec<OptionSpec>,
    /// Whether the wire supports faults on the whole bus.
    faults: bool,
    board_faults: bool,
    places: Vec<String>,
    measured: Measured,
    mount: Mount,
    calibrations: Calibrations,
    baud: Baud,
    driver: BuildDriver,
    wire: BuildWire,
    decoder: Option<Decoders>,
    frames: Option<Frames>,
}

impl BusKind {
    /// Creates the kind `name` with the description `about` for `twin list`; `driver` builds the
    /// driver that runs on the robot, `wire` the emulation of the wire and the boards.
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
            board_faults: false,
            places: Vec::new(),
            measured: Box::new(|_| Vec::new()),
            mount: Box::new(|_| None),
            calibrations: Box::new(|_| Vec::new()),
            baud: Box::new(|_| BAUD),
            driver: Box::new(move |context| Ok(Box::new(driver(context)?))),
            wire: Box::new(move |context| Ok(Box::new(wire(context)?))),
            decoder: None,
            frames: None,
        }
    }

    /// Creates the kind of a device with faults, whose configuration is read from the scenario.
    pub(crate) fn of_device<D: FramedDevice>(
        name: &str,
        about: &str,
        config: fn(&BusContext<'_>) -> Result<D, BuildError>,
    ) -> Self
    where
        <D::Protocol as Protocol>::Message: Debug + 'static,
        <D::Emulation as Emulation>::Message: Debug + 'static,
    {
        let driver = move |context: &BusContext<'_>| Ok(config(context)?.driver()?);
        let wire = move |context: &BusContext<'_>| {
            let faults = context.fault_schedule();
            Ok(config(context)?.wire(&faults)?)
        };
        let kind = Self::new(name, about, driver, wire).with_faults();
        kind.with_decoder(|_, direction| match direction {
            Direction::ToBoards => framed::<<D::Emulation as Emulation>::Message>(),
            Direction::ToDriver => framed::<<D::Protocol as Protocol>::Message>(),
        })
    }

    /// Adds the decoder of the frames on a bus with these options, for readers of its bytes.
    #[must_use]
    pub fn with_decoder(
        mut self,
        decoder: impl Fn(&Options, Direction) -> Decoder + Send + Sync + 'static,
    ) -> Self {
        self.decoder = Some(Box::new(decoder));
        self
    }

    /// Adds the frames on a bus with these options, for faults behind a kind of message: the wire
    /// passes them to [`twinrig_wire::Faulty::framed`].
    #[must_use]
    pub fn with_frames(
        mut self,
        frames: impl Fn(&Options) -> FrameReader + Send + Sync + 'static,
    ) -> Self {
        self.frames = Some(Box::new(frames));
        self
    }

    /// Returns the names of the kinds of messages on a bus with these options.
    pub(crate) fn messages(&self, options: &Options) -> Vec<&'static str> {
        let frames = self.frames.as_ref().map(|frames| frames(options));
        let kinds = frames.map_or(&[][..], |frames| frames.kinds);
        kinds.iter().map(|(name, _)| *name).collect()
    }

    /// Returns a decoder of the bytes in a direction; none if the kind has none.
    pub(crate) fn decoder(&self, options: &Options, direction: Direction) -> Option<Decoder> {
        let decoder = self.decoder.as_ref()?;
        Some(decoder(options, direction))
    }

    /// Adds an option, a key of the bus table; its value is in [`BusContext::options`].
    #[must_use]
    pub fn with_option(mut self, option: OptionSpec) -> Self {
        self.options.push(option);
        self
    }

    /// Enables faults on the whole bus, `wire/NAME`: the wire applies
    /// [`BusContext::fault_schedule`].
    #[must_use]
    pub fn with_faults(mut self) -> Self {
        self.faults = true;
        self
    }

    /// Adds the key `usb`, the timing of a USB converter: latency timer, jitter, clock.
    /// [`BusContext::device_wire`] applies it.
    #[must_use]
    pub fn with_usb(self) -> Self {
        let about = "timing of the USB converter; without this table the host has a UART";
        self.with_option(option(USB, about, Accepts::Group(usb::options())))
    }

    /// Enables faults at `place`, `wire/NAME/PLACE`; a `*` in it stands for every leg and every
    /// motor on a free shaft of the scene.
    #[must_use]
    pub fn with_place(mut self, place: impl Into<String>) -> Self {
        self.places.push(place.into());
        self
    }

    /// Enables faults of boards ([`twinrig_runtime::FaultKind::acts_on_boards`]) on the whole bus,
    /// and at the places that have a `*`: the wire applies [`FaultSchedule::clock`] and
    /// [`FaultSchedule::harms_board`].
    #[must_use]
    pub fn with_board_faults(mut self) -> Self {
        self.board_faults = true;
        self
    }

    /// Declares the plant signals that the boards measure, as patterns derived from the options by
    /// `measured`. These signals are computed even if no part reads the measurements.
    #[must_use]
    pub fn measuring(
        mut self,
        measured: impl Fn(&Options) -> Vec<String> + Send + Sync + 'static,
    ) -> Self {
        self.measured = Box::new(measured);
        self
    }

    /// Declares the sensor that the bus mounts at a load of the plant, derived from the options.
    #[must_use]
    pub(crate) fn mounting(
        mut self,
        mount: impl Fn(&Options) -> Option<SensorMount> + Send + Sync + 'static,
    ) -> Self {
        self.mount = Box::new(mount);
        self
    }

    /// Returns the sensor that the bus mounts at a load of the plant.
    pub(crate) fn mount(&self, options: &Options) -> Option<SensorMount> {
        (self.mount)(options)
    }

    /// Declares the calibrations that filters of the bus name, derived from the options.
    #[must_use]
    pub(crate) fn calibrated(
        mut self,
        calibrations: impl Fn(&Options) -> Vec<Placed<String>> + Send + Sync + 'static,
    ) -> Self {
        self.calibrations = Box::new(calibrations);
        self
    }

    /// Returns the calibrations that filters of the bus name.
    pub(crate) fn calibrations(&self, options: &Options) -> Vec<Placed<String>> {
        (self.calibrations)(options)
    }

    /// Sets the baud rate of the serial port \[bit/s\].
    #[must_use]
    pub fn at_baud(mut self, baud: u32) -> Self {
        self.baud = Box::new(move |_| baud);
        self
    }

    /// Derives the baud rate of the serial port \[bit/s\] from the options.
    #[must_use]
    pub(crate) fn with_baud(
        mut self,
        baud: impl Fn(&Options) -> u32 + Send + Sync + 'static,
    ) -> Self {
        self.baud = Box::new(baud);
        self
    }

    /// Returns the name in scenarios.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Returns the scenario keys of the kind.
    pub(crate) fn offer(&self) -> Kind {
        Kind {
            options: self.options.clone(),
            ..Kind::new(&self.name, &self.about)
        }
    }

    /// Returns the baud rate of the serial port \[bit/s\].
    pub(crate) fn baud(&self, options: &Options) -> u32 {
        (self.baud)(options)
    }

    /// Returns the patterns of the plant signals that the boards measure.
    pub(crate) fn measured(&self, options: &Options) -> Vec<String> {
        (self.measured)(options)
    }

    /// Returns whether faults on the whole bus are supported.
    pub(crate) fn has_faults(&self) -> bool {
        self.faults
    }

    /// Returns whether there is a board with faults of its own at a place, or are boards on the
    /// whole bus, an empty place, in a scene with these legs and motors.
    pub(crate) fn has_boards_at(&self, place: &str, legs: &[&str]) -> bool {
        let mut of_boards = self.places.iter().filter(|pattern| pattern.contains('*'));
        let is_board = |pattern: &String| legs.iter().any(|leg| pattern.replace('*', leg) == place);
        self.board_faults && (place.is_empty() || of_boards.any(is_board))
    }

    /// Returns the places of faults for a scene with these legs and motors.
    pub(crate) fn places(&self, legs: &[&str]) -> Vec<String> {
        let places = self.places.iter().flat_map(|place| {
            if place.contains('*') {
                legs.iter().map(|leg| place.replace('*', leg)).collect()
            } else {
                vec![place.clone()]
            }
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
