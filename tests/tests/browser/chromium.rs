//! Drives Chromium over the DevTools protocol.

use chromiumoxide::Page;
use chromiumoxide::browser::{Browser, BrowserConfig};
use chromiumoxide::cdp::browser_protocol::emulation::{
    MediaFeature, SetDeviceMetricsOverrideParams, SetEmulatedMediaParams, SetScriptExecutionDisabledParams,
    SetTouchEmulationEnabledParams,
};
use chromiumoxide::cdp::browser_protocol::input::{
    DispatchKeyEventParams, DispatchKeyEventType, DispatchTouchEventParams, DispatchTouchEventReturns,
    DispatchTouchEventType, InsertTextParams, TouchPoint,
};
use chromiumoxide::cdp::browser_protocol::log::{self, EventEntryAdded};
use chromiumoxide::cdp::browser_protocol::network::{self, EventRequestWillBeSent};
use chromiumoxide::cdp::js_protocol::runtime::EventExceptionThrown;
use chromiumoxide::page::ScreenshotParams;
use chromiumoxide::types::MethodId;
use chromiumoxide::{Command, Method};
use futures_util::StreamExt;
use serde::Serialize;
use skipped_tests::skipped_unless_required;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::task::JoinHandle;

/// The control key among the modifiers of a key event.
const CONTROL: i64 = 2;
/// Number of attempts to click an element that is replaced meanwhile.
const CLICKS: u32 = 20;
/// An element that has not moved for this long stays where it is.
const STILL: Duration = Duration::from_millis(50);
/// Where a Chromium may be.
const PLACES: [&str; 4] =
    ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome", "/snap/bin/chromium"];

/// [`DispatchTouchEventParams`] that says so when no finger is left: theirs leaves an empty list out, and Chromium refuses.
#[derive(Debug, Serialize)]
struct Touched {
    #[serde(rename = "type")]
    kind: DispatchTouchEventType,
    #[serde(rename = "touchPoints")]
    touch_points: Vec<TouchPoint>,
}

impl Method for Touched {
    fn identifier(&self) -> MethodId {
        DispatchTouchEventParams::IDENTIFIER.into()
    }
}

impl Command for Touched {
    type Response = DispatchTouchEventReturns;
}

/// A running browser.
pub(crate) struct Chromium {
    browser: Browser,
    events: JoinHandle<()>,
    _profile: tempfile::TempDir,
}

impl Chromium {
    /// Starts Chromium, or reports why the test is skipped.
    pub(crate) async fn launch() -> Option<Self> {
        let Some(executable) = PLACES.into_iter().find(|place| Path::new(place).exists()) else {
            skipped_unless_required("GAITWRIGHT_REQUIRE_BROWSER", "there is no Chromium");
            return None;
        };
        let profile = tempfile::tempdir().unwrap();
        let config = BrowserConfig::builder()
            .chrome_executable(executable)
            .user_data_dir(profile.path())
            .no_sandbox()
            .window_size(1280, 900)
            .args([
                "--disable-gpu",
                "--disable-quic",
                "--no-first-run",
                "--disable-background-networking",
                "--disable-component-update",
                "--disable-sync",
            ])
            // A mouse, which a machine without a screen does not have: 2 is a device that hovers, 4 a fine pointer.
            .arg((
                "blink-settings",
                "primaryHoverType=2,availableHoverTypes=2,primaryPointerType=4,availablePointerTypes=4",
            ))
            .build()
            .unwrap();
        let (browser, mut handler) = Browser::launch(config).await.unwrap();
        let events = tokio::spawn(async move { while handler.next().await.is_some() {} });
        Some(Self { browser, events, _profile: profile })
    }

    /// Opens an address and watches what the page does.
    pub(crate) async fn open(&self, address: &str) -> Tab {
        Tab::new(self.browser.new_page("about:blank").await.unwrap(), address, true).await
    }

    /// Opens an address with scripts switched off.
    pub(crate) async fn open_without_scripts(&self, address: &str) -> Tab {
        Tab::new(self.browser.new_page("about:blank").await.unwrap(), address, false).await
    }

    /// Ends it.
    pub(crate) async fn close(mut self) {
        self.browser.close().await.unwrap();
        self.browser.wait().await.unwrap();
        self.events.abort();
    }
}

/// A page.
pub(crate) struct Tab {
    page: Page,
    requests: Arc<Mutex<Vec<String>>>,
    complaints: Arc<Mutex<Vec<String>>>,
}

impl Tab {
    async fn new(page: Page, address: &str, scripts: bool) -> Self {
        let (requests, complaints) = (Arc::new(Mutex::new(Vec::new())), Arc::new(Mutex::new(Vec::new())));
        page.execute(network::EnableParams::default()).await.unwrap();
        page.execute(log::EnableParams::default()).await.unwrap();
        let mut sent = page.event_listener::<EventRequestWillBeSent>().await.unwrap();
        let list = Arc::clone(&requests);
        tokio::spawn(async move {
            while let Some(event) = sent.next().await {
                list.lock().unwrap().push(event.request.url.clone());
            }
        });
        // Messages of the console: script errors, refused resources, violations of the content policy.
        let mut logged = page.event_listener::<EventEntryAdded>().await.unwrap();
        let list = Arc::clone(&complaints);
        tokio::spawn(async move {
            while let Some(event) = logged.next().await {
                list.lock().unwrap().push(format!("{:?}: {}", event.entry.level, event.entry.text));
            }
        });
        let mut thrown = page.event_listener::<EventExceptionThrown>().await.unwrap();
        let list = Arc::clone(&complaints);
        tokio::spawn(async move {
            while let Some(event) = thrown.next().await {
                list.lock().unwrap().push(format!("thrown: {:?}", event.exception_details));
            }
        });
        if !scripts {
            page.execute(SetScriptExecutionDisabledParams::new(true)).await.unwrap();
        }
        page.execute(SetDeviceMetricsOverrideParams::new(1280, 900, 1.0, false)).await.unwrap();
        // The library switches the emulation on for every tab, so that no page has a mouse.
        page.execute(SetTouchEmulationEnabledParams::new(false)).await.unwrap();
        page.bring_to_front().await.unwrap();
        page.goto(address).await.unwrap();
        Self { page, requests, complaints }
    }

    /// Waits until an element exists.
    pub(crate) async fn wait_for(&self, selector: &str) {
        for _ in 0..400 {
            if self.page.find_element(selector).await.is_ok() {
                return;
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
        panic!("{selector} does not appear on {:?}", self.page.url().await);
    }

    /// Waits until an expression is true.
    pub(crate) async fn wait_until(&self, expression: &str) {
        for _ in 0..400 {
            // During navigation no page can evaluate the expression.
            let value = self.page.evaluate(expression.to_owned()).await.ok();
            if value.is_some_and(|v| v.value().and_then(serde_json::Value::as_bool) == Some(true)) {
                return;
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
        panic!("never true on {:?}: {expression}", self.page.url().await);
    }

    /// Waits until an answer counts, and returns the selector of its button.
    pub(crate) async fn answer(&self, value: &str) -> String {
        let button = format!("form[data-ready] button[value={value}]:enabled");
        self.wait_for(&button).await;
        self.wait_until("document.readyState === 'complete'").await;
        button
    }

    /// Opens every folded part of the page.
    pub(crate) async fn unfold(&self) {
        self.run("for (const d of document.querySelectorAll('details')) d.open = true").await;
    }

    /// The lowest edge of elements, and the size of the smallest one, px.
    pub(crate) async fn lowest(&self, selector: &str) -> (f64, f64, f64) {
        let of = |what: &str| {
            format!("[...document.querySelectorAll(`{selector}`)].map(e => e.getBoundingClientRect().{what})")
        };
        let (low, width, height) = (of("bottom"), of("width"), of("height"));
        let all = format!("JSON.stringify([Math.max(...{low}), Math.min(...{width}), Math.min(...{height})])");
        serde_json::from_str(&self.value(&all).await).unwrap()
    }

    /// Goes to another address.
    pub(crate) async fn goto(&self, address: &str) {
        self.page.goto(address).await.unwrap();
    }

    /// Loads the page anew.
    pub(crate) async fn reload(&self) {
        self.page.reload().await.unwrap();
    }

    /// Emulates preferences of the user: `prefers-color-scheme`, `prefers-reduced-motion`.
    pub(crate) async fn prefer(&self, feature: &str, value: &str) {
        let media = SetEmulatedMediaParams::builder().feature(MediaFeature::new(feature, value)).build();
        self.page.execute(media).await.unwrap();
    }

    /// Emulates print media from here on.
    pub(crate) async fn be_paper(&self) {
        self.page.execute(SetEmulatedMediaParams::builder().media("print").build()).await.unwrap();
    }

    /// Number of pixels by which the page is wider than the window.
    pub(crate) async fn beyond(&self) -> String {
        self.value(
            "(() => {
                const width = document.documentElement.clientWidth;
                const beyond = document.documentElement.scrollWidth - width;
                const wide = [...document.querySelectorAll('body, body *')].filter(e => e.scrollWidth > e.clientWidth + 1);
                const names = wide.slice(-3).map(e => `${e.tagName} ${e.className} ${e.textContent.slice(0, 60)}`);
                return beyond ? `${beyond}: ${names.join('; ')}` : '0';
            })()",
        )
        .await
    }

    /// Forgets every session.
    pub(crate) async fn forget_cookies(&self) {
        self.page.execute(network::ClearBrowserCookiesParams::default()).await.unwrap();
    }

    /// A picture of the whole page.
    pub(crate) async fn picture(&self, file: &Path) {
        self.page.save_screenshot(ScreenshotParams::builder().full_page(true).build(), file).await.unwrap();
    }

    /// Where the page is.
    pub(crate) async fn address(&self) -> String {
        self.page.url().await.unwrap().unwrap_or_default()
    }

    /// Clicks an element with the mouse, once the page is loaded and the element keeps its place.
    pub(crate) async fn click(&self, selector: &str) {
        // Finds the element again if a live update replaces it before the click.
        for _ in 0..CLICKS {
            self.wait_for(selector).await;
            self.wait_until(&format!("document.readyState === 'complete' && !!document.querySelector(`{selector}`)"))
                .await;
            let place = format!("JSON.stringify(document.querySelector(`{selector}`)?.getBoundingClientRect())");
            let before = self.value(&place).await;
            tokio::time::sleep(STILL).await;
            if self.value(&place).await != before {
                continue;
            }
            if let Ok(element) = self.page.find_element(selector).await
                && element.click().await.is_ok()
            {
                return;
            }
        }
        panic!("{selector} cannot be clicked on {:?}", self.page.url().await);
    }

    /// Clicks an element that is in view, without running any script in the page.
    pub(crate) async fn click_plainly(&self, selector: &str) {
        self.wait_for(selector).await;
        let point = self.page.find_element(selector).await.unwrap().clickable_point().await.unwrap();
        self.page.click(point).await.unwrap();
    }

    /// Moves the mouse over an element.
    pub(crate) async fn point_at(&self, selector: &str) {
        self.wait_for(selector).await;
        let element = self.page.find_element(selector).await.unwrap();
        // Scrolling, of which a page hears one frame later, hides what it shows at the pointer.
        element.scroll_into_view().await.unwrap();
        self.value("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done('drawn'))))")
            .await;
        element.hover().await.unwrap();
    }

    /// Emulates a touch screen from here on.
    pub(crate) async fn become_touch_screen(&self) {
        self.page.execute(SetTouchEmulationEnabledParams::new(true)).await.unwrap();
    }

    /// Touches an element with a finger.
    pub(crate) async fn touch(&self, selector: &str) {
        self.wait_for(selector).await;
        let element = self.page.find_element(selector).await.unwrap();
        element.scroll_into_view().await.unwrap();
        let at = element.clickable_point().await.unwrap();
        for (kind, touch_points) in [
            (DispatchTouchEventType::TouchStart, vec![TouchPoint::new(at.x, at.y)]),
            (DispatchTouchEventType::TouchEnd, vec![]),
        ] {
            self.page.execute(Touched { kind, touch_points }).await.unwrap();
        }
    }

    /// Replaces the text of a field.
    pub(crate) async fn fill(&self, selector: &str, text: &str) {
        self.wait_for(selector).await;
        self.run(&format!("document.querySelector('{selector}').select()")).await;
        self.type_text(text).await;
    }

    /// Types into the focused element.
    pub(crate) async fn type_text(&self, text: &str) {
        self.page.execute(InsertTextParams::new(text)).await.unwrap();
    }

    /// Presses a key, after navigation if a page is loading.
    pub(crate) async fn press(&self, key: &str) {
        for _ in 0..100 {
            if let Ok(body) = self.page.find_element("body").await
                && body.press_key(key).await.is_ok()
            {
                return;
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
        panic!("no page to press {key} on");
    }

    /// Presses a letter while the control key is held.
    pub(crate) async fn press_with_control(&self, letter: &str) {
        for kind in [DispatchKeyEventType::RawKeyDown, DispatchKeyEventType::KeyUp] {
            let pressed = DispatchKeyEventParams {
                modifiers: Some(CONTROL),
                key: Some(letter.to_owned()),
                code: Some(format!("Key{}", letter.to_uppercase())),
                ..DispatchKeyEventParams::new(kind)
            };
            self.page.execute(pressed).await.unwrap();
        }
    }

    /// How many elements there are.
    pub(crate) async fn count(&self, selector: &str) -> usize {
        self.page.find_elements(selector).await.map_or(0, |found| found.len())
    }

    /// The text of an element, once it is there.
    pub(crate) async fn text(&self, selector: &str) -> String {
        self.wait_for(selector).await;
        self.value(&format!("document.querySelector({selector:?})?.innerText ?? ''")).await
    }

    /// Runs a script, after navigation if a page is loading.
    pub(crate) async fn run(&self, script: &str) {
        for _ in 0..100 {
            if self.page.evaluate(format!("(() => {{ {script} }})()")).await.is_ok() {
                return;
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
        panic!("cannot run on {:?}: {script}", self.page.url().await);
    }

    /// Makes known what a script defines.
    pub(crate) async fn define(&self, script: &str) {
        self.page.evaluate(script.to_owned()).await.unwrap();
    }

    /// The value of an expression, or the result of a promise, as JSON text or plain string. Waits for navigation if a
    /// page is loading.
    pub(crate) async fn value(&self, expression: &str) -> String {
        for _ in 0..100 {
            match self.page.evaluate(expression.to_owned()).await {
                Ok(found) => {
                    let value = found.value().cloned().unwrap_or_default();
                    return value.as_str().map_or_else(|| value.to_string(), str::to_owned);
                }
                Err(error) if error.to_string().contains("Cannot find context") => {
                    tokio::time::sleep(Duration::from_millis(50)).await;
                }
                Err(error) => panic!("{expression}: {error}"),
            }
        }
        panic!("no page has a value for {expression}");
    }

    /// Changes the size of the window.
    pub(crate) async fn resize(&self, width: i64, height: i64) {
        self.page.execute(SetDeviceMetricsOverrideParams::new(width, height, 1.0, false)).await.unwrap();
        tokio::time::sleep(Duration::from_millis(100)).await;
    }

    /// No request left the origin, and the console is empty.
    pub(crate) async fn is_clean(&self, origin: &str) {
        tokio::time::sleep(Duration::from_millis(100)).await;
        let requests = self.requests.lock().unwrap();
        let foreign: Vec<_> = requests
            .iter()
            .filter(|url| !url.starts_with(origin) && !url.starts_with("data:") && !url.starts_with("about:"))
            .collect();
        assert!(foreign.is_empty(), "requests to other origins: {foreign:?}");
        let complaints = self.complaints.lock().unwrap();
        assert!(complaints.is_empty(), "{complaints:?}");
    }
}
