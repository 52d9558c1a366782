//! Figures of studies, trials, lab sessions, analyses and reference gaits, for pages and for downloads.

pub(crate) mod analysis;
pub(crate) mod atlas_maps;
mod cost_and_rmse;
pub(crate) mod lab_charts;
pub(crate) mod lab_session;
pub(crate) mod maps_over_two_bounds;
mod outcome;
pub(crate) mod recording_traces;
pub(crate) mod reference_figures;
pub(crate) mod study;
mod study_progress;
mod study_results;
pub(crate) mod trial;
pub(crate) mod trials_by_bound;
mod utility;

pub(crate) use cost_and_rmse::cost_and_rmse;
pub(crate) use outcome::StudyOutcome;
pub(crate) use study_progress::{PROGRESS, progress_chart, warm_starts};
pub(crate) use study_results::{MAX_IN_A_CHART, StudyResults, have_one_reference_gait};
pub(crate) use utility::utility;
