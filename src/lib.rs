//! Real-time motion server for the bench dragon: 223 hinged benches led along a route.
//!
//! The layers, each knowing only those below it:
//!
//! | module | what it is |
//! |---|---|
//! | [`server`], [`monitor`], [`guard`], [`record`], [`replay`], [`export`], [`bridge`], [`timecode`] | the processes' logic |
//! | [`plan`] | what a choreographer asks |
//! | [`dragon`] | chain, boards, clearance, contact |
//! | [`route`] | the curves that the handles follow |
//!
//! Beside them: [`doctor`] (what stands in the way of a show), [`config`] (the validated TOML document), [`report`] (what
//! the processes say), [`table`] (answers in rows and columns), [`figure`] (answers for print), [`histogram`], [`clock`],
//! [`processors`], [`stop`], [`number`] and [`nameless_file`]. The bus is the crate `bench_dragon_ipc`.

pub mod bridge;
pub mod clock;
pub mod config;
pub mod control;
pub mod doctor;
pub mod export;
pub mod figure;
pub mod guard;
pub mod histogram;
pub mod metrics;
pub mod monitor;
pub mod nameless_file;
pub mod number;
pub mod observe;
pub mod processors;
pub mod record;
pub mod replay;
pub mod report;
pub mod server;
mod source;
pub mod stop;
pub mod table;
pub mod timecode;
pub mod view;
pub mod watch;
pub mod web;
