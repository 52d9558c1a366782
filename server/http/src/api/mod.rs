//! The REST interface under `/api/v1`: the handlers, by resource. Routes come from the descriptions, so every route is
//! described.

mod access_log;
mod assessments;
mod atlases;
mod audit;
mod backups;
mod blind;
mod certificates;
mod devices;
mod emg_results;
mod events;
mod execution_reports;
mod explanations;
mod exports;
mod figures;
mod gait_motion;
mod gaits;
pub mod health;
mod history;
mod jobs;
mod lab_script_trials;
mod lab_sessions;
mod limit_cycles;
mod local_optima;
mod measurement_files;
mod members;
mod preferences;
mod recommendation;
mod reference_gaits;
mod safety_reports;
mod sensitivities;
mod sessions;
mod sort_column;
mod studies;
mod study_archives;
mod study_comparison;
mod study_sort;
mod subjects;
mod suggestions;
mod tokens;
mod trials;
mod trials_csv;
mod undo;
mod users;
mod walk_controller_files;

use super::AppState;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

/// Every route below `/api/v1`.
pub fn routes() -> OpenApiRouter<AppState> {
    OpenApiRouter::new()
        // who and what
        .routes(routes!(subjects::list, subjects::create))
        .routes(routes!(subjects::get))
        .routes(routes!(subjects::consents, subjects::consent))
        .routes(routes!(subjects::withdraw))
        .routes(routes!(subjects::corrections, subjects::correct))
        .routes(routes!(subjects::muscles, subjects::set_muscles))
        .routes(routes!(reference_gaits::of_subject))
        .routes(routes!(devices::list, devices::create))
        .routes(routes!(devices::get))
        .routes(routes!(reference_gaits::list, reference_gaits::create))
        .routes(routes!(reference_gaits::get))
        // studies
        .routes(routes!(studies::list, studies::create))
        .routes(routes!(studies::get, studies::patch))
        .routes(routes!(studies::start))
        .routes(routes!(studies::pause))
        .routes(routes!(studies::resume))
        .routes(routes!(studies::stop))
        .routes(routes!(studies::extend))
        .routes(routes!(studies::clone_study))
        .routes(routes!(study_comparison::get))
        .routes(routes!(trials::of_study))
        .routes(routes!(trials_csv::download))
        .routes(routes!(recommendation::of_study))
        .routes(routes!(recommendation::of_study_csv))
        .routes(routes!(study_archives::of_study))
        .routes(routes!(study_archives::imports_of_study))
        .routes(routes!(history::of_study))
        .routes(routes!(history::of_study_csv))
        .routes(routes!(atlases::get))
        .routes(routes!(atlases::get_csv))
        .routes(routes!(preferences::of_study, preferences::create))
        .routes(routes!(preferences::of_study_csv))
        .routes(routes!(events::of_study))
        // members of a study and access to it
        .routes(routes!(members::of_study, members::add))
        .routes(routes!(members::get))
        .routes(routes!(members::end))
        .routes(routes!(members::access, members::restrict))
        .routes(routes!(members::invite))
        // trials
        .routes(routes!(trials::get))
        .routes(routes!(trials::cancel))
        .routes(routes!(trials::retry))
        .routes(routes!(trials::iterations))
        .routes(routes!(trials::attempts))
        .routes(routes!(local_optima::of_trial))
        .routes(routes!(gaits::get))
        .routes(routes!(gaits::get_csv))
        .routes(routes!(exports::problem))
        .routes(routes!(exports::motion_file))
        .routes(routes!(exports::controller))
        .routes(routes!(gait_motion::get))
        .routes(routes!(certificates::get, certificates::create))
        .routes(routes!(execution_reports::get, execution_reports::create))
        .routes(routes!(sensitivities::get))
        .routes(routes!(explanations::get, explanations::create))
        // figures
        .routes(routes!(figures::of_study))
        .routes(routes!(figures::of_trial))
        .routes(routes!(figures::of_session))
        .routes(routes!(figures::of_analysis))
        .routes(routes!(figures::of_reference))
        // scripts of the lab
        .routes(routes!(lab_script_trials::ask))
        .routes(routes!(lab_script_trials::tell))
        // blind comparisons
        .routes(routes!(blind::next))
        .routes(routes!(blind::motion))
        .routes(routes!(blind::answer))
        .routes(routes!(blind::raters))
        .routes(routes!(blind::unblind))
        .routes(routes!(blind::unblinded_pairs))
        // lab sessions
        .routes(routes!(lab_sessions::of_study, lab_sessions::create))
        .routes(routes!(lab_sessions::get))
        .routes(routes!(walk_controller_files::controller))
        .routes(routes!(lab_sessions::close))
        .routes(routes!(lab_sessions::unblind))
        .routes(routes!(measurement_files::list))
        .routes(routes!(measurement_files::get))
        .routes(routes!(measurement_files::content))
        .routes(routes!(measurement_files::emg))
        .routes(routes!(measurement_files::joint_angles))
        .routes(routes!(emg_results::get, emg_results::create))
        .routes(routes!(limit_cycles::list))
        .routes(routes!(lab_sessions::session_progress))
        .routes(routes!(lab_sessions::walk))
        .routes(routes!(lab_sessions::answer))
        .routes(routes!(lab_sessions::retract))
        // answers
        .routes(routes!(preferences::get))
        .routes(routes!(preferences::retract))
        .routes(routes!(undo::preference))
        .routes(routes!(suggestions::of_study, suggestions::create))
        .routes(routes!(suggestions::get))
        .routes(routes!(suggestions::retract))
        .routes(routes!(assessments::of_study, assessments::create))
        .routes(routes!(assessments::get))
        .routes(routes!(assessments::retract))
        .routes(routes!(undo::assessment))
        .routes(routes!(safety_reports::of_study))
        .routes(routes!(safety_reports::report))
        .routes(routes!(safety_reports::review))
        // access
        .routes(routes!(users::me))
        .routes(routes!(users::list, users::create))
        .routes(routes!(users::get))
        .routes(routes!(users::link))
        .routes(routes!(users::disable))
        .routes(routes!(users::enable))
        .routes(routes!(users::set_role))
        .routes(routes!(sessions::list))
        .routes(routes!(sessions::end))
        .routes(routes!(tokens::list, tokens::create))
        .routes(routes!(tokens::get))
        .routes(routes!(tokens::revoke))
        // operation
        .routes(routes!(jobs::list))
        .routes(routes!(jobs::get))
        .routes(routes!(jobs::cancel))
        .routes(routes!(jobs::workers))
        .routes(routes!(backups::create))
        .routes(routes!(backups::get))
        .routes(routes!(audit::list))
        .routes(routes!(access_log::list))
        .routes(routes!(health::get))
}
