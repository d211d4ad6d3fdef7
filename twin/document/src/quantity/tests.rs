use proptest::prelude::*;

use super::*;
use crate::units::KINDS;

#[test]
fn units_of_data_sheets_have_their_conversion() {
    // 0.16 s for 60° are 375 °/s; 20 kgf·cm are 20 · 0.01 m · 9.80665 N.
    for (text, unit, remedy) in [
        ("0.16 s/60°", Unit::RadianPerSecond, 6.545),
        ("20 kg·cm", Unit::NewtonMeter, 1.961),
        ("277.7 oz-in", Unit::NewtonMeter, 1.961),
    ] {
        let error = parse_quantity(text, unit).unwrap_err();
        let written = error.help.split('"').nth(1).unwrap();
        assert_eq!(
            parse_quantity(written, unit),
            Ok(remedy),
            "{text}: {}",
            error.help
        );
    }
    assert_eq!(
        parse_quantity("2 kg·mm²", Unit::KilogramSquareMeter),
        Ok(2e-6)
    );
    assert_eq!(
        parse_quantity("5 g·mm²", Unit::KilogramSquareMeter),
        Ok(5e-9)
    );
}

#[test]
fn power_of_ten_adds_no_rounding() {
    // 12.6 × 0.01 is 0.126 in floating point, but 0.7 × 0.001 is not 0.0007.
    assert_eq!(parse_quantity("0.7 mm", Unit::Meter), Ok(0.0007));
    assert_eq!(parse_quantity("1.1e3 g", Unit::Kilogram), Ok(1.1));
}

#[test]
fn spellings_of_a_unit_are_equivalent() {
    for text in ["0.1 N·m/rad", "0.1 N*m/rad", "0.1 N m/rad", "0.1N m / rad"] {
        assert_eq!(parse_quantity(text, Unit::NewtonMeterPerRadian), Ok(0.1));
    }
    assert_eq!(
        parse_quantity("35°", Unit::Radian),
        parse_quantity("35 deg", Unit::Radian)
    );
    assert_eq!(parse_duration("5 µs"), parse_duration("5 us"));
}

#[test]
fn wrong_unit_lists_fitting_units() {
    let error = parse_quantity("3 Hz", Unit::Meter).unwrap_err();
    assert_eq!(error.message, "`3 Hz` is a frequency; expected a length");
    assert_eq!(error.help, "units that fit: m, cm, mm, um, km");
}

#[test]
fn length_without_unit_is_rejected() {
    assert!(parse_quantity("3", Unit::Meter).is_err());
    assert_eq!(parse_quantity("3", Unit::One), Ok(3.0));
    assert_eq!(parse_quantity("3 %", Unit::One), Ok(0.03));
}

#[test]
fn durations_are_exact() {
    let nanos = |text: &str| parse_duration(text).map(SimDuration::as_nanos);
    assert_eq!(nanos("0.1 s"), Ok(100_000_000));
    assert_eq!(nanos("200 s"), Ok(200_000_000_000));
    assert_eq!(nanos("1.000000001 s"), Ok(1_000_000_001));
    assert_eq!(nanos("2e-3 s"), Ok(2_000_000));
    assert_eq!(nanos("0.5 min"), Ok(30_000_000_000));
    assert_eq!(nanos("0.000 s"), Ok(0));
    for text in [
        "0.5 ns",
        "-1 s",
        "1e12 s",
        "3155760001 s",
        "1e400 s",
        "9e9999 s",
        "1",
        "inf s",
        "NaN s",
        "",
    ] {
        assert!(nanos(text).is_err(), "{text}");
    }
}

#[test]
fn symbol_of_every_unit_is_a_spelling() {
    for &unit in Unit::ALL {
        let symbol = if unit == Unit::One { "" } else { unit.symbol() };
        assert_eq!(
            parse_quantity(&format!("2.5 {symbol}"), unit),
            Ok(2.5),
            "{unit}"
        );
    }
}

#[test]
fn spellings_are_unique() {
    for kind in KINDS {
        for (spelling, _) in kind.spellings {
            let owners: Vec<_> = KINDS
                .iter()
                .filter(|other| units::scale(other, spelling).is_some())
                .map(|other| other.name)
                .collect();
            assert_eq!(owners, [kind.name], "{spelling}");
        }
    }
}

proptest! {
    #[test]
    fn printed_quantities_round_trip_bit_for_bit(
        value in any::<f64>().prop_filter("finite", |value| value.is_finite()),
        kind in 0..KINDS.len(),
    ) {
        let unit = KINDS[kind].unit;
        let back = parse_quantity(&print_quantity(value, unit), unit).unwrap();
        prop_assert_eq!(back.to_bits(), value.to_bits());
    }

    #[test]
    fn conversions_of_data_sheets_are_accepted_when_followed(
        number in prop_oneof![Just(0.0), any::<f64>().prop_filter("finite", |x| x.is_finite())],
        of in prop::sample::select(vec![
            ("s/60°", Unit::RadianPerSecond),
            ("kg·cm", Unit::NewtonMeter),
            ("oz·in", Unit::NewtonMeter),
        ]),
    ) {
        let (spelling, unit) = of;
        let help = parse_quantity(&format!("{number} {spelling}"), unit).unwrap_err().help;
        if let Some(written) = help.strip_prefix("write `\"") {
            let written = written.strip_suffix("\"`").unwrap();
            prop_assert!(parse_quantity(written, unit).is_ok(), "{help}");
        }
    }

    #[test]
    fn printed_durations_round_trip(nanos in 0..=LONGEST_NANOS) {
        for text in [format!("{nanos} ns"), format!("{}.{:09} s", nanos / 1_000_000_000, nanos % 1_000_000_000)] {
            prop_assert_eq!(parse_duration(&text), Ok(SimDuration::from_nanos(nanos)));
        }
    }

    #[test]
    fn no_text_causes_a_panic(text in ".*") {
        let _ = parse_quantity(&text, Unit::Meter);
        let _ = parse_duration(&text);
    }

    #[test]
    fn no_number_with_a_unit_causes_a_panic(text in "[-+]?[0-9.eE+-]{0,24} ?(s|ms|us|ns|min|µs)?") {
        let _ = parse_duration(&text);
    }
}
