//! Memory reuse: after one problem of a size, the next allocates nothing.

use twinrig_contact::{Bound, Method, Restitution};

use crate::agreement::SWEEPS;
use crate::oracle::Case;

#[test]
fn second_problem_of_a_size_does_not_allocate() {
    let j = [
        [1.0, 0.2, -0.3, 0.1],
        [0.1, 1.0, 0.4, 0.0],
        [-0.2, 0.3, 1.0, 0.5],
    ];
    let bounds = vec![
        Bound::NonNegative,
        Bound::Disc {
            normal: 0,
            friction: 0.4,
        },
        Bound::DiscSecond,
    ];
    let case = Case::new(&j.map(Vec::from), vec![-1.0, 2.0, 0.5], bounds, 0.0);
    for method in [Method::Newton, Method::Direct, SWEEPS] {
        let mut problem = case.problem();
        let all = |problem: &mut twinrig_contact::Problem| {
            case.fill(problem);
            problem.solve_by(method).unwrap();
            for law in [Restitution::Newton, Restitution::Poisson] {
                problem
                    .impact(law, &case.b, &[0.5, 0.0, 0.0], method)
                    .unwrap();
            }
        };
        all(&mut problem);
        let counted = allocation_counter::measure(|| all(&mut problem));
        assert_eq!(counted.count_total, 0, "{method:?}");
    }
}
