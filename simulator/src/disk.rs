//! The simulated disk, with the kernel's memory of what is not on it yet.
//!
//! A killed process leaves what it has written, up to any byte of its last write. A power loss leaves what was synced, and any
//! part of what was written since. A full disk takes as many bytes as it has room for.

use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use bench_dragon::recording::DiskSpace;
use bench_dragon::recording::on_disk::{FileSync, FileSyncs, RecordingDisk, RecordingFile};

use crate::dice::Dice;

/// Size of the disk.
const CAPACITY_BYTES: u64 = 1 << 40;
/// Size of a page, the unit of what a power loss keeps.
const PAGE_BYTES: usize = 4096;
/// Time of a write: of a call, and of a byte.
const CALL_NS: u64 = 20_000;
const BYTE_NS: u64 = 10;

/// A disk.
#[derive(Clone, Debug, Default)]
pub(crate) struct SimulatedDisk(Arc<Mutex<DiskState>>);

#[derive(Debug, Default)]
struct DiskState {
    files: BTreeMap<u64, FileState>,
    names: BTreeMap<PathBuf, u64>,
    next_file: u64,
    next_opening: u64,
    /// Bytes that are free beside the files; `None` on an empty disk.
    free_bytes: Option<u64>,
    /// Time that the calls since the last look have taken.
    spent_ns: u64,
}

#[derive(Debug, Default)]
struct FileState {
    /// The file as processes see it.
    cached: Vec<u8>,
    reserved_bytes: u64,
    /// The file as it is on the disk.
    durable: Vec<u8>,
    unsynced: Vec<Change>,
    /// Whether the name has reached the disk.
    has_durable_name: bool,
    /// The opening that has locked the file, and its process.
    locked_by: Option<(u64, Arc<ProcessLife>)>,
}

#[derive(Clone, Debug)]
enum Change {
    Length(u64),
    Write(u64, Vec<u8>),
}

impl Change {
    fn apply(&self, bytes: &mut Vec<u8>) {
        match self {
            Self::Length(length) => bytes.resize(*length as usize, 0),
            Self::Write(at, written) => {
                let end = *at as usize + written.len();
                bytes.resize(bytes.len().max(end), 0);
                bytes[*at as usize..end].copy_from_slice(written);
            }
        }
    }
}

/// The life of a process: how many bytes it still writes until it is killed.
#[derive(Debug)]
pub(crate) struct ProcessLife {
    bytes_left: AtomicU64,
    ends_at_sync: AtomicBool,
}

impl ProcessLife {
    const FOR_EVER: u64 = u64::MAX;

    pub(crate) fn new() -> Arc<Self> {
        Arc::new(Self { bytes_left: AtomicU64::new(Self::FOR_EVER), ends_at_sync: AtomicBool::new(false) })
    }

    /// Kills the process after so many written bytes.
    pub(crate) fn kill_after(&self, bytes: u64) {
        self.bytes_left.store(bytes, Ordering::Relaxed);
    }

    /// Kills the process when it next waits for a sync.
    pub(crate) fn kill_at_sync(&self) {
        self.ends_at_sync.store(true, Ordering::Relaxed);
    }

    /// Whether the process has been killed.
    pub(crate) fn is_over(&self) -> bool {
        self.bytes_left.load(Ordering::Relaxed) == 0
    }

    /// Takes the bytes of a write. Returns how many of them are written.
    fn take(&self, bytes: u64) -> u64 {
        match self.bytes_left.load(Ordering::Relaxed) {
            Self::FOR_EVER => bytes,
            left => {
                self.bytes_left.store(left.saturating_sub(bytes), Ordering::Relaxed);
                bytes.min(left)
            }
        }
    }
}

impl SimulatedDisk {
    fn lock(&self) -> MutexGuard<'_, DiskState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The disk as a process uses it.
    pub(crate) fn of(&self, process: &Arc<ProcessLife>) -> Arc<dyn RecordingDisk> {
        Arc::new(DiskOfProcess { disk: self.clone(), process: Arc::clone(process) })
    }

    /// Limits the room beside the files; `None` for an empty disk.
    pub(crate) fn limit(&self, free_bytes: Option<u64>) {
        self.lock().free_bytes = free_bytes;
    }

    pub(crate) fn free_bytes(&self) -> u64 {
        self.lock().free_bytes.unwrap_or(CAPACITY_BYTES)
    }

    /// Takes the time that calls have spent since the last look.
    pub(crate) fn spent_ns(&self) -> u64 {
        std::mem::take(&mut self.lock().spent_ns)
    }

    /// The named files and their bytes.
    pub(crate) fn files(&self) -> Vec<(PathBuf, Vec<u8>)> {
        let state = self.lock();
        state.names.iter().map(|(path, file)| (path.clone(), state.files[file].cached.clone())).collect()
    }

    /// Removes the files without names of killed processes.
    pub(crate) fn bury(&self) {
        let mut state = self.lock();
        let named: Vec<u64> = state.names.values().copied().collect();
        state.files.retain(|file, _| named.contains(file));
    }

    /// Removes all files.
    pub(crate) fn clear(&self) {
        let mut state = self.lock();
        state.files.clear();
        state.names.clear();
    }

    /// The power is lost. The disk has what was synced, and any part of the later changes.
    pub(crate) fn lose_power(&self, dice: &mut Dice) {
        self.bury();
        let mut state = self.lock();
        let unnamed: Vec<PathBuf> = {
            let files = &state.files;
            let is_lost = |file: &u64, dice: &mut Dice| !files[file].has_durable_name && dice.chance(0.5);
            state.names.iter().filter(|(_, file)| is_lost(file, dice)).map(|(path, _)| path.clone()).collect()
        };
        for path in unnamed {
            let file = state.names.remove(&path);
            file.map(|file| state.files.remove(&file));
        }
        for file in state.files.values_mut() {
            let kept = dice.below(file.unsynced.len() + 1);
            let has_holes = dice.chance(0.3);
            for (place, change) in std::mem::take(&mut file.unsynced).into_iter().enumerate() {
                match change {
                    change if place < kept => change.apply(&mut file.durable),
                    Change::Write(at, bytes) if has_holes => keep_pages(at, &bytes, dice, &mut file.durable),
                    // The writes behind the first lost one are lost too, but for a part of its pages.
                    Change::Write(at, bytes) if place == kept => {
                        let part = bytes[..dice.below(bytes.len() + 1)].to_vec();
                        Change::Write(at, part).apply(&mut file.durable);
                    }
                    _ => {}
                }
            }
            file.cached.clone_from(&file.durable);
            (file.reserved_bytes, file.has_durable_name) = (0, true);
        }
    }
}

/// Keeps some pages of a write; the others are zeros.
fn keep_pages(at: u64, bytes: &[u8], dice: &mut Dice, durable: &mut Vec<u8>) {
    for (number, page) in bytes.chunks(PAGE_BYTES).enumerate() {
        if dice.chance(0.5) {
            Change::Write(at + (number * PAGE_BYTES) as u64, page.to_vec()).apply(durable);
        }
    }
}

impl DiskState {
    /// Number of bytes up to `end` that a file may have, with the room that it holds and the free room.
    fn room(&mut self, file: u64, end: u64) -> u64 {
        let Some(state) = self.files.get(&file) else { return 0 };
        let held = state.reserved_bytes.max(state.cached.len() as u64);
        let Some(free_bytes) = self.free_bytes else { return end };
        end.min(held + free_bytes)
    }

    fn take_room(&mut self, file: u64, end: u64) {
        let Some(state) = self.files.get(&file) else { return };
        let held = state.reserved_bytes.max(state.cached.len() as u64);
        self.free_bytes = self.free_bytes.map(|free_bytes| free_bytes.saturating_sub(end.saturating_sub(held)));
    }
}

#[derive(Debug)]
struct DiskOfProcess {
    disk: SimulatedDisk,
    process: Arc<ProcessLife>,
}

impl DiskOfProcess {
    fn file(&self, file: u64) -> Arc<dyn RecordingFile> {
        let mut state = self.disk.lock();
        state.next_opening += 1;
        let (disk, process, opening) = (self.disk.clone(), Arc::clone(&self.process), state.next_opening);
        Arc::new(SimulatedFile { disk, process, file, opening })
    }
}

fn killed() -> io::Error {
    io::Error::other("the process was killed")
}

impl RecordingDisk for DiskOfProcess {
    fn create_nameless(&self, _folder: &Path) -> io::Result<Arc<dyn RecordingFile>> {
        let mut state = self.disk.lock();
        let file = state.next_file;
        state.next_file += 1;
        state.files.insert(file, FileState::default());
        drop(state);
        Ok(self.file(file))
    }

    fn create_new(&self, path: &Path) -> io::Result<Arc<dyn RecordingFile>> {
        let file = self.create_nameless(path)?;
        file.give_name(path)?;
        Ok(file)
    }

    fn is_file(&self, path: &Path) -> io::Result<bool> {
        if self.disk.lock().names.contains_key(path) { Ok(true) } else { Err(ErrorKind::NotFound.into()) }
    }

    fn open(&self, path: &Path, _to_write: bool) -> io::Result<Arc<dyn RecordingFile>> {
        let file = self.disk.lock().names.get(path).copied();
        Ok(self.file(file.ok_or(ErrorKind::NotFound)?))
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        let mut state = self.disk.lock();
        let file = state.names.remove(path).ok_or(ErrorKind::NotFound)?;
        state.files.remove(&file);
        Ok(())
    }
}

#[derive(Debug)]
struct SimulatedFile {
    disk: SimulatedDisk,
    process: Arc<ProcessLife>,
    file: u64,
    opening: u64,
}

impl SimulatedFile {
    fn with<T>(&self, act: impl FnOnce(&mut FileState) -> T) -> io::Result<T> {
        if self.process.is_over() {
            return Err(killed());
        }
        let mut state = self.disk.lock();
        state.files.get_mut(&self.file).map(act).ok_or_else(|| ErrorKind::NotFound.into())
    }
}

impl RecordingFile for SimulatedFile {
    fn length(&self) -> io::Result<u64> {
        self.with(|file| file.cached.len() as u64)
    }

    fn set_length(&self, bytes: u64) -> io::Result<()> {
        self.with(|file| {
            let change = Change::Length(bytes);
            change.apply(&mut file.cached);
            file.unsynced.push(change);
            file.reserved_bytes = 0;
        })
    }

    fn read_at(&self, buffer: &mut [u8], at: u64) -> io::Result<usize> {
        self.with(|file| {
            let rest = file.cached.get(at as usize..).unwrap_or_default();
            let read = rest.len().min(buffer.len());
            buffer[..read].copy_from_slice(&rest[..read]);
            read
        })
    }

    fn write_at(&self, bytes: &[u8], at: u64) -> io::Result<usize> {
        self.length()?;
        let mut state = self.disk.lock();
        let end = at + bytes.len() as u64;
        let room = state.room(self.file, end).saturating_sub(at).min(bytes.len() as u64);
        if room == 0 && !bytes.is_empty() {
            return Err(ErrorKind::StorageFull.into());
        }
        let written = self.process.take(room);
        state.take_room(self.file, at + written);
        state.spent_ns += CALL_NS + BYTE_NS * written;
        if let Some(file) = state.files.get_mut(&self.file) {
            let change = Change::Write(at, bytes[..written as usize].to_vec());
            change.apply(&mut file.cached);
            file.unsynced.push(change);
        }
        if self.process.is_over() { Err(killed()) } else { Ok(written as usize) }
    }

    fn reserve(&self, at: u64, bytes: u64) -> io::Result<()> {
        let end = at + bytes;
        self.length()?;
        let mut state = self.disk.lock();
        if state.room(self.file, end) < end {
            return Err(ErrorKind::StorageFull.into());
        }
        state.take_room(self.file, end);
        if let Some(file) = state.files.get_mut(&self.file) {
            file.reserved_bytes = file.reserved_bytes.max(end);
        }
        Ok(())
    }

    fn sync(&self) -> io::Result<()> {
        if self.process.ends_at_sync.load(Ordering::Relaxed) {
            self.process.kill_after(0);
        }
        self.with(|file| {
            for change in std::mem::take(&mut file.unsynced) {
                change.apply(&mut file.durable);
            }
            file.has_durable_name = true;
        })
    }

    fn space(&self) -> io::Result<DiskSpace> {
        Ok(DiskSpace { free_bytes: self.disk.free_bytes(), total_bytes: CAPACITY_BYTES })
    }

    fn give_name(&self, path: &Path) -> io::Result<()> {
        self.length()?;
        let mut state = self.disk.lock();
        if state.names.contains_key(path) {
            return Err(ErrorKind::AlreadyExists.into());
        }
        state.names.insert(path.to_owned(), self.file);
        Ok(())
    }

    fn lock(&self) -> io::Result<bool> {
        let own = (self.opening, Arc::clone(&self.process));
        self.with(|file| {
            // A killed process has no locks.
            let _ = file.locked_by.take_if(|(_, process)| process.is_over());
            file.locked_by.get_or_insert(own).0 == self.opening
        })
    }

    fn unlock(&self) {
        let opening = self.opening;
        // A killed process has no locks.
        let _ = self.with(|file| file.locked_by.take_if(|(by, _)| *by == opening));
    }
}

/// The files that wait for their sync.
#[derive(Clone, Debug, Default)]
pub(crate) struct WaitingSyncs(Arc<Mutex<Vec<FileSync>>>);

impl WaitingSyncs {
    fn lock(&self) -> MutexGuard<'_, Vec<FileSync>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn len(&self) -> usize {
        self.lock().len()
    }

    /// Syncs the first file, and ends it if it is finished.
    pub(crate) fn sync_first(&self) {
        let mut files = self.lock();
        if !files.is_empty() {
            // A killed process syncs nothing.
            let _ = files.remove(0).run();
        }
    }
}

/// Greatest number of waiting files, as of the sync thread.
const MOST_WAITING: usize = 4;

impl FileSyncs for WaitingSyncs {
    fn is_idle(&self) -> bool {
        self.lock().is_empty()
    }

    fn request(&mut self, sync: FileSync) {
        if self.len() == MOST_WAITING {
            self.sync_first();
        }
        self.lock().push(sync);
    }

    fn failure(&mut self) -> Option<io::Error> {
        None
    }

    fn finish(&mut self) {
        while self.len() > 0 {
            self.sync_first();
        }
    }
}
