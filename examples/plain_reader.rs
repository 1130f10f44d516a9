//! Reads the frames of a service with iceoryx2 alone, without any isochrone crate. Any program that
//! uses iceoryx2, in any language it supports, can exchange frames with a node in this way. The
//! contract is docs/wire.md.
//!
//! Start a node (`isochrone run examples/level.toml`, or `isochrone demo`), then:
//!
//! ```text
//! cargo run --release -p isochrone-examples --bin plain_reader -- [SERVICE] [FRAMES]
//! ```
//!
//! SERVICE defaults to plant/level and FRAMES to 5. Exit status: 0 done, 1 the service cannot be
//! read, 3 nothing was published for five seconds. The environment variable ICEORYX2_CONFIG names the
//! configuration of the domain to join; otherwise it is `config/iceoryx2.toml`, or iceoryx2's default.
#![allow(clippy::print_stdout, reason = "showing frames is what this program is for")]

use std::error::Error;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use iceoryx2::config::Config;
use iceoryx2::prelude::*;
use iceoryx2::service::builder::publish_subscribe::PublishSubscribeOpenError::DoesNotExist;

const PATIENCE: Duration = Duration::from_secs(5);
const POLL: Duration = Duration::from_millis(1);
/// Between two looks for a frame. Nobody wakes a reader, because that would cost the thread that sends a system
/// call. The announced period says when the next frame is due, for a reader that is to wake up less often.
const LOOK: Duration = Duration::from_micros(100);

/// The user header of a frame. iceoryx2 compares the type name and layout, not the Rust type. Times
/// are nanoseconds of CLOCK_MONOTONIC.
#[repr(C)]
#[derive(Debug, ZeroCopySend)]
#[type_name("isochrone.FrameHeader.v2")]
struct FrameHeader {
    sequence: u64,   // 0, 1, 2 ... per publisher; a gap is a loss
    cycle: u64,      // the publisher's cycle, including skipped ones
    release_ns: u64, // when the cycle was due
    publish_ns: u64, // when the frame was sent
    source_ns: u64,  // when the oldest sample behind the values was published; 0: none
    missed: u64,     // cycles lost since the publisher started
    flags: u64,      // docs/quality.md; 0: nothing to say
    term: u64,       // when the publisher took over the service, Unix ns; 0: a plain writer
    layout: u64,     // which layout the frame has; 0: not given
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "plant/level".into());
    let mut frames_left: u32 =
        arguments.next().map_or(Ok(5), |text| text.parse()).map_err(|_| "FRAMES is a number")?;

    let config = match std::env::var("ICEORYX2_CONFIG") {
        Ok(file) => Config::from_file(&file.as_str().try_into()?)?,
        Err(_) => Config::global_config().clone(),
    };
    let node = NodeBuilder::new().config(&config).create::<ipc::Service>()?;
    let mut deadline = Instant::now() + PATIENCE;
    let service = loop {
        // Open, not create: the creator of a service sets its history, buffers and overflow.
        let opened = node
            .service_builder(&name.as_str().try_into()?)
            .publish_subscribe::<[f64]>()
            .user_header::<FrameHeader>()
            .open();
        match opened {
            Err(DoesNotExist) if Instant::now() > deadline => {
                println!("there is no service {name}");
                return Ok(ExitCode::from(3));
            }
            Err(DoesNotExist) => node.wait(100 * POLL)?,
            opened => break opened?,
        }
    };

    // A JSON message on another service describes the values of a frame. It is sent when a reader
    // connects and every 500 ms while one is connected; publishers without an announcement send
    // frames of layout 0. (An f64 represents LREAL, INT, BOOL, TIME and WORD exactly.)
    let layouts = node
        .service_builder(&format!("isochrone/layout/{name}").as_str().try_into()?)
        .publish_subscribe::<[u8]>()
        .subscriber_max_buffer_size(1)
        .subscriber_max_borrowed_samples(1)
        .max_publishers(5)
        .max_subscribers(65)
        .max_nodes(88)
        .open_or_create()?
        .subscriber_builder()
        .create()?;
    println!("service {name}");

    let subscriber = service.subscriber_builder().create()?;
    let mut layout = None;
    deadline = Instant::now() + PATIENCE;
    while frames_left > 0 {
        let Some(frame) = subscriber.receive()? else {
            if Instant::now() > deadline {
                println!("no frames on {name}");
                return Ok(ExitCode::from(3));
            }
            node.wait(LOOK)?; // ends the program on Ctrl-C
            continue;
        };
        let number = frame.user_header().layout;
        while number != 0 && layout != Some(number) && Instant::now() < deadline {
            // A writer may restart with another layout: the number identifies each frame's layout.
            match layouts.receive()? {
                Some(message) => {
                    let json = std::str::from_utf8(message.payload())?;
                    if json.contains(&format!("\"{number:016x}\"")) {
                        println!("layout {json}");
                        layout = Some(number);
                    }
                }
                None => node.wait(POLL)?,
            }
        }
        println!("{:?}", frame.user_header());
        println!("  {:?}", frame.payload());
        frames_left -= 1;
        deadline = Instant::now() + PATIENCE;
    }
    Ok(ExitCode::SUCCESS)
}
