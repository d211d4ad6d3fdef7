//! Outliers among the rows of a study of coupling.

use twinrig_report::number::si;

use super::{CouplingKind, CouplingMethod, CouplingStudy};
use crate::outliers::{Neighbour, append_reason, contradicting, contradiction};
use crate::plants::row::Status;

impl CouplingStudy {
    /// Marks the rows that contradict their neighbours.
    pub(crate) fn mark_contradictions(&mut self) {
        let plants: Vec<String> = self.plants().into_iter().map(str::to_owned).collect();
        let mut found = Vec::new();
        for plant in &plants {
            let floor = self.floor_of(plant);
            for kind in [CouplingKind::Together, CouplingKind::Alone] {
                for method in CouplingMethod::ALL {
                    let rows = self.rows.iter().enumerate().filter(|(_, row)| {
                        row.plant == *plant && row.kind == kind && row.method == method
                    });
                    let error = rows.map(|(place, row)| {
                        let error = row.error_rms_m.filter(|_| row.status == Status::Ok);
                        (place, error.map(|error| error.max(floor)))
                    });
                    let (places, errors): (Vec<usize>, Vec<Option<f64>>) = error.unzip();
                    for (n, neighbours) in contradicting(&errors, true) {
                        let neighbours = neighbours.map(|n| Neighbour {
                            result: si(errors[n].unwrap_or_default(), "m"),
                            setting: si(self.rows[places[n]].step_s, "s"),
                        });
                        found.push((places[n], neighbours));
                    }
                }
            }
        }
        for (place, neighbours) in found {
            let row = &mut self.rows[place];
            row.contradicts = true;
            row.why = Some(append_reason(row.why.take(), contradiction(neighbours)));
        }
    }
}
