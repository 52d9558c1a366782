//! The tuning loop, and the rules for studies and trials.
//!
//! The rules ([`lifecycle`], [`trial_transitions`], [`trial_choice`], [`pending_comparison`]) are pure functions of the record. The
//! [`Scheduler`](scheduler::Scheduler) applies them: it proposes trials, dispatches solves and records results. All its
//! state is in the record, so a new process continues where a killed one stopped.

pub mod analysis;
pub mod archive;
pub mod assessment;
pub mod atlas;
pub mod blind;
pub mod bound_grid;
pub mod built_in_entries;
pub mod certificate_request;
pub mod certification;
pub mod certified_best;
mod certifier;
pub mod command;
pub mod consent;
pub mod device;
pub mod equal_actions;
pub mod execution;
pub mod execution_request;
mod explainer;
pub mod explanation;
pub mod gait_utilities;
pub mod history;
pub mod job_status;
mod jobs_after_solves;
pub mod lab;
pub mod lab_script;
pub mod lifecycle;
pub mod membership;
pub mod nearest_reference;
mod next_step;
pub mod pair_answer;
pub mod pending_comparison;
mod planning_tasks;
pub mod preference;
pub mod pruning;
pub mod ranking;
pub mod reference_import;
pub mod reference_preview;
pub mod relaxed_trial;
pub mod retention;
pub mod safety_report;
pub mod safety_reports;
pub mod safety_review;
pub mod same_motion;
pub mod sample_study;
pub mod scheduler;
pub mod seed;
pub mod sensitivities;
pub mod snapshot;
pub mod solve_input;
pub mod study_change;
pub mod study_plan;
pub mod study_plan_schemas;
pub mod subject;
pub mod suggestion;
pub mod summary;
pub mod trial_choice;
mod trial_jobs;
mod trial_queue;
pub mod trial_result;
pub mod trial_transitions;
pub mod utility_history;
mod walk_simulator;
pub mod walkable;
