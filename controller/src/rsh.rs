//! Client of LinuxCNC's remote shell (`linuxcncrsh`): MDI blocks, program runs, abort and position.

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::time::{Duration, Instant};

use claymill_nurbs::Point3;
use thiserror::Error;

/// A conversation with LinuxCNC's remote shell, `linuxcncrsh`.
#[derive(Debug)]
pub struct Remote {
    stream: TcpStream,
    unread: Vec<u8>,
}

/// The control did not answer as it should.
#[derive(Debug, Error)]
pub enum RemoteError {
    /// No connection, or it broke.
    #[error("LinuxCNC: {0}")]
    Io(io::Error),
    /// It is silent.
    #[error("LinuxCNC has not answered within {} s", PATIENCE.as_secs())]
    Silent,
    /// It refused an order.
    #[error("LinuxCNC refused `{order}`: {answer}")]
    Refused {
        /// What it was told.
        order: String,
        /// What it said.
        answer: String,
    },
}

impl From<io::Error> for RemoteError {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => RemoteError::Silent,
            _ => RemoteError::Io(error),
        }
    }
}

/// An order is answered within this time, or the control counts as gone.
const PATIENCE: Duration = Duration::from_secs(30);
/// A program that was told to run does so within this time.
const STARTS: Duration = Duration::from_secs(3);
/// The password that linuxcncrsh has unless it was started with another one.
const ENABLE: &str = "EMCTOO";

impl Remote {
    /// Connects, switches the machine on and into MDI mode.
    ///
    /// # Errors
    /// The control does not answer, or refuses.
    pub fn connect(address: &str) -> Result<Self, RemoteError> {
        let stream = TcpStream::connect(address)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        stream.set_write_timeout(Some(PATIENCE))?;
        stream.set_nodelay(true)?;
        let mut remote = Remote { stream, unread: Vec::new() };
        remote.order("hello EMC claymill 1.0")?;
        for line in [&format!("set enable {ENABLE}"), "set echo off", "set verbose on"] {
            remote.order(line)?;
        }
        // Leaving the emergency stop may be lost while the control starts.
        let begun = Instant::now();
        while !remote.ask("get machine")?.to_ascii_uppercase().ends_with("ON") {
            remote.order("set estop off")?;
            std::thread::sleep(Duration::from_millis(200));
            remote.order("set machine on")?;
            std::thread::sleep(Duration::from_millis(200));
            if begun.elapsed() > PATIENCE {
                return Err(RemoteError::Refused {
                    order: "set machine on".into(),
                    answer: "it stays off".into(),
                });
            }
        }
        remote.order("set mode mdi")?;
        remote.order("set set_wait received")?;
        Ok(remote)
    }

    /// One block of G-code; returns when the control has taken it.
    ///
    /// # Errors
    /// The control does not answer, or refuses.
    pub fn mdi(&mut self, block: &str) -> Result<(), RemoteError> {
        self.order(&format!("set mdi {block}")).map(|_| ())
    }

    /// Runs a program that the control can read, to its end; calls `seen` with every position on the way. The machine is
    /// in MDI mode afterwards.
    ///
    /// # Errors
    /// The control does not answer or refuses, or the program still runs after `patience`.
    pub fn run_file(
        &mut self,
        path: &Path,
        patience: Duration,
        mut seen: impl FnMut(Point3),
    ) -> Result<(), RemoteError> {
        self.order("set mode auto")?;
        self.order(&format!("set open {}", path.display()))?;
        self.order("set run")?;
        let begun = Instant::now();
        let mut ran = false;
        loop {
            let running = !self.ask("get program_status")?.to_ascii_uppercase().ends_with("IDLE");
            ran |= running;
            if !running && (ran || begun.elapsed() > STARTS) {
                break;
            }
            if begun.elapsed() > patience {
                return Err(RemoteError::Refused { order: "set run".into(), answer: "it still runs".into() });
            }
            self.position()?.into_iter().for_each(&mut seen);
        }
        self.order("set mode mdi").map(|_| ())
    }

    /// Ends what the machine is doing, and waits until it stands still. The control turns the spindle off.
    ///
    /// # Errors
    /// The control does not answer, or still moves after `patience`.
    pub fn abort(&mut self, patience: Duration) -> Result<(), RemoteError> {
        self.order("set abort")?;
        self.settle(patience, |_| ())?;
        // What the abort itself has to say is no fault of the blocks that follow.
        self.error()?;
        self.order("set mode mdi").map(|_| ())
    }

    /// Where the machine is, mm.
    ///
    /// # Errors
    /// The control does not answer.
    pub fn position(&mut self) -> Result<Option<Point3>, RemoteError> {
        self.place("get abs_act_pos")
    }

    /// Where the machine is from the work's zero, with the work and tool offsets in force, mm.
    ///
    /// # Errors
    /// The control does not answer.
    pub fn work_position(&mut self) -> Result<Option<Point3>, RemoteError> {
        self.place("get rel_act_pos")
    }

    fn place(&mut self, question: &str) -> Result<Option<Point3>, RemoteError> {
        let answer = self.ask(question)?;
        let numbers: Vec<f64> = answer.split_whitespace().filter_map(|w| w.parse().ok()).collect();
        Ok((numbers.len() >= 3).then(|| Point3::new(numbers[0], numbers[1], numbers[2])))
    }

    /// Waits until the machine stands still; calls `seen` with every position on the way.
    ///
    /// # Errors
    /// The control does not answer, or still moves after `patience`.
    pub fn settle(&mut self, patience: Duration, mut seen: impl FnMut(Point3)) -> Result<(), RemoteError> {
        let begun = Instant::now();
        let (mut last, mut still): (Option<Point3>, Option<Instant>) = (None, None);
        while begun.elapsed() < patience {
            let here = self.position()?;
            if let Some(p) = here {
                seen(p);
            }
            if here.is_some() && here == last {
                if still.get_or_insert_with(Instant::now).elapsed() > Duration::from_millis(400) {
                    return Ok(());
                }
            } else {
                still = None;
            }
            last = here;
            std::thread::sleep(Duration::from_millis(5));
        }
        Err(RemoteError::Refused { order: "wait".into(), answer: "the machine still moves".into() })
    }

    /// What went wrong in the control since it was last asked; `None` when nothing did.
    ///
    /// # Errors
    /// The control does not answer.
    pub fn error(&mut self) -> Result<Option<String>, RemoteError> {
        let answer = self.ask("get error")?;
        let text = answer.trim_start_matches("ERROR").trim().to_owned();
        Ok((!text.is_empty() && !text.eq_ignore_ascii_case("ok")).then_some(text))
    }

    fn order(&mut self, order: &str) -> Result<String, RemoteError> {
        let answer = self.ask(order)?;
        if answer.to_ascii_uppercase().contains("NAK") {
            return Err(RemoteError::Refused { order: order.to_owned(), answer });
        }
        Ok(answer)
    }

    fn ask(&mut self, line: &str) -> Result<String, RemoteError> {
        self.stream.write_all(format!("{line}\r\n").as_bytes())?;
        // `set verbose` and `set echo` may be answered or not; everything else is.
        loop {
            if let Some(end) = self.unread.iter().position(|b| *b == b'\n') {
                let line: Vec<u8> = self.unread.drain(..=end).collect();
                let text = String::from_utf8_lossy(&line).trim().to_owned();
                if text.is_empty() {
                    continue;
                }
                return Ok(text);
            }
            if self.unread.len() > 1 << 16 {
                return Err(io::Error::new(io::ErrorKind::InvalidData, "an answer without end").into());
            }
            let mut buffer = [0; 4096];
            let count = self.stream.read(&mut buffer)?;
            if count == 0 {
                return Err(io::Error::from(io::ErrorKind::ConnectionReset).into());
            }
            self.unread.extend_from_slice(&buffer[..count]);
        }
    }
}
