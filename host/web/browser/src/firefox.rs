//! Controls Firefox through Marionette, its built-in automation protocol: JSON commands over TCP,
//! each preceded by its length.

use std::cell::Cell;
use std::io::{Read as _, Write as _};
use std::net::{Ipv4Addr, TcpStream};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::{env, fs, process};

use framelock_limited::Process;
use serde_json::{Value, json};

use crate::{Browser, LONG, LONGEST, wait_until};

/// A separate Firefox process. It ends at its time limit, or when this value is dropped.
pub(crate) struct Firefox {
    process: Process,
    profile: PathBuf,
    connection: TcpStream,
    commands: Cell<u32>,
}

impl Firefox {
    pub(crate) fn start() -> Self {
        static STARTED: AtomicU32 = AtomicU32::new(0);
        let nth = STARTED.fetch_add(1, Ordering::Relaxed);
        let profile = env::temp_dir().join(format!("framelock-firefox-{}-{nth}", process::id()));
        let _ = fs::remove_dir_all(&profile);
        fs::create_dir(&profile).expect("the temporary folder is writable");
        // Port 0 stands for any free port. Firefox writes the port that it chose to a file.
        fs::write(
            profile.join("user.js"),
            "user_pref('marionette.port', 0);\n",
        )
        .expect("the profile is writable");
        let start = |program: &&str| {
            let mut command = Command::new(program);
            // Firefox's console and preferences belong to the system context, which a page cannot
            // access.
            command.args(["--headless", "--marionette", "--remote-allow-system-access"]);
            command.args(["--no-remote", "--profile"]).arg(&profile);
            command.stdout(Stdio::null()).stderr(Stdio::null());
            Process::start_within(LONGEST, &mut command).ok()
        };
        let process = ["firefox-esr", "firefox"]
            .iter()
            .find_map(start)
            .expect("there is no Firefox in PATH; on Debian, as root: apt-get install firefox-esr");
        let port = || {
            let port = fs::read_to_string(profile.join("MarionetteActivePort")).ok()?;
            port.trim().parse::<u16>().ok()
        };
        wait_until("Firefox's port", || port().is_some());
        let port = port().expect("the port was written");
        let connection = TcpStream::connect((Ipv4Addr::LOCALHOST, port)).expect("Firefox listens");
        connection
            .set_read_timeout(Some(LONG))
            .expect("the timeout is not zero");
        let firefox = Self {
            process,
            profile,
            connection,
            commands: Cell::new(0),
        };
        firefox.heard();
        firefox.call("WebDriver:NewSession", &json!({}));
        let most = LONG.as_millis();
        firefox.call(
            "WebDriver:SetTimeouts",
            &json!({"script": most, "pageLoad": most}),
        );
        firefox
    }

    /// Returns the next message from Firefox.
    fn heard(&self) -> Value {
        let mut from = &self.connection;
        let mut byte = || {
            let mut byte = [0];
            from.read_exact(&mut byte).expect("Firefox answers");
            char::from(byte[0])
        };
        let mut length = 0;
        while let Some(digit) = byte().to_digit(10) {
            length = 10 * length + digit;
        }
        let mut text = vec![0; length.try_into().expect("the message is short")];
        from.read_exact(&mut text).expect("Firefox answers");
        serde_json::from_slice(&text).expect("the message is JSON")
    }

    fn tried_call(&self, command: &str, parameters: &Value) -> Result<Value, String> {
        self.commands.set(self.commands.get() + 1);
        let message = json!([0, self.commands.get(), command, parameters]).to_string();
        let message = format!("{}:{message}", message.len());
        let sent = (&self.connection).write_all(message.as_bytes());
        sent.expect("Firefox listens");
        let mut answer = self.heard();
        match answer[2].take() {
            Value::Null => Ok(answer[3].take()),
            error => Err(error.to_string()),
        }
    }

    fn call(&self, command: &str, parameters: &Value) -> Value {
        let answer = self.tried_call(command, parameters);
        answer.unwrap_or_else(|error| panic!("{command}: {error}"))
    }

    /// Runs a function's body in the browser's own context.
    fn in_the_browser(&self, script: &str) -> Value {
        self.call("Marionette:SetContext", &json!({"value": "chrome"}));
        let parameters = json!({"script": script, "args": []});
        let mut answer = self.call("WebDriver:ExecuteScript", &parameters);
        self.call("Marionette:SetContext", &json!({"value": "content"}));
        answer["value"].take()
    }
}

impl Browser for Firefox {
    fn navigate(&self, url: &str) {
        self.call("WebDriver:Navigate", &json!({"url": url}));
    }

    fn tried(&self, script: &str) -> Result<Value, String> {
        let parameters = json!({"script": "return eval(arguments[0])", "args": [script]});
        let mut answer = self.tried_call("WebDriver:ExecuteScript", &parameters)?;
        Ok(answer["value"].take())
    }

    fn press(&self, key: &str) {
        let key = match key {
            "ArrowLeft" => "\u{E012}",
            "ArrowRight" => "\u{E014}",
            "Home" => "\u{E011}",
            "End" => "\u{E010}",
            "Tab" => "\u{E004}",
            "Enter" => "\u{E007}",
            "Delete" => "\u{E017}",
            other => other,
        };
        let strokes = ["keyDown", "keyUp"].map(|stroke| json!({"type": stroke, "value": key}));
        let keys = json!([{"type": "key", "id": "keys", "actions": strokes}]);
        self.call("WebDriver:PerformActions", &json!({"actions": keys}));
    }

    /// Resizes the page. Firefox's windows are at least 500 pixels wide, so for a narrower page the
    /// content is enlarged instead.
    fn resize(&self, width: u32, height: u32) {
        let zoom = (500.0 / f64::from(width)).max(1.0);
        self.in_the_browser(&format!("gBrowser.selectedBrowser.fullZoom = {zoom}"));
        let [across, down] = [width, height].map(|pixels| (f64::from(pixels) * zoom).round());
        let size = json!({"width": across, "height": down});
        self.call("WebDriver:SetWindowRect", &size);
        wait_until("the new window size", || {
            let is = self.tried("innerWidth").ok().and_then(|is| is.as_u64());
            is.is_some_and(|is| is.abs_diff(width.into()) < 4)
        });
    }

    fn complaints(&self) -> Vec<String> {
        // Firefox's console also contains complaints about its own parts.
        let complaints = self.in_the_browser(
            "return Services.console.getMessageArray().map(String).filter((text) => text.includes('index.html'))",
        );
        serde_json::from_value(complaints).expect("a list of texts")
    }
}

impl Drop for Firefox {
    fn drop(&mut self) {
        // Failures do not matter: the test is over, and this only cleans up.
        let _ = self.process.kill().and_then(|()| self.process.wait());
        let _ = fs::remove_dir_all(&self.profile);
    }
}
