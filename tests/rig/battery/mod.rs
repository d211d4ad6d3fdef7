//! Battery of random drops, stands and walks, checked against laws without a reference solution:
//! properties of any motion of any robot with any method.
//!
//! Environment variables: `BATTERY_CASES` number of cases, `BATTERY_FIRST` seed of the first,
//! `BATTERY_METHOD` the only method (`rk4`, `rodas4`, `moreau`, `massless`, `compliant`,
//! `compliant-massless`), `BATTERY_NOMINAL` number of nominal drops per method, `BATTERY_AGREE` and
//! `BATTERY_AGREE_FINELY` number of cases in which methods are compared, with steps of 0.1 ms and
//! of 10 µs, `BATTERY_HARSH` number of harsh drops per method. A case that violates a law is
//! written as a scenario file for `twin run`. Known violations are listed in `known.txt`; those of
//! other seeds than the first 1000 and of a single method are printed and not asserted. Cases that
//! found a fault become fixed ones, as [`FORMERLY_REFUSED`] is.
//!
//! ```console
//! $ export BATTERY_FIRST=17 BATTERY_CASES=1
//! $ cargo test --profile ci -p twinrig-tests --test rig battery::laws_hold -- --nocapture
//! ```

mod agreement;
mod case;
mod law;
mod law_report;
pub mod momentum;
mod run;
mod sensitivity;

use std::ops::Range;

use law_report::{LISTED, LawReport};
use twinrig::Registry;
use twinrig::kernel::SimDuration;

use case::{Case, Harsh, Method};
use law::Law;

/// Default number of cases, of which each is by one method.
const CASES: u64 = 400;
/// Default number of cases in which methods are compared, with steps of 0.1 ms.
const COMPARED: u64 = 20;
/// The same with steps of 10 µs.
const COMPARED_FINELY: u64 = 2;
/// Default number of harsh drops per method.
const HARSH: u64 = 20;
/// Default number of nominal drops per method.
const NOMINAL: u64 = 50;
/// Seeds of nominal drops that ended with an error in earlier versions.
const FORMERLY_REFUSED: [(Method, u64); 3] = [
    (Method::Massless, 470),
    (Method::Massless, 1835),
    (Method::Massless, 2246),
];

fn variable(name: &str, default: u64) -> u64 {
    match std::env::var(name) {
        Ok(text) => text
            .parse()
            .unwrap_or_else(|_| panic!("{name} = {text:?} is not a number")),
        Err(_) => default,
    }
}

/// Returns the seeds of a battery, by default the first ones. The variable `count` has their
/// number.
fn seeds(count: &str, default: u64) -> Range<u64> {
    let first = variable("BATTERY_FIRST", 0);
    first..first + variable(count, default)
}

/// Returns the cases of which the violations are known: none if some methods are left out.
fn known(cases: Range<u64>, is_whole: bool) -> Range<u64> {
    if is_whole { cases } else { 0..LISTED + 1 }
}

/// Returns the method in `BATTERY_METHOD` if it is among `methods`, or all of them.
fn selected(methods: &[Method]) -> Vec<Method> {
    let name = std::env::var("BATTERY_METHOD").ok();
    let is_selected = |method: &&Method| name.as_deref().is_none_or(|name| name == method.name());
    methods.iter().filter(is_selected).copied().collect()
}

#[test]
fn laws_hold_in_random_drops_stands_and_walks() {
    let registry = Registry::standard();
    let robot = run::robot();
    let methods = selected(&Method::RIGID);
    let mut report = LawReport::new("battery");
    let cases = seeds("BATTERY_CASES", CASES);
    for seed in cases.clone() {
        let case = Case::random(seed, &robot);
        if methods.contains(&case.method) {
            report.check(&Law::GENERAL, &run::run(&registry, &case));
        }
    }
    report.finish(known(cases, methods.len() == Method::RIGID.len()));
}

/// Each case on one of the plants with compliant constraints.
#[test]
fn laws_hold_with_compliant_constraints() {
    let registry = Registry::standard();
    let robot = run::robot();
    let methods = selected(&Method::COMPLIANT);
    let mut report = LawReport::new("battery-compliant");
    let cases = seeds("BATTERY_CASES", CASES);
    for seed in cases.clone() {
        let method = Method::COMPLIANT[usize::from(seed % 2 == 1)];
        if methods.contains(&method) {
            let case = Case::random_compliant(seed, method, &robot);
            report.check(&Law::GENERAL, &run::run(&registry, &case));
        }
    }
    report.finish(known(cases, methods.len() == Method::COMPLIANT.len()));
}

/// The robot of the file on level ground without restitution.
#[test]
fn nominal_drops_complete() {
    let registry = Registry::standard();
    let robot = run::robot();
    let mut report = LawReport::new("battery-nominal");
    for seed in seeds("BATTERY_NOMINAL", NOMINAL) {
        for method in selected(&Method::ALL) {
            let case = Case::nominal_drop(seed, method, &robot);
            let case = if method.is_compliant() {
                case.compliant(method)
            } else {
                case
            };
            report.check(&[Law::Refusal], &run::run(&registry, &case));
        }
    }
    report.finish(0..LISTED);
}

/// Impacts give no energy.
#[test]
fn laws_hold_in_harsh_drops() {
    let registry = Registry::standard();
    let robot = run::robot();
    let methods = selected(&Method::RIGID);
    let mut report = LawReport::new("battery-harsh");
    let drops = seeds("BATTERY_HARSH", HARSH);
    for method in methods.iter().copied() {
        for seed in drops.clone() {
            let Harsh { case, text } = Harsh::drop(seed, method, &robot);
            report.check(&Law::HARSH, &run::run_text(&registry, &case, &text));
        }
    }
    report.finish(known(drops, methods.len() == Method::RIGID.len()));
}

#[test]
fn formerly_refused_nominal_drops_complete() {
    let registry = Registry::standard();
    let robot = run::robot();
    let mut report = LawReport::new("battery-refused");
    for (method, seed) in FORMERLY_REFUSED {
        let case = Case::nominal_drop(seed, method, &robot);
        report.check(&[Law::Refusal], &run::run(&registry, &case));
    }
    report.finish(0..LISTED);
}

/// The methods of the full plant agree until a copy with an initial offset of 1e-9 rad has
/// departed.
#[test]
#[ignore = "slow"]
fn methods_agree_until_a_perturbed_copy_departs() {
    let registry = Registry::standard();
    let robot = run::robot();
    let first = variable("BATTERY_FIRST", 0);
    let mut report = LawReport::new("battery-agreement");
    let mut is_default = first == 0;
    for (count_variable, default, step_us) in [
        ("BATTERY_AGREE", COMPARED, 100),
        ("BATTERY_AGREE_FINELY", COMPARED_FINELY, 10),
    ] {
        let step = SimDuration::from_micros(step_us);
        let cases = variable(count_variable, default);
        is_default &= cases == default;
        for seed in first..first + cases {
            let case = Case::random(seed, &robot).by(Method::Rk4);
            match agreement::compare(&registry, &case, step) {
                Ok(comparisons) => report.add_comparisons(&case, comparisons),
                Err(error) => panic!("case {seed}: {error}"),
            }
        }
    }
    report.finish(known(0..LISTED, is_default));
}
