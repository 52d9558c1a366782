//! Figures as PNG.

use super::figure::Figure;
use resvg::usvg::fontdb::Source;
use std::sync::Arc;
use thiserror::Error;

/// Pixels of a PNG per unit of the drawing, which gives 1280 for a chart.
const SCALE: f32 = 2.0;
/// Maximum number of pixels of a PNG. Large drawings get a smaller scale.
const MAX_PIXELS: f32 = 1.2e7;

/// Why a PNG cannot be made.
#[derive(Debug, Error)]
pub enum PngError {
    /// The SVG cannot be read.
    #[error("Cannot draw a figure: {0}.")]
    Svg(#[from] resvg::usvg::Error),
    /// The pixels cannot be allocated or encoded.
    #[error("Cannot draw a figure: {0}.")]
    Pixels(String),
}

impl Figure {
    /// PNG, with text in the embedded font DejaVu Sans.
    ///
    /// # Errors
    /// [`PngError`], which is a bug in the program.
    pub fn png(&self) -> Result<Vec<u8>, PngError> {
        let mut options = resvg::usvg::Options { font_family: "DejaVu Sans".to_owned(), ..Default::default() };
        options.fontdb_mut().load_font_source(Source::Binary(Arc::new(dejavu::sans::regular())));
        let tree = resvg::usvg::Tree::from_str(&self.svg(), &options)?;
        let scale = SCALE.min((MAX_PIXELS / (tree.size().width() * tree.size().height())).sqrt());
        let size = tree.size().to_int_size().scale_by(scale);
        let size = size.ok_or_else(|| PngError::Pixels("it has no size".to_owned()))?;
        let pixels = resvg::tiny_skia::Pixmap::new(size.width(), size.height());
        let mut pixels = pixels.ok_or_else(|| PngError::Pixels("it is too large".to_owned()))?;
        let transform = resvg::tiny_skia::Transform::from_scale(scale, scale);
        resvg::render(&tree, transform, &mut pixels.as_mut());
        pixels.encode_png().map_err(|e| PngError::Pixels(e.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Chart, Stroke, Tree, TreeNode};

    fn figure() -> Figure {
        let points = vec![(0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0)];
        let chart =
            Chart::new("Knee, \"left\" <a>", "cycle, %", "angle, °").with("this gait", 0, Stroke::Solid, points);
        Figure::chart("angles", chart)
    }

    #[test]
    fn png_of_a_large_tree_is_within_the_pixel_limit() {
        let node = |i: usize| TreeNode {
            parent: i.checked_sub(1).map(|p| p / 2),
            label: format!("trial {}", i + 1),
            link: "/trials/x".to_owned(),
            class: "not_converged",
        };
        let figure = Figure::tree(Tree { title: "Warm starts".to_owned(), nodes: (0..400).map(node).collect() });
        let pixels = resvg::tiny_skia::Pixmap::decode_png(&figure.png().unwrap()).unwrap();
        let count = (pixels.width() * pixels.height()) as f32;
        assert!(count > 1e5 && count <= MAX_PIXELS * 1.01, "{count}");
    }

    #[test]
    fn png_has_text_lines_and_a_white_background() {
        let png = figure().png().unwrap();
        let pixels = resvg::tiny_skia::Pixmap::decode_png(&png).unwrap();
        let colour = |x, y| pixels.pixel(x, y).map(|p| (p.red(), p.green(), p.blue(), p.alpha()));
        assert_eq!(colour(1, 1), Some((255, 255, 255, 255)));
        // Only the title is above the drawing, so dark pixels there are text.
        let dark = (0..pixels.width()).any(|x| (4..40).any(|y| colour(x, y).is_some_and(|(r, ..)| r < 100)));
        assert!(dark, "no title was drawn");
        let blue = |p: &resvg::tiny_skia::PremultipliedColorU8| (p.red(), p.green(), p.blue()) == (0x0a, 0x6f, 0x8a);
        assert!(pixels.pixels().iter().any(blue), "no line in its colour was drawn");
        assert_eq!(png, figure().png().unwrap());
    }
}
