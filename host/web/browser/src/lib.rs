//! Opens the page in a headless Chromium and in Firefox for its tests. Any failure here must fail
//! the calling test, so the functions panic instead of returning errors.

#![allow(clippy::missing_panics_doc, reason = "a panic fails the test")]

mod firefox;

use std::sync::{Arc, Mutex};
use std::thread::{panicking, sleep};
use std::time::{Duration, Instant};

use headless_chrome::browser::default_executable;
use headless_chrome::protocol::cdp::Log::LogEntryLevel;
use headless_chrome::protocol::cdp::types::{Event, Method};
use headless_chrome::{LaunchOptions, Tab};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use firefox::Firefox;

/// A timeout that is longer than any operation here takes, so that no test depends on the speed of
/// the machine.
const LONG: Duration = Duration::from_secs(120);

/// The time limit of Firefox. A test uses it for a small part of this time.
const LONGEST: Duration = Duration::from_secs(1200);

/// The last text that a test writes to the console. When it arrives, all earlier complaints have
/// arrived.
const END: &str = "the test is over";

/// Defines commands to Chromium whose parameters and answers are plain JSON. Chromium may be newer
/// than the crate's types, and its answers may then not fit those types.
macro_rules! commands {
    ($($name:ident: $method:literal,)*) => {$(
        #[derive(Debug, Serialize)]
        struct $name(Value);

        impl Method for $name {
            const NAME: &'static str = $method;
            type ReturnObject = Value;
        }
    )*};
}
commands! {
    Evaluate: "Runtime.evaluate",
    AccessibilityTree: "Accessibility.getFullAXTree",
    Media: "Emulation.setEmulatedMedia",
    Metrics: "Emulation.setDeviceMetricsOverride",
}

/// A browser under the control of a test.
trait Browser {
    fn navigate(&self, url: &str);
    /// Runs a script in the page. Returns the value of the script's last expression, or the exception.
    fn tried(&self, script: &str) -> Result<Value, String>;
    fn press(&self, key: &str);
    fn resize(&self, width: u32, height: u32);
    /// Returns the warnings, errors and violations of the security policy that the page has caused so far.
    fn complaints(&self) -> Vec<String>;
    /// Returns Chromium, for operations that are implemented only there. Panics in another browser.
    fn chromium(&self) -> &Chromium {
        panic!("this operation is implemented only for Chromium")
    }
}

/// The page, open in a browser of its own. When the page is dropped, the test fails if the browser
/// has reported an error, a warning or a violation of the page's security policy.
pub struct Page {
    browser: Box<dyn Browser>,
}

struct Chromium {
    // Chromium ends when this value is dropped.
    _browser: headless_chrome::Browser,
    tab: Arc<Tab>,
    complaints: Arc<Mutex<Vec<String>>>,
}

impl Chromium {
    fn start() -> Self {
        let chromium = default_executable()
            .expect("there is no Chromium in PATH; on Debian, as root: apt-get install chromium");
        let options = LaunchOptions::default_builder()
            .path(Some(chromium))
            // Chromium's sandbox works neither as root nor in many containers. The page is ours, so it
            // needs no sandbox.
            .sandbox(false)
            .idle_browser_timeout(LONG)
            .build()
            .expect("these options can be combined");
        let browser = headless_chrome::Browser::new(options).expect("Chromium starts");
        browser.set_default_timeout(LONG);
        let tab = browser.new_tab().expect("Chromium opens a tab");
        let complaints = Arc::new(Mutex::new(Vec::new()));
        let heard = Arc::clone(&complaints);
        let listener = move |event: &Event| {
            if let Some(complaint) = complaint(event) {
                heard
                    .lock()
                    .expect("no other thread panicked")
                    .push(complaint);
            }
        };
        tab.add_event_listener(Arc::new(listener))
            .and_then(|_| tab.enable_log()?.enable_runtime().map(drop))
            .expect("Chromium reports what is written to its console");
        Self {
            _browser: browser,
            tab,
            complaints,
        }
    }

    fn call(&self, command: impl Method<ReturnObject = Value> + Serialize) -> Value {
        let answer = self.tab.call_method(command);
        answer.expect("Chromium knows the command")
    }
}

impl Browser for Chromium {
    fn navigate(&self, url: &str) {
        self.tab.navigate_to(url).expect("the page can be opened");
    }

    fn tried(&self, script: &str) -> Result<Value, String> {
        let parameters = json!({"expression": script, "returnByValue": true, "awaitPromise": true});
        let answer = self.tab.call_method(Evaluate(parameters));
        let answer = answer.map_err(|error| error.to_string())?;
        match answer.get("exceptionDetails") {
            Some(exception) => Err(exception.to_string()),
            None => Ok(answer["result"]["value"].clone()),
        }
    }

    fn press(&self, key: &str) {
        self.tab.press_key(key).expect("the key exists");
    }

    fn resize(&self, width: u32, height: u32) {
        let size =
            json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": false});
        self.call(Metrics(size));
    }

    fn complaints(&self) -> Vec<String> {
        self.tried(&format!("console.debug('{END}')"))
            .expect("the console is writable");
        let complaints = || self.complaints.lock().expect("no other thread panicked");
        wait_until("the last text in the console", || {
            complaints().last().is_some_and(|last| last.contains(END))
        });
        complaints().pop();
        complaints().clone()
    }

    fn chromium(&self) -> &Chromium {
        self
    }
}

impl Page {
    /// Starts Chromium with an empty tab, 1280 pixels wide.
    #[must_use]
    pub fn none() -> Self {
        Self::in_browser(Box::new(Chromium::start()))
    }

    /// Opens the page in Chromium. `moment` is the part of the address after the #.
    #[must_use]
    pub fn at(moment: &str) -> Self {
        let page = Self::none();
        page.open(moment);
        page
    }

    /// Opens the page in Chromium and then in Firefox.
    pub fn in_each(moment: &str) -> impl Iterator<Item = Self> {
        let firefox = || Self::in_browser(Box::new(Firefox::start()));
        let pages = [Self::none as fn() -> Self, firefox];
        pages.into_iter().map(move |page| {
            let page = page();
            page.open(moment);
            page
        })
    }

    fn in_browser(browser: Box<dyn Browser>) -> Self {
        browser.resize(1280, 900);
        Self { browser }
    }

    /// Loads the page with `moment` after the # in its address.
    pub fn open(&self, moment: &str) {
        let page = built("FRAMELOCK_PAGE");
        // Go to another page first, because changing only the part after the # would not reload the
        // page.
        self.browser.navigate("about:blank");
        let address = format!("file://{page}#{moment}");
        self.browser.navigate(&address);
        self.wait_for("window.framelock && JSON.parse(framelock()).address");
    }

    /// Runs a script.
    pub fn run(&self, script: &str) {
        let _: Value = self.read(script);
    }

    /// Runs a script. Returns the value of the script's last expression.
    #[must_use]
    pub fn read<T: DeserializeOwned>(&self, script: &str) -> T {
        let value = self.browser.tried(script);
        let value = value
            .and_then(|value| serde_json::from_value(value).map_err(|error| error.to_string()));
        value.unwrap_or_else(|error| panic!("{script}\n{error}"))
    }

    /// Waits until the script returns a value that JavaScript treats as true.
    pub fn wait_for(&self, condition: &str) {
        wait_until(condition, || {
            self.browser.tried(&format!("!!({condition})")) == Ok(Value::Bool(true))
        });
    }

    /// Returns the page's state.
    #[must_use]
    pub fn state(&self) -> Value {
        self.read("JSON.parse(framelock())")
    }

    /// Moves the slider to a position. Returns the page's state there.
    #[must_use]
    pub fn go(&self, position: usize) -> Value {
        self.read(&format!(
            "{{ const slider = document.getElementById('position');
            slider.value = {position};
            slider.dispatchEvent(new Event('input'));
            JSON.parse(framelock()) }}"
        ))
    }

    /// Presses a key, `ArrowLeft` for example.
    pub fn press(&self, key: &str) {
        self.browser.press(key);
    }

    /// Sets a preference of the user's system, such as `prefers-color-scheme` to `dark`.
    pub fn prefer(&self, feature: &str, value: &str) {
        let features = json!({"features": [{"name": feature, "value": value}]});
        self.browser.chromium().call(Media(features));
    }

    /// Resizes the page to this width and height in pixels.
    pub fn resize(&self, width: u32, height: u32) {
        self.browser.resize(width, height);
    }

    /// Returns the role and the name of each element that a screen reader announces.
    #[must_use]
    pub fn accessible(&self) -> Vec<(String, String)> {
        let tree = self.browser.chromium().call(AccessibilityTree(json!({})));
        let nodes = tree["nodes"].as_array().expect("a list of nodes");
        let text = |value: &Value| value["value"].as_str().unwrap_or_default().to_owned();
        let heard = nodes.iter().filter(|node| node["ignored"] == false);
        heard
            .map(|node| (text(&node["role"]), text(&node["name"])))
            .collect()
    }

    /// Returns a screenshot of the page as PNG.
    #[must_use]
    pub fn picture(&self) -> Vec<u8> {
        use headless_chrome::protocol::cdp::Page::CaptureScreenshotFormatOption::Png;
        let picture = self
            .browser
            .chromium()
            .tab
            .capture_screenshot(Png, None, None, true);
        picture.expect("Chromium takes a screenshot")
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        if panicking() {
            return;
        }
        let complaints = self.browser.complaints();
        let complaints = complaints.join("\n");
        assert!(
            complaints.is_empty(),
            "the browser reported problems:\n{complaints}"
        );
    }
}

fn wait_until(what: &str, is_so: impl Fn() -> bool) {
    let begin = Instant::now();
    while !is_so() {
        assert!(begin.elapsed() < LONG, "timed out waiting for {what}");
        sleep(Duration::from_millis(20));
    }
}

/// Returns the text of a warning or an error in the browser's console. The page's own script writes
/// nothing to the console, so any text from a script counts as a complaint.
fn complaint(event: &Event) -> Option<String> {
    match event {
        Event::LogEntryAdded(event) => {
            let entry = &event.params.entry;
            let matters = matches!(entry.level, LogEntryLevel::Warning | LogEntryLevel::Error);
            matters.then(|| format!("{:?}: {}", entry.source, entry.text))
        }
        Event::RuntimeExceptionThrown(event) => Some(format!("{:?}", event.params)),
        Event::RuntimeConsoleAPICalled(event) => Some(format!("{:?}", event.params.args)),
        _ => None,
    }
}

/// Returns the path of a file that the stage `web` builds. The stage writes the path to this environment variable.
#[must_use]
pub fn built(variable: &str) -> String {
    let path = std::env::var(variable);
    path.unwrap_or_else(|_| panic!("{variable}: run `cargo xtask verify --only web`"))
}
