//! One process of every role on one instance. The storm restarts each killed process.

use std::fs;
use std::process::ExitStatus;
use std::thread;
use std::time::Duration;

use bench_dragon::recording::repair;
use rustix::process::{Pid, Signal, kill_process};
use test_support::eventually::{DEADLINE, before_deadline};

use crate::books::{Books, Phase};
use crate::player::Player;
use crate::random::Random;
use crate::role::{Role, recording};
use crate::stage::Stage;

/// Length of a process's start, in which it creates or opens its services.
pub(crate) const START_UP: Duration = Duration::from_millis(30);
/// Longest time between two kills of a round.
const BETWEEN: Duration = Duration::from_millis(150);
/// Greatest number of kills in a round. After it, all processes must show progress.
const MOST_KILLS: usize = 8;

/// The reason of a failure.
pub(crate) type Failure = String;

/// The processes of a stage, at most one per role.
#[derive(Debug)]
pub(crate) struct Troupe<'a> {
    stage: &'a Stage,
    random: Random,
    players: Vec<Player>,
    turns: usize,
    /// Number of starts and kills of servers. While it is constant, a server runs all the time.
    changes_of_server: u64,
    /// For each brief role: the changes of server at the start, and the progress of ended processes.
    brief: Vec<(Role, u64, u64)>,
}

impl<'a> Troupe<'a> {
    /// Starts a process of every role.
    pub(crate) fn gather(stage: &'a Stage, random: Random) -> Self {
        let mut troupe = Self { stage, random, players: vec![], turns: 0, changes_of_server: 0, brief: vec![] };
        for role in Role::ALL {
            troupe.start(role);
        }
        troupe
    }

    /// Kills and restarts some processes, with up to `most` kills, then waits for progress of all.
    pub(crate) fn play_round(&mut self, most: u32, books: &mut Books) -> Result<(), Failure> {
        let kills = 1 + self.random.below(MOST_KILLS.min(most as usize));
        let mut missing = vec![];
        let mut left = kills;
        let mut last = None;
        while left > 0 {
            let longest = if self.random.percent(70) { START_UP } else { BETWEEN };
            thread::sleep(self.random.up_to(longest));
            self.look(books)?;
            let together = if self.random.percent(15) { 1 + self.random.below(left.min(4)) } else { 1 };
            let mut victims = vec![];
            for _ in 0..together {
                let role = match last {
                    Some(role) if self.random.percent(40) => role,
                    _ => self.random.pick(&[
                        Role::Serve,
                        Role::Serve,
                        Role::Serve,
                        Role::Monitor,
                        Role::Record,
                        Role::Record,
                        Role::Echo,
                        Role::Hz,
                        Role::Latency,
                        Role::Ctl,
                    ]),
                };
                if self.has(role) {
                    self.kill(role, books)?;
                    victims.push(role);
                }
            }
            left -= victims.len();
            for role in victims {
                last = Some(role);
                if self.random.percent(80) { self.start(role) } else { missing.push(role) }
            }
            if !missing.is_empty() && (left == 0 || missing.len() > 3 || self.random.percent(30)) {
                missing.drain(..).for_each(|role| self.start(role));
            }
        }
        for role in missing {
            self.start(role);
        }
        self.await_progress(books)
    }

    /// Ends all processes, the server last, then finishes and reads every recording.
    pub(crate) fn end(mut self, books: &mut Books) -> Result<(), Failure> {
        self.players.sort_by_key(|player| player.role == Role::Serve);
        for mut player in self.players.drain(..) {
            let pid = Pid::from_raw(player.pid().cast_signed()).expect("a process id is not 0");
            if player.ended().is_none() {
                kill_process(pid, Signal::TERM).expect("the process has not been waited for");
            }
            let ended = before_deadline(|| player.ended().ok_or(()));
            let status = ended.map_err(|()| format!("{} does not end at SIGTERM", player.role.name()))?;
            if !status.success() && !player.role.is_brief() {
                return Err(describe(&player, status));
            }
            books.complain(&player.complaints());
        }
        self.read_recordings(books)
    }

    /// Finishes the files of killed recorders, and counts the frames.
    fn read_recordings(&self, books: &mut Books) -> Result<(), Failure> {
        let folder = self.stage.path("");
        for entry in fs::read_dir(&folder).expect("the stage has a folder").flatten() {
            let path = entry.path();
            if entry.metadata().expect("no other process changes the folder").len() == 0 {
                // The recorder was killed before the first byte.
                continue;
            }
            let repaired = repair(&path).map_err(|error| format!("{}: {error}", path.display()))?;
            if let Some(kept) = repaired.kept {
                return Err(format!("{} was damaged: kept as {}", path.display(), kept.display()));
            }
            books.recordings += 1;
            books.recorded += repaired.frames;
        }
        Ok(())
    }

    fn has(&self, role: Role) -> bool {
        self.players.iter().any(|player| player.role == role)
    }

    fn player(&self, role: Role) -> &Player {
        self.players.iter().find(|player| player.role == role).expect("each role has a process at the end of a round")
    }

    fn start(&mut self, role: Role) {
        self.turns += 1;
        if role == Role::Serve {
            self.changes_of_server += 1;
        }
        let command = self.stage.command(&role.arguments(self.turns, &mut self.random));
        let player = Player::start(role, self.turns, command);
        if role.is_brief() {
            let before = self.brief_progress(role);
            let at = if self.server_is_there() { self.changes_of_server } else { u64::MAX };
            self.brief.retain(|(other, ..)| *other != role);
            self.brief.push((role, at, before));
        }
        self.players.push(player);
    }

    fn server_is_there(&self) -> bool {
        self.players.iter().any(|player| player.role == Role::Serve && player.progress() > 0)
    }

    fn kill(&mut self, role: Role, books: &mut Books) -> Result<(), Failure> {
        let index = self.players.iter().position(|player| player.role == role).expect("it is there");
        let player = self.players.swap_remove(index);
        let phase = if self.progress(&player) == 0 { Phase::Starting } else { Phase::Playing };
        if role == Role::Serve {
            self.changes_of_server += 1;
        }
        match player.kill() {
            Ok(complaints) => {
                books.kill(role.name(), phase);
                books.complain(&complaints);
                Ok(())
            }
            Err((mut player, status)) => {
                self.take_end(&mut player, status, books).map(|()| books.kill(role.name(), phase))
            }
        }
    }

    /// Fails if a process has ended without a kill. Restarts brief processes.
    fn look(&mut self, books: &mut Books) -> Result<(), Failure> {
        for index in (0..self.players.len()).rev() {
            if let Some(status) = self.players[index].ended() {
                let mut player = self.players.swap_remove(index);
                self.take_end(&mut player, status, books)?;
                self.start(player.role);
            }
        }
        Ok(())
    }

    /// Handles a process that has ended by itself.
    fn take_end(&mut self, player: &mut Player, status: ExitStatus, books: &mut Books) -> Result<(), Failure> {
        let complaints = player.complaints();
        books.complain(&complaints);
        if !player.role.is_brief() {
            return Err(describe(player, status));
        }
        let Some((_, begun_at, progress)) = self.brief.iter_mut().find(|(role, ..)| *role == player.role) else {
            return Ok(());
        };
        *progress += player.progress();
        // A refusal is a reply too.
        let was_answered = player.progress() > 0;
        let had_no_server = *begun_at != self.changes_of_server
            && complaints.last().is_some_and(|complaint| complaint.contains("no server runs on instance"));
        let is_fine = match player.role {
            Role::Ctl => was_answered || had_no_server,
            _ => status.success(),
        };
        if is_fine { Ok(()) } else { Err(describe(player, status)) }
    }

    /// Returns the progress of a process.
    fn progress(&self, player: &Player) -> u64 {
        match player.role {
            Role::Record => {
                let path = self.stage.path(&recording(player.turn));
                fs::metadata(path).map_or(0, |metadata| metadata.len())
            }
            _ => player.progress(),
        }
    }

    fn brief_progress(&self, role: Role) -> u64 {
        self.brief.iter().find(|(other, ..)| *other == role).map_or(0, |(.., progress)| *progress)
    }

    fn total_progress(&self, role: Role) -> u64 {
        self.progress(self.player(role)) + self.brief_progress(role)
    }

    /// Waits until a reader has seen the last server, then until all processes have made progress.
    fn await_progress(&mut self, books: &mut Books) -> Result<(), Failure> {
        self.await_state("the server is seen", books, |troupe| {
            let run_id = troupe.player(Role::Serve).run_id();
            if run_id.is_some() && troupe.player(Role::Echo).run_id() == run_id { None } else { Some("echo") }
        })?;
        let before = Role::ALL.map(|role| (role, self.total_progress(role)));
        self.await_state("everyone gets on", books, |troupe| {
            let gets_on = |role, before| role == Role::Serve || troupe.total_progress(role) > before;
            before.iter().find(|(role, before)| !gets_on(*role, *before)).map(|(role, _)| role.name())
        })
    }

    /// Waits until `missing` returns `None`.
    fn await_state(
        &mut self,
        what: &str,
        books: &mut Books,
        missing: impl Fn(&Self) -> Option<&'static str>,
    ) -> Result<(), Failure> {
        let looked = before_deadline(|| match self.look(books) {
            Ok(()) => missing(self).map_or(Ok(Ok(())), Err),
            Err(failure) => Ok(Err(failure)),
        });
        looked.unwrap_or_else(|name| {
            let players = self.players.iter().map(|player| {
                let (name, turn, progress) = (player.role.name(), player.turn, self.progress(player));
                format!("\n{name} {turn}, pid {}: progress {progress}, {:?}", player.pid(), player.complaints())
            });
            Err(format!("waited {DEADLINE:?} until {what}: {name} does not{}", players.collect::<String>()))
        })
    }
}

fn describe(player: &Player, status: ExitStatus) -> Failure {
    let complaints = player.complaints().join("\n");
    format!("{} {} ended by itself with {status}:\n{complaints}", player.role.name(), player.turn)
}
