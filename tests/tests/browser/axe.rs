//! Accessibility checks with axe-core.

use crate::chromium::Tab;
use skipped_tests::skipped_unless_required;
use std::path::{Path, PathBuf};

/// The script of axe-core. Its licence prevents including it here, so `.ci/run` downloads it.
pub(crate) struct Axe(String);

/// How often a page is read that changes meanwhile.
const READINGS: usize = 5;

impl Axe {
    /// `None` if axe-core is not installed and not required.
    pub(crate) fn find() -> Option<Self> {
        let default = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/axe/node_modules/axe-core/axe.min.js");
        let file = std::env::var_os("GAITWRIGHT_AXE").map_or(default, PathBuf::from);
        if let Ok(script) = std::fs::read_to_string(&file) {
            return Some(Self(script));
        }
        skipped_unless_required("GAITWRIGHT_REQUIRE_AXE", &format!("there is no axe-core at {}", file.display()));
        None
    }

    /// The findings on a page, in light and in dark colours.
    pub(crate) async fn complaints(&self, page: &Tab) -> Vec<String> {
        let mut complaints = Vec::new();
        for scheme in ["light", "dark"] {
            page.prefer("prefers-color-scheme", scheme).await;
            page.define(&self.0).await;
            let found = self.read(page).await;
            complaints.extend(found.into_iter().map(|complaint| format!("{scheme}: {complaint}")));
        }
        complaints
    }

    /// The findings on a page as it is. A page that updates itself can replace an element while axe-core reads it, which
    /// then throws; the next reading finds the new element.
    async fn read(&self, page: &Tab) -> Vec<String> {
        let run = "axe.run({ runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa', 'best-practice'] }) \
                   .then(r => r.violations.flatMap(v => v.nodes.map(n => v.id + ': ' + n.html.slice(0, 120)))) \
                   .catch(error => String(error))";
        let mut found = String::new();
        for _ in 0..READINGS {
            found = page.value(run).await;
            if let Ok(complaints) = serde_json::from_str(&found) {
                return complaints;
            }
        }
        panic!("axe-core cannot read the page: {found}");
    }
}
