//! Two buses that a pair of bridges joins over the network: what is on the one is on the other.

mod bridges;
mod cable;
mod clients;
mod commands;
mod cut;
mod hostile;
mod independent;
mod links;
mod poses;
