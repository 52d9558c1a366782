//! `gaitwright sweep`: optimises a gait for each row of a table of actions, in parallel. Results keep the order of the
//! rows.

use super::command_end::CommandEnd;
use super::cores::cores_or;
use super::flag_numbers::workers;
use super::input_file::read;
use super::interruption::cancelled_by_signal;
use super::out_file::OutFile;
use super::output::{data, tell};
use super::problem_flags::ProblemFlags;
use super::solve::status_word;
use clap::Args;
use gait_optimizer::{
    CancelToken, GaitProblem, SolveError, SolveOptions, SolveOutcome, SolveStatus, TunedBounds, WarmStart, solve,
};
use gaitwright_charts::csv_table::{CsvCell, CsvTable, cells};
use gaitwright_compute::Pool;
use gaitwright_service::error::Error;
use indicatif::ProgressBar;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;

#[derive(Debug, Args)]
pub(super) struct SweepCommand {
    #[command(flatten)]
    flags: ProblemFlags,
    /// CSV file of actions with the header a1,a2,a3,a4,a5,a6,a7,a8.
    #[arg(long, value_name = "FILE.csv")]
    actions: PathBuf,
    /// Output file with one row for each action, in the same order. Until it is complete, rows are in a hidden file
    /// next to it (.NAME.csv.PID.part, with the process ID), which remains if the process is killed.
    #[arg(long, value_name = "FILE.csv")]
    out: PathBuf,
    /// Number of solves that run in parallel (default: number of cores).
    #[arg(long, value_name = "NUMBER", value_parser = workers, allow_negative_numbers = true)]
    workers: Option<usize>,
}

/// The columns after the action. Scripts rely on them.
const COLUMNS: [&str; 6] =
    ["status", "iterations", "seconds_total", "cost_of_transport", "gait_rmse_rad", "max_violation"];

type SweepResult = Result<SolveOutcome, SolveError>;

impl SweepCommand {
    pub(super) async fn run(self) -> Result<CommandEnd, Error> {
        let actions = actions(&self.actions)?;
        let problem = self.flags.problem(TunedBounds::default())?;
        let (start, options) = (self.flags.warm_start(None)?, self.flags.options()?);
        if let Some(start) = &start {
            tell(&format!("every row starts from {}", start.gait.in_words()));
        }
        let warm = start.map(|start| start.point);
        let mut inputs = self.flags.inputs();
        inputs.push(&self.actions);
        // Before there is a file to leave behind.
        let cancel = cancelled_by_signal();
        let out = OutFile::open(&self.out, &inputs)?;
        tell(&format!("partial results: {}", out.part().display()));
        let workers = cores_or(self.workers);
        let stopped = cancel.clone();
        let pool = Pool::new(1);
        let table = pool.run(move |_| {
            let mut table = SweepTable::begin(out);
            solve_all(&problem, &actions, warm.as_ref(), &options, workers, &cancel, &mut table);
            table
        });
        table.await?.end(stopped.is_cancelled())
    }
}

/// The table of results. Each row is written as soon as all earlier ones are.
struct SweepTable {
    out: OutFile,
    /// A write error. All rows are printed at the end then, so that hours of solving are not lost.
    unwritten: Option<Error>,
    text: String,
    rows: usize,
    converged: usize,
    /// An error that all rows have in common, which becomes the error of the command.
    refused: Option<SolveError>,
}

impl SweepTable {
    fn begin(out: OutFile) -> Self {
        let mut table = Self { out, unwritten: None, text: String::new(), rows: 0, converged: 0, refused: None };
        table.line(TunedBounds::NAMES.iter().chain(&COLUMNS).map(|name| CsvCell::from(*name)).collect());
        table
    }

    fn add(&mut self, action: &TunedBounds, answer: SweepResult) {
        let mut row: Vec<CsvCell> = action.to_array().iter().map(CsvCell::from).collect();
        match answer {
            Ok(outcome) => {
                let r = &outcome.report;
                self.converged += usize::from(r.status == SolveStatus::Converged);
                row.extend(cells![
                    status_word(r.status),
                    r.iterations,
                    format!("{:.3}", r.seconds_total),
                    finite(r.cost_of_transport),
                    finite(r.gait_rmse_rad),
                    finite(r.max_violation),
                ]);
                self.rows += 1;
            }
            Err(error) => {
                tell(&format!("{}: {error}", action.to_array().map(|value| value.to_string()).join(",")));
                row.extend([status_word(SolveStatus::Stalled), "", "", "", "", ""].map(CsvCell::from));
                self.refused = Some(error);
            }
        }
        self.line(row);
    }

    fn line(&mut self, cells: Vec<CsvCell>) {
        let mut table = CsvTable::default();
        table.row(cells);
        let line = table.into_text();
        if self.unwritten.is_none() {
            self.unwritten = self.out.append(&line).err();
        }
        self.text.push_str(&line);
    }

    fn end(self, stopped: bool) -> Result<CommandEnd, Error> {
        if let (0, Some(error)) = (self.rows, self.refused) {
            return Err(error.into());
        }
        let path = self.out.path().display().to_string();
        if stopped {
            data(self.text.trim_end())?;
            tell(&format!("stopped: the rows were written to standard output; {path} was not written"));
            return Ok(CommandEnd::Interrupted);
        }
        if let Err(error) = self.unwritten.map_or_else(|| self.out.finish(), Err) {
            data(self.text.trim_end())?;
            return Err(error);
        }
        let rows = self.text.lines().count() - 1;
        tell(&format!("{} of {rows} converged; written to {path}", self.converged));
        Ok(CommandEnd::Done)
    }
}

/// Reads and checks every row before anything is solved.
fn actions(path: &Path) -> Result<Vec<TunedBounds>, Error> {
    let text = read(path)?;
    let mut reader = csv::ReaderBuilder::new();
    let mut reader = reader.trim(csv::Trim::All).comment(Some(b'#')).flexible(true).from_reader(text.as_bytes());
    let malformed = |reason: String| Error::Malformed(format!("{}: {reason}", path.display()));
    let header = reader.headers().map_err(|e| malformed(e.to_string()))?.clone();
    if header.iter().ne(TunedBounds::NAMES) {
        let found = header.iter().collect::<Vec<_>>().join(",");
        return Err(malformed(format!("The header is {found:?}; it must be {:?}.", TunedBounds::NAMES.join(","))));
    }
    let mut actions = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|e| malformed(e.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        if record.len() != TunedBounds::COUNT {
            let reason = format!("the number of cells is {}; it must be {}", record.len(), TunedBounds::COUNT);
            return Err(malformed(format!("line {line}: {reason}.")));
        }
        let mut values = [0.0; TunedBounds::COUNT];
        for ((value, cell), name) in values.iter_mut().zip(&record).zip(TunedBounds::NAMES) {
            *value = cell
                .parse()
                .map_err(|_| malformed(format!("line {line}: {name} is {cell:?}, which is not a number.")))?;
        }
        actions.push(TunedBounds::from_array(values).map_err(|e| malformed(format!("line {line}: {e}")))?);
    }
    if actions.is_empty() {
        return Err(malformed("The table has no rows.".to_owned()));
    }
    Ok(actions)
}

fn solve_all(
    problem: &GaitProblem,
    actions: &[TunedBounds],
    warm: Option<&WarmStart>,
    options: &SolveOptions,
    workers: usize,
    cancel: &CancelToken,
    table: &mut SweepTable,
) {
    let bar = ProgressBar::new(actions.len() as u64);
    bar.tick();
    let next = AtomicUsize::new(0);
    let (sender, receiver) = mpsc::channel();
    std::thread::scope(|scope| {
        for _ in 0..workers.min(actions.len()) {
            let (sender, next) = (sender.clone(), &next);
            scope.spawn(move || {
                loop {
                    let row = next.fetch_add(1, Ordering::Relaxed);
                    let Some(action) = actions.get(row) else { return };
                    let problem = GaitProblem { bounds: *action, ..problem.clone() };
                    let answer = solve(&problem, warm, options, &mut |_| {}, cancel);
                    // Cannot fail: the receiver lives as long as this scope.
                    let _ = sender.send((row, answer));
                }
            });
        }
        drop(sender);
        let mut early: BTreeMap<usize, SweepResult> = BTreeMap::new();
        let mut due = 0;
        for (row, answer) in receiver {
            bar.inc(1);
            early.insert(row, answer);
            while let Some(answer) = early.remove(&due) {
                table.add(&actions[due], answer);
                due += 1;
            }
        }
    });
    bar.finish_and_clear();
}

/// The number, if it is finite.
fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}
