//! Charts as SVG, drawn on the server, without scripts and external resources.
//!
//! Colours, strokes and fonts are classes of the style sheet, so that one drawing fits the light and the dark scheme. A
//! downloaded [`Figure`] contains the rules that it needs.

#![warn(clippy::print_stdout, clippy::print_stderr)]
#![cfg_attr(test, allow(clippy::unwrap_used, clippy::expect_used, clippy::panic))]

mod axis;
mod chart;
mod contours;
pub mod csv_table;
mod escaped_text;
mod figure;
pub mod gait_charts;
pub mod gait_series;
pub mod gait_table;
mod heat_map;
mod parallel;
#[cfg(feature = "png")]
mod png;
mod series;
mod simplified;
mod sparkline;
mod standalone;
mod stride_pictures;
mod tree;
mod walker;

pub use axis::power_of_ten;
pub use chart::{Chart, LegCycle, Span};
pub use figure::{Drawing, Figure};
pub use gait_charts::band_in_words;
pub use heat_map::{HeatMap, Tile};
pub use parallel::{Parallel, ParallelAxis, ParallelLine};
#[cfg(feature = "png")]
pub use png::PngError;
pub use series::{Band, PointLink, Series, Stroke};
pub use sparkline::sparkline;
pub use standalone::STYLE_SHEET;
pub use stride_pictures::stride_pictures;
pub use tree::{Tree, TreeNode};
pub use walker::{Animation, GaitWalker, Ghost};
