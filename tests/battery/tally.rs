//! What a battery found, law by law and method by method.

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::case::Method;
use crate::law::{Finding, Law, applies};
use crate::run::Run;

/// Violations of a law by a method that are printed; all are counted and written.
const SHOWN: usize = 5;

/// Laws that do not hold yet: violations are counted, and not asserted. A case that cannot be built fails in any case.
const AWAITED: [(Law, Method); 22] = [
    (Law::Refusal, Method::Rk4),
    (Law::Refusal, Method::Rodas4),
    (Law::Refusal, Method::Moreau),
    (Law::Refusal, Method::Massless),
    (Law::Penetration, Method::Rk4),
    (Law::Penetration, Method::Rodas4),
    (Law::Penetration, Method::Moreau),
    (Law::Penetration, Method::Massless),
    (Law::Dissipation, Method::Rk4),
    (Law::Dissipation, Method::Rodas4),
    (Law::Dissipation, Method::Moreau),
    (Law::Dissipation, Method::Massless),
    (Law::Energy, Method::Rk4),
    (Law::Energy, Method::Rodas4),
    (Law::Energy, Method::Moreau),
    (Law::Energy, Method::Massless),
    (Law::Momentum, Method::Rk4),
    (Law::Momentum, Method::Rodas4),
    (Law::Friction, Method::Rk4),
    (Law::Friction, Method::Rodas4),
    (Law::Friction, Method::Moreau),
    (Law::Friction, Method::Massless),
];

#[derive(Default)]
struct Count {
    judged: u64,
    broken: Vec<(u64, Finding)>,
}

/// Counts of what was judged and broken.
pub struct Tally {
    folder: PathBuf,
    cases: u64,
    counts: BTreeMap<(Law, Method), Count>,
}

impl Tally {
    /// Files of cases that break a law go to a folder of that name.
    pub fn new(name: &str) -> Self {
        Self {
            folder: PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name),
            cases: 0,
            counts: BTreeMap::new(),
        }
    }

    /// Judges a run by laws.
    pub fn take(&mut self, laws: &[Law], run: &Result<Run, String>) {
        self.cases += 1;
        let run = run.as_ref().unwrap_or_else(|error| panic!("{error}"));
        for &law in laws {
            let Some(finding) = law.judge(run) else {
                continue;
            };
            let count = self.counts.entry((law, run.case.method)).or_default();
            count.judged += 1;
            if finding.is_violation() {
                let path = self.folder.join(format!(
                    "{law:?}-{}-{}.toml",
                    run.case.method.name(),
                    run.case.seed
                ));
                let text = format!("# {law:?}: {finding}\n{}", run.case.scenario());
                let written = std::fs::create_dir_all(&self.folder)
                    .and_then(|()| std::fs::write(&path, text));
                if let Err(error) = written {
                    panic!("{}: {error}", path.display());
                }
                count.broken.push((run.case.seed, finding));
            }
        }
    }

    /// The table, and the first violations with the command that repeats each.
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

    /// Panics with the report where a law is broken.
    pub fn close(&self) {
        let report = self.report();
        let held = |(law, method): &(Law, Method)| !AWAITED.contains(&(*law, *method));
        let judged = self.counts.iter().filter(|(which, _)| held(which));
        let broken: usize = judged.map(|(_, count)| count.broken.len()).sum();
        assert!(broken == 0, "{report}");
        println!("{report}");
    }
}
