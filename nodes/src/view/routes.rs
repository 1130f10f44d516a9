//! The responses to requests.

use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::http::Request;
use super::pages::Look;
use super::response::{Response, json};
use super::shared::View;
use super::threads::locked;
use super::{files, writes};

/// An answer.
pub(super) enum Answer {
    Whole(Response),
    /// A stream of events.
    Events,
}

impl From<Response> for Answer {
    fn from(response: Response) -> Self {
        Self::Whole(response)
    }
}

/// The signals that a page reports to show.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Looking {
    page: String,
    look: Look,
}

pub(super) fn answer(view: &View, request: &Request) -> Answer {
    if let Err(refusal) = check_origin(view, request) {
        return refusal.into();
    }
    match (request.method.as_str(), request.path.as_str()) {
        ("GET", "/events") => Answer::Events,
        ("GET" | "HEAD", "/signals") => {
            Response::of(JSON, locked(&view.plant).list.json.as_bytes()).into()
        }
        ("GET" | "HEAD", path) => match files::find(path) {
            Some((kind, file)) => Response::of(kind, file).into(),
            None => nowhere().into(),
        },
        ("POST", path) => post(view, request, path).unwrap_or_else(|refusal| refusal).into(),
        _ => Response::sentence(405, "this server takes GET, HEAD and POST").into(),
    }
}

const JSON: &str = "application/json";

fn nowhere() -> Response {
    Response::sentence(404, "there is nothing here; the page is at /")
}

/// A name of the internet that leads here is not this server, and the page of another server is no page of it.
fn check_origin(view: &View, request: &Request) -> Result<(), Response> {
    let Some(host) = request.header("host") else {
        return Err(Response::sentence(400, "a request names its Host"));
    };
    if !view.access.is_host(host) {
        let port = view.port;
        return Err(Response::sentence(
            403,
            format!(
                "this page is at http://127.0.0.1:{port}/, http://localhost:{port}/ and http://[::1]:{port}/ \
                 alone; through ssh, forward the same port: ssh -L {port}:localhost:{port} HOST"
            ),
        ));
    }
    if request.header("origin").is_some_and(|origin| !view.access.is_origin(origin)) {
        return Err(Response::sentence(403, "only the page of this server may ask"));
    }
    // As a browser says of what a page of another server loads without asking for leave, such as a picture.
    let is_foreign = |site: &str| ["cross-site", "same-site"].contains(&site);
    if request.path != "/" && request.header("sec-fetch-site").is_some_and(is_foreign) {
        return Err(Response::sentence(403, "only the page of this server may ask"));
    }
    Ok(())
}

fn post(view: &View, request: &Request, path: &str) -> Result<Response, Response> {
    if !["/look", "/set", "/undo", "/ack"].contains(&path) {
        return Err(nowhere());
    }
    let kind = request.header("content-type").unwrap_or_default();
    if kind.split(';').next().is_none_or(|kind| kind.trim() != JSON) {
        return Err(Response::sentence(415, format!("send {JSON}")));
    }
    if path == "/look" {
        let Looking { page, look } = read(request)?;
        let looked = view.pages.look(&page, look);
        return looked
            .map(|()| Response::of(JSON, "{}"))
            .map_err(|why| Response::sentence(409, why));
    }
    let Some(writer) = &view.writer else {
        return Err(Response::sentence(
            403,
            "this page is for reading; start `isochrone view` with --allow-write to set parameters",
        ));
    };
    if !request.header("x-isochrone-token").is_some_and(|token| view.access.is_token(token)) {
        return Err(Response::sentence(
            403,
            "this needs the token of the URL that `isochrone view` has printed",
        ));
    }
    let order = match path {
        "/set" => writes::WriteRequest::Set(read(request)?),
        "/ack" => writes::WriteRequest::Ack(read(request)?),
        _ => writes::WriteRequest::Undo(read(request)?),
    };
    let done = writer.carry_out(&view.plant, order).map_err(|why| Response::sentence(409, why))?;
    Ok(Response::of(JSON, json(&done)))
}

fn read<T: DeserializeOwned>(request: &Request) -> Result<T, Response> {
    serde_json::from_slice(&request.body).map_err(|error| {
        Response::sentence(400, format!("the body is not what is expected: {error}"))
    })
}
