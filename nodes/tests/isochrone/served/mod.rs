//! The page that `view` serves, asked as a program asks.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use isochrone_testing::plants::{TANK, tank};
use isochrone_testing::{Domain, PATIENCE, Process};

/// The tank with more to look at: a saw tooth, and `scale`, whose input is a parameter. Its level may be late.
pub(crate) fn served_tank() -> String {
    let more = "[[block]]\nname = \"saw\"\ntype = \"SawTooth\"\nin = { incrementRange = 1, numberSteps = 30 }\n\
                [[block]]\nname = \"trim\"\ntype = \"LimRateOfChangeCI\"\nin = { setChangeRate = 10.0 }\n\
                [[block]]\nname = \"scale\"\ntype = \"ScaleLinear\"\n\
                in = { x = 1.0, x1 = 0.0, y1 = 0.0, x2 = 1.0, y2 = 1.0, yMin = -100.0, yMax = 100.0 }\n";
    TANK.replace("200ms", "2s") + more
}

/// A node, and its page.
pub(crate) fn serve(arguments: &str) -> (Domain, Process, Served) {
    let (domain, node) = tank(&served_tank());
    let served = Served::start(&domain, arguments);
    (domain, node, served)
}

/// A view that serves.
pub(crate) struct Served {
    pub(crate) process: Process,
    pub(crate) port: u16,
    pub(crate) url: String,
    token: Option<String>,
}

/// An answer.
#[derive(Debug)]
pub(crate) struct Reply {
    pub(crate) status: u16,
    pub(crate) head: String,
    pub(crate) body: String,
}

impl Served {
    /// Serves a node's page on a free port.
    pub(crate) fn start(domain: &Domain, arguments: &str) -> Self {
        let mut process = domain.start(&format!("view {arguments} --port 0"));
        let mut url = String::new();
        process.wait_until("its URL", |stdout, _| {
            url = stdout.lines().next().unwrap_or_default().to_owned();
            !url.is_empty()
        });
        let (address, token) = match url.split_once("/#token=") {
            Some((address, token)) => (address, Some(token.to_owned())),
            None => (url.trim_end_matches('/'), None),
        };
        let port = address.rsplit_once(':').unwrap().1.parse().unwrap();
        Self { process, port, url, token }
    }

    pub(crate) fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream
    }

    /// Sends these bytes, and reads the answer.
    pub(crate) fn ask(&self, request: &[u8]) -> Reply {
        let mut stream = self.connect();
        // One that is refused may not be read to its end.
        let _ = stream.write_all(request);
        let _ = stream.shutdown(Shutdown::Write);
        Reply::read(stream)
    }

    /// A request with these headers besides the right `Host`.
    pub(crate) fn request(&self, line: &str, headers: &str, body: &str) -> Reply {
        let (port, length) = (self.port, body.len());
        let headers = format!("Host: 127.0.0.1:{port}\r\nContent-Length: {length}\r\n{headers}");
        self.ask(format!("{line} HTTP/1.1\r\n{headers}\r\n{body}").as_bytes())
    }

    pub(crate) fn get(&self, path: &str) -> Reply {
        self.request(&format!("GET {path}"), "", "")
    }

    /// What the page posts, with the token that the URL has.
    pub(crate) fn post(&self, path: &str, body: &Value) -> Reply {
        let token = self.token.as_deref().unwrap_or_default();
        let headers = format!(
            "Origin: http://127.0.0.1:{}\r\nContent-Type: application/json\r\nX-Isochrone-Token: {token}\r\n",
            self.port
        );
        self.request(&format!("POST {path}"), &headers, &body.to_string())
    }

    /// Opens a page, and has it look at these signals.
    pub(crate) fn page(&self, rows: &[&str], curves: &[&str]) -> Page {
        let mut page = self.events();
        let hello = page.next("hello");
        page.look = json!({ "page": hello["page"], "look": { "rows": rows, "curves": curves } });
        let reply = page.tell_look();
        assert_eq!(reply.status, 200, "{reply:?}");
        page
    }

    /// Opens a stream of events.
    pub(crate) fn events(&self) -> Page {
        let mut stream = self.connect();
        write!(stream, "GET /events HTTP/1.1\r\nHost: localhost:{}\r\n\r\n", self.port).unwrap();
        Page {
            lines: BufReader::new(stream),
            port: self.port,
            look: Value::Null,
            told: Instant::now(),
        }
    }
}

impl Reply {
    fn read(mut stream: TcpStream) -> Self {
        let mut bytes = Vec::new();
        stream.read_to_end(&mut bytes).unwrap();
        let text = String::from_utf8(bytes).unwrap();
        let (head, body) = text.split_once("\r\n\r\n").unwrap_or((&text, ""));
        let status = head.split(' ').nth(1).unwrap_or_else(|| panic!("{text:?}")).parse().unwrap();
        Self { status, head: head.to_owned(), body: body.to_owned() }
    }

    pub(crate) fn of(stream: TcpStream) -> Self {
        Self::read(stream)
    }

    pub(crate) fn json(&self) -> Value {
        serde_json::from_str(&self.body).unwrap_or_else(|error| panic!("{error}: {self:?}"))
    }
}

/// An open page.
pub(crate) struct Page {
    lines: BufReader<TcpStream>,
    port: u16,
    /// What it posts of itself; null before it knows its name.
    look: Value,
    told: Instant,
}

impl Page {
    /// Says what it looks at.
    fn tell_look(&mut self) -> Reply {
        self.told = Instant::now();
        let (port, body) = (self.port, self.look.to_string());
        let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        let length = body.len();
        write!(
            stream,
            "POST /look HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nContent-Type: application/json\r\n\
             Content-Length: {length}\r\n\r\n{body}"
        )
        .unwrap();
        Reply::read(stream)
    }

    /// The data of the next event of a kind.
    #[track_caller]
    pub(crate) fn next(&mut self, kind: &str) -> Value {
        self.until(kind, |_| true)
    }

    /// The data of the first event of a kind that is as wanted.
    #[track_caller]
    pub(crate) fn until(&mut self, kind: &str, mut is_wanted: impl FnMut(&Value) -> bool) -> Value {
        let wanted = format!("event: {kind}");
        let mut is_of_kind = false;
        let since = Instant::now();
        loop {
            assert!(since.elapsed() < PATIENCE, "no event \"{kind}\" as it is wanted");
            let mut line = String::new();
            let count = self.lines.read_line(&mut line).unwrap_or_else(|error| {
                panic!("no event \"{kind}\" as it is wanted: {error}");
            });
            assert!(count > 0, "the page ended before an event \"{kind}\" as it is wanted");
            // As a page says that it is there.
            if !self.look.is_null() && self.told.elapsed() > Duration::from_secs(5) {
                self.tell_look();
            }
            let line = line.trim_end();
            match line.strip_prefix("data: ") {
                Some(data) if is_of_kind => {
                    let data: Value = serde_json::from_str(data).unwrap();
                    if kind == "hello" {
                        self.look =
                            json!({ "page": data["page"], "look": { "rows": [], "curves": [] } });
                    }
                    if is_wanted(&data) {
                        return data;
                    }
                }
                Some(_) => {}
                None if line.starts_with("event: ") => is_of_kind = line == wanted,
                None => {}
            }
        }
    }

    /// Reads until the server says nothing more.
    pub(crate) fn read_to_end(mut self) -> String {
        let mut text = String::new();
        let _ = self.lines.read_to_string(&mut text);
        text
    }
}
