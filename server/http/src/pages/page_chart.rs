//! Charts as pages show them.

use gaitwright_charts::{Chart, Drawing, Figure, gait_tiles};

/// A chart ready for the page.
#[derive(Debug)]
pub(super) struct Drawn {
    pub(super) title: String,
    pub(super) note: &'static str,
    pub(super) svg: String,
    /// Whether it scrolls in its place on a narrow screen, as its text would be too small otherwise.
    pub(super) is_wide: bool,
    pub(super) legend: Vec<(String, String)>,
    /// Where it is as a file: form and address.
    pub(super) files: Vec<(&'static str, String)>,
}

impl Drawn {
    pub(super) fn new(chart: &Chart) -> Self {
        Self {
            title: chart.title.clone(),
            note: "",
            svg: chart.svg(),
            is_wide: false,
            legend: chart.legend(),
            files: Vec::new(),
        }
    }

    /// A figure with its files, which are in a folder, with a query.
    pub(super) fn of(figure: &Figure, folder: &str, query: &str) -> Self {
        let address = |ending: &str| format!("{folder}/{}.{ending}{query}", figure.name);
        let files = vec![
            ("SVG", address("svg")),
            #[cfg(feature = "png")]
            ("PNG", address("png")),
            ("CSV", address("csv")),
        ];
        let (svg, legend) = match &figure.drawing {
            Drawing::Chart(chart) => return Self { files, ..Self::new(chart) },
            Drawing::Tiles(_, stick_figures) => (gait_tiles(stick_figures), Vec::new()),
            Drawing::Map(map) => (map.svg(), Vec::new()),
            Drawing::Tree(tree) => (tree.svg(), Vec::new()),
        };
        let is_wide = matches!(figure.drawing, Drawing::Tiles(..) | Drawing::Map(_));
        Self { title: figure.title().to_owned(), note: "", svg, is_wide, legend, files }
    }
}
