//! The pages in a real browser. Every test name contains `browser`. Without Chromium the tests are skipped with a
//! message, unless `GAITWRIGHT_REQUIRE_BROWSER` is set.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod axe;
mod chromium;
mod compare;
mod every_page;
mod gait;
mod lab;
mod lab_session;
mod lists;
mod measurement_files;
mod program;
mod rater;
mod sign_in;
mod site;
mod study;
mod visits;
