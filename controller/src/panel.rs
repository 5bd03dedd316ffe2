//! The order in force and the status of a machine, shared between those who give orders and the
//! motion, and their text and byte forms.

use std::fmt;
use std::str::FromStr;
use std::sync::{Mutex, MutexGuard, PoisonError};

use claymill_nurbs::{Point3, Vector3};

use crate::{Event, Order};

/// Where orders come together, and where those who give them see what the machine does.
#[derive(Debug)]
pub struct Panel {
    /// Whether every path waits for its own order.
    single_step: bool,
    status: Mutex<Status>,
}

/// What a machine says of itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Status {
    /// The order in force.
    pub order: Order,
    /// The record that it is at, or was at last.
    pub seq: u64,
    /// Paths that were run to their ends.
    pub paths: u64,
    /// How often what waited was dropped.
    pub discards: u64,
    /// Tip (mm) and tool axis; `None` before it has moved.
    pub place: Option<(Point3, Vector3)>,
    /// Speed of the tip, mm/s.
    pub speed: f64,
    /// Why it comes to rest and does not go on, until it is told to drop what waits.
    pub fault: Option<String>,
}

impl Panel {
    /// A panel with a first order; with `single_step`, the machine holds after every path.
    #[must_use]
    pub fn new(order: Order, single_step: bool) -> Self {
        let status = Status { order, seq: 0, paths: 0, discards: 0, place: None, speed: 0.0, fault: None };
        Panel { single_step, status: Mutex::new(status) }
    }

    /// What the machine says of itself.
    #[must_use]
    pub fn status(&self) -> Status {
        self.lock().clone()
    }

    /// The order in force.
    #[must_use]
    pub fn order(&self) -> Order {
        self.lock().order
    }

    /// Gives an order. An abort is the last one.
    pub fn tell(&self, order: Order) {
        let mut status = self.lock();
        if status.order != Order::Abort {
            status.order = order;
        }
    }

    /// Takes note of what the machine reports; a step ends with its path.
    pub fn saw(&self, event: &Event) {
        let mut status = self.lock();
        match event {
            Event::At(point) => {
                status.seq = point.seq;
                status.place = Some((point.tip, point.axis));
                status.speed = point.speed;
            }
            Event::PathDone(_) => {
                status.paths += 1;
                if status.order == Order::Step || (self.single_step && status.order == Order::Run) {
                    status.order = Order::Hold;
                }
            }
            // An order to discard may have been told since: it stays.
            Event::Fault(why) => status.fault = Some(why.clone()),
            Event::NotDiscarded => {
                if status.order == Order::Discard {
                    status.order = Order::Hold;
                }
            }
            Event::Discarded => {
                status.discards += 1;
                status.fault = None;
                // A stream that begins anew recalls the one before it without an order from here: the machine goes on.
                if status.order == Order::Discard {
                    status.order = Order::Hold;
                }
            }
            Event::Executed(..) | Event::ToldAgain(_) | Event::Stands => {}
        }
    }

    fn lock(&self) -> MutexGuard<'_, Status> {
        // Every change is whole when its holder goes.
        self.status.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A text is no order.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no order; write hold, run, step, abort or discard")]
pub struct UnknownOrder(pub String);

impl FromStr for Order {
    type Err = UnknownOrder;

    fn from_str(text: &str) -> Result<Self, UnknownOrder> {
        match text {
            "hold" => Ok(Order::Hold),
            "run" | "resume" => Ok(Order::Run),
            "step" => Ok(Order::Step),
            "abort" => Ok(Order::Abort),
            "discard" => Ok(Order::Discard),
            other => Err(UnknownOrder(other.into())),
        }
    }
}

impl fmt::Display for Order {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Order::Hold => "hold",
            Order::Run => "run",
            Order::Step => "step",
            Order::Abort => "abort",
            Order::Discard => "discard",
        })
    }
}

const ORDERS: [Order; 5] = [Order::Run, Order::Hold, Order::Step, Order::Abort, Order::Discard];

impl Order {
    /// Its byte in a connection; 0 stands for no order.
    pub(crate) fn byte(order: Option<Order>) -> u8 {
        order.and_then(|o| ORDERS.iter().position(|x| *x == o)).map_or(0, |i| i as u8 + 1)
    }

    /// The order of a byte; outer `None` where there is none such.
    pub(crate) fn of_byte(byte: u8) -> Option<Option<Order>> {
        match byte {
            0 => Some(None),
            n => ORDERS.get(usize::from(n) - 1).copied().map(Some),
        }
    }
}

impl Status {
    /// Bytes in a connection: order u8, whether there is a place u8, whether there is a fault u8, then seq, paths, discards
    /// u64, tip and axis (3 × f64 each), speed f64, and the fault's text up to the end.
    const BYTES: usize = 3 + 3 * 8 + 7 * 8;
    /// A fault's text is cut behind so many bytes.
    const LONGEST_FAULT: usize = 1000;

    pub(crate) fn encode(&self) -> Vec<u8> {
        let flags = [self.place.is_some(), self.fault.is_some()].map(u8::from);
        let mut bytes = vec![Order::byte(Some(self.order)), flags[0], flags[1]];
        for count in [self.seq, self.paths, self.discards] {
            bytes.extend(count.to_le_bytes());
        }
        let (tip, axis) = self.place.unwrap_or((Point3::origin(), Vector3::z()));
        for number in tip.iter().chain(axis.iter()).chain([&self.speed]) {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(self.fault.iter().flat_map(|text| text.bytes()).take(Status::LONGEST_FAULT));
        bytes
    }

    pub(crate) fn decode(bytes: &[u8]) -> Option<Status> {
        let (bytes, text) = bytes.split_at_checked(Status::BYTES)?;
        let eight = |i: usize| bytes[3 + 8 * i..11 + 8 * i].try_into().unwrap_or_default();
        let count = |i: usize| u64::from_le_bytes(eight(i));
        let number = |i: usize| f64::from_le_bytes(eight(i));
        let tip = Point3::new(number(3), number(4), number(5));
        let axis = Vector3::new(number(6), number(7), number(8));
        let speed = number(9);
        let finite = tip.iter().chain(axis.iter()).chain([&speed]).all(|v| v.is_finite());
        let flag = |i: usize| match bytes[i] {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        };
        let place = flag(1)?.then_some((tip, axis));
        let fault = flag(2)?.then(|| String::from_utf8_lossy(text).into_owned());
        let order = Order::of_byte(bytes[0])??;
        let (seq, paths, discards) = (count(0), count(1), count(2));
        finite.then_some(Status { order, seq, paths, discards, place, speed, fault })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SetPoint;

    #[test]
    fn a_step_ends_with_its_path_and_an_abort_never() {
        let panel = Panel::new(Order::Step, false);
        panel.saw(&Event::PathDone(3));
        assert_eq!(panel.status().order, Order::Hold);
        panel.tell(Order::Run);
        panel.saw(&Event::PathDone(4));
        assert_eq!((panel.status().order, panel.status().paths), (Order::Run, 2));
        panel.tell(Order::Abort);
        panel.tell(Order::Run);
        panel.saw(&Event::Discarded);
        assert_eq!(panel.status().order, Order::Abort);
        let stepping = Panel::new(Order::Run, true);
        stepping.saw(&Event::PathDone(0));
        assert_eq!(stepping.status().order, Order::Hold);
        // A fault leaves the order as it is, also one to discard that came just before it.
        let panel = Panel::new(Order::Run, false);
        panel.saw(&Event::Fault("one".into()));
        assert_eq!(panel.order(), Order::Run);
        panel.tell(Order::Discard);
        panel.saw(&Event::Fault("another".into()));
        assert_eq!((panel.order(), panel.status().fault.as_deref()), (Order::Discard, Some("another")));
        // What could not be discarded stays, and the machine holds.
        panel.saw(&Event::NotDiscarded);
        assert_eq!((panel.order(), panel.status().fault.as_deref()), (Order::Hold, Some("another")));
    }

    #[test]
    fn a_status_survives_its_bytes() {
        let panel = Panel::new(Order::Hold, false);
        let point = SetPoint {
            seq: 7,
            parameter: 0.5,
            tip: Point3::new(1.0, -2.0, 3.5),
            axis: -Vector3::y(),
            speed: 4.0,
        };
        for place in [false, true] {
            if place {
                panel.saw(&Event::At(point));
            }
            for fault in ["", "record 3: it is damaged", "ö"] {
                if !fault.is_empty() {
                    panel.saw(&Event::Fault(fault.into()));
                }
                let bytes = panel.status().encode();
                assert_eq!(Status::decode(&bytes), Some(panel.status()));
                for i in 0..3 {
                    let mut damaged = bytes.clone();
                    damaged[i] = 9;
                    assert_eq!(Status::decode(&damaged), None);
                }
                assert_eq!(Status::decode(&bytes[..20]), None);
            }
            panel.saw(&Event::Discarded);
            assert_eq!(panel.status().fault, None);
        }
        for order in ["hold", "run", "step", "abort", "discard"] {
            let order: Order = order.parse().unwrap();
            assert_eq!(Order::of_byte(Order::byte(Some(order))), Some(Some(order)));
        }
        assert!("stop".parse::<Order>().is_err() && Order::of_byte(6).is_none());
    }
}
