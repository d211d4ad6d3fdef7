//! A battery of random drops, stands and walks, and laws that need no reference: what must hold of any motion of any robot by
//! any method.
//!
//! `BATTERY_CASES` is the number of cases, `BATTERY_FIRST` the seed of the first, `BATTERY_METHOD` the one method (`rk4`,
//! `rodas4`, `moreau`, `massless`) that is looked at, `BATTERY_NOMINAL` the number of nominal drops by each, `BATTERY_AGREE` and
//! `BATTERY_AGREE_FINELY` the number of cases in which methods are compared, in steps of 0.1 ms and of 10 µs. A case that
//! breaks a law is written as a scenario file, which `twin run` repeats. Violations that are known stand in `known.txt`; with other
//! counts than the default ones, nothing is asserted but printed:
//!
//! ```console
//! $ BATTERY_FIRST=17 BATTERY_CASES=1 cargo test -p twinrig-tests --test battery drop_stand -- --nocapture
//! ```

mod agreement;
mod broken;
mod case;
mod law;
mod momentum;
mod run;
mod tally;

use tally::Tally;
use twinrig::Registry;
use twinrig::kernel::SimDuration;

use case::{Case, Method};
use law::Law;

/// Cases where nothing else is asked for.
const CASES: u64 = 1000;
/// Cases in which methods are compared.
const AGREEING: u64 = 20;
/// The same in steps of 10 µs.
const AGREEING_FINELY: u64 = 2;
/// Nominal drops by each method.
const NOMINAL: u64 = 100;
/// Nominal drops that were refused once, by their seeds.
const REFUSED_ONCE: [(Method, u64); 3] = [
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

/// The methods that are asked for: `BATTERY_METHOD`, all without.
fn methods() -> Vec<Method> {
    let name = std::env::var("BATTERY_METHOD").ok();
    let wanted = |method: &Method| name.as_deref().is_none_or(|name| name == method.name());
    Method::ALL.into_iter().filter(wanted).collect()
}

#[test]
fn no_law_is_broken_by_any_drop_stand_or_walk() {
    let registry = Registry::standard();
    let robot = run::robot();
    let methods = methods();
    let mut tally = Tally::new("battery");
    let first = variable("BATTERY_FIRST", 0);
    let cases = variable("BATTERY_CASES", CASES);
    for seed in first..first + cases {
        let case = Case::drawn(seed, &robot);
        if methods.contains(&case.method) {
            tally.take(&Law::ALL, &run::run(&registry, &case));
        }
    }
    let everybodys = (first, cases) == (0, CASES) && methods.len() == Method::ALL.len();
    tally.close(everybodys);
}

/// The robot as its file has it, on level ground that gives nothing back.
#[test]
fn at_most_one_nominal_drop_in_a_thousand_is_refused() {
    let registry = Registry::standard();
    let robot = run::robot();
    let mut tally = Tally::new("battery-nominal");
    let first = variable("BATTERY_FIRST", 0);
    for seed in first..first + variable("BATTERY_NOMINAL", NOMINAL) {
        for method in methods() {
            let case = Case::nominal_drop(seed, method, &robot);
            tally.take(&[Law::Refusal], &run::run(&registry, &case));
        }
    }
    tally.close(true);
}

#[test]
fn nominal_drops_that_were_refused_once_are_not() {
    let registry = Registry::standard();
    let robot = run::robot();
    let mut tally = Tally::new("battery-refused");
    for (method, seed) in REFUSED_ONCE {
        let case = Case::nominal_drop(seed, method, &robot);
        tally.take(&[Law::Refusal], &run::run(&registry, &case));
    }
    tally.close(true);
}

/// The methods of the full plant agree on a drop, stand or walk until a copy that starts 1e-9 rad away has departed from it.
#[test]
fn methods_agree_until_a_perturbed_copy_departs() {
    let registry = Registry::standard();
    let robot = run::robot();
    let first = variable("BATTERY_FIRST", 0);
    let mut tally = Tally::new("battery-agreement");
    let mut everybodys = first == 0;
    for (variable_of_count, default, step_us) in [
        ("BATTERY_AGREE", AGREEING, 100),
        ("BATTERY_AGREE_FINELY", AGREEING_FINELY, 10),
    ] {
        let step = SimDuration::from_micros(step_us);
        let cases = variable(variable_of_count, default);
        everybodys &= cases == default;
        for seed in first..first + cases {
            let case = Case::drawn(seed, &robot).by(Method::Rk4);
            match agreement::compare(&registry, &case, step) {
                Ok(comparisons) => tally.compared(&case, comparisons),
                Err(error) => panic!("case {seed}: {error}"),
            }
        }
    }
    tally.close(everybodys);
}
