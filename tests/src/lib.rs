//! Whole-system tests of Gaitwright live in `tests/tests`.
