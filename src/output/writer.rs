//! A file, its queue, and the thread that writes to it.

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

/// Bytes that wait for a terminal at most: about as many lines as it can show again.
const TERMINAL_ROOM: usize = 64 << 10;
/// Bytes that wait for a pipe or a file at most.
const FILE_ROOM: usize = 8 << 20;
/// Bytes of one `write(2)` at most.
const WRITE_BYTES: usize = 64 << 10;
/// How long a process that ends waits for a terminal that takes nothing.
const TERMINAL_PATIENCE: Duration = Duration::from_secs(1);
/// How long a process that ends waits for a pipe or a file that takes nothing.
const FILE_PATIENCE: Duration = Duration::from_secs(5);
/// How often a wait looks at its reason to end, and the writer at a file that is not ready.
const LOOK_PERIOD: Duration = Duration::from_millis(10);
/// The writer formats one line at most.
const STACK_BYTES: usize = 128 << 10;

/// Writes to the file that one or both standard streams lead to. A push returns at once; a thread writes.
///
/// The thread is never joined, for it may stand in a `write(2)` that never returns. It ends with the process.
#[derive(Debug)]
pub(super) struct Writer {
    stream: Stream,
    pub(super) is_terminal: bool,
    /// The writer that reports the dropped lines of this one, if it is another.
    reports_to: Option<Arc<Self>>,
    queue: Mutex<Queue>,
    /// Wakes the writer.
    due: Condvar,
    /// Wakes whoever waits for the writer.
    written: Condvar,
    writes: AtomicU64,
    /// Whether a flush has given up, and nothing was taken after it.
    is_stalled: AtomicBool,
    /// Why stdout and stderr take no more.
    failures: [OnceLock<Failure>; 2],
    has_thread: bool,
}

/// Why a stream takes no more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Failure {
    errno: Errno,
    /// Whether nobody reads any more: the reader of a pipe has ended, or the terminal is closed.
    pub(super) is_end_of_reader: bool,
}

impl Failure {
    /// The error of whoever prints to stdout. A closed terminal is a broken pipe, too.
    pub(super) fn error(self) -> io::Error {
        let error = io::Error::from(self.errno);
        let kind = if self.is_end_of_reader { ErrorKind::BrokenPipe } else { error.kind() };
        io::Error::new(kind, format!("cannot write to stdout: {error}"))
    }
}

impl Writer {
    /// Starts the thread that writes to the file of a stream. Where no thread can be started, each push writes by itself.
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
            Arc::get_mut(&mut writer).expect("the thread that would share it does not run").has_thread = false;
        }
        writer
    }

    /// Why a stream that leads here takes no more.
    pub(super) fn failure(&self, stream: Stream) -> Option<Failure> {
        self.failures[stream as usize].get().copied()
    }

    /// Fails where stdout, which leads here, takes no more.
    pub(super) fn check(&self) -> io::Result<()> {
        self.failure(Stream::Stdout).map_or(Ok(()), |failure| Err(failure.error()))
    }

    /// Takes whole lines, or drops and counts them.
    pub(super) fn push(&self, stream: Stream, lines: Vec<u8>) {
        if self.failure(stream).is_none() {
            self.change(|queue| queue.push(stream, lines));
        }
    }

    /// Takes whole lines once there is room for them. They are dropped where `is_stopped` comes first.
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

    /// Replaces the live line, or takes it away. A longer text than the terminal is wide is cut off.
    pub(super) fn set_live(&self, text: Option<String>) {
        let columns = tcgetwinsize(fd(self.stream)).map_or(0, |size| usize::from(size.ws_col));
        // A terminal without a size is as wide as the first ones were. The last column stays free: some wrap behind it.
        let most = if columns == 0 { 80 } else { columns } - 1;
        self.change(|queue| queue.live.text = text.map(|text| text.chars().take(most).collect()));
    }

    pub(super) fn push_screen(&self, frame: &[u8]) {
        self.change(|queue| queue.screen.extend_from_slice(frame));
    }

    /// Holds the lines back from now on, or lets them go.
    pub(super) fn hold(&self, is_held: bool) {
        self.change(|queue| queue.is_held = is_held);
    }

    /// Waits until all is written that is not held back. Ends early once the file has taken nothing for [`Self::patience`],
    /// while `is_bounded`, or where it has taken nothing since another flush ended early; returns whether all is written.
    pub(super) fn flush(&self, is_bounded: impl Fn() -> bool) -> bool {
        let mut queue = self.queue();
        let (mut progress, mut since) = (self.progress(), Instant::now());
        while !queue.is_idle() {
            queue = self.wait(queue);
            let now = self.progress();
            if now != progress || !is_bounded() {
                (progress, since) = (now, Instant::now());
            } else if self.is_stalled.load(Ordering::Relaxed) || since.elapsed() >= self.patience() {
                self.is_stalled.store(true, Ordering::Relaxed);
                return false;
            }
        }
        true
    }

    /// How long the end of a process waits for a file that takes nothing.
    pub(super) fn patience(&self) -> Duration {
        if self.is_terminal { TERMINAL_PATIENCE } else { FILE_PATIENCE }
    }

    /// The lines that have not been written, and that nobody has been told of.
    pub(super) fn unseen(&self) -> u64 {
        self.queue().unseen()
    }

    /// One line about lines that were dropped.
    pub(super) fn report(&self, lines: u64) -> Vec<u8> {
        let file = match (self.is_terminal, self.stream) {
            (true, _) => "the terminal",
            (false, Stream::Stdout) => "stdout",
            (false, Stream::Stderr) => "stderr",
        };
        let were = if lines == 1 { "line was" } else { "lines were" };
        format!("{lines} {were} dropped: {file} took no output\n").into_bytes()
    }

    /// Changes with every byte that is taken, also by the reader of a pipe that the writer waits for.
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
        // A writer that is awake looks again by itself: to wake it costs a system call.
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

    /// Writes what waits, with the queue unlocked meanwhile.
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
                // Another process that has the file open does not want to wait for it.
                Err(Errno::AGAIN) => thread::sleep(LOOK_PERIOD),
                Err(errno) => {
                    let is_end_of_reader = errno == Errno::PIPE || errno == Errno::IO && is_device(stream);
                    // It is the first one: nobody else writes.
                    let _ = self.failures[stream as usize].set(Failure { errno, is_end_of_reader });
                }
            }
        }
    }

    fn wait<'a>(&self, queue: MutexGuard<'a, Queue>) -> MutexGuard<'a, Queue> {
        self.written.wait_timeout(queue, LOOK_PERIOD).unwrap_or_else(PoisonError::into_inner).0
    }

    /// A thread that panicked while it held the queue has left it whole all the same.
    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Whether a stream leads to a device, such as a terminal, which may be closed already and then counts as none.
fn is_device(stream: Stream) -> bool {
    fstat(fd(stream)).is_ok_and(|stat| FileType::from_raw_mode(stat.st_mode) == FileType::CharacterDevice)
}

fn fd(stream: Stream) -> BorrowedFd<'static> {
    match stream {
        Stream::Stdout => stdio::stdout(),
        Stream::Stderr => stdio::stderr(),
    }
}
