//! The program as users run it. Each test starts real processes on its own instance, and uses the bus, stdin, stdout, signals
//! and files.
//!
//! No test depends on a duration. A test waits for the event that it needs: a line, a frame or an end. If a test counts all
//! frames, a reader's buffer holds the whole show.

#![allow(clippy::print_stdout, reason = "a test prints its seed and its figures")]

mod bad_input;
mod bridge_osc;
mod bridge_psn;
mod bridge_troubles;
mod browser;
mod c_compiler;
mod c_library;
mod children;
mod clients_page;
mod commands;
mod ctl_status;
mod directory;
mod doctor;
mod drawing;
mod drawn_files;
mod echo;
mod endings;
mod examples;
mod excerpts;
mod export;
mod figures;
mod gate;
mod ground;
mod guard;
mod hangup;
mod http;
mod killed_cleaners;
mod killed_recorders;
mod late_join;
mod latency;
mod limits;
mod log;
mod loose_hinges;
mod lying_source;
mod metrics;
mod monitor;
mod other_versions;
mod overflow;
mod paper_page;
mod path;
mod planner;
mod poses;
mod poses_files;
mod pty;
mod python;
mod reader;
mod reader_reports;
mod readers_end;
mod reading;
mod real_time;
mod record;
mod releases;
mod replay;
mod resources;
mod restart;
mod route;
mod run_sheet;
mod second_server;
mod seed;
mod service_manager;
mod shell;
mod show;
mod show_also;
mod show_orphans;
mod show_repairs;
mod show_summary;
mod show_view;
mod signals;
mod slow_readers;
mod stage;
mod steady_desk;
mod stock_clients;
mod stuck_output;
mod suspended;
mod system_calls;
mod terminal;
mod timecode;
mod tmux;
mod turnaround;
mod verify;
mod view;
mod view_page;
mod view_states;
mod wall_clock;
mod watch;
#[cfg(feature = "zenoh")]
mod zenoh;
