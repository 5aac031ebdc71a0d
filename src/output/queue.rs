//! The queue of output to one file: lines in their order, and the newest state of a live line.
//!
//! The queue is bounded and never waits. It drops and counts a line for which there is no room. It also drops all later lines,
//! until all earlier lines are written. A report of the count then replaces them. So the written lines keep their order, and a
//! report marks each gap.

use std::collections::VecDeque;
use std::mem;

use super::live_line::LiveLine;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Stream {
    /// Standard output.
    Stdout,
    /// Standard error.
    Stderr,
}

/// The next task of the writer.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Piece {
    /// Write whole lines, or a state of the live line.
    Bytes(Stream, Vec<u8>),
    /// Report the number of dropped lines.
    Report(u64),
}

#[derive(Debug)]
pub(super) struct Queue {
    room_bytes: usize,
    lines: VecDeque<(Stream, Vec<u8>)>,
    bytes: usize,
    dropped: u64,
    /// The live line: its newest text, and the text that the terminal shows.
    pub(super) live: LiveLine,
    /// A frame of a screen on the whole terminal. It overtakes all lines.
    pub(super) screen: Vec<u8>,
    pub(super) is_held: bool,
    pub(super) is_writing: bool,
}

impl Queue {
    pub(super) fn new(room_bytes: usize) -> Self {
        Self {
            room_bytes,
            lines: VecDeque::new(),
            bytes: 0,
            dropped: 0,
            live: LiveLine::default(),
            screen: Vec::new(),
            is_held: false,
            is_writing: false,
        }
    }

    /// Whether the queue has room for a number of bytes. An empty queue takes a line of any length.
    pub(super) fn has_room(&self, bytes: usize) -> bool {
        self.dropped == 0 && (self.lines.is_empty() || self.bytes + bytes <= self.room_bytes)
    }

    /// Adds whole lines, or drops and counts them.
    pub(super) fn push(&mut self, stream: Stream, lines: Vec<u8>) {
        if self.has_room(lines.len()) {
            self.bytes += lines.len();
            self.lines.push_back((stream, lines));
        } else {
            self.dropped += line_count(&lines);
        }
    }

    /// Takes the next piece to write. Sets `is_writing`, which the writer clears afterwards. `None` if nothing is due.
    pub(super) fn next(&mut self) -> Option<Piece> {
        let piece = self.next_piece();
        self.is_writing = piece.is_some();
        piece
    }

    /// Whether all output is written, except lines that are held back.
    pub(super) fn is_idle(&self) -> bool {
        let waits = self.has_lines() && !self.is_held || self.live.is_due() || !self.screen.is_empty();
        !self.is_writing && !waits
    }

    /// Number of unwritten lines: queued lines, and dropped lines without a report.
    pub(super) fn unseen(&self) -> u64 {
        self.dropped + self.lines.iter().map(|(_, lines)| line_count(lines)).sum::<u64>()
    }

    fn has_lines(&self) -> bool {
        !self.lines.is_empty() || self.dropped > 0
    }

    fn next_piece(&mut self) -> Option<Piece> {
        if !self.screen.is_empty() {
            return Some(Piece::Bytes(Stream::Stdout, mem::take(&mut self.screen)));
        }
        if self.has_lines() && !self.is_held {
            if let Some(erasing) = self.live.erase() {
                return Some(Piece::Bytes(Stream::Stderr, erasing));
            }
            let Some((stream, lines)) = self.lines.pop_front() else {
                return Some(Piece::Report(mem::take(&mut self.dropped)));
            };
            self.bytes -= lines.len();
            return Some(Piece::Bytes(stream, lines));
        }
        self.live.draw().map(|drawing| Piece::Bytes(Stream::Stderr, drawing))
    }
}

fn line_count(lines: &[u8]) -> u64 {
    lines.split_inclusive(|byte| *byte == b'\n').count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(text: &str) -> Vec<u8> {
        format!("{text}\n").into_bytes()
    }

    /// Takes all due pieces and returns them as one text.
    fn written(queue: &mut Queue) -> String {
        let mut text = String::new();
        while let Some(piece) = queue.next() {
            match piece {
                Piece::Bytes(_, bytes) => text += &String::from_utf8(bytes).expect("UTF-8"),
                Piece::Report(lines) => text += &[lines.to_string().as_str(), " dropped\n"].concat(),
            }
            queue.is_writing = false;
        }
        assert!(queue.is_idle());
        text
    }

    #[test]
    fn lines_of_both_streams_keep_their_order() {
        let mut queue = Queue::new(100);
        queue.push(Stream::Stdout, line("one"));
        queue.push(Stream::Stderr, line("two"));
        assert!(!queue.is_idle());
        assert_eq!(queue.next(), Some(Piece::Bytes(Stream::Stdout, line("one"))));
        assert_eq!(queue.next(), Some(Piece::Bytes(Stream::Stderr, line("two"))));
        assert!(!queue.is_idle(), "the second line is being written");
        assert_eq!(queue.next(), None);
        assert!(queue.is_idle());
    }

    #[test]
    fn lines_without_room_are_dropped_counted_and_reported() {
        let mut queue = Queue::new(8);
        for text in ["one", "two", "three\nfour", "5"] {
            queue.push(Stream::Stdout, line(text));
        }
        assert_eq!(queue.unseen(), 5);
        assert_eq!(written(&mut queue), "one\ntwo\n3 dropped\n", "the short line does not overtake the long one");
        queue.push(Stream::Stdout, line("six"));
        assert_eq!(written(&mut queue), "six\n");
    }

    #[test]
    fn empty_queue_takes_a_line_of_any_length() {
        let mut queue = Queue::new(2);
        assert!(queue.has_room(100));
        queue.push(Stream::Stdout, line("long"));
        assert!(!queue.has_room(1));
        assert_eq!(written(&mut queue), "long\n");
    }

    #[test]
    fn live_line_shows_its_newest_text_below_all_lines() {
        let mut queue = Queue::new(100);
        queue.live.text = Some("1 %".to_owned());
        queue.live.text = Some("2 %".to_owned());
        assert_eq!(written(&mut queue), "\r\u{1b}[K2 %");
        assert_eq!(written(&mut queue), "", "the terminal shows it already");
        queue.push(Stream::Stdout, line("one"));
        queue.push(Stream::Stderr, line("two"));
        assert_eq!(written(&mut queue), "\r\u{1b}[Kone\ntwo\n\r\u{1b}[K2 %");
        queue.live.text = None;
        assert_eq!(written(&mut queue), "\r\u{1b}[K");
    }

    #[test]
    fn held_lines_wait_for_their_release_but_a_screen_is_written() {
        let mut queue = Queue::new(4);
        queue.is_held = true;
        queue.push(Stream::Stderr, line("log"));
        queue.push(Stream::Stderr, line("more"));
        queue.screen.extend_from_slice(b"frame");
        assert_eq!(written(&mut queue), "frame");
        queue.is_held = false;
        assert!(!queue.is_idle());
        assert_eq!(written(&mut queue), "log\n1 dropped\n");
    }
}
