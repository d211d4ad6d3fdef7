//! The part of a page that tells what a walk costs, and where energy appears or vanishes.

use crate::number::{method_setting, si};
use crate::row::Status;
use crate::study::Study;
use crate::transport::{Cost, Transport};

use super::table::Table;
use super::text::{element, escaped, paragraph};

/// What walking costs in each plant.
pub(crate) fn section(study: &Study) -> String {
    let Some(cost) = study.transports.iter().find_map(|one| one.cost.as_ref()) else {
        return String::new();
    };
    let mut out = "<h2>What walking costs</h2>\n".to_owned();
    out += &paragraph(&format!(
        "Each plant by each of its methods, at the scenario's step, is led by the same commands for {} from the same start, and \
         counted from {} on. Work is that of the drives on the robot, without losses of motors and gears; the cost of transport is \
         work by weight and distance. Net work is by the energy books; positive work is torque by turning of every drive for \
         itself where it gives, so a drive that brakes gets nothing back. What the drives give is taken by friction and impacts or \
         is stored: what is then left over has appeared from nowhere or vanished. The cost is covered had the drives given \
         that, too; where it differs much from the net cost, a plant says nothing about consumption. Shares are of the net work.",
        si(cost.to_s, "s"),
        si(cost.from_s, "s"),
    ));
    out += &table(study);
    out += &told(study);
    out
}

fn table(study: &Study) -> String {
    let mut table = Table::new(
        &[
            "plant",
            "method",
            "speed",
            "cost, net",
            "covered",
            "positive",
            "work, net",
            "from nowhere",
            "friction",
            "impacts",
            "stored",
        ],
        2,
    );
    let mut before = "";
    for one in &study.transports {
        let first = !before.is_empty() && before != one.plant;
        before = &one.plant;
        let bad = one.status != Status::Ok || one.fell_at_s.is_some();
        let setting = method_setting(one.step_s, one.tolerance);
        let about = match &one.why {
            Some(why) => format!("{setting}; {why}"),
            None => setting,
        };
        let about = element("span", "wrap soft", &escaped(&about));
        let mut cells = vec![
            element("b", "", &escaped(&one.plant)),
            escaped(&one.method) + &about,
        ];
        let numbers = one.cost.as_ref().map(numbers);
        cells.extend(numbers.into_iter().flatten());
        table.row(
            match (first, bad) {
                (true, false) => "first",
                (false, false) => "",
                (true, true) => "first bad",
                (false, true) => "bad",
            },
            cells,
        );
    }
    table.html()
}

/// Books and drives that are further apart than this share of the net work do not know positive work.
const KNOWN: f64 = 0.05;

/// How far net work by the drives is from that by the books, as a share of the greater.
fn apart(cost: &Cost) -> Option<f64> {
    let drives = cost.drive_work_j?;
    let most = cost.work_j.abs().max(drives.abs());
    (most > 0.0).then(|| (drives - cost.work_j).abs() / most)
}

fn numbers(cost: &Cost) -> [String; 9] {
    let known = apart(cost).is_some_and(|apart| apart <= KNOWN);
    let ratio = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.3}"));
    let joule = |value: f64| si(value, "J");
    [
        format!("{:.3} m/s", cost.speed_m_s),
        ratio(cost.cost_of_transport),
        ratio(cost.covered_cost_of_transport),
        ratio(cost.positive_cost_of_transport.filter(|_| known)),
        joule(cost.work_j),
        share(cost).map_or_else(
            || joule(cost.residual_j),
            |share| format!("{}, {:.2} %", joule(cost.residual_j), 100.0 * share),
        ),
        joule(cost.dissipated_j),
        joule(cost.impact_j),
        joule(cost.stored_j),
    ]
}

/// The residual as a share of the net work.
fn share(cost: &Cost) -> Option<f64> {
    (cost.work_j != 0.0).then(|| cost.residual_j / cost.work_j.abs())
}

/// What the figures say, in sentences.
fn told(study: &Study) -> String {
    let sound = || {
        let all = study.transports.iter();
        let standing = all.filter(|one| one.status == Status::Ok && one.fell_at_s.is_none());
        standing.filter_map(|one| Some((one, one.cost.as_ref()?)))
    };
    let mut out = String::new();
    let costs = || sound().filter_map(|(one, cost)| Some((one, cost.cost_of_transport?)));
    let least = costs().min_by(|a, b| a.1.total_cmp(&b.1));
    let most = costs().max_by(|a, b| a.1.total_cmp(&b.1));
    if let (Some((low, least)), Some((high, most))) = (least, most)
        && least > 0.0
    {
        out += &paragraph(&format!(
            "Between plants that stay upright the net cost goes from {least:.3} ({}) to {most:.3} ({}), a factor of {:.2}. The \
             thesis (section 2.6.1) tells of a model in maximal coordinates that consumed up to 15 times less than the robot.",
            name(low),
            name(high),
            most / least
        ));
    }
    out += &opened(study);
    let apart = sound().filter_map(|(one, cost)| Some((one, apart(cost)?)));
    if let Some((one, apart)) = apart.max_by(|a, b| a.1.total_cmp(&b.1)) {
        out += &paragraph(&format!(
            "Net work by torque and turning of the drives, looked at every step, and by the books are {:.2} % apart at most ({}): so \
             well is positive work known. Where they are more than {} % apart it is not shown.",
            100.0 * apart,
            name(one),
            100.0 * KNOWN
        ));
    }
    out
}

/// Where the books are furthest open, upright or not, and what that does to the cost.
fn opened(study: &Study) -> String {
    let ended = study.transports.iter();
    let ended = ended.filter(|one| one.status == Status::Ok);
    let known = ended.filter_map(|one| {
        let cost = one.cost.as_ref()?;
        Some((one, cost, share(cost)?))
    });
    let furthest = known.max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()));
    let Some((one, cost, share)) = furthest else {
        return String::new();
    };
    let fell = one
        .fell_at_s
        .map_or(String::new(), |at| format!(" (it fell at {})", si(at, "s")));
    let way = if cost.residual_j > 0.0 {
        "appear from nowhere"
    } else {
        "vanish"
    };
    let text = format!(
        "The books are furthest open in {}{fell}: the drives give {}, and {} {way}, {:.2} % of that; at most {} appear and {} vanish in \
         a tenth of the window.",
        name(one),
        si(cost.work_j, "J"),
        si(cost.residual_j.abs(), "J"),
        100.0 * share.abs(),
        si(cost.appears_most_j, "J"),
        si(cost.vanishes_most_j, "J"),
    );
    let covered = cost.covered_cost_of_transport;
    let covered = cost
        .cost_of_transport
        .zip(covered)
        .filter(|(net, _)| *net > 0.0);
    let covered = covered.map_or(String::new(), |(net, covered)| {
        format!(
            " A cost of {net:.3} would be {covered:.3}, {:.2} times as much, had the drives covered it.",
            covered / net
        )
    });
    paragraph(&(text + &covered))
}

fn name(one: &Transport) -> String {
    format!(
        "{} {}, {}",
        one.plant,
        one.method,
        method_setting(one.step_s, one.tolerance)
    )
}
