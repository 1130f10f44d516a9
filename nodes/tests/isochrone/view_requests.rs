//! The server of a node's page: who may ask for what, and how many at a time.

use std::io::{Read, Write};

use crate::served::{Reply, Served, serve, served_tank};
use isochrone_testing::plants::tank;
use serde_json::json;

#[test]
fn a_name_of_the_internet_that_leads_here_and_a_page_of_another_server_get_nothing() {
    let (_domain, _node, served) = serve("tank");
    let port = served.port;
    let with = |headers: &str| served.ask(format!("GET / HTTP/1.1\r\n{headers}\r\n").as_bytes());
    for own in [format!("127.0.0.1:{port}"), format!("localhost:{port}"), format!("[::1]:{port}")] {
        assert_eq!(with(&format!("Host: {own}\r\n")).status, 200, "{own}");
        assert_eq!(with(&format!("Host: {own}\r\nOrigin: http://{own}\r\n")).status, 200, "{own}");
    }
    for (headers, status, says) in [
        (format!("Host: evil.example:{port}\r\n"), 403, "through ssh, forward the same port"),
        ("Host: localhost:1\r\n".into(), 403, "forward the same port"),
        (String::new(), 400, "names its Host"),
        (format!("Host: localhost:{port}\r\nHost: localhost:{port}\r\n"), 400, "more than once"),
        (
            format!("Host: localhost:{port}\r\nOrigin: http://evil.example\r\n"),
            403,
            "only the page",
        ),
        (format!("Host: localhost:{port}\r\nOrigin: null\r\n"), 403, "only the page"),
    ] {
        let reply = with(&headers);
        assert_eq!(reply.status, status, "{headers} {reply:?}");
        assert!(reply.body.contains(says), "{headers} {reply:?}");
    }
    let fetched = |path: &str, site: &str| {
        served.request(&format!("GET {path}"), &format!("Sec-Fetch-Site: {site}\r\n"), "").status
    };
    assert_eq!(fetched("/page.js", "same-origin"), 200);
    assert_eq!(fetched("/", "cross-site"), 200, "a link leads here");
    for site in ["cross-site", "same-site"] {
        assert_eq!((fetched("/events", site), fetched("/signals", site)), (403, 403), "{site}");
    }
    let page = served.get("/");
    for header in ["default-src 'none'", "frame-ancestors 'none'", "nosniff", "no-store"] {
        assert!(page.head.contains(header), "{page:?}");
    }
    assert!(!page.head.contains("Access-Control"), "{page:?}");
    assert!(!page.body.contains("<script>") && !page.body.contains("style="), "nothing inline");
}

#[test]
fn what_is_no_request_is_refused_in_a_sentence_and_a_slow_one_given_up_while_others_are_served() {
    let (_domain, _node, served) = serve("tank");
    // It never ends what it began.
    let mut slow = served.connect();
    slow.write_all(b"GET / HTTP/1.1\r\nHost: ").unwrap();
    for path in
        ["/../Cargo.toml", "/page/../page.js", "/%2e%2e/etc/passwd", "/page.js/", "//", "/x"]
    {
        assert_eq!(served.get(path).status, 404, "{path}");
    }
    for path in ["/", "/page.css", "/page.js", "/chart.js", "/icon.svg", "/signals"] {
        let reply = served.get(path);
        assert_eq!(reply.status, 200, "{path}");
        let length = format!("Content-Length: {}", reply.body.len());
        assert!(!reply.body.is_empty() && reply.head.contains(&length), "{path} {}", reply.head);
        let head = served.request(&format!("HEAD {path}"), "", "");
        assert!(head.body.is_empty() && head.head.contains(&length), "{path} {head:?}");
    }
    assert_eq!(served.request("DELETE /", "", "").status, 405);
    let json = "Content-Type: application/json\r\n";
    assert_eq!(served.request("POST /look", json, "no JSON").status, 400);
    assert_eq!(served.request("POST /look", "", "{}").status, 415);
    assert_eq!(served.request("POST /else", json, "{}").status, 404);
    assert_eq!(served.request("POST /look", json, &" ".repeat(100_000)).status, 413);
    assert_eq!(served.request("GET /", &format!("x: {}\r\n", "a".repeat(100_000)), "").status, 431);
    assert_eq!(served.ask(b"\x16\x03\x01\x00\xa5\x01\x00\r\n\r\n").status, 400, "TLS");
    assert_eq!(served.ask(b"\xff\xfe\r\n\r\n").status, 400);
    let look = json!({ "page": "none", "look": { "rows": [], "curves": [] } });
    assert_eq!(served.post("/look", &look).status, 409);
    let reply = Reply::of(slow);
    assert_eq!(reply.status, 408, "{reply:?}");
}

#[test]
fn twenty_pages_see_values_and_curves_one_that_never_reads_hinders_none_and_whoever_comes_after_48_is_told_so()
 {
    let (domain, _node) = tank(&served_tank());
    let publisher = domain.start("publish tank/in --value 1.5 --rate 100");
    let served = Served::start(&domain, "tank");
    let standing = served.page(&["saw.value"], &["saw.value"]);
    let mut pages: Vec<_> = (0..20).map(|_| served.page(&["level"], &["saw.value"])).collect();
    for page in &mut pages {
        let rows = page.until("rows", |rows| rows["level"]["value"] == "1.5");
        assert_eq!(rows["level"]["flags"], json!([]), "{rows}");
        page.until("curves", |news| news["curves"]["saw.value"].is_array());
    }
    publisher.stop().expect_code(0);
    for page in &mut pages {
        page.until("rows", |rows| {
            rows["level"]["marks"].as_str().is_some_and(|it| it.contains('!'))
        });
        page.until("alarms", |alarms| alarms[0]["name"] == "level");
    }
    let mut more: Vec<_> = (0..48 - 21).map(|_| served.events()).collect();
    more.iter_mut().for_each(|page| drop(page.next("hello")));
    let refused = served.get("/events");
    assert_eq!(refused.status, 503, "{refused:?}");
    assert!(refused.body.contains("48 pages are open"), "{refused:?}");
    assert_eq!(served.get("/").status, 200, "whoever comes is told what to do on a page");
    let many: Vec<_> = (0..100).map(|_| served.connect()).collect();
    for mut stream in &many {
        write!(stream, "GET /events HTTP/1.1\r\nHost: localhost:{}\r\n\r\n", served.port).unwrap();
    }
    assert!(many.into_iter().all(|stream| Reply::of(stream).status == 503), "none is reset");
    pages[0].next("curves");
    drop((more, pages));
    isochrone_testing::wait_until("places are free again", || {
        let mut stream = served.connect();
        write!(stream, "GET /events HTTP/1.1\r\nHost: localhost:{}\r\n\r\n", served.port).unwrap();
        let mut status = [0; 12];
        stream.read_exact(&mut status).unwrap();
        status.ends_with(b"200")
    });
    drop(standing);
}
