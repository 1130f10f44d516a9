//! The output of an isochrone program: lines of text, and a JSON document at the end.

use std::io::{BufRead, BufReader, Read};
use std::sync::mpsc::{Receiver, channel};
use std::thread;

use crate::Child;

impl Child {
    /// Reads its stdout in the background: passes each line on, and at the end sends the JSON document that begins
    /// with the first line "{".
    pub fn document(&mut self, line: impl Fn(&str) + Send + 'static) -> Receiver<String> {
        let (sender, receiver) = channel();
        if let Some(stdout) = self.stdout() {
            thread::spawn(move || {
                let mut stdout = BufReader::new(stdout);
                let mut text = String::new();
                while stdout.read_line(&mut text).is_ok_and(|length| length > 0) {
                    if text == "{\n" {
                        let _ = stdout.read_to_string(&mut text);
                        break;
                    }
                    line(text.trim_end());
                    text.clear();
                }
                let _ = sender.send(text);
            });
        }
        receiver
    }
}

#[cfg(test)]
mod tests {
    use std::process::{Command, Stdio};
    use std::sync::{Arc, Mutex};

    use super::*;

    #[test]
    fn lines_are_handed_on_and_the_document_is_sent() {
        let mut command = Command::new("printf");
        let mut child =
            Child::start("printf", command.arg("a\nb\n{\n}\n").stdout(Stdio::piped())).unwrap();
        let lines = Arc::new(Mutex::new(Vec::new()));
        let seen = lines.clone();
        let document = child.document(move |line| seen.lock().unwrap().push(line.to_owned()));
        assert_eq!(document.recv().unwrap(), "{\n}\n");
        assert_eq!(*lines.lock().unwrap(), ["a", "b"]);
    }
}
