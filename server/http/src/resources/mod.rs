//! Resources of REST, made from rows of the record and from results of the optimiser.
//!
//! A type here has the name that it has in the description, which is mostly that of its row. Handlers import it, and name
//! the row with its module: `Trial` and `trials::Trial`. Each conversion names every field of the row, so no new column is
//! served by accident.
//!
//! Identifiers, times and enumerations such as `StudyState` come from the store, because every layer uses them. Commands
//! and results of rules that contain no row are types of the service. Settings and the files of the optimiser are served as
//! they are ([`documents`]).

pub(crate) mod access_log;
pub(crate) mod assessments;
pub(crate) mod atlases;
pub(crate) mod audit;
pub(crate) mod certificates;
pub(crate) mod devices;
pub(crate) mod document_schemas;
pub(crate) mod emg;
pub(crate) mod events;
pub(crate) mod execution_reports;
pub(crate) mod explanations;
pub(crate) mod feedback;
pub(crate) mod imports;
pub(crate) mod jobs;
pub(crate) mod lab_sessions;
pub(crate) mod limit_cycles;
pub(crate) mod local_optima;
pub(crate) mod measurement_files;
pub(crate) mod members;
pub(crate) mod reference_gaits;
pub(crate) mod safety_reviews;
pub(crate) mod sensitivities;
pub(crate) mod sessions;
pub(crate) mod solve_reports;
pub(crate) mod stick_figures;
pub(crate) mod studies;
pub(crate) mod subjects;
pub(crate) mod suggestions;
pub(crate) mod tokens;
pub(crate) mod trials;
pub(crate) mod users;
