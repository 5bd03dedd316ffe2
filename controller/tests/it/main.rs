//! Programs, streams and virtual controls from outside, in one program. Tests that measure rates, kill processes or
//! run LinuxCNC are programs of their own beside this folder.

mod damaged;
mod faults;
mod fuzzed;
mod grammar;
mod job;
mod limits;
mod on_the_machine;
mod own_blocks;
mod owners;
mod records;
mod reference;
mod round_trip;
mod route;
mod simulate;
mod taken_up;
mod tilted;
