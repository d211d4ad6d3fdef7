//! Violations found by the battery, by law and method.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::PathBuf;

use crate::battery::agreement::Comparison;
use crate::battery::case::{Case, Method};
use crate::battery::law::{Finding, Law, applies};
use crate::battery::run::Run;

/// Number of violations printed per law and method; all are counted and written.
const SHOWN: usize = 5;

/// Known violations, one line per test, law and method: `battery Momentum rk4: 20 29`. The list is
/// exact: an unlisted violation fails the test, and so does a listed one that does not occur.
const KNOWN: &str = include_str!("known.txt");

/// Number of the cases whose violations are listed.
pub const LISTED: u64 = 1000;

#[derive(Default)]
struct LawCount {
    judged: u64,
    broken: Vec<(u64, Finding)>,
}

/// Counts of evaluated and violated laws.
pub struct LawReport {
    name: String,
    folder: PathBuf,
    cases: u64,
    counts: BTreeMap<(Law, Method), LawCount>,
    /// Cases without violation, by method.
    clean: BTreeMap<Method, u64>,
}

impl LawReport {
    /// Creates an empty report; scenario files of violations are written to a folder `name`.
    pub fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            folder: PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name),
            cases: 0,
            counts: BTreeMap::new(),
            clean: BTreeMap::new(),
        }
    }

    /// Evaluates laws on a run.
    pub fn check(&mut self, laws: &[Law], run: &Result<Run, String>) {
        self.cases += 1;
        let run = run.as_ref().unwrap_or_else(|error| panic!("{error}"));
        let mut clean = true;
        for &law in laws {
            let Some(finding) = law.judge(run) else {
                continue;
            };
            clean &= !finding.is_violation();
            self.add(law, run, finding);
        }
        *self.clean.entry(run.case.method).or_default() += u64::from(clean);
    }

    /// Adds comparisons of methods on one case.
    pub fn add_comparisons(&mut self, case: &Case, comparisons: Vec<Comparison>) {
        self.cases += 1;
        for Comparison { run, finding } in comparisons {
            assert_eq!(run.case.seed, case.seed);
            self.add(Law::Agreement, &run, finding);
        }
    }

    fn add(&mut self, law: Law, run: &Run, finding: Finding) {
        let (method, seed) = (run.case.method, run.case.seed);
        let count = self.counts.entry((law, method)).or_default();
        count.judged += 1;
        if !finding.is_violation() {
            return;
        }
        let path = self
            .folder
            .join(format!("{law:?}-{}-{seed}.toml", method.name()));
        let text = format!("# {law:?}: {finding}\n{}", run.text);
        let written =
            std::fs::create_dir_all(&self.folder).and_then(|()| std::fs::write(&path, text));
        if let Err(error) = written {
            panic!("{}: {error}", path.display());
        }
        count.broken.push((seed, finding));
    }

    /// Formats the table and the first violations, each with the command that repeats it.
    fn report(&self) -> String {
        let mut lines = vec![format!("{} cases; violations / judged:", self.cases)];
        for law in Law::ALL {
            let cells = Method::ALL.map(|method| match self.counts.get(&(law, method)) {
                Some(count) => format!("{} {}/{}", method.name(), count.broken.len(), count.judged),
                None if applies(law, method) => format!("{} -", method.name()),
                None => String::new(),
            });
            lines.push(format!(
                "  {:<12} {}",
                format!("{law:?}"),
                cells.join("   ")
            ));
        }
        let clean = self.clean.iter();
        let clean: Vec<String> = clean
            .map(|(method, n)| format!("{} {n}", method.name()))
            .collect();
        lines.push(format!("  {:<12} {}", "clean", clean.join("   ")));
        for ((law, method), count) in &self.counts {
            for (seed, finding) in count.broken.iter().take(SHOWN) {
                let file = self
                    .folder
                    .join(format!("{law:?}-{}-{seed}.toml", method.name()));
                lines.push(format!(
                    "{law:?}, {}, case {seed}: {finding}\n    twin run {} --no-record",
                    method.name(),
                    file.display()
                ));
            }
        }
        lines.join("\n")
    }

    /// Formats the violations as lines of [`KNOWN`].
    fn found(&self) -> Vec<String> {
        let broken = self
            .counts
            .iter()
            .filter(|(_, count)| !count.broken.is_empty());
        let line = |((law, method), count): (&(Law, Method), &LawCount)| {
            let mut seeds: Vec<u64> = count.broken.iter().map(|(seed, _)| *seed).collect();
            seeds.sort_unstable();
            let seeds: Vec<String> = seeds.iter().map(u64::to_string).collect();
            let (name, method) = (&self.name, method.name());
            format!("{name} {law:?} {method}: {}", seeds.join(" "))
        };
        broken.map(line).collect()
    }

    /// Returns the known violations of these cases.
    fn known(&self, cases: &Range<u64>) -> Vec<String> {
        let prefix = format!("{} ", self.name);
        let lines = KNOWN.lines().filter(|line| line.starts_with(&prefix));
        let among_these = lines.filter_map(|line| {
            let (law_and_method, seeds) = line.split_once(": ")?;
            let seeds = seeds.split(' ').filter(|seed| {
                let seed = seed.parse().expect("known.txt has numbers after a colon");
                cases.contains(&seed)
            });
            let seeds = seeds.collect::<Vec<_>>().join(" ");
            (!seeds.is_empty()).then(|| format!("{law_and_method}: {seeds}"))
        });
        among_these.collect()
    }

    /// Prints the report, and asserts that the violations of `cases` are the known ones; none are
    /// known of cases from [`LISTED`] on, whose violations are printed only.
    pub fn finish(&self, cases: Range<u64>) {
        let report = self.report();
        println!("{report}");
        if cases.end > LISTED {
            return;
        }
        let (known, found) = (self.known(&cases), self.found());
        assert!(
            known == found,
            "violations are not those of tests/rig/battery/known.txt, whose lines for these cases are now:\n{}\n{report}",
            found.join("\n")
        );
    }
}
