//! The table of trials. The query string has sorting, filters and page, so the table works without scripts and can be
//! bookmarked.

use crate::bound_units;
use crate::format::{self, words};
use crate::pages::form_numbers;
use crate::paging::ListFingerprint;
use gait_optimizer::TunedBounds;
use gaitwright_service::error::Error;
use gaitwright_store::trial_list::{self, ListStart, ListedTrial, Listing, RANGES, SORTS, ValueRange};
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
    /// The column whose range filters the table; empty for none. Its ends as typed, in the unit of the table.
    range: String,
    pub(super) from: String,
    pub(super) to: String,
    /// Cursor of the last trial of the previous page; empty for the first page.
    #[serde(skip_serializing_if = "String::is_empty")]
    after: String,
    /// Cursor of the first trial of the next page; empty unless the table goes back.
    #[serde(skip_serializing_if = "String::is_empty")]
    before: String,
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
            range: String::new(),
            from: String::new(),
            to: String::new(),
            after: String::new(),
            before: String::new(),
            shown: String::new(),
        }
    }
}

impl TrialsQuery {
    fn listing(&self, list: &ListFingerprint) -> Result<Listing, Error> {
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
            range: self.value_range()?,
            limit: PAGE,
            start: self.start(list)?,
        })
    }

    fn value_range(&self) -> Result<Option<ValueRange>, Error> {
        if self.range.is_empty() {
            return Ok(None);
        }
        let column = RANGES.into_iter().find(|column| *column == self.range);
        let column = column.ok_or_else(|| Error::invalid("range", self.range.as_str(), "a column from the list"))?;
        let (from, to) = (end_of_range(column, "from", &self.from, -1.0)?, end_of_range(column, "to", &self.to, 1.0)?);
        Ok(Some(ValueRange { column, from: from.unwrap_or(f64::MIN), to: to.unwrap_or(f64::MAX) }))
    }

    /// The list that the cursors are about.
    fn list(&self, study: StudyId) -> ListFingerprint {
        let filter = [("sort", &self.sort), ("order", &self.order), ("state", &self.state), ("text", &self.text)];
        let range = [("range", &self.range), ("from", &self.from), ("to", &self.to)];
        let filter = filter.into_iter().chain(range).collect::<Vec<_>>();
        let filter = filter.into_iter().map(|(name, value)| (name.to_owned(), value.clone()));
        ListFingerprint::of(&format!("/studies/{study}#trials"), &filter.collect())
    }

    fn start(&self, list: &ListFingerprint) -> Result<ListStart, Error> {
        Ok(match (self.after.as_str(), self.before.as_str()) {
            ("", "") => ListStart::First,
            ("", before) => ListStart::Before(list.key(before)?),
            (after, _) => ListStart::After(list.key(after)?),
        })
    }

    /// The same choice on its first page.
    fn first_page(&self) -> Self {
        Self { after: String::new(), before: String::new(), ..self.clone() }
    }

    fn link(&self) -> Result<String, Error> {
        let query = serde_urlencoded::to_string(self).map_err(|e| Error::Internal(e.to_string()))?;
        Ok(format!("?{query}#trials"))
    }
}

/// An end of a range in the unit of the record. Angles are shown with three digits, so an end stands for every angle that is shown as
/// it: the range is wider by half a unit of the third digit, to lower angles if `direction` is -1, to greater ones if it is 1.
fn end_of_range(column: &str, field: &str, text: &str, direction: f64) -> Result<Option<f64>, Error> {
    let Some(value) = form_numbers::optional(field, text)? else { return Ok(None) };
    if !value.is_finite() {
        return Err(Error::invalid(field, text, "a finite number"));
    }
    let unit = TunedBounds::unit_of(column);
    if bound_units::ANGLES.of(unit) == unit || value == 0.0 {
        return Ok(Some(value));
    }
    let half_a_digit = 0.5 * 10_f64.powf(value.abs().log10().floor() - 2.0);
    Ok(Some((value + direction * half_a_digit).to_radians()))
}

/// A column that sorts the table.
pub(super) struct Column {
    pub(super) name: &'static str,
    pub(super) label: &'static str,
    pub(super) meaning: String,
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
    /// The columns whose range can be chosen: name, label, whether it is chosen.
    pub(super) ranges: Vec<(&'static str, String, bool)>,
    pub(super) values: Vec<Column>,
    pub(super) bounds: Vec<Column>,
    pub(super) rows: Vec<TrialRow>,
    /// Which trials are shown, if the page does not show all of them.
    pub(super) extent: Option<String>,
    pub(super) earlier: Option<String>,
    pub(super) later: Option<String>,
}

impl TrialsTable {
    /// How many columns every choice of columns has: the number and the state.
    const ALWAYS_SHOWN: usize = 2;

    /// The columns that can be left out, in the order of the table: name and label.
    pub(super) fn optional_columns(&self) -> Vec<(&'static str, String)> {
        let bounds = self.bounds.iter().map(|one| (one.name, format!("{}: {}", one.label, one.meaning)));
        let values = self.values.iter().skip(Self::ALWAYS_SHOWN).map(|one| (one.name, one.label.to_owned()));
        let warm_start = [("warm_start", "Warm start".to_owned())];
        let reason = [("reason", "Reason".to_owned())];
        values.chain(warm_start).chain(bounds).chain(reason).collect()
    }

    pub(super) async fn read(
        db: &mut Connection,
        study: StudyId,
        counts: TrialCounts,
        choice: TrialsQuery,
    ) -> Result<Self, Error> {
        let list = choice.list(study);
        let listing = choice.listing(&list)?;
        let listed = trial_list::of_study(db, study, &listing).await?;
        let (first, last) = (listed.first(), listed.last());
        let (before, matching) = first.map_or((0, 0), |row| (row.before, row.matching));
        let shown = u32::try_from(listed.len()).unwrap_or(PAGE);
        let earlier = first.filter(|_| before > 0).map(|row| list.cursor(&row.place)).transpose()?;
        let later = last.filter(|row| row.before + 1 < matching).map(|row| list.cursor(&row.place)).transpose()?;
        let page = |page: TrialsQuery| page.link();
        let earlier = earlier.map(|before| page(TrialsQuery { before, ..choice.first_page() })).transpose()?;
        // Trials can leave the list while it is open, so that nothing is left on a page.
        let is_gone = first.is_none() && !matches!(listing.start, ListStart::First);
        let earlier = if is_gone { Some(page(choice.first_page())?) } else { earlier };
        Ok(Self {
            any: counts.total > 0,
            states: states(listing.state),
            ranges: ranges(&choice),
            values: columns(&choice, &listing, false)?,
            bounds: columns(&choice, &listing, true)?,
            extent: (matching < counts.total || shown < matching)
                .then(|| extent(shown, before, matching, counts.total)),
            earlier,
            later: later.map(|after| page(TrialsQuery { after, ..choice.first_page() })).transpose()?,
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

fn ranges(choice: &TrialsQuery) -> Vec<(&'static str, String, bool)> {
    let range = |column: &'static str| {
        let label = match heading(column) {
            (label, meaning) if TunedBounds::NAMES.contains(&column) => format!("{label}: {meaning}"),
            (label, _) => label.to_owned(),
        };
        (column, label, choice.range == column)
    };
    RANGES.into_iter().map(range).collect()
}

fn extent(shown: u32, before: u32, matching: u32, total: u32) -> String {
    let count = |value: u32| format::count(value);
    if shown == 0 {
        return format!("No matching trials; {} in total.", count(total));
    }
    let (first, last) = (count(before + 1), count(before + shown));
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
            let link = TrialsQuery { sort: sort.to_owned(), order: order.to_owned(), ..choice.first_page() }.link()?;
            let (label, meaning) = heading(sort);
            let sorted = if current { choice.order.clone() } else { String::new() };
            Ok(Column { name: sort, label, meaning, numeric: sort != "state", link, sorted })
        })
        .collect()
}

fn heading(sort: &'static str) -> (&'static str, String) {
    let (label, meaning) = match sort {
        "number" => ("Trial", "Trials are numbered in the order in which they were proposed"),
        "state" => ("State", ""),
        "gait_rmse_rad" => ("RMSE, rad", "Gait RMSE against the reference gait"),
        "cost_of_transport" => ("Cost", "Cost of transport, no unit"),
        "iterations" => ("Iterations", "Interior-point iterations of the solve"),
        "seconds_total" => ("Time, s", "Wall time of the solve"),
        bound => return (bound, bound_units::meaning(bound)),
    };
    (label, meaning.to_owned())
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
        action: bound_units::bounds(&listed.action).into_iter().map(|bound| bound.value).collect(),
        reason: listed.reason,
        message: listed.message,
    }
}
