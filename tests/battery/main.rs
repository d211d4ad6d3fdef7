//! A battery of random drops, stands and walks, and laws that need no reference: what must hold of any motion of any robot by
//! any method.
//!
//! `BATTERY_CASES` is the number of cases, `BATTERY_FIRST` the seed of the first, `BATTERY_METHOD` the one method (`rk4`,
//! `rodas4`, `moreau`, `massless`) that is looked at, `BATTERY_NOMINAL` the number of nominal drops by each. A case that
//! breaks a law is written as a scenario file, which `twin run` repeats:
//!
//! ```console
//! $ BATTERY_FIRST=17 BATTERY_CASES=1 cargo test -p twinrig-tests --test battery drop_stand -- --nocapture
//! ```

mod case;
mod law;
mod momentum;
mod run;
mod tally;

use tally::Tally;
use twinrig::Registry;

use case::{Case, Method};
use law::Law;

/// Cases where nothing else is asked for.
const CASES: u64 = 200;
/// Nominal drops by each method.
const NOMINAL: u64 = 10;

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
    for seed in first..first + variable("BATTERY_CASES", CASES) {
        let case = Case::drawn(seed, &robot);
        if methods.contains(&case.method) {
            tally.take(&Law::ALL, &run::run(&registry, &case));
        }
    }
    tally.close();
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
    tally.close();
}
