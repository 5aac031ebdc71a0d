//! The recorder in the world: its process, its disk, and the repair of what a killed one leaves.

use std::collections::HashMap;
use std::hash::Hash as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use bench_dragon::recording::on_disk::repair_on;
use bench_dragon::recording::{Kept, Parts, PartsReader, RecordError, Recorded, RepairError, repair_checked};
use bench_dragon::source::replay::verify::{RunVerdict, verify};
use bench_dragon_ipc::CommandEvent;
use bench_dragon_ipc::service::COMMAND_EVENT_BUFFER;

use super::captain::Captain;
use super::{Event, MS_NS, START_NS, World};
use crate::dice::Dice;
use crate::disk::{ProcessLife, SimulatedDisk};
use crate::fault::Part;
use crate::promises::{FrameHash, Promise, RecordingBook, frame_hash};
use crate::recorder::{RecordedShow, RecorderProcess};
use crate::scenario::SECOND_NS;
use crate::supervisor::ChildState;

/// Longest time of a sync on a sound disk.
const SYNC_NS: u64 = 20 * MS_NS;
/// Longest time to the repair of a recording.
const REPAIR_NS: u64 = 2 * SECOND_NS;
/// Longest age of a frame that a killed recorder may lose, and that a power loss may, without other faults.
const LONGEST_UNWRITTEN_NS: u64 = 520 * MS_NS;
const LONGEST_UNSYNCED_NS: u64 = 3 * SECOND_NS;
/// Time after a fault in which these ages may be longer.
const TROUBLE_NS: u64 = 5 * SECOND_NS;
/// The folder of the show on the simulated disk.
const FOLDER: &str = "/show";

/// The recordings of a show.
#[derive(Debug, Default)]
pub(super) struct Recordings {
    pub(super) disk: SimulatedDisk,
    /// The books of recorders that have ended.
    ended: Vec<RecordingBook>,
    /// The last events of all runs, which late joiners receive.
    past_events: Vec<CommandEvent>,
    next_name: u64,
    has_lost_power: bool,
}

impl<'a> World<'a> {
    fn recorded_show(&self) -> RecordedShow<'a> {
        let scenario = self.scenario;
        let rotate_bytes = Dice::new(scenario.seed, 11).chance(0.4).then_some(1_000_000);
        RecordedShow { toml: &scenario.toml, handles: scenario.config.formation().layout().handles(), rotate_bytes }
    }

    pub(super) fn start_recorder(&mut self, life: u64) {
        let number = self.recordings.next_name;
        self.recordings.next_name += 1;
        let path = PathBuf::from(FOLDER).join(format!("recording-{number}.mcap"));
        let started = RecorderProcess::start(life, path, &self.recordings.disk, &self.recorded_show(), self.now_ns);
        match started {
            Ok(recorder) => {
                self.recorder = Some(recorder);
                self.after(START_NS, Event::RecorderJoins(life));
            }
            Err(error) => self.note_recorders_end(error.is_disk_full()),
        }
    }

    /// The process of a life, unless it is over. A stopped one gets the event when it continues.
    fn recorder_at(&mut self, life: u64, event: Event) -> Option<&mut RecorderProcess> {
        let now_ns = self.now_ns;
        let recorder = self.recorder.as_mut().filter(|recorder| recorder.life == life)?;
        if recorder.stopped_until_ns > now_ns {
            self.agenda.add(recorder.stopped_until_ns, event);
            return None;
        }
        Some(recorder)
    }

    pub(super) fn join_recorder(&mut self, life: u64) {
        let has_server = self.server.is_some();
        let past = self.recordings.past_events.clone();
        let Some(recorder) = self.recorder_at(life, Event::RecorderJoins(life)) else { return };
        recorder.has_joined = has_server;
        if has_server {
            recorder.events.extend(past);
            self.watch.recorded_ns = self.now_ns;
        } else {
            self.after(20 * MS_NS, Event::RecorderJoins(life));
        }
    }

    /// The reporting thread publishes the events of the server, at most so many.
    pub(super) fn publish_events(&mut self, most: usize) {
        let Some(server) = &mut self.server else { return };
        for _ in 0..most {
            let Ok(event) = server.events.pop() else { return };
            let past = &mut self.recordings.past_events;
            past.push(event);
            if past.len() > COMMAND_EVENT_BUFFER {
                past.remove(0);
            }
            self.watch.observer.take_event(event);
            self.supervisor.seen.see_event(&event);
            if let Some(recorder) = self.recorder.as_mut().filter(|recorder| recorder.has_joined) {
                if recorder.events.len() == COMMAND_EVENT_BUFFER {
                    recorder.events.pop_front();
                }
                recorder.events.push_back(event);
            }
        }
    }

    pub(super) fn read_for_recorder(&mut self, life: u64) {
        let (now_ns, show) = (self.now_ns, self.recorded_show());
        let Some(recorder) = self.recorder_at(life, Event::RecorderReads(life)) else { return };
        recorder.read(&show, now_ns);
        let report = if recorder.has_buffer() && recorder.report.is_due(1) { recorder.report.take() } else { None };
        let at_ns = recorder.busy_until_ns.max(now_ns);
        self.watch.recorded_ns = now_ns;
        self.watch.take_report(report);
        self.plan_write(at_ns);
    }

    /// The writing thread wakes at an instant, unless it wakes earlier.
    fn plan_write(&mut self, at_ns: u64) {
        let Some(recorder) = &mut self.recorder else { return };
        if recorder.wakes_ns.is_none_or(|wakes_ns| at_ns < wakes_ns) {
            recorder.wakes_ns = Some(at_ns);
            self.agenda.add(at_ns, Event::RecorderWrites(recorder.life));
        }
    }

    pub(super) fn write(&mut self, life: u64) {
        let now_ns = self.now_ns;
        self.look_at_disk();
        let (slow_until, slow) = self.windows.disk_slow;
        let slow = if slow_until > now_ns { slow } else { 1 };
        let disk = self.recordings.disk.clone();
        let Some(recorder) = self.recorder_at(life, Event::RecorderWrites(life)) else { return };
        // The thread has woken earlier, for a job that came in between.
        if recorder.wakes_ns.take_if(|wakes_ns| *wakes_ns <= now_ns).is_none() {
            return;
        }
        if recorder.busy_until_ns > now_ns {
            let at_ns = recorder.busy_until_ns;
            return self.plan_write(at_ns);
        }
        let written = recorder.write(&disk, slow, now_ns);
        if recorder.process.is_over() {
            return self.kill_recorder();
        }
        let (has_syncs, planned) = (recorder.syncs.len() > 0, recorder.has_planned_sync);
        recorder.has_planned_sync = has_syncs;
        match written {
            Ok(Some(at_ns)) => self.plan_write(at_ns),
            Ok(None) => {}
            Err(fault) => return self.fail_recorder(fault),
        }
        if has_syncs && !planned {
            self.plan_sync(life);
        }
    }

    fn plan_sync(&mut self, life: u64) {
        let (slow_until, slow) = self.windows.disk_slow;
        let slow = if slow_until > self.now_ns { slow } else { 1 };
        let sync_ns = self.scenario.latency_ns(self.now_ns, 81, SYNC_NS).saturating_mul(slow).min(60 * SECOND_NS);
        // A sync that began on a slow disk may end long after the disk is fast again.
        if slow > 1
            && let Some(recorder) = &mut self.recorder
        {
            recorder.book.trouble_ns = recorder.book.trouble_ns.max(self.now_ns + sync_ns);
        }
        self.after(sync_ns, Event::RecorderSyncs(life));
    }

    pub(super) fn sync(&mut self, life: u64) {
        let Some(recorder) = self.recorder_at(life, Event::RecorderSyncs(life)) else { return };
        recorder.sync_first();
        recorder.has_planned_sync = recorder.syncs.len() > 0;
        if recorder.has_planned_sync {
            self.plan_sync(life);
        }
    }

    /// Another program gives its room back after a while. Faults of the disk excuse what is late.
    fn look_at_disk(&mut self) {
        let now_ns = self.now_ns;
        let is_full = self.windows.disk_full_until > now_ns;
        if !is_full {
            self.recordings.disk.limit(None);
        }
        let is_slow = self.windows.disk_slow.0 > now_ns;
        if let Some(recorder) = &mut self.recorder
            && (is_full || is_slow || recorder.stopped_until_ns > now_ns || recorder.busy_until_ns > now_ns)
        {
            recorder.book.trouble_ns = recorder.book.trouble_ns.max(now_ns);
            self.watch.disturb(now_ns);
        }
    }

    fn fail_recorder(&mut self, fault: bench_dragon::recording::on_disk::WriterFault) {
        let Some(recorder) = self.recorder.take() else { return };
        let (mut report, has_one_file) = (recorder.report.clone(), recorder.has_one_file());
        let process = Arc::clone(&recorder.process);
        let (book, ended) = recorder.fail_or_end(Err(fault));
        if process.is_over() {
            // It was killed while it finished its file.
            self.bury_recorder(book);
            return self.note_recorders_end(false);
        }
        let is_full = ended.as_ref().is_err_and(RecordError::is_disk_full);
        if is_full {
            report.set_disk_full();
        }
        self.watch.take_report(report.take_last());
        let is_cut = matches!(ended, Err(RecordError::DiskFull { kept: Kept::Unfinished, .. }));
        self.promises.require(Promise::FullDiskIsReported, self.now_ns, !is_cut || !has_one_file, || {
            format!("a full disk leaves a file without an end: {ended:?}")
        });
        self.promises
            .require(Promise::FullDiskIsReported, self.now_ns, is_full, || format!("a recorder ends: {ended:?}"));
        self.bury_recorder(book);
        self.note_recorders_end(is_full);
    }

    /// A killed recorder leaves its file as it is.
    pub(super) fn kill_recorder(&mut self) {
        self.look_at_disk();
        let Some(recorder) = self.recorder.take() else { return };
        let (unwritten_ns, unsynced_ns) = self.ages(&recorder.book);
        let is_excused = self.now_ns.saturating_sub(recorder.book.trouble_ns) < TROUBLE_NS;
        self.promises.require(
            Promise::KillLosesLittle,
            self.now_ns,
            is_excused || unwritten_ns <= LONGEST_UNWRITTEN_NS && unsynced_ns <= LONGEST_UNSYNCED_NS,
            || format!("the oldest unwritten frame is {unwritten_ns} ns old, the oldest unsynced one {unsynced_ns} ns"),
        );
        self.bury_recorder(recorder.kill());
        self.note_recorders_end(false);
    }

    fn ages(&self, book: &RecordingBook) -> (u64, u64) {
        (book.unwritten_ns(self.now_ns), book.unsynced_ns(self.now_ns))
    }

    fn bury_recorder(&mut self, book: RecordingBook) {
        self.recordings.disk.bury();
        let repair_ns = self.scenario.latency_ns(self.now_ns, 82, REPAIR_NS);
        self.after(repair_ns, Event::Repair(book.path.clone()));
        self.recordings.ended.push(book);
    }

    fn note_recorders_end(&mut self, is_full: bool) {
        if self.is_over {
            return;
        }
        // A show goes on without a recorder that has ended too often.
        self.supervisor.note_end(Part::Recorder, self.now_ns);
        if is_full {
            self.supervisor.wait_for_room();
        }
    }

    /// Repairs a recording. Some repairs are killed on the way, and are repeated.
    pub(super) fn repair(&mut self, path: &Path) {
        let mut dice = Dice::new(self.scenario.seed ^ self.now_ns, 12);
        let disk = self.recordings.disk.clone();
        if dice.chance(0.5) {
            let process = ProcessLife::new();
            process.kill_after(dice.scaled(1.0, 2e4) as u64);
            // The first repair may be killed, or find its file removed.
            let _ = repair_on(&*disk.of(&process), path);
            disk.bury();
        }
        // A full disk, or damage, is for the check at the end.
        let _ = repair_on(&*disk.of(&ProcessLife::new()), path);
        disk.spent_ns();
    }

    /// The server has ended in order, and the show ends its recorder.
    pub(super) fn end_recorder(&mut self) {
        if let Some(recorder) = self.recorder.take() {
            if recorder.stopped_until_ns > self.now_ns || recorder.busy_until_ns > self.now_ns + 30 * SECOND_NS {
                self.recorder = Some(recorder);
                self.kill_recorder();
            } else {
                self.watch.take_report(recorder.report.clone().take_last());
                let process = Arc::clone(&recorder.process);
                let (book, ended) = recorder.end(&self.recorded_show(), self.now_ns);
                let is_full = ended.as_ref().is_err_and(RecordError::is_disk_full);
                let handed = book.frames().len() as u64;
                let is_right = ended.as_ref().is_ok_and(|&frames| frames == handed) || is_full || process.is_over();
                self.promises.require(Promise::FullDiskIsReported, self.now_ns, is_right, || {
                    format!("of {handed} frames: {ended:?}")
                });
                self.bury_recorder(book);
            }
        }
        self.check_recordings();
    }

    /// The machine loses its power, and starts again: a new show begins.
    pub(super) fn lose_power(&mut self) {
        self.kill_recorder();
        let mut dice = Dice::new(self.scenario.seed ^ self.now_ns, 13);
        // Some power losses come in the middle of a repair.
        if let Some(book) = self.recordings.ended.last()
            && dice.chance(0.7)
        {
            let process = ProcessLife::new();
            if dice.chance(0.7) {
                process.kill_at_sync();
            } else {
                process.kill_after(dice.scaled(1.0, 2e4) as u64);
            }
            let _ = repair_on(&*self.recordings.disk.of(&process), &book.path);
        }
        self.recordings.disk.lose_power(&mut dice);
        self.recordings.ended.iter_mut().for_each(RecordingBook::lose_power);
        self.recordings.has_lost_power = true;
        self.check_recordings();
        self.drop_server();
        self.is_over = true;
        self.guards.clear();
        if self.captain != Captain::Waits {
            self.captain = Captain::Done;
        }
    }

    /// Looks for the recorder, as the supervisor does.
    pub(super) fn look_at_recorder(&mut self) -> ChildState {
        self.look_at_disk();
        if self.recordings.disk.free_bytes() >= bench_dragon::supervision::LEAST_ROOM_BYTES {
            self.supervisor.note_room(self.now_ns);
        }
        let now_ns = self.now_ns;
        let recorder = self.recorder.as_mut();
        let is_stopped = recorder.as_ref().is_some_and(|recorder| recorder.stopped_until_ns > now_ns);
        let runs = recorder.is_some();
        let is_heard = recorder.is_some_and(|recorder| std::mem::take(&mut recorder.is_heard));
        ChildState { part: Part::Recorder, runs, is_stopped, is_heard }
    }

    /// Reads all recordings of the show back, as a person does after the show, and removes them.
    fn check_recordings(&mut self) {
        let books = std::mem::take(&mut self.recordings.ended);
        let has_lost_power = std::mem::take(&mut self.recordings.has_lost_power);
        self.recordings.past_events.clear();
        if !books.is_empty()
            && let Err((promise, what)) = self.read_back(&books, has_lost_power)
        {
            self.promises.require(promise, self.now_ns, false, || what);
        }
        self.recordings.disk.clear();
    }

    fn read_back(&mut self, books: &[RecordingBook], has_lost_power: bool) -> Result<(), (Promise, String)> {
        let disk = self.recordings.disk.clone();
        disk.limit(None);
        let folder = tempfile::tempdir().map_err(|error| (Promise::NothingPanics, error.to_string()))?;
        let mut found: Vec<Vec<FrameHash>> = vec![Vec::new(); books.len()];
        let mut has_holes = false;
        for (path, bytes) in disk.files() {
            bytes.hash(&mut self.trace);
            let repaired = repair_on(&*disk.of(&ProcessLife::new()), &path);
            // A power loss leaves holes, also of a file of which nothing was synced.
            let is_foreign = matches!(repaired, Err(RepairError::Foreign(_)));
            if is_foreign && has_lost_power {
                continue;
            }
            // So is the end of a file that had not reached the disk. A file behind it, which a repair has synced, may be whole.
            has_holes |= has_lost_power && repaired.as_ref().is_ok_and(|repair| repair.was_unfinished);
            let is_damaged = matches!(repaired, Err(RepairError::Damaged { .. }));
            if repaired.is_err() && !(is_damaged && has_lost_power) {
                return Err((Promise::RepairLosesNothing, format!("{}: {repaired:?}", path.display())));
            }
            let bytes = disk.files().into_iter().find(|(named, _)| *named == path).map(|(_, bytes)| bytes);
            let copy = folder.path().join(path.file_name().unwrap_or_default());
            std::fs::write(&copy, bytes.unwrap_or_default()).expect("there is room for a copy");
            let checked =
                repair_checked(&copy, |_| ()).map_err(|error| (Promise::RepairLosesNothing, error.to_string()))?;
            let is_sound = checked.kept.is_none();
            has_holes |= !is_sound;
            if !is_sound && !has_lost_power {
                return Err((Promise::RepairLosesNothing, format!("{} is damaged: {checked:?}", path.display())));
            }
            // A file with a summary has all that the summary names.
            if let Ok(repaired) = repaired
                && (is_sound && repaired.frames != checked.frames || !is_sound && !repaired.was_unfinished)
            {
                return Err((Promise::RepairLosesNothing, format!("{repaired:?}, then {checked:?}")));
            }
        }
        let Ok(parts) = Parts::find(folder.path()) else {
            // A power loss may leave no file.
            return if has_lost_power { Ok(()) } else { check_all(books, &found, has_holes) };
        };
        let of_frame =
            books.iter().enumerate().flat_map(|(of, book)| book.frames().iter().map(move |&frame| (frame, of)));
        let of_frame: HashMap<FrameHash, usize> = of_frame.collect();
        let mut reader = PartsReader::new(Arc::new(parts.clone()));
        loop {
            match reader.next_wanted(|_| true) {
                Ok(Some(Recorded::Frame(frame))) => {
                    self.counts.recorded += 1;
                    let hash = frame_hash(&frame.header, &frame.handles);
                    let Some(&of) = of_frame.get(&hash) else {
                        return Err((Promise::RecordingIsPrefix, format!("no recorder read {:?}", frame.header)));
                    };
                    found[of].push(hash);
                }
                Ok(Some(_)) => {}
                Ok(None) => break,
                Err(error) => return Err((Promise::RecordingIsPrefix, error.to_string())),
            }
        }
        check_all(books, &found, has_holes)?;
        self.verify(&parts)
    }

    fn verify(&mut self, parts: &Parts) -> Result<(), (Promise, String)> {
        let Ok(verification) = verify(parts, &AtomicBool::new(false), |_| ()) else { return Ok(()) };
        for run in verification.runs {
            self.counts.verified += run.verified;
            if matches!(run.verdict, RunVerdict::Differs { .. }) {
                return Err((Promise::RecordingIsVerified, format!("{run:?}")));
            }
        }
        Ok(())
    }
}

fn check_all(books: &[RecordingBook], found: &[Vec<FrameHash>], has_holes: bool) -> Result<(), (Promise, String)> {
    for (book, found) in books.iter().zip(found) {
        book.check(found, has_holes).map_err(|what| (Promise::RecordingIsPrefix, what))?;
    }
    Ok(())
}
