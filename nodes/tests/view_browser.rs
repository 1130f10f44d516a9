//! The page of a running node in a browser.
//!
//! It needs Chromium and its driver. Without them the test skips itself, but not where `CI` is set.

mod domain;
mod served;

use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::{Command, Stdio};

use domain::{Domain, Process, not_tested, tank, wait_until};
use serde_json::{Value, json};
use served::{Served, TANK};

/// A browser, by the WebDriver protocol.
struct Browser {
    port: u16,
    session: String,
    _driver: Process,
}

impl Browser {
    /// Starts one; `None` where there is none.
    fn start(domain: &Domain) -> Option<Self> {
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
        let profile = format!("--user-data-dir={}", domain.path("profile").display());
        let capabilities = json!({ "capabilities": { "alwaysMatch": {
            "goog:loggingPrefs": { "browser": "ALL" },
            "goog:chromeOptions": { "args": ["--headless=new", "--no-sandbox", "--disable-gpu",
                "--disable-dev-shm-usage", "--no-first-run", "--disable-background-networking",
                "--disable-component-update", "--disable-sync", "--disable-extensions", profile] },
        } } });
        let mut browser = Self { port: port.unwrap(), session: String::new(), _driver: driver };
        let session = browser.call("POST", "", capabilities);
        browser.session = format!("/{}", session["sessionId"].as_str().unwrap());
        Some(browser)
    }

    #[track_caller]
    fn call(&self, method: &str, path: &str, body: Value) -> Value {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(domain::PATIENCE)).unwrap();
        let (session, body) = (&self.session, body.to_string());
        write!(
            stream,
            "{method} /session{session}{path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\
             Content-Type: application/json\r\nContent-Length: {}\r\n\r\n{body}",
            body.len()
        )
        .unwrap();
        let mut answer = Vec::new();
        // The driver may keep the connection: its answer has a length.
        let head_end = loop {
            let mut part = [0; 4096];
            let count = stream.read(&mut part).unwrap();
            answer.extend_from_slice(&part[..count]);
            let end = answer.windows(4).position(|four| four == b"\r\n\r\n");
            if let Some(end) = end {
                break end + 4;
            }
            assert!(count > 0, "{}", String::from_utf8_lossy(&answer));
        };
        let head = String::from_utf8_lossy(&answer[..head_end]).to_ascii_lowercase();
        let length = head.lines().find_map(|line| line.strip_prefix("content-length:")).unwrap();
        let length: usize = length.trim().parse().unwrap();
        while answer.len() < head_end + length {
            let mut part = [0; 65536];
            let count = stream.read(&mut part).unwrap();
            assert!(count > 0, "the driver closed the connection");
            answer.extend_from_slice(&part[..count]);
        }
        let answer: Value = serde_json::from_slice(&answer[head_end..]).unwrap();
        let value = answer["value"].clone();
        assert!(value["error"].is_null(), "{path}: {value}");
        value
    }

    #[track_caller]
    fn open(&self, url: &str) {
        self.call("POST", "/url", json!({ "url": url }));
    }

    /// What a script returns.
    #[track_caller]
    fn run(&self, script: &str) -> Value {
        self.call("POST", "/execute/sync", json!({ "script": script, "args": [] }))
    }

    /// Waits until a script returns true.
    #[track_caller]
    fn wait_for(&self, what: &str, script: &str) {
        wait_until(what, || self.run(script) == true);
    }

    #[track_caller]
    fn wait_for_text(&self, selector: &str, text: &str) {
        let (selector, text) = (json!(selector), json!(text));
        self.wait_for(
            &format!("{selector} says {text}"),
            &format!(
                "return document.querySelector({selector})?.innerText.includes({text}) ?? false"
            ),
        );
    }

    fn resize(&self, width: u32, height: u32) {
        let params =
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        let command = json!({ "cmd": "Emulation.setDeviceMetricsOverride", "params": params });
        self.call("POST", "/goog/cdp/execute", command);
    }

    /// What the browser has against the page since the last time.
    fn complaints(&self) -> Vec<Value> {
        self.call("POST", "/se/log", json!({ "type": "browser" })).as_array().unwrap().clone()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            self.call("DELETE", "", json!({}));
        }
    }
}

#[test]
fn curves_move_a_parameter_is_set_and_a_node_that_went_away_comes_back() {
    let (domain, node) = tank(TANK);
    let Some(browser) = Browser::start(&domain) else { return };
    let served = Served::start(&domain, "tank --allow-write");
    browser.resize(1400, 1000);
    browser.open(&served.url);
    browser.wait_for_text("#node", "tank");
    browser.wait_for_text("#state", "runs");
    assert_eq!(browser.run("return location.hash"), "", "the token does not stay in the address");

    // A search and a tick, as people do it.
    browser.run(
        "const search = document.getElementById('search'); search.value = 'saw.value'; \
         search.dispatchEvent(new Event('input'))",
    );
    browser.wait_for_text("#count", "1 of ");
    browser.run("document.querySelector('#table tr.signal input').click()");
    let drawn = "return [...document.querySelectorAll('.strip canvas')].at(-1).toDataURL()";
    browser.wait_for_text("#strips", "saw.value");
    browser.wait_for_text("#strips .strip:last-child .range", "max ");
    let before = browser.run(drawn);
    wait_until("the curve moves", || browser.run(drawn) != before);
    browser.wait_for_text("#task-list", "all seen");
    browser.wait_for_text("#alarm-list", "level");

    browser.run(
        "const search = document.getElementById('search'); search.value = 'ramp rate'; \
         search.dispatchEvent(new Event('input'))",
    );
    browser.wait_for_text("#table tr.signal .value", "10");
    browser.run("document.querySelector('#table tr.signal .name button').click()");
    browser.wait_for_text("#chosen", "0 to 50");
    let set = |value: &str| {
        browser.run(&format!(
            "document.getElementById('setting-value').value = '{value}'; \
             document.querySelector('#setting button').click()"
        ));
    };
    set("60");
    browser.wait_for_text("#told", "60 is outside of the limits: 0 to 50");
    // The browser says that the answer was not 200.
    assert!(browser.complaints().iter().all(|it| it["message"].as_str().unwrap().contains("409")));
    set("7.5");
    browser.wait_for_text("#told", "set ramp.setChangeRate to 7.5 1/s, from cycle");
    browser.wait_for_text("#table tr.signal .value", "7.5");
    let get = || domain.run("get tank ramp.setChangeRate").expect_code(0).stdout;
    assert_eq!(get().trim(), "7.5");
    browser.run("document.querySelector('#told button').click()");
    browser.wait_for_text("#told", "taken back from cycle");
    assert_eq!(get().trim(), "10");

    node.kill();
    browser.wait_for_text("#notice", "The node is gone");
    browser.wait_for(
        "no value stays",
        "return document.querySelector('#table tr.signal .value').innerText === '–'",
    );
    let mut second = domain.start("run tank.toml");
    second.wait_for("is running");
    browser.wait_for_text("#notice", "The node came back");
    browser.wait_for_text("#table tr.signal .value", "10");
    let before = browser.run(drawn);
    wait_until("the curve moves again", || browser.run(drawn) != before);
    assert_eq!(browser.complaints(), [] as [Value; 0]);

    // What the page showed when its server ended is not true any more.
    served.process.stop().expect_code(0);
    browser.wait_for_text("#state", "not connected");
    // Longer than the page takes to try again, and to look at its state.
    std::thread::sleep(std::time::Duration::from_millis(2500));
    browser.wait_for(
        "no value stays",
        "return document.querySelector('#table tr.signal .value').innerText === '–' \
           && document.getElementById('state').innerText.includes('not connected')",
    );
    drop(browser);
    second.stop().expect_code(0);
}

#[test]
fn the_page_fits_a_screen_and_a_phone_and_a_reader_cannot_set() {
    let (domain, node) = tank(TANK);
    let Some(browser) = Browser::start(&domain) else { return };
    let served = Served::start(&domain, "tank");
    for (width, height) in [(1400, 1000), (390, 844)] {
        browser.resize(width, height);
        browser.open(&served.url);
        browser.wait_for_text("#table tr.signal .value", "0");
        browser.wait_for(
            "curves",
            "return document.getElementById('strips').textContent.includes('max ')",
        );
        let loose = browser.run(
            "const page = document.documentElement; \
             const beyond = [...document.querySelectorAll('section, .strip canvas, #table, .task table, button, input')] \
               .filter(it => it.getClientRects().length && it.getBoundingClientRect().right > page.clientWidth + 1); \
             return [page.scrollWidth - page.clientWidth, beyond.map(it => it.outerHTML.slice(0, 80))]",
        );
        assert_eq!(loose, json!([0, []]), "{width} x {height}");
        let empty = browser.run(
            "return [...document.querySelectorAll('.strip canvas, .task canvas')].filter(it => it.width < 200).length",
        );
        assert_eq!(empty, 0, "{width} x {height}");
        let unnamed = browser.run(
            "return [...document.querySelectorAll('button, input, select, canvas')].filter(it => \
               !(it.innerText || it.getAttribute('aria-label') || it.labels?.length)).map(it => it.outerHTML)",
        );
        assert_eq!(unnamed, json!([]), "everything has a name for who cannot see it");
    }
    browser.run(
        "const role = document.getElementById('role'); role.value = 'parameter'; \
         role.dispatchEvent(new Event('change')); document.querySelector('#table tr.signal .name button').click()",
    );
    browser.wait_for_text("#chosen", "isochrone view --allow-write");
    assert_eq!(browser.run("return document.getElementById('setting').checkVisibility()"), false);
    assert_eq!(browser.complaints(), [] as [Value; 0]);
    drop(browser);
    served.process.stop().expect_code(0);
    node.stop().expect_code(0);
}
