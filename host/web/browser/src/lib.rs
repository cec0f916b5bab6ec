//! Opens the page in a headless Chromium and in Firefox for its tests. Any failure here must fail
//! the calling test, so all functions panic.

#![allow(clippy::missing_panics_doc, reason = "a panic fails the test")]

mod firefox;

use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::thread::{panicking, sleep};
use std::time::{Duration, Instant};

use headless_chrome::browser::default_executable;
use headless_chrome::protocol::cdp::Log::LogEntryLevel;
use headless_chrome::protocol::cdp::types::{Event, Method};
use headless_chrome::{Browser, LaunchOptions, Tab};
use serde::Serialize;
use serde_json::{Value, json};

use firefox::Firefox;

/// A timeout that is longer than any operation here takes, so that no test depends on the speed of
/// the machine.
const LONG: Duration = Duration::from_secs(120);

/// The time limit of a browser. A test uses a browser for a small part of this time.
const LONGEST: Duration = Duration::from_secs(1200);

/// The last text that a test writes to the console. When it arrives, all earlier complaints have
/// arrived.
const END: &str = "the test is over";

/// A JavaScript function for scripts. It moves the slider to a position and returns the page's
/// state there.
pub const GO: &str = "const go = (to) => {
    const slider = document.getElementById('position');
    slider.value = to;
    slider.dispatchEvent(new Event('input'));
    return JSON.parse(framelock());
};";

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

/// The page, open in a browser of its own. When the page is dropped, the test fails if the browser
/// has reported an error, a warning or a violation of the page's security policy.
pub struct Page {
    browser: Driven,
}

enum Driven {
    Chromium(Chromium),
    Firefox(Firefox),
}

struct Chromium {
    // Chromium ends when this value is dropped.
    _browser: Browser,
    tab: Arc<Tab>,
    complaints: Arc<Mutex<Vec<String>>>,
}

impl Page {
    /// Starts Chromium with an empty tab, 1280 pixels wide.
    #[must_use]
    pub fn none() -> Self {
        Self::in_browser(Driven::Chromium(Chromium::start()))
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
        let firefox = || Self::in_browser(Driven::Firefox(Firefox::start()));
        let pages = [Self::none as fn() -> Self, firefox];
        pages.into_iter().map(move |page| {
            let page = page();
            page.open(moment);
            page
        })
    }

    fn in_browser(browser: Driven) -> Self {
        let page = Self { browser };
        page.resize(1280, 900);
        page
    }

    /// Returns Chromium. Some operations are implemented only for Chromium.
    fn chromium(&self) -> &Chromium {
        match &self.browser {
            Driven::Chromium(chromium) => chromium,
            Driven::Firefox(_) => panic!("this operation is implemented only for Chromium"),
        }
    }
}

impl Chromium {
    fn start() -> Self {
        let chromium = default_executable()
            .expect("there is no Chromium in PATH; on Debian, as root: apt-get install chromium");
        let options = LaunchOptions::default_builder()
            .path(Some(chromium))
            // The sandbox would need privileges that root and many containers do not have. The page
            // is ours.
            .sandbox(false)
            .idle_browser_timeout(LONG)
            .build()
            .expect("these options can be combined");
        let browser = Browser::new(options).expect("Chromium starts");
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

    fn tried(&self, script: &str) -> Result<Value, String> {
        let parameters = json!({"expression": script, "returnByValue": true, "awaitPromise": true});
        let answer = self.tab.call_method(Evaluate(parameters));
        let answer = answer.map_err(|error| error.to_string())?;
        match answer.get("exceptionDetails") {
            Some(exception) => Err(exception.to_string()),
            None => Ok(answer["result"]["value"].clone()),
        }
    }

    fn call(&self, command: impl Method<ReturnObject = Value> + Serialize) -> Value {
        let answer = self.tab.call_method(command);
        answer.expect("Chromium knows the command")
    }

    /// Returns the complaints reported so far.
    fn complaints(&self) -> Vec<String> {
        self.tried(&format!("console.debug('{END}')"))
            .expect("the console is writable");
        wait_until("the last text in the console", || {
            let complaints = self.complaints.lock().expect("no other thread panicked");
            complaints.last().is_some_and(|last| last.contains(END))
        });
        let mut complaints = self.complaints.lock().expect("no other thread panicked");
        complaints.pop();
        complaints.clone()
    }
}

impl Page {
    /// Reloads the page at this moment.
    pub fn open(&self, moment: &str) {
        let page = built("FRAMELOCK_PAGE");
        // Go to another page first, because changing only the part after the # would not reload the
        // page.
        for url in [
            "about:blank",
            &format!("file://{}#{moment}", page.display()),
        ] {
            match &self.browser {
                Driven::Chromium(chromium) => {
                    let opened = chromium.tab.navigate_to(url);
                    opened.expect("the page can be opened");
                }
                Driven::Firefox(firefox) => firefox.navigate(url),
            }
        }
        self.wait_for("window.framelock && JSON.parse(framelock()).address");
    }

    /// Runs a script. Returns the value of the script's last expression.
    #[allow(
        clippy::must_use_candidate,
        reason = "some scripts are run only for their effect"
    )]
    pub fn run(&self, script: &str) -> Value {
        self.tried(script)
            .unwrap_or_else(|error| panic!("{script}\n{error}"))
    }

    fn tried(&self, script: &str) -> Result<Value, String> {
        match &self.browser {
            Driven::Chromium(chromium) => chromium.tried(script),
            Driven::Firefox(firefox) => firefox.tried(script),
        }
    }

    /// Waits until the script returns a value that JavaScript treats as true.
    pub fn wait_for(&self, condition: &str) {
        wait_until(condition, || {
            self.tried(&format!("!!({condition})")) == Ok(Value::Bool(true))
        });
    }

    /// Returns the page's state.
    #[must_use]
    pub fn state(&self) -> Value {
        self.run("JSON.parse(framelock())")
    }

    /// Moves the slider to a position. Returns the page's state there.
    #[must_use]
    pub fn go(&self, position: u64) -> Value {
        self.run(&format!("{{ {GO} go({position}) }}"))
    }

    /// Presses a key, `ArrowLeft` for example.
    pub fn press(&self, key: &str) {
        match &self.browser {
            Driven::Chromium(chromium) => {
                let pressed = chromium.tab.press_key(key);
                pressed.expect("the key exists");
            }
            Driven::Firefox(firefox) => firefox.press(key),
        }
    }

    /// Sets a preference of the user's system, such as `prefers-color-scheme` to `dark`.
    pub fn prefer(&self, feature: &str, value: &str) {
        let features = json!({"features": [{"name": feature, "value": value}]});
        self.chromium().call(Media(features));
    }

    /// Resizes the page to this number of pixels.
    pub fn resize(&self, width: u32, height: u32) {
        let size =
            json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": false});
        match &self.browser {
            Driven::Chromium(chromium) => {
                chromium.call(Metrics(size));
            }
            Driven::Firefox(firefox) => firefox.resize(width, height),
        }
    }

    /// Returns the role and the name of each element that a screen reader announces.
    #[must_use]
    pub fn accessible(&self) -> Vec<(String, String)> {
        let tree = self.chromium().call(AccessibilityTree(json!({})));
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
        let complaints = match &self.browser {
            Driven::Chromium(chromium) => chromium.complaints(),
            Driven::Firefox(firefox) => firefox.complaints("index.html"),
        };
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

/// Returns the path in an environment variable. The `cargo xtask` command that builds the file sets
/// this variable.
#[must_use]
pub fn built(variable: &str) -> PathBuf {
    let path = std::env::var_os(variable);
    let path = path.unwrap_or_else(|| panic!("{variable}: run `cargo xtask verify --only web`"));
    path.into()
}
