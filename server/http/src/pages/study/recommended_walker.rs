//! The recommended gait, walking, with the reference gait behind it.

use crate::AppState;
use gait_optimizer::Gait;
use gaitwright_charts::{GaitWalker, Ghost};
use gaitwright_compute::OnPool;
use gaitwright_service::error::Error;
use gaitwright_store::studies::{Evaluation, Study};
use gaitwright_store::{TrialId, gaits, reference_gaits};

/// The recommended gait on the page.
pub(super) enum RecommendedGait {
    /// No gait is or will be stored.
    None,
    /// A trial that is still to converge.
    Expected,
    /// The page shows it already.
    Shown(TrialId),
    Walks(RecommendedWalker),
}

impl RecommendedGait {
    /// The best trial of a study, with its number and whether its gait is stored; drawn unless the page shows it already.
    pub(super) async fn read(
        app: &mut AppState,
        study: &Study,
        best: Option<(TrialId, u32, bool)>,
        shown: &str,
    ) -> Result<Self, Error> {
        match best {
            Some((trial, _, true)) if trial.to_string() == shown => Ok(Self::Shown(trial)),
            Some((trial, number, true)) => {
                let walks = RecommendedWalker::read(app, study, (trial, number)).await?;
                Ok(walks.map_or(Self::None, Self::Walks))
            }
            None if !study.state.has_ended() && study.plan.evaluation == Evaluation::Optimizer => Ok(Self::Expected),
            _ => Ok(Self::None),
        }
    }

    /// The trial in its place; empty if there is none yet.
    pub(super) fn trial(&self) -> String {
        match self {
            Self::None | Self::Expected => String::new(),
            Self::Shown(trial) => trial.to_string(),
            Self::Walks(walker) => walker.trial.to_string(),
        }
    }

    pub(super) fn has_place(&self) -> bool {
        !matches!(self, Self::None)
    }
}

/// The walker of a trial, which a script moves.
pub(super) struct RecommendedWalker {
    pub(super) trial: TrialId,
    pub(super) number: u32,
    pub(super) svg: String,
}

impl RecommendedWalker {
    /// `None` if the gait is not stored, or too malformed to draw.
    pub(super) async fn read(
        app: &mut AppState,
        study: &Study,
        (trial, number): (TrialId, u32),
    ) -> Result<Option<Self>, Error> {
        let mut reader = app.read().await?;
        let Some(gait) = gaits::find(&mut reader, trial).await? else { return Ok(None) };
        let reference = reference_gaits::get(&mut reader, study.plan.reference_gait_id).await?.definition;
        drop(reader);
        let draw = move |pool: &OnPool| {
            let gait: Gait = gait.unpack(pool)?;
            let ghost = Ghost::of_reference(&gait, &reference);
            let figure = GaitWalker::new(&gait).and_then(|figure| Ok(figure.with_ghost(ghost?)));
            Ok::<_, Error>(figure.ok().map(|figure| figure.svg("The recommended gait")))
        };
        let svg = app.compute(draw).await.map_err(Error::from)??;
        Ok(svg.map(|svg| Self { trial, number, svg }))
    }
}
