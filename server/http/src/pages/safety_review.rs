//! The forms for a safety report and a safety review on the page of a gait, as typed.

use crate::refused_fields::{FieldLabels, TypedForm};
use gaitwright_service::error::Error;
use gaitwright_service::studies::new_safety_report::NewSafetyReport;
use gaitwright_service::studies::safety_review::Decision;
use gaitwright_store::SafetyReportId;
use gaitwright_store::safety_reviews::SafetyDecision;
use serde::Deserialize;

/// The form for a review.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ReviewFields {
    #[serde(default)]
    pub(super) decision: String,
    #[serde(default)]
    pub(super) author: String,
    #[serde(default)]
    pub(super) reason: String,
    /// The reports that the page showed, separated by commas.
    reports: String,
}

impl ReviewFields {
    pub(super) fn read(&self) -> Result<Decision, Error> {
        let decision = match self.decision.as_str() {
            "unsafe" => SafetyDecision::Unsafe,
            "cleared" => SafetyDecision::Cleared,
            other => return Err(Error::invalid("decision", other, "one of the decisions on the form")),
        };
        let identifier = |text: &str| {
            text.parse()
                .map_err(|_| Error::invalid("reports", text, "the identifier of a safety report from this form"))
        };
        let reports = self.reports.split(',').map(identifier).collect::<Result<Vec<SafetyReportId>, _>>()?;
        let (reason, author) = (self.reason.clone(), Some(self.author.clone()));
        Ok(Decision { decision, reason, author, reports: Some(reports) })
    }
}

impl TypedForm for ReviewFields {
    const LABELS: FieldLabels = &[("decision", "Decision"), ("author", "Your name or code"), ("reason", "Reason")];

    fn repair(&mut self, field: &str) -> bool {
        match field {
            "decision" => "unsafe".clone_into(&mut self.decision),
            "author" => "a name".clone_into(&mut self.author),
            "reason" => "a reason".clone_into(&mut self.reason),
            _ => return false,
        }
        true
    }
}

/// The form for a report.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ReportFields {
    /// Absent if a user is signed in.
    author: Option<String>,
    #[serde(default)]
    pub(super) note: String,
}

impl ReportFields {
    pub(super) fn new_report(&self) -> NewSafetyReport {
        NewSafetyReport { source: None, author: self.author.clone(), note: self.note.clone() }
    }

    /// The author as typed.
    pub(super) fn author(&self) -> &str {
        self.author.as_deref().unwrap_or_default()
    }
}

impl TypedForm for ReportFields {
    const LABELS: FieldLabels = &[("author", "Your name or code"), ("note", "What happened")];

    fn repair(&mut self, field: &str) -> bool {
        match field {
            "author" => self.author = Some("a name".to_owned()),
            "note" => self.note.clear(),
            _ => return false,
        }
        true
    }
}
