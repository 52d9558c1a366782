//! Charts as pages show them.

use crate::plots::{Chart, Drawing, Figure, gait_tiles};

/// A chart ready for the page.
#[derive(Debug)]
pub(super) struct Drawn {
    pub(super) title: String,
    pub(super) note: &'static str,
    pub(super) svg: String,
    pub(super) legend: Vec<(String, String)>,
    /// Where it is as a file: form and address.
    pub(super) files: Vec<(&'static str, String)>,
}

impl Drawn {
    pub(super) fn new(chart: &Chart) -> Self {
        let legend = chart.legend().into_iter().map(|(class, label)| (class, label.to_owned())).collect();
        Self { title: chart.title.clone(), note: "", svg: chart.svg(), legend, files: Vec::new() }
    }

    /// A figure with its files, which are in a folder, with a query.
    pub(super) fn of(figure: &Figure, folder: &str, query: &str) -> Self {
        let address = |ending: &str| format!("{folder}/{}.{ending}{query}", figure.name);
        let files = vec![("SVG", address("svg")), ("PNG", address("png")), ("CSV", address("csv"))];
        let (svg, legend) = match &figure.drawing {
            Drawing::Chart(chart) => return Self { files, ..Self::new(chart) },
            Drawing::Tiles(_, stick_figures) => (gait_tiles(stick_figures), Vec::new()),
            Drawing::Map(map) => (map.svg(), Vec::new()),
            Drawing::Tree(tree) => (tree.svg(), Vec::new()),
        };
        Self { title: figure.title().to_owned(), note: "", svg, legend, files }
    }
}
