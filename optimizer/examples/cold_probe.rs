//! Development probe: cold and warm solves.
use gait_optimizer::*;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let verbose = args.iter().any(|a| a == "-v");
    for (s, m) in [(1, false), (1, true), (2, false), (2, true)] {
        if args.iter().any(|a| a == "-n") && m {
            continue;
        }
        if args.iter().any(|a| a == "-m") && !m {
            continue;
        }
        let problem = GaitProblem::new(Subject::builtin(s).unwrap(), m).unwrap();
        let o = solve(
            &problem,
            None,
            &SolveOptions { threads: 2, max_iterations: 400, ..Default::default() },
            &mut |r| {
                if verbose {
                    eprintln!(
                        "{:?} {} obj {:.8} viol {:.1e} dual {:.1e} mu {:.1e} a {:.3}",
                        r.phase,
                        r.iteration,
                        r.objective,
                        r.constraint_violation,
                        r.dual_infeasibility,
                        r.barrier,
                        r.step
                    )
                }
            },
            &CancelToken::new(),
        )
        .unwrap();
        let r = &o.report;
        println!(
            "s{s} {m} {:?} it {} obj {:.8} cot {:.6} rmse {:.4} viol {:.1e} t {:.2} (eval {:.2} la {:.2}) speed {:.4} T {:?}",
            r.status,
            r.iterations,
            r.objective,
            r.cost_of_transport,
            r.gait_rmse_rad,
            r.max_violation,
            r.seconds_total,
            r.seconds_evaluation,
            r.seconds_linear_algebra,
            r.speed_m_s,
            r.durations_s.map(|t| (t * 1000.).round())
        );
        for v in o.violations.iter().take(3) {
            println!("   {} {} {}", v.row, v.amount, v.unit);
        }
    }
}
