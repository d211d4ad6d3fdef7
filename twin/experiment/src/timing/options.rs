//! Options of a study of the timing of a servo bus, and its loops.
#![allow(clippy::doc_markdown, reason = "the text is printed verbatim")]

use std::path::PathBuf;

use clap::Args;
use twinrig_dynamixel::timing::{Adapter, BusLoop, adapters, stated_times};
use twinrig_dynamixel::{ReadPattern, ServoKind};
use twinrig_kernel::SimDuration;
use twinrig_rig::error::Error as RigError;
use twinrig_rig::servo_models;
use twinrig_wire::UsbTiming;

use super::results::{TimingPoint, TimingStudy};
use crate::error::{Error, StudyError};
use crate::options::request::{StudyContext, StudyFrame, StudyReport, StudyRequest, unique};
use crate::options::values::{any_duration, whole_number};
use crate::parallel::run_all;

/// Bits of a byte with start and stop bit.
const BITS: u64 = 10;
/// Longest return delay: 254 units of 2 µs.
const RETURN_DELAY_MOST: SimDuration = SimDuration::from_micros(508);
/// Adapter without another one.
const AT_ONCE: &str = "at-once";
/// Baud rates without other ones \[bit/s\], those that the model has of them.
const BAUD: [u64; 3] = [57_600, 1_000_000, 4_000_000];

/// Predict rate and latency of a servo bus by number of servos, latency timer, baud rate and read
/// pattern
///
/// Runs the driver over the emulated bus, without a robot: goals to all servos, positions of all,
/// and again at once. The program takes no time, so that a real loop is slower. Rate: transfers a
/// second. Age: of the oldest position when a transfer ends, since its servo sampled the encoder.
#[derive(Clone, Debug, Args)]
pub struct TimingOptions {
    /// Model of the servos, as in scenarios: xl330-m288, xm430-w350, ax-12a, sts3215
    #[arg(long, value_name = "MODEL", default_value = "xl330-m288", value_parser = model)]
    pub model: &'static ServoKind,
    /// Adapter and host: a preset of `usb` in scenarios, or `at-once`, a high-speed chip or a
    /// CDC-ACM device whose packets wait for the latency timer only
    #[arg(long, value_name = "NAME", default_value = AT_ONCE, value_parser = adapter)]
    pub adapter: Adapter,
    /// Numbers of servos, separated by commas
    #[arg(
        long,
        value_name = "NUMBERS",
        value_delimiter = ',',
        default_value = "1,6,12,25,50",
        value_parser = clap::value_parser!(u8).range(1..=252)
    )]
    pub servos: Vec<u8>,
    /// Latency timers of the adapter, separated by commas [default: 0 ms,1 ms,16 ms; that of the
    /// adapter if it is another than `at-once`]
    #[arg(long, value_name = "DURATIONS", value_delimiter = ',', value_parser = any_duration)]
    pub timer: Vec<SimDuration>,
    /// Baud rates in bit/s, separated by commas [default: 57600,1000000,4000000, as far as the
    /// model has them]
    #[arg(long, value_name = "RATES", value_delimiter = ',')]
    pub baud: Vec<u64>,
    /// Read patterns, separated by commas: sync, one-by-one, bulk, fast-sync [default: those of the
    /// model]
    #[arg(long, value_name = "PATTERNS", value_delimiter = ',', value_parser = pattern)]
    pub read: Vec<ReadPattern>,
    /// Return delay of the servos, up to 508 us
    #[arg(long, value_name = "DURATION", default_value = "0 us", value_parser = return_delay)]
    pub return_delay: SimDuration,
    /// Transfers of each loop
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = whole_number)]
    pub transfers: usize,
    /// Folder for the HTML page, the CSV and the JSON file
    #[arg(long, value_name = "DIR", default_value = "studies")]
    pub out: PathBuf,
    /// Print JSON instead of a table
    #[arg(long)]
    pub json: bool,
}

impl StudyRequest for TimingOptions {
    fn frame(&self) -> StudyFrame<'_> {
        StudyFrame {
            name: "timing",
            scenarios: &[],
            plants: &[],
            set: &[],
            out: &self.out,
            json: self.json,
        }
    }

    fn check(&self) -> Result<(), Error> {
        unique("--servos", &self.servos)?;
        unique("--timer", &self.timer)?;
        unique("--baud", &self.baud)?;
        let names: Vec<&str> = self.read.iter().map(|it| it.name()).collect();
        unique("--read", &names)
    }

    fn run(&self, context: StudyContext<'_>) -> Result<StudyReport, Error> {
        let loops = self.loops()?;
        let study = |source: StudyError| Error::of_study("the bus", source);
        let run = |index: usize| loops[index].run(self.transfers);
        let observer = context.observer;
        let mut progress = |done: usize, _: f64| {
            observer.at(done.min(loops.len() - 1), loops.len(), "loops over the bus")
        };
        let points = run_all(loops.len(), &run, &mut progress).map_err(study)?;
        let points: Vec<TimingPoint> = loops
            .iter()
            .zip(points)
            .map(|(it, times)| it.point(times))
            .collect();
        if let Some(why) = points.first().and_then(|it| it.why.clone())
            && points.iter().all(|it| it.why.is_some())
        {
            return Err(study(StudyError::Run(why)));
        }
        let stated = stated_times().map_err(|error| study(StudyError::Run(error.to_string())))?;
        let study = TimingStudy {
            model: self.model.model.name,
            adapter: self.adapter.name,
            return_delay: self.return_delay,
            transfers: self.transfers,
            points,
            stated,
        };
        Ok(StudyReport::new(
            study.summary(),
            study.page(context.machine, context.command),
            study.csv(),
            study.json(context.machine, context.command),
        ))
    }
}

/// One loop of the study.
struct Loop {
    bus: BusLoop,
    baud: u64,
}

impl Loop {
    /// Returns durations and ages \[s\].
    fn run(&self, transfers: usize) -> Result<[Vec<f64>; 2], String> {
        let times = self.bus.run(transfers).map_err(|error| error.to_string())?;
        let seconds = |times: Vec<SimDuration>| {
            let mut seconds: Vec<f64> = times.iter().map(|it| it.as_secs_f64()).collect();
            seconds.sort_by(f64::total_cmp);
            seconds
        };
        Ok([times.durations, times.ages].map(seconds))
    }

    fn point(&self, times: Result<[Vec<f64>; 2], String>) -> TimingPoint {
        let point = TimingPoint {
            timer_s: self.bus.usb.latency_timer.as_secs_f64(),
            baud: self.baud,
            read: self.bus.pattern.name().to_owned(),
            servos: self.bus.servos,
            ..TimingPoint::default()
        };
        match times {
            Err(why) => TimingPoint {
                why: Some(why),
                ..point
            },
            Ok([durations, ages]) => point.with(&durations, &ages),
        }
    }
}

impl TimingOptions {
    fn loops(&self) -> Result<Vec<Loop>, Error> {
        let timers = match &*self.timer {
            [] if self.adapter.name == AT_ONCE => [0, 1, 16].map(SimDuration::from_millis).into(),
            [] => vec![self.adapter.usb.latency_timer],
            given => given.to_vec(),
        };
        let (bauds, patterns) = (self.bauds()?, self.patterns()?);
        let mut loops = Vec::new();
        for timer in timers {
            for &baud in &bauds {
                for &pattern in &patterns {
                    loops.extend(self.servos.iter().map(|&servos| Loop {
                        baud,
                        bus: BusLoop {
                            kind: self.model,
                            servos,
                            byte_time: SimDuration::from_nanos(
                                (BITS * 1_000_000_000).div_ceil(baud),
                            ),
                            pattern,
                            usb: UsbTiming {
                                latency_timer: timer,
                                ..self.adapter.usb.clone()
                            },
                            return_delay: self.return_delay,
                            seed: 1,
                        },
                    }));
                }
            }
        }
        Ok(loops)
    }

    /// Returns the baud rates: those given, or the usual ones that the model has.
    fn bauds(&self) -> Result<Vec<u64>, Error> {
        let model = self.model.model;
        let has = |baud: &u64| model.baud_rates.value(*baud).is_some();
        if self.baud.is_empty() {
            return Ok(BAUD.into_iter().filter(has).collect());
        }
        match self.baud.iter().find(|baud| !has(baud)) {
            None => Ok(self.baud.clone()),
            Some(baud) => Err(invalid(
                format!("--baud {baud}: the {} has no such rate", model.name),
                format!("choose from {}", model.baud_rates.names()),
            )),
        }
    }

    /// Returns the read patterns: those given, or all of the model.
    fn patterns(&self) -> Result<Vec<ReadPattern>, Error> {
        let model = self.model.model;
        let all = ReadPattern::ALL.into_iter().filter(|it| it.is_of(model));
        if self.read.is_empty() {
            return Ok(all.collect());
        }
        match self.read.iter().find(|it| !it.is_of(model)) {
            None => Ok(self.read.clone()),
            Some(lacking) => Err(invalid(
                format!(
                    "--read {}: the {} has no such instruction",
                    lacking.name(),
                    model.name
                ),
                choices(all.map(ReadPattern::name)),
            )),
        }
    }
}

fn invalid(why: String, help: String) -> Error {
    Error::from(RigError::InvalidOptions { why, help })
}

fn choices<'n>(names: impl Iterator<Item = &'n str>) -> String {
    format!("choose from {}", names.collect::<Vec<_>>().join(", "))
}

fn model(text: &str) -> Result<&'static ServoKind, String> {
    let found = servo_models().find(|(name, _)| *name == text);
    let (_, kind) = found.ok_or_else(|| choices(servo_models().map(|(name, _)| name)))?;
    Ok(kind)
}

fn adapter(text: &str) -> Result<Adapter, String> {
    let found = adapters().into_iter().find(|it| it.name == text);
    found.ok_or_else(|| choices(adapters().iter().map(|it| it.name)))
}

fn pattern(text: &str) -> Result<ReadPattern, String> {
    let mut all = ReadPattern::ALL.into_iter();
    let found = all.find(|it| it.name() == text);
    found.ok_or_else(|| choices(ReadPattern::ALL.into_iter().map(ReadPattern::name)))
}

fn return_delay(text: &str) -> Result<SimDuration, String> {
    match any_duration(text)? {
        delay if delay <= RETURN_DELAY_MOST => Ok(delay),
        _ => Err(format!("it must be at most {RETURN_DELAY_MOST}")),
    }
}
