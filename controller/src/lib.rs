//! From a job folder to a machine's control: posts, their parsers, the stream and controls that exist only here.
//!
//! ```text
//!   job folder ─► MachineJob ─► ladder (NURBS, polynomial, biarcs, straight) ─► grammar ─► program
//!                     ▲                                                                       │
//!                     └──────────────── comparison ◄── elements ◄── the same grammar ◄────────┘
//! ```
//!
//! A program is never believed: it is read back from its file by the grammar of its control, and held against
//! the job, curve by curve. Lengths are millimetres in the setup's machine coordinates, whose +Z is the tool
//! axis.
//!
//! ```
//! use claymill_controller::{Dialect, Machine, check};
//! let program = "G90 G21 G94\nG0 Z10.\nG0 X0. Y0.\nG0 Z0.\nG1 X10. F600.\nM30\n";
//! assert_eq!(check(program, Dialect::G1, &Machine::default()), Ok(2));
//! ```

// What is to be said is returned: only the command prints.
#![cfg_attr(not(test), warn(clippy::print_stdout, clippy::print_stderr))]

mod biarc;
mod compare;
mod dialects;
mod drive;
mod error;
mod follow;
mod frame;
mod frames;
mod handshake;
mod job;
mod judge;
mod limits;
mod lower;
mod machine;
mod number;
mod panel;
mod placed;
mod port;
mod post;
mod private_file;
mod producer;
mod queue;
mod recall;
mod record;
mod reference;
mod rotary;
mod route;
mod rsh;
mod run;
mod shape;
mod shared;
mod simulate;
mod switches;
mod tilt;
mod wire;
mod words;

pub use compare::{Comparison, check, compare, dialect_of, elements, moves_of};
pub use dialects::{Dialect, Element, UnknownDialect, tool_number};
pub use error::{MachineError, PostError, ReadError, Refusal};
pub use frame::Frame;
pub use job::{MachineJob, Section, Stroke};
pub use limits::{Travel, travel};
pub use lower::Rung;
pub use machine::{
    AxisName, ControlFacts, Coolant, Dynamics, Feed, Files, LineNumbers, Machine, PlaneBy, SetupPlace,
    Spindle, Tilting, ToolPlace, Units,
};
pub use number::LengthFormat;
pub use panel::{Panel, Status, UnknownOrder};
pub use port::{Port, tell};
pub use post::{PostTotals, WrittenFile, blocks_of, post, post_to, retreat_of};
pub use producer::Producer;
pub use queue::{Consumer, QueueError, SILENCE};
pub use record::{LONGEST_RECORD, Path, RECORD_VERSION, Record, RecordError};
pub use reference::{Ended, Event, Order, Reference, ReferenceError, SetPoint, Tally};
pub use route::{Approach, Route};
pub use rsh::{Remote, RemoteError};
pub use shape::{ARC_RADIUS_MM, Arc, Plane, Shape};
pub use simulate::{FeedProfile, Simulation, simulate};
pub use tilt::{Angles, Placed, Tilt, Turn};
pub use wire::{Sender, WireError, serve};
