//! HTML pages.

use twinrig_experiment::{Factor, Machine};

use crate::oscillator::Oscillators;
use crate::{precision, stability, walker};

pub(crate) fn machine() -> Machine {
    Machine {
        cpu: "Any <CPU> & \"co\"".to_owned(),
        cores: 2,
        load: Some(1.5),
        system: "linux x86_64".to_owned(),
        build: "twinrig 0.0.0 (test)".to_owned(),
    }
}

const METHODS: [&str; 5] = [
    "rk4",
    "semi-implicit",
    "explicit-euler",
    "tolerant",
    "brittle",
];

fn pages() -> [String; 3] {
    let precise = precision::study(&METHODS);
    let oscillators = Oscillators::new(&METHODS, 200).with_engine(&["rk4"]);
    let stable = stability::study(&oscillators, &[Factor::Stiffness, Factor::Damping]);
    let walked = walker::study(&["steady", "leaking", "falling", "unbuildable"], 5);
    [precise, stable, walked].map(|study| {
        let page = study.page(&machine(), "twin study <&> it").html();
        if let Some(folder) = std::env::var_os("STUDY_PAGES") {
            let path = std::path::Path::new(&folder).join(format!(
                "{} of {}.html",
                study.kind.name(),
                study.scenario
            ));
            std::fs::write(path, &page).unwrap();
        }
        page
    })
}

/// Returns the names of the elements of `page`, and checks that they are properly nested.
pub(crate) fn elements(page: &str) -> Vec<String> {
    let mut open: Vec<String> = Vec::new();
    let mut all = Vec::new();
    let mut rest = page.strip_prefix("<!DOCTYPE html>\n").unwrap();
    while let Some(start) = rest.find('<') {
        assert!(!rest[..start].contains('>'), "{}", &rest[..start]);
        let end = start + rest[start..].find('>').unwrap();
        let tag = &rest[start + 1..end];
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop().as_deref(), Some(name));
        } else {
            let name = tag.split([' ', '/']).next().unwrap().to_owned();
            all.push(name.clone());
            if !tag.ends_with('/') {
                open.push(name);
            }
        }
        rest = &rest[end + 1..];
        // Style sheets are not parsed.
        if open.last().is_some_and(|name| name == "style") {
            rest = &rest[rest.find("</style>").unwrap()..];
        }
    }
    assert!(open.is_empty(), "{open:?}");
    all
}

#[test]
fn pages_are_well_formed_and_self_contained() {
    for page in pages() {
        let elements = elements(&page);
        for expected in ["svg", "table", "polyline", "title"] {
            assert!(
                elements.iter().any(|name| name == expected),
                "no {expected}"
            );
        }
        for absent in ["script", "link", "img", "iframe"] {
            assert!(elements.iter().all(|name| name != absent), "{absent}");
        }
        for absent in ["http:", "https:", "url(", "NaN", "inf "] {
            assert!(!page.contains(absent), "{absent}");
        }
        assert!(page.contains("Any &lt;CPU&gt; &amp; &quot;co&quot;"));
    }
}

#[test]
fn failed_runs_are_shown() {
    let [precise, stable, _] = pages();
    assert!(precise.contains("class=\"strip\"") && precise.contains("it snapped"));
    assert!(stable.contains("class=\"strip\"") && stable.contains("it snapped"));
    assert!(
        precise.contains("does not decrease with the step")
            && !precise.contains("Cost of transport")
    );
    assert!(stable.contains("wrong"));
}

#[test]
fn pages_show_cost_of_transport_and_stiffness_dependence() {
    let walked = walker::study(&["steady", "leaking", "falling", "unbuildable"], 5);
    let walked = walked.page(&machine(), "").html();
    for text in [
        "Cost of transport",
        "residual",
        // 4 s of 30 mW, of 1 W of drive power; 1 W and 1.03 W over the product of weight and speed,
        // 5 W.
        "the net work of the drives is 4 J, and 120 mJ are created, 3.00 % of that",
        "A cost of 0.200 would be 0.206, 1.03 times as much",
        "fell at 4 s",
        "there is no such walker",
    ] {
        assert!(walked.contains(text), "{text}");
    }
    let oscillators = Oscillators::new(&["rk4", "explicit-euler"], 200);
    let stable = stability::study(&oscillators, &[Factor::Stiffness]);
    let stable = stable.page(&machine(), "").html();
    assert!(stable.contains("Dependence on stiffness") && stable.contains("<td>yes</td>"));
}
