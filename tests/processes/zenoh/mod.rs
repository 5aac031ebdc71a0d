//! Two buses that a pair of bridges connects over the network.

mod bridges;
mod cable;
mod clients;
mod commands;
mod cut;
mod hostile;
mod independent;
mod links;
mod poses;
