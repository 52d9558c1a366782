//! Simple regret of a method on seeded benchmark problems.
//!
//! ```text
//! cargo run --release -p gait-learner --example regret -- --problem table1|hart3|hart6|atlas1|atlas1m --seeds A..B --method NAME
//!     --comparisons N [--noise S] [--lengthscale L] [--batch N] [--set '{"setting": value}'] --out FILE.csv
//! cargo run --release -p gait-learner --example regret -- --problem ATLAS.csv [--columns NAME,...] --seeds A..B ...
//! cargo run --release -p gait-learner --example regret -- --summarise FILE.csv...
//! ```
//!
//! NAME is `random` (random actions, the winner is recommended), a method (`linecospar`, `eubo`, `thompson`,
//! `information_gain`) with recommended settings, a method with the suffix `_published`, or `eubo_uncertain` (EUBO for
//! noisy feedback).
//!
//! `atlas1` and `atlas1m` are the gaits of subject 1 without and with muscles, and `--problem ATLAS.csv` reads another table of
//! `gaitwright atlas`. Each seed is a person. `--people low_results` (default) have a utility that is a random mixture of the
//! columns, of which low values are better; `ideal_results` want the columns, and `ideal_motion` the joint angles, near those
//! of an ideal between two gaits.
//!
//! For these problems, `--known-gaits on` proposes no action with the gait of a visited one, as studies do, and
//! `--inactive-bounds on` lets the learner ignore bounds that were active in no visited gait. With `--joint-angles L`,
//! actions are as alike as the joint angles of their gaits, with lengthscale `L`, and each gait is proposed once.
//!
//! Writes rows `method,seed,k,regret`: regret after `k` comparisons, that is `k + 1` visited actions. Prints quartiles.
//! Regret is 1 minus the utility of the recommended action. `--noise S` adds logistic noise of scale `S` to the
//! utility. `--batch N` proposes `N` actions at a time. `--set` changes settings. `--seeds A..B` excludes `B`.
//!
//! `--summarise` reads such files. It prints medians with bootstrap intervals and quartiles. It compares each further
//! file with the first one, by seed: wins, losses, and p-values of the sign test and of Wilcoxon's signed-rank test.

#![allow(clippy::expect_used, unreachable_pub, missing_docs)]

mod joint_angles;
mod problems;
mod simulation;
mod summary;
mod table;

use std::error::Error;
use std::io::Write;
use std::time::Instant;

use gait_learner::LearnerSettings;
use problems::{Knowledge, Problem};
use simulation::{Person, champion, run};
use summary::{Curves, quantile, report};
use table::{DEFAULT_COLUMNS, People, Table};

struct Options {
    problem: String,
    seeds: std::ops::Range<u64>,
    method: String,
    comparisons: usize,
    noise: f64,
    lengthscale: Option<f64>,
    columns: String,
    people: People,
    joint_angles: Option<f64>,
    batch: usize,
    knowledge: Knowledge,
    set: serde_json::Map<String, serde_json::Value>,
    out: Option<String>,
}

/// Parses a finite number of at least `least`.
fn number(name: &str, value: &str, least: f64) -> Result<f64, String> {
    match value.parse::<f64>() {
        Ok(number) if number.is_finite() && number >= least => Ok(number),
        _ => Err(format!("{name}: {value} is not a number of at least {least}")),
    }
}

/// Parses `on` or `off`.
fn switch(name: &str, value: &str) -> Result<bool, String> {
    match value {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err(format!("{name}: {value} is not on or off")),
    }
}

fn options() -> Result<Options, Box<dyn Error>> {
    let mut options = Options {
        problem: "table1".into(),
        seeds: 200..400,
        method: "linecospar".into(),
        comparisons: 50,
        noise: 0.0,
        lengthscale: None,
        columns: DEFAULT_COLUMNS.into(),
        people: People::default(),
        joint_angles: None,
        batch: 1,
        knowledge: Knowledge::default(),
        set: serde_json::Map::new(),
        out: None,
    };
    let mut arguments = std::env::args().skip(1);
    while let Some(name) = arguments.next() {
        let value = arguments.next().ok_or_else(|| format!("{name} needs a value"))?;
        match name.as_str() {
            "--problem" => options.problem = value,
            "--seeds" => {
                let (from, to) = value.split_once("..").ok_or("--seeds needs A..B")?;
                options.seeds = from.parse()?..to.parse()?;
                if options.seeds.is_empty() {
                    return Err(format!("--seeds {value} is empty: A..B excludes B").into());
                }
            }
            "--method" => options.method = value,
            "--comparisons" => options.comparisons = value.parse()?,
            "--noise" => options.noise = number(&name, &value, 0.0)?,
            "--lengthscale" => options.lengthscale = Some(number(&name, &value, 1e-6)?),
            "--columns" => options.columns = value,
            "--people" => options.people = People::named(&value).ok_or_else(|| format!("unknown people {value}"))?,
            "--joint-angles" => options.joint_angles = Some(number(&name, &value, 1e-6)?),
            "--batch" => options.batch = value.parse::<usize>()?.max(1),
            "--known-gaits" => options.knowledge.gaits = switch(&name, &value)?,
            "--inactive-bounds" => options.knowledge.inactive = switch(&name, &value)?,
            "--set" => options.set = serde_json::from_str(&value)?,
            "--out" => options.out = Some(value),
            _ => return Err(format!("unknown option {name}").into()),
        }
    }
    if options.joint_angles.is_some() && options.knowledge.inactive {
        return Err("--inactive-bounds: the learner knows no bounds with --joint-angles".into());
    }
    Ok(options)
}

/// The settings of the method with the changes of `--set`.
fn settings(options: &Options) -> Result<LearnerSettings, Box<dyn Error>> {
    let mut document = if options.method == "eubo_uncertain" {
        serde_json::to_value(LearnerSettings::for_uncertain_answers())?
    } else if let Some(name) = options.method.strip_suffix("_published") {
        serde_json::to_value(LearnerSettings::published(serde_json::from_value(name.into())?))?
    } else {
        serde_json::json!({ "method": options.method })
    };
    document.as_object_mut().ok_or("settings are an object")?.extend(options.set.clone());
    Ok(serde_json::from_value(document)?)
}

/// Prints the summary of the files.
fn summarise(files: &[String]) -> Result<(), Box<dyn Error>> {
    let curves = files
        .iter()
        .map(|file| {
            let text = std::fs::read_to_string(file).map_err(|error| format!("{file}: {error}"))?;
            Ok((file.clone(), Curves::read(&text).map_err(|error| format!("{file}: {error}"))?))
        })
        .collect::<Result<Vec<_>, String>>()?;
    print!("{}", report(&curves));
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let Some((first, files)) = arguments.split_first()
        && first == "--summarise"
    {
        return summarise(files);
    }
    let options = options()?;
    let settings = if options.method == "random" { None } else { Some(settings(&options)?) };
    let mut out = options.out.as_ref().map(std::fs::File::create).transpose()?;
    if let Some(out) = &mut out {
        writeln!(out, "method,seed,k,regret")?;
    }
    let path = std::path::Path::new(&options.problem);
    let is_table = path.extension().is_some_and(|extension| extension == "csv");
    let table = match Table::built_in(&options.problem, &options.columns) {
        None if is_table => Some(Table::read(path, &options.columns)),
        built_in => built_in,
    };
    let table = match (table.transpose()?, options.joint_angles) {
        (Some(table), Some(lengthscale)) => Some(table.described_by_joint_angles(lengthscale)?),
        (None, Some(_)) => return Err("--joint-angles: the problem has no gaits".into()),
        (table, None) => table,
    };
    let start = Instant::now();
    let mut curves = Vec::new();
    for seed in options.seeds.clone() {
        let problem = match &table {
            Some(table) => table.person(options.people, seed),
            None => Problem::named(&options.problem, seed, options.lengthscale).ok_or("unknown problem")?,
        };
        let person = Person::new(&problem, options.noise, seed);
        let regrets = match &settings {
            Some(settings) => run(person, settings, options.comparisons, options.batch, options.knowledge)?,
            None => champion(person, options.comparisons),
        };
        if let Some(out) = &mut out {
            for (k, regret) in regrets.iter().enumerate() {
                writeln!(out, "{},{seed},{k},{regret:.6}", options.method)?;
            }
        }
        curves.push(regrets);
    }
    let seconds = start.elapsed().as_secs_f64();
    for k in [5, 10, 15, 20, 30, 50, 75, 100].into_iter().filter(|&k| k <= options.comparisons) {
        let mut at: Vec<f64> = curves.iter().map(|c| c[k]).collect();
        at.sort_by(f64::total_cmp);
        let mean = at.iter().sum::<f64>() / at.len() as f64;
        print!(
            "k={k}: {:.3} [{:.3}, {:.3}] mean {mean:.3}   ",
            quantile(&at, 0.5),
            quantile(&at, 0.25),
            quantile(&at, 0.75)
        );
    }
    let trials = curves.len() * (options.comparisons + 1);
    println!("{} runs, {:.2} ms a trial", curves.len(), 1e3 * seconds / trials.max(1) as f64);
    Ok(())
}
