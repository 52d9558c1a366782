//! Charts as pages show them.

use crate::plots::Chart;

/// A chart ready for the page.
pub(super) struct Drawn {
    pub(super) title: String,
    pub(super) note: &'static str,
    pub(super) svg: String,
    pub(super) legend: Vec<(String, String)>,
}

impl Drawn {
    pub(super) fn new(chart: &Chart, note: &'static str) -> Self {
        let legend = chart.legend().into_iter().map(|(class, label)| (class, label.to_owned())).collect();
        Self { title: chart.title.clone(), note, svg: chart.svg(), legend }
    }
}
