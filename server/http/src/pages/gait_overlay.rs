//! The part of the page of a gait in which other gaits of the study are chosen and overlaid.

use crate::figures::trial::OverlaidGaits;
use crate::refused_fields::{FieldLabels, RefusedFields, TypedForm};
use gait_optimizer::ReferenceGait;
use gaitwright_charts::gait_charts::Group;
use gaitwright_compute::OnPool;
use gaitwright_service::error::Error;
use gaitwright_service::studies::overlaid_gaits::{self, MAX_OTHERS};
use gaitwright_store::trials::Trial;
use gaitwright_store::{Connection, TrialId, trials};

/// So many of the newest trials are offered.
const OFFERED: u32 = 200;

/// The chosen trials.
#[derive(Debug, Clone, Default)]
pub(super) struct OverlayForm {
    pub(super) other: Vec<TrialId>,
}

impl TypedForm for OverlayForm {
    const LABELS: FieldLabels = &[("other", "Other gaits of this study")];

    fn repair(&mut self, _: &str) -> bool {
        false
    }
}

/// Trials with the same gait, of which the first one is overlaid on the gait of the page.
pub(super) struct OfferedTrials {
    pub(super) id: TrialId,
    pub(super) is_chosen: bool,
    /// `trials 3, 5, Gait RMSE 0.123 rad`.
    pub(super) name: String,
}

/// The gaits that can be overlaid on that of the page, and those that are.
pub(super) struct GaitOverlay {
    pub(super) offered: Vec<OfferedTrials>,
    /// Maximum number of chosen trials.
    pub(super) most: usize,
    /// Whether older trials are not offered.
    pub(super) newest_only: bool,
    /// Why the choice was refused.
    pub(super) refused: RefusedFields,
    /// The query of files that show the same.
    pub(super) query: String,
    gaits: Option<OverlaidGaits>,
}

impl GaitOverlay {
    /// Reads the gaits of the form. A refused choice shows the gait of the page alone.
    pub(super) async fn read(db: &mut Connection, trial: &Trial, form: &OverlayForm) -> Result<Self, Error> {
        let chosen = &form.other;
        let (gaits, refused) = match OverlaidGaits::read(db, trial, chosen).await {
            Ok(gaits) => (Some(gaits).filter(|_| !chosen.is_empty()), RefusedFields::default()),
            Err(error) => (None, RefusedFields::of(error, OverlayForm::LABELS)?),
        };
        let pools = overlaid_gaits::offered(db, trial, OFFERED).await?;
        let identifiers: Vec<String> = chosen.iter().map(TrialId::to_string).collect();
        Ok(Self {
            offered: pools.iter().filter_map(|pool| OfferedTrials::of(pool, chosen)).collect(),
            most: MAX_OTHERS,
            newest_only: trials::counts(db, trial.study_id).await?.total > OFFERED,
            refused,
            query: format!("?other={}", identifiers.join(",")),
            gaits,
        })
    }

    /// The charts of all gaits; none if no other gait is chosen.
    pub(super) fn draw(&self, pool: &OnPool, reference: &ReferenceGait) -> Result<Vec<Group>, Error> {
        self.gaits.as_ref().map_or_else(|| Ok(Vec::new()), |gaits| gaits.draw(pool, reference))
    }

    /// Whether the choice is of interest at once.
    pub(super) fn is_open(&self) -> bool {
        self.gaits.is_some() || !self.refused.is_empty()
    }
}

impl OfferedTrials {
    fn of(pool: &[Trial], chosen: &[TrialId]) -> Option<Self> {
        let named = pool.iter().find(|trial| chosen.contains(&trial.id));
        let shown = named.or(pool.first())?;
        let numbers: Vec<String> = pool.iter().map(|trial| trial.number.to_string()).collect();
        let what = if numbers.len() == 1 { "trial" } else { "trials" };
        let rmse = shown.gait_rmse_rad.map_or_else(String::new, |rmse| format!(", Gait RMSE {rmse:.4} rad"));
        let name = format!("{what} {}{rmse}", numbers.join(", "));
        Some(Self { id: shown.id, is_chosen: named.is_some(), name })
    }
}
