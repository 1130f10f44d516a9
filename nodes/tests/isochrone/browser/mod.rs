//! Chromium, as a test drives it.
//!
//! It needs its driver. Without them a test skips itself, but not where `CI` is set.

use std::fs;
use std::io::{self, BufRead, BufReader, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};

use isochrone_testing::{Domain, PATIENCE, Process, not_tested};

/// A browser, by the WebDriver protocol. It is gone with all of its processes and its profile when this is dropped.
pub(crate) struct Browser {
    port: u16,
    session: String,
    driver: Option<Process>,
    profile: PathBuf,
}

impl Browser {
    /// Starts one; `None` where there is none.
    pub(crate) fn start(domain: &Domain) -> Option<Self> {
        let runs = |program: &str| {
            let version = Command::new(program).arg("--version").stderr(Stdio::null()).output();
            version.is_ok_and(|version| version.status.success())
        };
        if !runs("chromedriver") || !runs("chromium") {
            let why = "no chromium and chromedriver on the path; apt-get install chromium-driver";
            assert!(std::env::var_os("CI").is_none(), "{why}");
            not_tested("the page of a running node in a browser", why);
            return None;
        }
        let mut command = Command::new("chromedriver");
        // An ordinary user of a build machine may have no home to write to.
        command
            .arg("--port=0")
            .env("HOME", domain.folder())
            .env("XDG_CONFIG_HOME", domain.path("c"));
        command.env("XDG_CACHE_HOME", domain.path("cache")).env("XDG_RUNTIME_DIR", domain.folder());
        let mut driver = Process::start(command);
        let mut port = None;
        driver.wait_until("its port", |stdout, _| {
            let told =
                stdout.lines().find_map(|line| line.split_once("started successfully on port "));
            port = told.and_then(|(_, port)| port.trim_end_matches('.').parse().ok());
            port.is_some()
        });
        let profile = profile(domain);
        let of_profile = format!("--user-data-dir={}", profile.display());
        let capabilities = json!({ "capabilities": { "alwaysMatch": {
            "goog:loggingPrefs": { "browser": "ALL" },
            "goog:chromeOptions": { "args": ["--headless=new", "--no-sandbox", "--disable-gpu",
                "--disable-dev-shm-usage", "--no-first-run", "--disable-background-networking",
                "--disable-component-update", "--disable-sync", "--disable-extensions", of_profile] },
        } } });
        let (session, driver) = (String::new(), Some(driver));
        let mut browser = Self { port: port.unwrap(), session, driver, profile };
        let session = browser.call("POST", "", capabilities);
        browser.session = format!("/{}", session["sessionId"].as_str().unwrap());
        Some(browser)
    }

    #[track_caller]
    fn call(&self, method: &str, path: &str, body: Value) -> Value {
        self.ask(method, path, body, PATIENCE).unwrap_or_else(|error| panic!("{path}: {error}"))
    }

    /// Asks the driver, and waits so long for each part of its answer.
    fn ask(
        &self,
        method: &str,
        path: &str,
        body: Value,
        patience: Duration,
    ) -> Result<Value, String> {
        let answer = self.exchange(method, path, &body.to_string(), patience);
        let answer = answer.map_err(|error| format!("no answer of the driver: {error}"))?;
        let answer: Value = serde_json::from_slice(&answer).map_err(|error| error.to_string())?;
        let value = answer["value"].clone();
        if value["error"].is_null() { Ok(value) } else { Err(value.to_string()) }
    }

    fn exchange(
        &self,
        method: &str,
        path: &str,
        body: &str,
        patience: Duration,
    ) -> io::Result<Vec<u8>> {
        let stream = TcpStream::connect(("127.0.0.1", self.port))?;
        stream.set_read_timeout(Some(patience))?;
        let session = &self.session;
        write!(
            &stream,
            "{method} /session{session}{path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\
             Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        )?;
        let mut answer = BufReader::new(stream);
        // The driver may keep the connection: its answer has a length.
        let mut length = None;
        loop {
            let mut line = String::new();
            answer.read_line(&mut line)?;
            match line.trim_end().to_ascii_lowercase().split_once(':') {
                Some(("content-length", value)) => length = value.trim().parse().ok(),
                Some(_) => {}
                None if line.trim_end().is_empty() => break,
                None => {}
            }
        }
        let mut body = vec![0; length.ok_or(ErrorKind::UnexpectedEof)?];
        answer.read_exact(&mut body)?;
        Ok(body)
    }

    #[track_caller]
    pub(crate) fn open(&self, url: &str) {
        self.call("POST", "/url", json!({ "url": url }));
    }

    /// What a script returns.
    #[track_caller]
    pub(crate) fn run(&self, script: &str) -> Value {
        self.call("POST", "/execute/sync", json!({ "script": script, "args": [] }))
    }

    /// Waits until a script returns true.
    #[track_caller]
    pub(crate) fn wait_for(&self, what: &str, script: &str) {
        let since = Instant::now();
        while self.run(script) != true {
            if since.elapsed() > PATIENCE {
                let (page, against) =
                    (self.run("return document.body.innerText"), self.complaints());
                panic!("waited until {what}\n{}\n{against:?}", page.as_str().unwrap_or_default());
            }
            thread::sleep(Duration::from_millis(2));
        }
    }

    #[track_caller]
    pub(crate) fn wait_for_text(&self, selector: &str, text: &str) {
        let (selector, text) = (json!(selector), json!(text));
        self.wait_for(
            &format!("{selector} says {text}"),
            &format!(
                "return document.querySelector({selector})?.innerText.includes({text}) ?? false"
            ),
        );
    }

    pub(crate) fn resize(&self, width: u32, height: u32) {
        let params =
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        self.command("Emulation.setDeviceMetricsOverride", params);
    }

    /// What the left button of the mouse does at a point of the window: `mousePressed`, `mouseMoved`, `mouseReleased`.
    pub(crate) fn mouse(&self, kind: &str, (x, y): (f64, f64), clicks: u32) {
        let button = if clicks > 0 { "left" } else { "none" };
        let params =
            json!({ "type": kind, "x": x, "y": y, "button": button, "clickCount": clicks });
        self.command("Input.dispatchMouseEvent", params);
    }

    fn command(&self, command: &str, params: Value) {
        self.call("POST", "/goog/cdp/execute", json!({ "cmd": command, "params": params }));
    }

    /// What the browser has against the page since the last time.
    pub(crate) fn complaints(&self) -> Vec<Value> {
        self.call("POST", "/se/log", json!({ "type": "browser" })).as_array().unwrap().clone()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // In order, if that goes: a test that fails may have a browser that does not answer.
        let _ = self.ask("DELETE", "", json!({}), Duration::from_secs(10));
        self.driver = None;
        let since = Instant::now();
        loop {
            let left = processes_of(&self.profile);
            for process in &left {
                let _ = kill_process(*process, Signal::KILL);
            }
            let is_gone = !self.profile.exists() || fs::remove_dir_all(&self.profile).is_ok();
            if (left.is_empty() && is_gone) || since.elapsed() > PATIENCE {
                break;
            }
            thread::sleep(Duration::from_millis(10));
        }
    }
}

/// Where the browser of a domain has its files.
pub(crate) fn profile(domain: &Domain) -> PathBuf {
    domain.path("profile")
}

/// The browser's processes, which have its profile in their command lines.
pub(crate) fn processes_of(profile: &Path) -> Vec<Pid> {
    let profile = profile.display().to_string();
    let pids = fs::read_dir("/proc").unwrap().flatten();
    let pids = pids.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    let is_its = |pid: &i32| {
        let line = fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
        String::from_utf8_lossy(&line).contains(&profile)
    };
    pids.filter(is_its).filter_map(Pid::from_raw).collect()
}
