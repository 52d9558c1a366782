//! Development probe of the cold start.
use gait_optimizer::cold_start::{GuessSettings, motion, muscles, posture};
use gait_optimizer::gait_problem::GaitProgramme;
use gait_optimizer::nlp::{self, BoundMultiplierStart, NlpSettings, StartPoint};
use gait_optimizer::{Device, GaitSettings, ReferenceGait, Subject, TunedBounds};
fn run(name: &str, p: &GaitProgramme, x: Vec<f64>, mu: f64, tol: f64, verbose: bool) -> nlp::NlpResult {
    let settings = NlpSettings {
        tolerance: tol,
        mu_initial: mu,
        bound_push: 1e-2, bound_fraction: 1e-2,
        bound_multiplier_start: BoundMultiplierStart::Centred,
        max_iterations: 600,
        threads: 2,
        ..NlpSettings::default()
    };
    let r = nlp::solve(p, &StartPoint::Cold(x), &settings, &mut |r| if verbose {eprintln!("{} {:?} obj {:.8} viol {:.1e} dual {:.1e} compl {:.1e} mu {:.1e} a {:.2} {:.2} dw {:.1e} tr {}", r.number, r.phase, r.objective, r.violation, r.dual_infeasibility, r.complementarity, r.mu, r.alpha_primal, r.alpha_dual, r.delta_w, r.trials)}, &|| false).unwrap();
    println!("{name}: {:?} it {} obj {:.8} viol {:.1e} time {:.2}s (eval {:.2} fac {:.2} solve {:.2}) facs {} mcot {:.6}", r.status, r.iterations, r.objective, r.residuals.violation, r.timing.total, r.timing.evaluation, r.timing.factorisation, r.timing.backsolves, r.counts.factorisations, p.objective_parts(&r.x).cost_of_transport);
    r
}
fn main() {
    let verbose = std::env::args().any(|a| a == "-v");
    for s in [1, 2] {
        let new = |m| GaitProgramme::new(&Subject::builtin(s).unwrap(), &Device::ampro3().unwrap(), &TunedBounds::default(), m, &GaitSettings::default(), &ReferenceGait::builtin().unwrap()).unwrap();
        let plain = new(false);
        let full = new(true);
        let guess = GuessSettings::default();
        let t = std::time::Instant::now();
        let postures = posture::solve(&plain, &guess).unwrap();
        println!("posture {:?}", t.elapsed());
        let x = motion::guess(&plain, &postures, &guess);
        let v = plain.violations(&x);
        for v in v.iter().take(5) { println!("  {:?} {}", v, v.row.map(|r| plain.rows.names[r].label()).unwrap_or_default()); }
        let r1 = run("track", &plain.for_tracking(10.0), x, 1e-3, 1e-3, verbose);
        let r2 = run("cost", &plain, r1.x.clone(), 1e-4, 1e-6, verbose);
        let _ = r2;
        let t = std::time::Instant::now();
        let xm = muscles::guess(&full, &plain, &r1.x).unwrap();
        println!("muscle guess {:?}", t.elapsed());
        let r3 = run("muscle track", &full.for_tracking(10.0), xm, 1e-2, 1e-3, verbose);
        run("muscle cost", &full, r3.x.clone(), 1e-4, 1e-6, verbose);
    }
}
