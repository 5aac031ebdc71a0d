//! Real-time motion server for the bench dragon.
