//! Plots as SVG, drawn on the server: no script is needed to see them, and nothing comes from elsewhere.
//!
//! Colours, strokes and fonts are classes of the style sheet, so that one drawing serves light and dark.

mod axis;
mod chart;

pub use chart::{Chart, Series, Stroke};
