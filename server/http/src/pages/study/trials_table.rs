//! The table of trials. The query string has sorting, filters and page, so the table works without scripts and can be
//! bookmarked.

use crate::format::{self, words};
use gait_optimizer::TunedBounds;
use gaitwright_service::error::Error;
use gaitwright_store::trial_list::{self, ListedTrial, Listing, SORTS, Start};
use gaitwright_store::trials::{TrialCounts, TrialState};
use gaitwright_store::{Connection, StudyId, TrialId};
use serde::{Deserialize, Serialize};

/// Trials per page; the downloads have all of them.
const PAGE: u32 = 50;
const DESCENDING: &str = "descending";

/// The query string of the table.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct TrialsQuery {
    pub(super) sort: String,
    pub(super) order: String,
    state: String,
    pub(super) text: String,
    page: u32,
    /// The trial whose gait the page shows walking, which the script sends.
    #[serde(skip_serializing)]
    pub(super) shown: String,
}

impl Default for TrialsQuery {
    fn default() -> Self {
        Self {
            sort: SORTS[0].to_owned(),
            order: DESCENDING.to_owned(),
            state: String::new(),
            text: String::new(),
            page: 1,
            shown: String::new(),
        }
    }
}

impl TrialsQuery {
    fn listing(&self) -> Result<Listing, Error> {
        let sort = SORTS.into_iter().find(|sort| *sort == self.sort);
        let state = match self.state.as_str() {
            "" => None,
            text => Some(text.parse().map_err(|_| {
                let known = TrialState::ALL.map(TrialState::as_str).join(", ");
                Error::invalid("state", text, &format!("empty or one of {known}"))
            })?),
        };
        if !["ascending", DESCENDING].contains(&self.order.as_str()) {
            return Err(Error::invalid("order", self.order.as_str(), "ascending or descending"));
        }
        Ok(Listing {
            sort: sort
                .ok_or_else(|| Error::invalid("sort", self.sort.as_str(), &format!("one of {}", SORTS.join(", "))))?,
            descending: self.order == DESCENDING,
            state,
            contains: self.text.trim().to_owned(),
            limit: PAGE,
            start: Start::Skip(self.before()),
        })
    }

    /// Number of trials on the pages before this one.
    fn before(&self) -> u32 {
        self.page.saturating_sub(1).saturating_mul(PAGE)
    }

    fn link(&self) -> Result<String, Error> {
        let query = serde_urlencoded::to_string(self).map_err(|e| Error::Internal(e.to_string()))?;
        Ok(format!("?{query}#trials"))
    }
}

/// A column that sorts the table.
pub(super) struct Column {
    pub(super) label: &'static str,
    pub(super) meaning: &'static str,
    pub(super) numeric: bool,
    pub(super) link: String,
    /// `aria-sort` of the column; empty if the table is sorted by another one.
    pub(super) sorted: String,
}

/// An option of the state filter.
pub(super) struct StateChoice {
    pub(super) value: &'static str,
    pub(super) words: String,
    pub(super) chosen: bool,
}

pub(super) struct TrialRow {
    pub(super) id: TrialId,
    pub(super) number: u32,
    pub(super) state: &'static str,
    pub(super) state_words: String,
    pub(super) rmse: String,
    pub(super) cost: String,
    pub(super) iterations: String,
    pub(super) seconds: String,
    pub(super) from: Option<(TrialId, u32)>,
    pub(super) action: Vec<String>,
    pub(super) reason: String,
    pub(super) message: String,
}

/// The visible part of the table.
pub(super) struct TrialsTable {
    pub(super) any: bool,
    pub(super) choice: TrialsQuery,
    pub(super) states: Vec<StateChoice>,
    pub(super) values: Vec<Column>,
    pub(super) bounds: Vec<Column>,
    pub(super) rows: Vec<TrialRow>,
    /// Which trials are shown, if the page does not show all of them.
    pub(super) extent: Option<String>,
    pub(super) earlier: Option<String>,
    pub(super) later: Option<String>,
}

impl TrialsTable {
    pub(super) async fn read(
        db: &mut Connection,
        study: StudyId,
        counts: TrialCounts,
        choice: TrialsQuery,
    ) -> Result<Self, Error> {
        let listing = choice.listing()?;
        let listed = trial_list::of_study(db, study, &listing).await?;
        let matching = listed.first().map_or(0, |row| row.matching);
        let shown = u32::try_from(listed.len()).unwrap_or(PAGE);
        let page = |page: u32| TrialsQuery { page, ..choice.clone() }.link();
        let more = choice.before() + shown < matching;
        Ok(Self {
            any: counts.total > 0,
            states: states(listing.state),
            values: columns(&choice, &listing, false)?,
            bounds: columns(&choice, &listing, true)?,
            extent: (matching < counts.total || shown < matching)
                .then(|| extent(shown, choice.before(), matching, counts.total)),
            earlier: (choice.page > 1).then(|| page(choice.page - 1)).transpose()?,
            later: more.then(|| page(choice.page + 1)).transpose()?,
            rows: listed.into_iter().map(trial_row).collect(),
            choice,
        })
    }
}

fn states(chosen: Option<TrialState>) -> Vec<StateChoice> {
    let choice = |state: TrialState| StateChoice {
        value: state.as_str(),
        words: words(state.as_str()),
        chosen: chosen == Some(state),
    };
    TrialState::ALL.into_iter().map(choice).collect()
}

fn extent(shown: u32, offset: u32, matching: u32, total: u32) -> String {
    let count = |value: u32| format::count(value);
    if shown == 0 {
        return format!("No matching trials; {} in total.", count(total));
    }
    let (first, last) = (count(offset + 1), count(offset + shown));
    if matching < total {
        format!("Matching trials: {first} to {last} of {}; {} in total.", count(matching), count(total))
    } else {
        format!("Trials {first} to {last} of {}. The downloads contain all of them.", count(total))
    }
}

fn columns(choice: &TrialsQuery, listing: &Listing, bounds: bool) -> Result<Vec<Column>, Error> {
    SORTS
        .into_iter()
        .filter(|sort| TunedBounds::NAMES.contains(sort) == bounds)
        .map(|sort| {
            let current = sort == listing.sort;
            let descending = current && !listing.descending;
            let order = if descending { DESCENDING } else { "ascending" };
            let link =
                TrialsQuery { sort: sort.to_owned(), order: order.to_owned(), page: 1, ..choice.clone() }.link()?;
            let (label, meaning) = heading(sort);
            let sorted = if current { choice.order.clone() } else { String::new() };
            Ok(Column { label, meaning, numeric: sort != "state", link, sorted })
        })
        .collect()
}

fn heading(sort: &'static str) -> (&'static str, &'static str) {
    match sort {
        "number" => ("Trial", "In the order in which they were proposed"),
        "state" => ("State", ""),
        "gait_rmse_rad" => ("RMSE, rad", "Gait RMSE against the reference gait"),
        "cost_of_transport" => ("Cost", "Cost of transport, no unit"),
        "iterations" => ("Iterations", "Interior-point iterations of the solve"),
        "seconds_total" => ("Time, s", "Wall time of the solve"),
        bound => (bound, format::meaning(bound)),
    }
}

fn trial_row(listed: ListedTrial) -> TrialRow {
    TrialRow {
        id: listed.id,
        number: listed.number,
        state: listed.state.as_str(),
        state_words: words(listed.state.as_str()),
        rmse: format::decimal(listed.gait_rmse_rad),
        cost: format::decimal(listed.cost_of_transport),
        iterations: listed.iterations.map_or_else(|| "–".to_owned(), |n| n.to_string()),
        seconds: format::seconds(listed.seconds_total),
        from: listed.from,
        action: listed.action.to_array().iter().map(f64::to_string).collect(),
        reason: listed.reason,
        message: listed.message,
    }
}
