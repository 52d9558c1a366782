//! axe-core: accessibility rules that are not ours.

use crate::chromium::Tab;
use gaitwright_tests::skipped::skipped;
use std::path::{Path, PathBuf};

/// The rules as a script. It is not ours to give on: `.ci/run` brings it.
pub(crate) struct Axe(String);

impl Axe {
    /// `None`: it is not here, and none is required.
    pub(crate) fn find() -> Option<Self> {
        let default = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/axe/node_modules/axe-core/axe.min.js");
        let file = std::env::var_os("GAITWRIGHT_AXE").map_or(default, PathBuf::from);
        if let Ok(script) = std::fs::read_to_string(&file) {
            return Some(Self(script));
        }
        assert!(std::env::var_os("GAITWRIGHT_REQUIRE_AXE").is_none(), "no axe-core at {}", file.display());
        skipped(&format!("no axe-core at {}", file.display()));
        None
    }

    /// What it has against a page, in light and in dark.
    pub(crate) async fn complaints(&self, page: &Tab) -> Vec<String> {
        let mut complaints = Vec::new();
        for scheme in ["light", "dark"] {
            page.prefer("prefers-color-scheme", scheme).await;
            page.define(&self.0).await;
            let found = page
                .value(
                    "axe.run({ runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa', 'best-practice'] }) \
                     .then(r => r.violations.flatMap(v => v.nodes.map(n => v.id + ': ' + n.html.slice(0, 120))))",
                )
                .await;
            let found: Vec<String> = serde_json::from_str(&found).unwrap();
            complaints.extend(found.into_iter().map(|complaint| format!("{scheme}: {complaint}")));
        }
        complaints
    }
}
