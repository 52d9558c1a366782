//! The section of the stride-to-stride map: the state after right heel strike without the horizontal position px, which has
//! no effect on the motion.

use super::feedback_linearization::State;
use nalgebra::SVector;

/// Dimension of the section.
pub(super) const SECTION: usize = 17;

/// A state without px.
pub(super) type Section = SVector<f64, SECTION>;

/// The section of a state.
pub(super) fn section(x: &State) -> Section {
    Section::from_column_slice(&x.as_slice()[1..])
}

/// The state with this section and the px of `x`.
pub(super) fn with_section(x: &State, section: &Section) -> State {
    State::from_fn(|i, _| if i == 0 { x[0] } else { section[i - 1] })
}
