//! Diagnostics of malformed documents and values of valid ones.

use twinrig_document::{Document, DocumentError, Item, Range, Reported, Table};
use twinrig_kernel::Unit;

fn leg(table: &Table<'_>) -> Result<(f64, u64), Reported> {
    let l1 = table.required("l1", |item| item.quantity(Unit::Meter, &Range::POSITIVE));
    let count = table.required("count", Item::natural);
    let spring = table.optional("spring", |item| {
        let spring = item.table()?;
        spring.required("stiffness", |item| {
            item.quantity(Unit::NewtonPerMeter, &Range::POSITIVE)
        })
    });
    spring?;
    Ok((l1?, count?))
}

fn read(text: &str) -> Result<(f64, u64), DocumentError> {
    Document::parse("leg.toml", text)?.check(leg)
}

#[test]
fn all_problems_are_shown_in_file_order() {
    let error = read("count = -3\nl1 = '12 Hz'\n[spring]\nstifness = 3\n").unwrap_err();
    insta::assert_snapshot!(error);
}

#[test]
fn syntax_error_is_shown_at_its_position() {
    insta::assert_snapshot!(read("l1 = '1 m\ncount = 3").unwrap_err());
}

#[test]
fn number_without_unit_lists_fitting_units() {
    insta::assert_snapshot!(read("count = 3\nl1 = 0.1").unwrap_err());
}

#[test]
fn caret_is_aligned_after_tabs_and_multibyte_characters() {
    insta::assert_snapshot!(read("\tl1 = 'µm²'\n\tcount = [ 'é', 2 ]").unwrap_err());
}

#[test]
fn set_value_replaces_the_file_and_is_reported_at_its_origin() {
    let mut document = Document::parse("leg.toml", "l1 = '1 m'\ncount = 3").unwrap();
    document.set("--set", "l1", "20 cm").unwrap();
    assert_eq!(document.check(leg), Ok((0.2, 3)));
    document
        .set("--set", "spring.stiffness", "\"2 m\"")
        .unwrap();
    insta::assert_snapshot!(document.check(leg).unwrap_err());
}

#[test]
fn set_requires_a_valid_key() {
    let mut document = Document::parse("leg.toml", "l1 = '1 m'\ncount = 3").unwrap();
    insta::assert_snapshot!(document.set("--set", "l1 l2", "3").unwrap_err());
    insta::assert_snapshot!(document.set("--set", "l1.deep", "3").unwrap_err());
}

/// An element of a list is known by its name, or by its kind where it has none; so is a table that
/// stands for a list of one.
#[test]
fn elements_of_lists_are_set_by_their_name() {
    let gains = |document: &Document| {
        document.check(|table| {
            let of = |item: &Item<'_>| {
                let table = &item.table()?;
                table.optional("name", |item| item.text().map(str::to_owned))?;
                table.optional("kind", |item| item.text().map(str::to_owned))?;
                table.optional("gains", |item| item.table()?.required("p", Item::natural))
            };
            table.optional("name", |item| item.text().map(str::to_owned))?;
            table.optional("bus", |item| {
                if item.is_list() {
                    item.each(of)
                } else {
                    of(item).map(|gains| vec![gains])
                }
            })
        })
    };
    let set = |text: &str, key: &str| {
        let mut document = Document::parse("run.toml", text).unwrap();
        document.set("--set", key, "9").unwrap();
        gains(&document).unwrap().unwrap()
    };
    let list = "[[bus]]\nkind = 'sbcp'\n[[bus]]\nkind = 'sbcp'\nname = 'the other'";
    assert_eq!(set(list, "bus.sbcp.gains.p"), [Some(9), None]);
    assert_eq!(set(list, "bus.\"the other\".gains.p"), [None, Some(9)]);
    assert_eq!(set("[bus]\nkind = 'sbcp'", "bus.sbcp.gains.p"), [Some(9)]);
    let set_error = |text: &str, key: &str| {
        let mut document = Document::parse("run.toml", text).unwrap();
        document.set("--set", key, "9").unwrap_err().to_string()
    };
    let unknown = set_error(list, "bus.'the othr'.gains.p");
    assert!(
        unknown.contains(r#"did you mean `"the other"`?"#),
        "{unknown}"
    );
    let twice = "[[bus]]\nkind = 'sbcp'\n[[bus]]\nkind = 'sbcp'";
    assert!(set_error(twice, "bus.sbcp.gains.p").contains("list with 2 elements"));
    // The name of a document is none of a table in it.
    let mut document = Document::parse("run.toml", "name = 'run'").unwrap();
    document.set("--set", "run.bus", "[]").unwrap();
    assert!(gains(&document).is_err());
}

/// Settings of elements are those of the document in which the values are written at their place.
#[test]
fn elements_of_lists_are_set_by_their_index() {
    let tables = |document: &Document| {
        document.check(|table| {
            let of = |item: &Item<'_>| {
                let table = &item.table()?;
                let at = table.required("at", Item::duration)?;
                Ok((
                    at,
                    table.optional("counts", |item| item.each(Item::natural))?,
                ))
            };
            table.optional("change", |item| item.each(of))
        })
    };
    let parse = |text: &str| Document::parse("run.toml", text).unwrap();
    let set = |text: &str, settings: &[(&str, &str)]| {
        let mut document = parse(text);
        for (key, value) in settings {
            document.set("--set", key, value).unwrap();
        }
        tables(&document).unwrap()
    };
    let listed = |text: &str| tables(&parse(text)).unwrap();
    let file = "[[change]]\nat = '1 s'\n[[change]]\nat = '2 s'\ncounts = [7, 8]";
    let one = ["change.0.at", "change.1.counts.0", "change.1.counts.2"];
    assert_eq!(
        set(file, &[(one[0], "3 s"), (one[1], "9"), (one[2], "5")]),
        listed("[[change]]\nat = '3 s'\n[[change]]\nat = '2 s'\ncounts = [9, 8, 5]")
    );
    // The index after the last one appends.
    let appended = listed("change = [{ at = '1 s' }, { at = '4 s', counts = [1] }]");
    for settings in [
        [("change.1", "{ at = '4 s', counts = [1] }")].as_slice(),
        &[("change.1.at", "4 s"), ("change.1.counts", "[1]")],
    ] {
        assert_eq!(set("change = [{ at = '1 s' }]", settings), appended);
    }
    let mut document = parse(file);
    insta::assert_snapshot!(document.set("--set", "change.3.at", "1 s").unwrap_err());
    insta::assert_snapshot!(document.set("--set", "change.first.at", "1 s").unwrap_err());
    assert!(document.set("--set", "change.01.at", "1 s").is_err());
    // A value that an element had from an earlier setting is lost with the list.
    document.set("--set", "change.1.at", "3 s").unwrap();
    document.set("--set", "change", "[]").unwrap();
    let (_, warnings) = document
        .check_and_warn(|table| table.optional("change", |item| item.each(Item::natural)))
        .unwrap();
    let messages: Vec<_> = warnings.iter().map(|it| &*it.problem.message).collect();
    assert_eq!(
        messages,
        ["`change.1.at` is set twice, and the last one counts"]
    );
}

#[test]
fn overrides_replace_single_values_and_are_checked_in_the_target() {
    let mut robot = Document::parse(
        "leg.toml",
        "l1 = '1 m'\ncount = 3\n[spring]\nstiffness = '3 N/m'",
    )
    .unwrap();
    let scenario = Document::parse(
        "run.toml",
        "[override]\n'spring.stiffness' = '4 N/m'\nl1.x = 3\ncount = 4",
    )
    .unwrap();
    let overrides = scenario
        .check(|table| table.required("override", Item::overrides))
        .unwrap();
    insta::assert_snapshot!(robot.override_with(&overrides).unwrap_err());

    let scenario = Document::parse(
        "run.toml",
        "[override]\nspring.stiffness = '4 N/m'\ncuont = 4",
    )
    .unwrap();
    let overrides = scenario
        .check(|table| table.required("override", Item::overrides))
        .unwrap();
    robot.override_with(&overrides).unwrap();
    insta::assert_snapshot!(robot.check(leg).unwrap_err());
}

#[test]
fn unreadable_file_is_named() {
    let error = Document::read("no/such.toml".as_ref()).unwrap_err();
    assert!(
        error.to_string().starts_with("error: cannot be read"),
        "{error}"
    );
    let error = Document::from_bytes("x.toml", b"a = 1\nb = \"\xff\"".to_vec()).unwrap_err();
    insta::assert_snapshot!(error);
}
