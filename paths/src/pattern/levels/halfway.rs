//! Which levels of a pattern are looked at next: halfway between neighbours, towards where too much may be left.

/// What was found at a level.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Found {
    /// Passes were laid along it.
    pub(crate) laid: bool,
    /// Something holds the ball up where too much is left: what it reaches ends between here and the next level.
    pub(crate) barred: bool,
}

/// A level that was looked at.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Level {
    pub(crate) at: f64,
    /// Since the levels halfway were looked at.
    pub(crate) fresh: bool,
    pub(crate) found: Found,
}

/// A level halfway between two, to be looked at.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Halfway {
    pub(crate) at: f64,
    /// How far away these are.
    pub(crate) gap: f64,
    /// Whether one of them is barred.
    pub(crate) beside_barred: bool,
}

/// Levels halfway between neighbours of which one is new. Between the first level and the lowest, and at the other end, too:
/// close to a corner much area can lie within little level. With `ends` also right beside the lowest and the highest.
pub(crate) fn halfway(levels: &[Level], (low, high): (f64, f64), ends: bool) -> Vec<Halfway> {
    /// Curves at the ends themselves may be points or lie on the border.
    const INSIDE: f64 = 1e-3;
    let between = |a: f64, b: f64, of: &[Level]| {
        let beside_barred = of.iter().any(|l| l.found.barred);
        Halfway { at: 0.5 * (a + b), gap: 0.5 * (b - a), beside_barred }
    };
    let asks = |of: &[Level]| {
        let known = of.iter().all(|l| l.found.laid) || of.iter().any(|l| l.found.barred);
        of.iter().any(|l| l.fresh) && known && !of.iter().all(|l| l.found.barred && !l.found.laid)
    };
    let mut found: Vec<Halfway> =
        levels.windows(2).filter(|w| asks(w)).map(|w| between(w[0].at, w[1].at, w)).collect();
    let (first, last) = (levels.first().map(std::slice::from_ref), levels.last().map(std::slice::from_ref));
    found.extend(first.filter(|l| asks(l)).map(|l| between(low, l[0].at, l)));
    found.extend(last.filter(|l| asks(l)).map(|l| between(l[0].at, high, l)));
    if ends {
        let inside = INSIDE * (high - low);
        let beside = |at| Halfway { at, gap: f64::INFINITY, beside_barred: false };
        found.extend([low + inside, high - inside].map(beside));
    }
    found
}
