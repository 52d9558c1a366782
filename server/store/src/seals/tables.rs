//! The tables whose rows have seals or checksums, and the keys of their rows.

use super::super::{Connection, StoreResult};
use super::JOINT;

/// A table whose rows are sealed.
#[derive(Debug, Clone, Copy)]
pub struct Sealed {
    /// Its name.
    pub table: &'static str,
    /// Its primary key.
    pub key: &'static [&'static str],
    /// Whether the columns of the key may contain any text, so that they are joined in hexadecimal.
    pub(super) hex: bool,
}

const fn sealed(table: &'static str, key: &'static [&'static str]) -> Sealed {
    Sealed { table, key, hex: false }
}

/// Tables with seals: everything that was measured, answered, decided or permitted. A column that is added later must
/// be null in existing rows, or the rows must be written again.
pub const TABLES: &[Sealed] = &[
    sealed("subjects", &["id"]),
    sealed("consents", &["seq"]),
    sealed("subject_muscles", &["seq"]),
    sealed("subject_corrections", &["seq"]),
    sealed("devices", &["id"]),
    sealed("reference_gaits", &["id"]),
    sealed("studies", &["id"]),
    sealed("trials", &["id"]),
    sealed("gaits", &["trial_id"]),
    sealed("other_local_optima", &["trial_id", "number"]),
    sealed("attempts", &["trial_id", "attempt"]),
    sealed("certificates", &["trial_id", "format_version"]),
    sealed("explanation_requests", &["trial_id"]),
    sealed("explanations", &["trial_id", "created_at"]),
    sealed("feedback", &["seq"]),
    sealed("feedback_retractions", &["feedback_seq"]),
    sealed("blind_pairs", &["id"]),
    sealed("blind_pair_answers", &["pair_id"]),
    sealed("blind_pair_retractions", &["pair_id"]),
    sealed("blind_pair_allocations", &["pair_id"]),
    sealed("rater_unblindings", &["seq"]),
    sealed("assessments", &["id"]),
    sealed("assessment_retractions", &["assessment_id"]),
    sealed("safety_reports", &["id"]),
    sealed("safety_reviews", &["id"]),
    sealed("safety_review_reports", &["review_id", "report_id"]),
    sealed("lab_sessions", &["id"]),
    sealed("lab_allocations", &["lab_session_id"]),
    sealed("controller_file_downloads", &["id"]),
    sealed("lab_session_steps", &["lab_session_id", "step"]),
    sealed("lab_answers", &["lab_session_id", "number"]),
    sealed("lab_answer_retractions", &["lab_session_id", "number"]),
    sealed("measurement_files", &["id"]),
    sealed("emg_results", &["id"]),
    sealed("users", &["id"]),
    sealed("tokens", &["id"]),
    sealed("study_members", &["id"]),
    sealed("study_member_ends", &["member_id"]),
    sealed("study_restrictions", &["seq"]),
    sealed("access_log", &["seq"]),
    sealed("access_prunings", &["seq"]),
    sealed("imports", &["seq"]),
];

/// Tables with checksums: their rows change often, or only repeat other data.
pub const CHECKED: &[Sealed] = &[
    sealed("events", &["seq"]),
    sealed("solve_inputs", &["sha256"]),
    sealed("solve_jobs", &["id"]),
    Sealed { table: "idempotency_keys", key: &["actor", "key"], hex: true },
    sealed("sessions", &["hash"]),
    sealed("sign_in_links", &["hash"]),
    sealed("clock", &["id"]),
    Sealed { table: "sign_in_failures", key: &["name", "source"], hex: true },
    sealed("sign_in_sources", &["network"]),
    sealed(MIGRATIONS, &["version"]),
];

/// Tables without either: the chains themselves, and the table of checksums.
pub const NOT_SEALED: &[&str] = &["audit", "seals", "checksums"];

/// The table of applied migrations.
pub(super) const MIGRATIONS: &str = "_sqlx_migrations";

impl Sealed {
    /// SQL for the key of a row as text; `row` is `new.`, `old.`, or the table and a dot.
    pub(super) fn key_of(&self, row: &str) -> String {
        let column = |column| if self.hex { format!("hex({row}{column})") } else { format!("{row}{column}") };
        let columns: Vec<String> = self.key.iter().map(column).collect();
        columns.join(&format!(" || '{JOINT}' || "))
    }

    pub(super) fn is_checked(&self) -> bool {
        CHECKED.iter().any(|checked| checked.table == self.table)
    }

    /// SQL for the hash that the record has of a row: its newest seal or its checksum.
    pub(super) fn known_hash(&self, key: &str) -> String {
        let table = self.table;
        if self.is_checked() {
            format!("(select c.sha256 from checksums c where c.table_name = '{table}' and c.key = cast({key} as text))")
        } else {
            format!(
                "(select s.sha256 from seals s where s.table_name = '{table}' and s.key = cast({key} as text) \
                 order by s.seq desc limit 1)"
            )
        }
    }

    /// A column of a key.
    pub(super) fn part(&self, part: &str) -> String {
        let text = hex::decode(part).ok().and_then(|bytes| String::from_utf8(bytes).ok());
        text.filter(|_| self.hex).unwrap_or_else(|| part.to_owned())
    }
}

/// SQL for the hash in the newest seal of a row; `None` if the table has no seals.
pub(in super::super) fn newest_of(table: &str) -> Option<String> {
    let sealed = TABLES.iter().find(|sealed| sealed.table == table)?;
    Some(sealed.known_hash(&sealed.key_of(&format!("{table}."))))
}

/// The existing tables whose rows have seals or checksums.
pub(in super::super) async fn present(db: &mut Connection) -> StoreResult<Vec<Sealed>> {
    let names: Vec<String> =
        sqlx::query_scalar("select name from sqlite_master where type = 'table'").fetch_all(db).await?;
    let is_there = |table: &str| names.iter().any(|name| name == table);
    // A process that was killed while creating the record can leave the list of migrations alone.
    let all = TABLES.iter().chain(CHECKED).filter(|_| is_there("seals"));
    Ok(all.filter(|sealed| is_there(sealed.table)).copied().collect())
}
