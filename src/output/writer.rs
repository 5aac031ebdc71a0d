//! The writer of a file: its queue, and the thread that writes to it.

use std::io::{self, ErrorKind};
use std::os::fd::BorrowedFd;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use rustix::fs::{FileType, fstat};
use rustix::io::{Errno, ioctl_fionread, write};
use rustix::stdio;
use rustix::termios::{isatty, tcgetwinsize};

use super::queue::{Piece, Queue, Stream};

/// Bound of a terminal's queue in bytes: about the lines that a terminal can scroll back.
const TERMINAL_ROOM: usize = 64 << 10;
/// Bound of the queue of a pipe or a file, in bytes.
const FILE_ROOM: usize = 8 << 20;
/// Greatest number of bytes in one `write(2)`.
const WRITE_BYTES: usize = 64 << 10;
/// Longest wait of an ending process for a terminal that accepts no bytes.
const TERMINAL_TIMEOUT: Duration = Duration::from_secs(1);
/// Longest wait of an ending process for a pipe or a file that accepts no bytes.
const FILE_TIMEOUT: Duration = Duration::from_secs(5);
/// Period at which a wait checks its condition, and the writer retries a file that is not ready.
const POLL_PERIOD: Duration = Duration::from_millis(10);
/// Stack of the writer thread, which formats at most one line.
const STACK_BYTES: usize = 128 << 10;

/// Writes to the file of one or both standard streams. A push returns at once; a thread writes.
///
/// The thread is never joined, because its `write(2)` may never return. It ends with the process.
#[derive(Debug)]
pub(super) struct Writer {
    stream: Stream,
    pub(super) is_terminal: bool,
    /// Another writer that reports the dropped lines of this one, if any.
    reports_to: Option<Arc<Self>>,
    queue: Mutex<Queue>,
    /// Wakes the writer thread.
    due: Condvar,
    /// Wakes threads that wait for the writer.
    written: Condvar,
    writes: AtomicU64,
    /// Whether a flush ended early, and the file has accepted no bytes since.
    is_stalled: AtomicBool,
    /// First write errors of stdout and stderr; a failed stream is not written again.
    failures: [OnceLock<Failure>; 2],
    has_thread: bool,
}

/// First write error of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Failure {
    errno: Errno,
    /// Whether the stream has lost its reader: the reader of a pipe has ended, or the terminal is closed.
    pub(super) is_end_of_reader: bool,
}

impl Failure {
    /// Returns the error of a print to stdout. A closed terminal counts as a broken pipe too.
    pub(super) fn error(self) -> io::Error {
        let error = io::Error::from(self.errno);
        let kind = if self.is_end_of_reader { ErrorKind::BrokenPipe } else { error.kind() };
        io::Error::new(kind, format!("cannot write to stdout: {error}"))
    }
}

impl Writer {
    /// Starts the thread that writes to the file of a stream. If the system cannot start a thread, each push writes itself.
    pub(super) fn start(stream: Stream, reports_to: Option<Arc<Self>>) -> Arc<Self> {
        let is_terminal = isatty(fd(stream));
        let mut writer = Arc::new(Self {
            stream,
            is_terminal,
            reports_to,
            queue: Mutex::new(Queue::new(if is_terminal { TERMINAL_ROOM } else { FILE_ROOM })),
            due: Condvar::new(),
            written: Condvar::new(),
            writes: AtomicU64::new(0),
            is_stalled: AtomicBool::new(false),
            failures: Default::default(),
            has_thread: true,
        });
        let of_thread = Arc::clone(&writer);
        let thread = thread::Builder::new().name("output".to_owned()).stack_size(STACK_BYTES);
        if thread.spawn(move || of_thread.write_on()).is_err() {
            Arc::get_mut(&mut writer).expect("no thread shares the writer").has_thread = false;
        }
        writer
    }

    /// First write error of a stream of this writer.
    pub(super) fn failure(&self, stream: Stream) -> Option<Failure> {
        self.failures[stream as usize].get().copied()
    }

    /// Returns the first write error of stdout. Call it only for the writer of stdout.
    pub(super) fn check(&self) -> io::Result<()> {
        self.failure(Stream::Stdout).map_or(Ok(()), |failure| Err(failure.error()))
    }

    /// Adds whole lines to the queue, or drops and counts them.
    pub(super) fn push(&self, stream: Stream, lines: Vec<u8>) {
        if self.failure(stream).is_none() {
            self.change(|queue| queue.push(stream, lines));
        }
    }

    /// Waits for room in the queue, then adds whole lines. Drops them if `is_stopped` becomes true first.
    pub(super) fn push_waiting(&self, stream: Stream, lines: Vec<u8>, is_stopped: impl Fn() -> bool) {
        let mut queue = self.queue();
        while !queue.has_room(lines.len()) && self.failure(stream).is_none() {
            if is_stopped() {
                return;
            }
            queue = self.wait(queue);
        }
        drop(queue);
        self.push(stream, lines);
    }

    /// Replaces the live line, or removes it. Cuts off a text that is wider than the terminal.
    pub(super) fn set_live(&self, text: Option<String>) {
        let columns = tcgetwinsize(fd(self.stream)).map_or(0, |size| usize::from(size.ws_col));
        // A terminal that reports no size counts as 80 columns wide. The last column stays free: some terminals wrap after it.
        let most = if columns == 0 { 80 } else { columns } - 1;
        self.change(|queue| queue.live.text = text.map(|text| text.chars().take(most).collect()));
    }

    pub(super) fn push_screen(&self, frame: &[u8]) {
        self.change(|queue| queue.screen.extend_from_slice(frame));
    }

    /// Starts or stops holding back the lines.
    pub(super) fn hold(&self, is_held: bool) {
        self.change(|queue| queue.is_held = is_held);
    }

    /// Waits until all output is written, except lines that are held back. While `is_bounded`, ends early if the file accepts
    /// no bytes for [`Self::timeout`], or has accepted none since another flush ended early. Returns whether all output is
    /// written.
    pub(super) fn flush(&self, is_bounded: impl Fn() -> bool) -> bool {
        let mut queue = self.queue();
        let (mut progress, mut since) = (self.progress(), Instant::now());
        while !queue.is_idle() {
            queue = self.wait(queue);
            let now = self.progress();
            if now != progress || !is_bounded() {
                (progress, since) = (now, Instant::now());
            } else if self.is_stalled.load(Ordering::Relaxed) || since.elapsed() >= self.timeout() {
                self.is_stalled.store(true, Ordering::Relaxed);
                return false;
            }
        }
        true
    }

    /// Longest wait of an ending process while the file accepts no bytes.
    fn timeout(&self) -> Duration {
        if self.is_terminal { TERMINAL_TIMEOUT } else { FILE_TIMEOUT }
    }

    /// Number of unwritten lines that no report has counted.
    pub(super) fn unseen(&self) -> u64 {
        self.queue().unseen()
    }

    /// Returns a line that reports dropped lines.
    pub(super) fn report(&self, lines: u64) -> Vec<u8> {
        let file = match (self.is_terminal, self.stream) {
            (true, _) => "the terminal",
            (false, Stream::Stdout) => "stdout",
            (false, Stream::Stderr) => "stderr",
        };
        let were = if lines == 1 { "line was" } else { "lines were" };
        format!("{lines} {were} dropped: {file} took no output\n").into_bytes()
    }

    /// A value that changes with every progress: a write, or a read by the reader of a full pipe.
    fn progress(&self) -> (u64, u64) {
        let unread = if self.is_terminal { 0 } else { ioctl_fionread(fd(self.stream)).unwrap_or(0) };
        (self.writes.load(Ordering::Relaxed), unread)
    }

    fn change(&self, change: impl FnOnce(&mut Queue)) {
        let is_asleep = {
            let mut queue = self.queue();
            change(&mut queue);
            !queue.is_writing
        };
        // A wake-up costs a system call. A busy writer checks the queue itself before it sleeps.
        if is_asleep {
            self.due.notify_one();
        }
        if !self.has_thread {
            drop(self.write_waiting(self.queue()));
        }
    }

    fn write_on(&self) {
        let mut queue = self.queue();
        loop {
            queue = self.write_waiting(queue);
            queue = self.due.wait(queue).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Writes all due output. Unlocks the queue during each write.
    fn write_waiting<'a>(&'a self, mut queue: MutexGuard<'a, Queue>) -> MutexGuard<'a, Queue> {
        while let Some(piece) = queue.next() {
            drop(queue);
            self.write(piece);
            queue = self.queue();
            queue.is_writing = false;
            self.written.notify_all();
        }
        queue
    }

    fn write(&self, piece: Piece) {
        let (stream, bytes) = match (piece, &self.reports_to) {
            (Piece::Bytes(stream, bytes), _) => (stream, bytes),
            (Piece::Report(lines), Some(other)) => return other.push(Stream::Stderr, self.report(lines)),
            (Piece::Report(lines), None) => (Stream::Stderr, self.report(lines)),
        };
        let mut left = &bytes[..];
        while !left.is_empty() && self.failure(stream).is_none() {
            match write(fd(stream), &left[..left.len().min(WRITE_BYTES)]) {
                Ok(written) => {
                    left = &left[written..];
                    self.is_stalled.store(false, Ordering::Relaxed);
                    self.writes.fetch_add(1, Ordering::Relaxed);
                }
                Err(Errno::INTR) => {}
                // Another process has made the shared file non-blocking.
                Err(Errno::AGAIN) => thread::sleep(POLL_PERIOD),
                Err(errno) => {
                    let is_end_of_reader = errno == Errno::PIPE || errno == Errno::IO && is_device(stream);
                    // This is the first failure: only one thread writes.
                    let _ = self.failures[stream as usize].set(Failure { errno, is_end_of_reader });
                }
            }
        }
    }

    fn wait<'a>(&self, queue: MutexGuard<'a, Queue>) -> MutexGuard<'a, Queue> {
        self.written.wait_timeout(queue, POLL_PERIOD).unwrap_or_else(PoisonError::into_inner).0
    }

    /// Locks the queue. Ignores poisoning: a thread that panics while it holds the lock leaves the queue consistent.
    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Whether a stream leads to a character device, such as a terminal. A closed terminal is still a device, but `isatty` rejects
/// it.
fn is_device(stream: Stream) -> bool {
    fstat(fd(stream)).is_ok_and(|stat| FileType::from_raw_mode(stat.st_mode) == FileType::CharacterDevice)
}

fn fd(stream: Stream) -> BorrowedFd<'static> {
    match stream {
        Stream::Stdout => stdio::stdout(),
        Stream::Stderr => stdio::stderr(),
    }
}
