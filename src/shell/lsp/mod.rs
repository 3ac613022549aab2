//! `imp lsp`: a language server that speaks with an editor over standard input and output.
//!
//! One thread reads messages (`frame`), one checks texts (`checker`), and the conversation itself
//! (`server`) answers requests in their order, so what is asked is answered at once also while a
//! long check is running. What is known of a text comes from [`crate::assist`]; here it is only
//! put into the protocol's words (`answers`, `edits`, `report`, `position`, `address`).

mod address;
mod answers;
mod checker;
mod edits;
mod frame;
mod position;
mod report;
mod server;

use std::io;
use std::sync::mpsc::{Sender, channel};

use self::checker::Checker;
use self::frame::Frame;
use self::server::{Event, Server};
use super::arguments::Lsp;
use super::output;
use crate::diagnostic::Code;

/// Serves until the client says that it is over; fails with 1 where it just goes away, and with
/// another exit code where the server cannot begin.
pub(super) fn lsp(command: &Lsp) -> Result<(), u8> {
    // Standard input and output are the only way, whether it is asked for or not.
    let Lsp { stdio: _ } = command;
    let (events, received) = channel();
    let started = Checker::start(events.clone()).and_then(|checker| {
        let reader = std::thread::Builder::new().name("read".into());
        reader.spawn(move || read(&events))?;
        Ok(checker)
    });
    let checker = started.map_err(|error| {
        output::error_text(&format!("error: cannot start a thread: {error}"));
        Code::CannotRead.exit_code()
    })?;
    let mut server = Server::new(checker, io::stdout());
    for event in received {
        if let Some(ended) = server.take(event) {
            return ended;
        }
    }
    Err(1)
}

/// Reads messages until there are no more.
fn read(events: &Sender<Event>) {
    let mut input = io::stdin().lock();
    loop {
        let event = match frame::read(&mut input) {
            Ok(Frame::Message(message)) => Event::Message(message),
            Ok(Frame::Malformed(answer)) => Event::Malformed(answer),
            Ok(Frame::End) => Event::End(None),
            Err(error) => Event::End(Some(error)),
        };
        let is_end = matches!(event, Event::End(_));
        // Where nobody listens the program is ending.
        if events.send(event).is_err() || is_end {
            return;
        }
    }
}
