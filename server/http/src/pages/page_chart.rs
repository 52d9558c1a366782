//! Charts as pages show them.

use gaitwright_charts::{Chart, Drawing, Figure, stride_pictures};

/// A chart ready for the page.
#[derive(Debug)]
pub(super) struct PageChart {
    pub(super) title: String,
    pub(super) note: &'static str,
    pub(super) svg: String,
    /// Whether it scrolls in its place on a narrow screen, as its text would be too small otherwise.
    pub(super) is_wide: bool,
    pub(super) legend: Vec<(String, String)>,
    /// Where it is as a file: form and address.
    pub(super) files: Vec<(&'static str, String)>,
}

impl PageChart {
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
            Drawing::Tiles(_, stick_figures) => (stride_pictures(stick_figures), Vec::new()),
            // Pages show the walker itself, which a script moves.
            Drawing::Animation(..) => (String::new(), Vec::new()),
            Drawing::Map(map) => (map.svg(), Vec::new()),
            Drawing::Parallel(parallel) => (parallel.svg(), parallel.legend()),
            Drawing::Tree(tree) => (tree.svg(), Vec::new()),
        };
        let is_wide = matches!(figure.drawing, Drawing::Tiles(..) | Drawing::Map(_) | Drawing::Parallel(_));
        Self { title: figure.title().to_owned(), note: "", svg, is_wide, legend, files }
    }
}

/// Moves the legends of charts into one legend for all of them; empty if a key means different things in them.
pub(super) fn shared_legend(charts: &mut [PageChart]) -> Vec<(String, String)> {
    let mut shared: Vec<(String, String)> = Vec::new();
    for (class, label) in charts.iter().flat_map(|chart| &chart.legend) {
        match shared.iter().find(|(known, _)| known == class) {
            None => shared.push((class.clone(), label.clone())),
            Some((_, known)) if known != label => return Vec::new(),
            Some(_) => {}
        }
    }
    if charts.len() < 2 {
        return Vec::new();
    }
    for chart in charts {
        chart.legend.clear();
    }
    shared
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_legend(entries: &[(&str, &str)]) -> PageChart {
        let legend = entries.iter().map(|(class, label)| ((*class).to_owned(), (*label).to_owned())).collect();
        PageChart { legend, ..PageChart::new(&Chart::new("", "", "")) }
    }

    #[test]
    fn charts_share_a_legend_if_their_keys_agree() {
        let mut charts = [with_legend(&[("c0", "left")]), with_legend(&[("c0", "left"), ("c3", "right")])];
        let shared = shared_legend(&mut charts);
        assert_eq!(shared.iter().map(|(_, label)| label.as_str()).collect::<Vec<_>>(), ["left", "right"]);
        assert!(charts.iter().all(|chart| chart.legend.is_empty()));
        let mut charts = [with_legend(&[("c0", "hip")]), with_legend(&[("c0", "knee")])];
        assert!(shared_legend(&mut charts).is_empty() && !charts[0].legend.is_empty());
    }
}
