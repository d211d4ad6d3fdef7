//! The bus of Oncilla: requirements, rates and delays (sections 5.3.1 and 5.3.2).

use twinrig_motordriver::{COMMAND_LEN, REPLY_LEN};
use twinrig_sbcp::{BYTE_TIME, OVERHEAD};

use crate::error::TwinError;
use crate::thesis::context::Context;
use crate::thesis::item::{Item, Measurements, PrintedFigure, Source};
use crate::thesis::verdict::{Basis, Input, Measurement, Rule};

const BOARDS: f64 = 4.0;

/// Bits of a byte on a serial line (eq. 5.1).
const BITS: f64 = 10.0;

const HOST: &str = "the rules of the emulated host were chosen to give 400 Hz and 1 kHz";

const ABOUT: &str = "\"approximately\"";

pub(crate) const SEC_5_3_1: Item = Item {
    id: "sec-5-3-1",
    title: "Requirements on the bus",
    place: "5.3.1.2, table 5.3, eq. 5.1",
    run_s: 0.1,
    figures: &[
        PrintedFigure::value(
            "payload",
            "data of a board in a cycle",
            "5.3.1.2",
            20.0,
            "B",
        )
        .rule(Rule::Within(0.0), "a count")
        .remark("table 5.3 has two positions of 12 bits in 2 bytes; the sum needs 4"),
        PrintedFigure::value(
            "effective",
            "data rate at 1 kHz",
            "5.3.1.2",
            800.0,
            "kbit/s",
        )
        .rule(Rule::Within(0.0), "a product of counts")
        .remark("with start and stop bits, ten to a byte"),
        PrintedFigure::value("baud", "least baud rate", "eq. 5.1", 1.28, "Mbit/s")
            .rule(Rule::Within(1e-9), "a product of counts")
            .remark("of the packets of the emulated bus"),
        PrintedFigure::value(
            "time-out",
            "time-out of the bus controller, over the latest first byte of an answer",
            "5.3.2",
            20.0,
            "µs",
        )
        .rule(Rule::AtMost(20.0), "an answer that comes is not timed out")
        .remark("printed response time of 10 µs and a byte on the bus"),
        PrintedFigure::value(
            "tracking",
            "greatest rate of set-points",
            "5.3.3",
            500.0,
            "Hz",
        )
        .rule(Rule::Within(1e-9), "a quotient")
        .remark("an interpolation takes two updates of the controller of 1 kHz"),
    ],
    sources: &[Source::rest(
        Basis::Arithmetic,
        &[Input::Set("printed counts and lengths")],
    )],
    measure: |_| Ok(sec_5_3_1()),
    commands: &["twin run scenarios/thesis/sec-5-3-2-bus-controller.toml"],
};

pub(crate) const SEC_5_3_2: Item = Item {
    id: "sec-5-3-2",
    title: "Rates and delays of the bus",
    place: "5.3.2, figures 5.7 and 5.8, table 5.5",
    run_s: 1.0,
    figures: &[
        PrintedFigure::value(
            "first",
            "first firmware: rate of four boards",
            "5.3.2",
            150.0,
            "Hz",
        )
        .rule(Rule::Within(0.1), ABOUT)
        .remark("guaranteed, by the longest cycle; the mean rate is higher"),
        PrintedFigure::value(
            "first-jitter",
            "first firmware: jitter",
            "5.3.2",
            500.0,
            "µs",
        )
        .rule(Rule::Within(0.1), "\"of the order of\"")
        .remark("half of the range of the response times"),
        PrintedFigure::value(
            "direct",
            "polled boards: rate of four",
            "5.3.2",
            400.0,
            "Hz",
        )
        .rule(Rule::Within(1e-3), "whole microframes")
        .remark(HOST),
        PrintedFigure::value(
            "board",
            "polled boards: time of one",
            "5.3.2, figure 5.7",
            625.0,
            "µs",
        )
        .rule(Rule::Within(1e-3), "whole microframes")
        .remark(HOST),
        PrintedFigure::value(
            "each-way",
            "polled boards: delay by USB, each way",
            "5.3.2, figure 5.7, table 5.5",
            250.0,
            "µs",
        )
        .rule(Rule::Within(0.2), "whole microframes of 125 µs")
        .remark("half of the time of a board less that on the bus"),
        PrintedFigure::value(
            "controller",
            "bus controller: rate of four",
            "5.3.2",
            1000.0,
            "Hz",
        )
        .rule(Rule::Within(1e-3), "whole microframes")
        .remark(HOST),
        PrintedFigure::value(
            "usb",
            "bus controller: delay by USB in a cycle",
            "5.3.2, figure 5.8",
            500.0,
            "µs",
        )
        .rule(Rule::Within(0.2), "whole microframes of 125 µs")
        .remark("the cycle less four boards on the bus, of 32 bytes and the response time each"),
        PrintedFigure::value("reaction", "response time of a board", "5.3.2", 10.0, "µs")
            .rule(Rule::AtMost(10.0), "printed as the greatest")
            .remark("the emulated firmware takes the printed time"),
        PrintedFigure::value(
            "jitter",
            "jitter at the boards",
            "5.3.4, table 5.5",
            2.0,
            "µs",
        )
        .rule(Rule::AtMost(2.0), "printed for the whole chain")
        .remark("with a timer of the master that is locked to the frames of USB"),
    ],
    sources: &[
        Source::of(
            &["first", "first-jitter"],
            Basis::Outcome,
            &[
                Input::Set("period of the firmware's loop"),
                Input::Free("phases of four loops"),
            ],
        ),
        Source::rest(
            Basis::Given,
            &[Input::Fitted("times of the host and of the firmware")],
        ),
    ],
    measure: sec_5_3_2,
    commands: &[
        "twin run scenarios/thesis/sec-5-3-2-first-firmware.toml",
        "twin run scenarios/thesis/sec-5-3-2-direct.toml",
        "twin run scenarios/thesis/sec-5-3-2-bus-controller.toml",
    ],
};

fn sec_5_3_1() -> Measurements {
    const HERTZ: f64 = 1000.0;
    /// Greatest response time of a board [µs], and updates of the controller in an interpolation.
    const RESPONSE: f64 = 10.0;
    const UPDATES: f64 = 2.0;
    let mut found = Measurements::default();
    let payload = (COMMAND_LEN + REPLY_LEN) as f64;
    let packets = payload + 2.0 * OVERHEAD as f64;
    found.set("payload", payload);
    found.set("effective", 1e-3 * BOARDS * payload * BITS * HERTZ);
    found.set("baud", 1e-6 * BOARDS * packets * BITS * HERTZ);
    found.set("time-out", RESPONSE + 1e6 * BYTE_TIME.as_secs_f64());
    found.set("tracking", HERTZ / UPDATES);
    found
}

/// Returns the inverse of a positive measurement.
fn inverse(found: Measurement) -> Measurement {
    Measurement::exact(1.0 / found.value)
}

fn sec_5_3_2(context: &Context<'_>) -> Result<Measurements, TwinError> {
    let mut found = Measurements::default();
    let microseconds = |found: Measurement| found.times(1e6);
    let run = context.run("thesis/sec-5-3-2-first-firmware.toml")?;
    let longest = run.measured("longest cycle: 6.0 to 6.5 ms, guaranteed 155 to 167 Hz")?;
    found.add("first", longest.map(inverse));
    let jitter = run.measured("jitter of a board's answer, half of its range: 500 µs")?;
    found.add("first-jitter", jitter.map(microseconds));
    let run = context.run("thesis/sec-5-3-2-direct.toml")?;
    let polled = run.measured("cycle of four boards: 2.5 ms, 400 Hz")?;
    found.add("direct", polled.map(inverse));
    found.add("board", polled.map(|cycle| cycle.times(1e6 / BOARDS)));
    let run = context.run("thesis/sec-5-3-2-bus-controller.toml")?;
    let cycle = run.measured("cycle of four boards: 1 ms, 1 kHz")?;
    let reaction = run.measured("boards answer within 10 µs")?;
    found.add("controller", cycle.map(inverse));
    let usb = |cycle: Option<Measurement>, share: f64| {
        let of_bus = reaction.map(on_the_bus);
        let usb = cycle
            .zip(of_bus)
            .map(|(cycle, bus)| cycle.value - BOARDS * bus);
        usb.map(|seconds| Measurement::exact(1e6 * share * seconds))
    };
    found.add("each-way", usb(polled, 0.5 / BOARDS));
    found.add("usb", usb(cycle, 1.0));
    found.add("reaction", reaction.map(microseconds));
    let jitter = run.measured("jitter of requests at the boards: 2 µs")?;
    found.add("jitter", jitter.map(microseconds));
    Ok(found)
}

/// Returns the time of a board on the bus, given its response time \[s\].
fn on_the_bus(reaction: Measurement) -> f64 {
    let bytes = COMMAND_LEN + REPLY_LEN + 2 * OVERHEAD;
    bytes as f64 * BYTE_TIME.as_secs_f64() + reaction.value
}
