//! The suggested observation period of an error message is accepted.

use crate::common::parse;
use proptest::prelude::*;

fn text(run_ms: u64, observe_us: u64, swing_us: u64, grid: Option<u64>, expect: &str) -> String {
    let grid = grid.map_or_else(String::new, |us| {
        format!("coupling = {{ grid = '{us} us' }}")
    });
    format!(
        "robot = 'cheetah-cub'\nduration = '{run_ms} ms'\n[plant]\nmodel = 'massless'\n{grid}\n\
         [observe]\nperiod = '{observe_us} us'\n[footsteps]\nshortest_swing = '{swing_us} us'\n\
         [[expect]]\n{expect}\n"
    )
}

/// Returns the `[observe] period` that the message `error` suggests.
fn suggested(error: &str) -> Option<&str> {
    let (_, rest) = error.split_once("write [observe] period = \"")?;
    rest.split('"').next()
}

proptest! {
    #[test]
    fn suggested_period_is_accepted(
        run_ms in 1..20_000_u64,
        observe in 1..200_u64,
        swing_us in prop_oneof![Just(0), Just(1), 1..80_000_u64],
        grid_us in prop_oneof![Just(None), (1..3000_u64).prop_map(Some)],
        expect in prop_oneof![
            Just("body = { fall = false }"),
            Just("footstep = { slip = { max = '1 mm' } }"),
            Just("signal = { name = 'x', always = { max = 1 } }"),
        ],
    ) {
        // A grid divides the observation period.
        let observe_us = grid_us.unwrap_or(250) * observe;
        let file = text(run_ms, observe_us, swing_us, grid_us, expect);
        let longest = match expect.split(' ').next() {
            Some("body") => 20_000_000,
            Some("footstep") if swing_us == 0 => 10_000_000,
            Some("footstep") => swing_us * 1000 / 4,
            _ => u64::MAX,
        };
        let too_long = observe_us * 1000 > longest || observe_us > 1000 * run_ms;
        match parse(&file) {
            Ok(_) => prop_assert!(!too_long, "accepted:\n{file}"),
            Err(error) => {
                let error = error.to_string();
                prop_assert!(too_long, "{error}");
                let suggested = suggested(&error).unwrap_or_else(|| panic!("{error}"));
                let mut corrected = file.replace(&format!("period = '{observe_us} us'"), &format!("period = '{suggested}'"));
                if error.contains("and a grid that divides it") {
                    corrected = corrected.replace(&format!("grid = '{}", grid_us.unwrap()), "grid = '1 ns' } #");
                }
                let again = parse(&corrected);
                prop_assert!(again.is_ok(), "{}\n{corrected}", again.unwrap_err());
            }
        }
    }
}
