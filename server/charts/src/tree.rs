//! The warm-start tree, drawn from left to right.

use super::escaped_text::escape;
use std::collections::BTreeSet;
use std::fmt::Write;

/// One node.
#[derive(Debug, Clone, PartialEq)]
pub struct TreeNode {
    /// Index of the parent, which is smaller than its own.
    pub parent: Option<usize>,
    /// Label.
    pub label: String,
    /// Link.
    pub link: String,
    /// Class of the mark.
    pub class: &'static str,
}

const STEP: f64 = 96.0;
const ROW: f64 = 26.0;
const MARGIN: f64 = 18.0;
/// Distance from the centre of a mark to its label, and estimated width of a character.
const LABEL: f64 = 10.0;
const CHARACTER: f64 = 7.4;
/// Width of an entry of the legend.
const LEGEND: f64 = 140.0;

/// The warm-start tree.
#[derive(Debug, Clone, PartialEq)]
pub struct Tree {
    /// Title.
    pub title: String,
    /// Nodes, parents before their children.
    pub nodes: Vec<TreeNode>,
}

impl Tree {
    /// An SVG element for a page, with links.
    pub fn svg(&self) -> String {
        let (width, height) = self.size_of_nodes();
        let (title, mut svg) = (escape(&self.title), String::with_capacity(8 * 1024));
        // Writing to a String cannot fail.
        let _ = write!(
            svg,
            "<svg class=\"tree\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" role=\"group\" \
             aria-label=\"{title}\">"
        );
        let _ = self.draw(&mut svg, true);
        svg.push_str("</svg>");
        svg
    }

    /// Width and height of [`Self::body`].
    pub(super) fn size(&self) -> (f64, f64) {
        let (width, height) = self.size_of_nodes();
        (width.max(MARGIN + LEGEND * self.classes().len() as f64), height + ROW)
    }

    /// The elements of a self-contained figure, with a legend instead of links.
    pub(super) fn body(&self) -> String {
        let mut svg = String::with_capacity(8 * 1024);
        // Writing to a String cannot fail.
        let _ = self.draw(&mut svg, false);
        let y = self.size_of_nodes().1 + ROW / 2.0;
        for (place, class) in self.classes().iter().enumerate() {
            let x = MARGIN + LEGEND * place as f64;
            let _ = mark(&mut svg, class, &class.replace('_', " "), (x, y));
        }
        svg
    }

    /// The classes of marks in the tree.
    fn classes(&self) -> BTreeSet<&'static str> {
        self.nodes.iter().map(|node| node.class).collect()
    }

    fn size_of_nodes(&self) -> (f64, f64) {
        let places = places(&self.nodes);
        let width = places.iter().map(|place| place.0).fold(0.0, f64::max) + MARGIN + STEP;
        (width, places.iter().map(|place| place.1).fold(0.0, f64::max) + MARGIN)
    }

    fn draw(&self, svg: &mut String, links: bool) -> std::fmt::Result {
        let places = places(&self.nodes);
        // One path for all branches, because a study can have hundreds of them.
        svg.push_str("<path class=\"branch\" d=\"");
        for (node, (x, y)) in self.nodes.iter().zip(&places) {
            let Some(parent) = node.parent else { continue };
            if let (Some((from_x, from_y)), Some(grown)) = (places.get(parent), self.nodes.get(parent)) {
                // Start at the end of the parent's label, if there is room.
                let name = LABEL + CHARACTER * grown.label.chars().count() as f64;
                let start = (from_x + name).min(x - LABEL);
                let bend = f64::midpoint(start, *x);
                write!(svg, "M{start:.1} {from_y}H{bend:.1}V{y}H{x}")?;
            }
        }
        svg.push_str("\"/>");
        for (node, place) in self.nodes.iter().zip(&places) {
            if links {
                write!(svg, "<a href=\"{}\">", escape(&node.link))?;
            }
            mark(svg, node.class, &node.label, *place)?;
            if links {
                svg.push_str("</a>");
            }
        }
        Ok(())
    }
}

fn mark(svg: &mut String, class: &str, label: &str, (x, y): (f64, f64)) -> std::fmt::Result {
    write!(svg, "<circle class=\"{class}\" cx=\"{x}\" cy=\"{y}\" r=\"6\"/>")?;
    write!(svg, "<text x=\"{}\" y=\"{}\">{}</text>", x + LABEL, y + 4.5, escape(label))
}

/// The positions of nodes. The first child continues the row of its parent; every other child starts a new row below.
fn places(nodes: &[TreeNode]) -> Vec<(f64, f64)> {
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); nodes.len()];
    let mut open: Vec<usize> = Vec::new();
    for (index, node) in nodes.iter().enumerate() {
        match node.parent.filter(|parent| *parent < index) {
            Some(parent) => children[parent].push(index),
            None => open.push(index),
        }
    }
    let mut places = vec![(MARGIN, MARGIN); nodes.len()];
    let mut rows = 0.0;
    open.reverse();
    let mut open: Vec<(usize, f64, bool)> = open.into_iter().map(|root| (root, 0.0, false)).collect();
    while let Some((index, depth, continues)) = open.pop() {
        if !continues {
            rows += 1.0;
        }
        places[index] = (MARGIN + STEP * depth, MARGIN + ROW * (rows - 1.0));
        for (place, &child) in children[index].iter().enumerate().rev() {
            open.push((child, depth + 1.0, place == 0));
        }
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn nodes(parents: &[Option<usize>]) -> Vec<TreeNode> {
        let node = |parent: &Option<usize>| TreeNode {
            parent: *parent,
            label: "<1>".to_owned(),
            link: String::new(),
            class: "",
        };
        parents.iter().map(node).collect()
    }

    #[test]
    fn chain_is_one_row_and_text_is_escaped() {
        let chain = nodes(&[None, Some(0), Some(1)]);
        assert_eq!(places(&chain).iter().map(|p| p.1).collect::<Vec<_>>(), [MARGIN; 3]);
        let chain = Tree { title: "\"".to_owned(), nodes: chain };
        assert!(!chain.svg().contains("<1>") && !chain.body().contains("<1>"));
        assert!(chain.svg().contains("<a href=") && !chain.body().contains("<a"));
    }

    proptest! {
        #[test]
        fn no_two_nodes_share_a_place(choices in proptest::collection::vec(any::<Option<prop::sample::Index>>(), 1..60)) {
            let parents: Vec<Option<usize>> =
                choices.iter().enumerate().map(|(i, c)| c.filter(|_| i > 0).map(|c| c.index(i))).collect();
            let mut seen = places(&nodes(&parents));
            seen.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
            seen.dedup();
            prop_assert_eq!(seen.len(), parents.len());
        }
    }
}
