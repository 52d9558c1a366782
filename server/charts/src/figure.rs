//! Figures for download: a drawing as self-contained SVG, or its values as CSV.

use super::chart::Chart;
use super::heat_map::HeatMap;
use super::parallel::Parallel;
use super::standalone::{self, Inside};
use super::stride_pictures;
use super::tree::Tree;
use super::walker::Animation;
use crate::csv_table::{CsvTable, cells};
use gait_optimizer::gait::stick_figure::StickFigure;

/// A drawing with a file name.
#[derive(Debug, Clone)]
pub struct Figure {
    /// File name without extension: lower-case letters, digits and hyphens.
    pub name: String,
    /// The drawing.
    pub drawing: Drawing,
}

/// A kind of drawing.
#[derive(Debug, Clone)]
pub enum Drawing {
    /// A line chart.
    Chart(Chart),
    /// A stride as a row of pictures, with a title.
    Tiles(String, Vec<StickFigure>),
    /// A walker that moves, with a title.
    Animation(String, Animation),
    /// A heat map.
    Map(HeatMap),
    /// Parallel coordinates.
    Parallel(Parallel),
    /// The warm-start tree.
    Tree(Tree),
}

impl Figure {
    /// A chart. `group` distinguishes charts with the same title.
    pub fn chart(group: &str, chart: Chart) -> Self {
        Self { name: file_name(group, &chart.title), drawing: Drawing::Chart(chart) }
    }

    /// A heat map. `group` distinguishes maps with the same title.
    pub fn map(group: &str, map: HeatMap) -> Self {
        Self { name: file_name(group, &map.title), drawing: Drawing::Map(map) }
    }

    /// Parallel coordinates.
    pub fn parallel(parallel: Parallel) -> Self {
        Self { name: file_name("", &parallel.title), drawing: Drawing::Parallel(parallel) }
    }

    /// The warm-start tree.
    pub fn tree(tree: Tree) -> Self {
        Self { name: file_name("", &tree.title), drawing: Drawing::Tree(tree) }
    }

    /// The stride as a row of pictures.
    pub fn tiles(title: &str, figures: Vec<StickFigure>) -> Self {
        Self { name: file_name("", title), drawing: Drawing::Tiles(title.to_owned(), figures) }
    }

    /// The stride as a picture that moves.
    pub fn animation(title: &str, animation: Animation) -> Self {
        Self { name: file_name("", title), drawing: Drawing::Animation(title.to_owned(), animation) }
    }

    /// The title.
    pub fn title(&self) -> &str {
        match &self.drawing {
            Drawing::Chart(chart) => &chart.title,
            Drawing::Tiles(title, _) | Drawing::Animation(title, _) => title,
            Drawing::Map(map) => &map.title,
            Drawing::Parallel(parallel) => &parallel.title,
            Drawing::Tree(tree) => &tree.title,
        }
    }

    /// Self-contained SVG on a white background.
    pub fn svg(&self) -> String {
        match &self.drawing {
            Drawing::Chart(chart) => {
                let inside = Inside { class: "chart", size: Chart::SIZE, body: chart.body() };
                standalone::svg(self.title(), &inside, &chart.legend())
            }
            Drawing::Tiles(title, figures) => {
                let inside =
                    Inside { class: "tiles", size: stride_pictures::SIZE, body: stride_pictures::body(figures) };
                standalone::svg(title, &inside, &[])
            }
            Drawing::Animation(title, animation) => {
                let inside = Inside { class: "gait-walker", size: animation.size(), body: animation.body() };
                standalone::svg(title, &inside, &[])
            }
            Drawing::Map(map) => {
                let inside = Inside { class: "chart map", size: map.size(), body: map.body() };
                standalone::svg(self.title(), &inside, &[])
            }
            Drawing::Parallel(parallel) => {
                let inside = Inside { class: "chart parallel", size: Parallel::SIZE, body: parallel.body() };
                standalone::svg(self.title(), &inside, &parallel.legend())
            }
            Drawing::Tree(tree) => {
                let inside = Inside { class: "tree", size: tree.size(), body: tree.body() };
                standalone::svg(self.title(), &inside, &[])
            }
        }
    }

    /// The values as CSV, with a row for each point of each line.
    pub fn csv(&self) -> String {
        let table = match &self.drawing {
            Drawing::Chart(chart) => chart_csv(chart),
            Drawing::Tiles(_, figures) => tiles_csv(figures),
            Drawing::Animation(_, animation) => tiles_csv(animation.stick_figures()),
            Drawing::Map(map) => map_csv(map),
            Drawing::Parallel(parallel) => parallel_csv(parallel),
            Drawing::Tree(tree) => tree_csv(tree),
        };
        table.into_text()
    }
}

fn chart_csv(chart: &Chart) -> CsvTable {
    let mut table = CsvTable::new(["line", &chart.x_label, &chart.y_label]);
    for series in &chart.series {
        for (x, y) in series.points.iter().filter(|(x, y)| x.is_finite() && y.is_finite()) {
            table.row(cells![&series.label, x, y]);
        }
    }
    for band in &chart.bands {
        for (x, low, high) in &band.points {
            table.row(cells![&band.label, x, low]);
            table.row(cells![&band.label, x, high]);
        }
    }
    table
}

fn parallel_csv(parallel: &Parallel) -> CsvTable {
    let bounds = parallel.axes.iter().map(|axis| format!("{}: {}", axis.name, axis.meaning));
    let columns = ["trial".to_owned()].into_iter().chain(bounds).chain([parallel.outcome.clone()]);
    let mut table = CsvTable::new(columns);
    for line in &parallel.lines {
        let mut row = cells![&line.link.name];
        row.extend(parallel.axes.iter().zip(&line.levels).map(|(axis, level)| axis.values.get(*level).into()));
        row.extend(cells![line.outcome]);
        table.row(row);
    }
    table
}

fn tiles_csv(figures: &[StickFigure]) -> CsvTable {
    let mut table = CsvTable::new(["time_s", "point", "forward_m", "up_m"]);
    for figure in figures {
        let mut points = vec![("hip", figure.hip), ("shoulder", figure.shoulder)];
        for (leg, names) in [
            (&figure.left, ["left knee", "left ankle", "left heel", "left toe"]),
            (&figure.right, ["right knee", "right ankle", "right heel", "right toe"]),
        ] {
            points.extend(names.into_iter().zip([leg.knee, leg.ankle, leg.heel, leg.toe]));
        }
        for (name, [x, z]) in points {
            table.row(cells![figure.time_s, name, x, z]);
        }
    }
    table
}

fn map_csv(map: &HeatMap) -> CsvTable {
    let (columns, rows) = (&map.columns, &map.rows);
    let mut table = CsvTable::new([rows.0.as_str(), &columns.0, &map.title, "note"]);
    for (row, cells) in rows.1.iter().zip(&map.cells) {
        for (column, value) in columns.1.iter().zip(cells) {
            table.row(cells![row, column, value.value, &value.below]);
        }
    }
    table
}

fn tree_csv(tree: &Tree) -> CsvTable {
    let mut table = CsvTable::new(["what", "grew_out_of", "state"]);
    for node in &tree.nodes {
        let parent = node.parent.and_then(|parent| tree.nodes.get(parent)).map_or("", |parent| &parent.label);
        table.row(cells![&node.label, parent, node.class]);
    }
    table
}

/// `angles`, `Right hip` as `angles-right-hip`.
fn file_name(group: &str, title: &str) -> String {
    let words = format!("{group} {title}");
    let words = words.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty());
    words.map(str::to_ascii_lowercase).collect::<Vec<_>>().join("-")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Stroke, Tile, TreeNode};

    fn figure() -> Figure {
        let chart = Chart::new("Knee, \"left\" <a>", "cycle, %", "angle, °")
            .with_band("deviation", 7, vec![(0.0, 0.0, 2.0), (1.0, 1.0, 3.0)])
            .with("this gait", 0, Stroke::Solid, vec![(0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0)]);
        Figure::chart("angles", chart)
    }

    #[test]
    fn figure_is_self_contained() {
        let svg = figure().svg();
        assert!(svg.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\"") && svg.contains("fill=\"#ffffff\""));
        assert!(
            !svg.contains("var(--") && svg.contains("this gait") && svg.contains("Knee, &quot;left&quot; &lt;a&gt;")
        );
        assert_eq!(figure().name, "angles-knee-left-a");
        let tree = resvg::usvg::Tree::from_str(&svg, &resvg::usvg::Options::default()).unwrap();
        assert!(tree.size().width() > 600.0);
    }

    #[test]
    fn map_is_self_contained_and_has_csv() {
        let one = |value: f64| Tile { value, text: format!("{value:+.2}"), below: "± 0.10".to_owned(), framed: true };
        let map = HeatMap {
            title: "Utility".to_owned(),
            columns: ("a5: clearance, m".to_owned(), vec![0.0, 0.013]),
            rows: ("a6: lean, rad".to_owned(), vec![0.1]),
            cells: vec![vec![one(0.25), one(-0.5)]],
            range: (-0.5, 0.25),
            has_contours: true,
        };
        let figure = Figure::map("a5-a6", map);
        assert_eq!(figure.name, "a5-a6-utility");
        let svg = figure.svg();
        assert!(svg.contains(".chart.map .value") && svg.contains("fill-opacity") && !svg.contains("var(--"), "{svg}");
        resvg::usvg::Tree::from_str(&svg, &resvg::usvg::Options::default()).unwrap();
        let expected =
            "\"a6: lean, rad\",\"a5: clearance, m\",Utility,note\n0.1,0,0.25,± 0.10\n0.1,0.013,-0.5,± 0.10\n";
        assert_eq!(figure.csv(), expected);
    }

    #[test]
    fn large_tree_is_self_contained_with_a_legend() {
        let node = |i: usize| TreeNode {
            parent: i.checked_sub(1),
            label: format!("trial {}", i + 1),
            link: "/trials/x".to_owned(),
            class: if i == 3 { "best" } else { "not_converged" },
        };
        let forest = (0..400).map(|i| TreeNode { parent: node(i).parent.map(|p| p / 2), ..node(i) }).collect();
        let figure = Figure::tree(Tree { title: "Warm starts".to_owned(), nodes: forest });
        let svg = figure.svg();
        assert!(svg.contains(".tree circle") && !svg.contains("var(--") && !svg.contains("href"), "{}", &svg[..3000]);
        assert!(svg.contains(">not converged</text>") && svg.contains(">best</text>"));
        assert!(
            figure.csv().starts_with("what,grew_out_of,state\ntrial 1,,not_converged\ntrial 2,trial 1,not_converged\n")
        );
    }

    #[test]
    fn csv_has_the_drawn_values() {
        let expected = "line,\"cycle, %\",\"angle, °\"\nthis gait,0,1\nthis gait,2,3\ndeviation,0,0\ndeviation,0,2\n\
                        deviation,1,1\ndeviation,1,3\n";
        assert_eq!(figure().csv(), expected);
    }
}
