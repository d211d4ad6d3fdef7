//! The plant, seen from outside.

mod golden;
mod scene;

#[test]
fn probe() {
    use twinrig_mujoco::*;
    for name in ["between", "passive", "hard-hit", "loose", "hard-light"] {
        for c in Coordinates::ALL {
            for i in [Integrator::Euler, Integrator::Rk4] {
                for us in [2000, 1000, 500, 100] {
                    let r = std::panic::catch_unwind(|| {
                        golden::far(
                            name,
                            |s| {
                                let mut o = Options::new(s, c);
                                o.numerics.integrator = i;
                                o
                            },
                            us,
                        )
                    });
                    match r {
                        Ok(f) => println!(
                            "{name:14} {:8} {:13} {us:5} rms {:.2e} worst {:.2e} lost {:.4e} {:.4e} drift {:.1e} res {:.1e}",
                            c.name(),
                            i.name(),
                            f.rms,
                            f.worst,
                            f.lost[0],
                            f.lost[1],
                            f.drift,
                            f.residual
                        ),
                        Err(_) => println!("{name} {} {} {us} PANIC", c.name(), i.name()),
                    }
                }
            }
        }
    }
}
