//! The tool library that is taken where none is given.

use std::path::Path;

use crate::library::Library;

const TOOLS: &str = include_str!("../data/tools.toml");

impl Library {
    /// The tools that are shipped: balls of 2 to 25 mm radius, flat and bull nose end mills, with holders and with cutting
    /// data for clay, foam and aluminium.
    #[must_use]
    pub fn shipped() -> Self {
        let read = Self::parse(TOOLS, Path::new("(shipped)/tools.toml"));
        debug_assert!(read.is_ok(), "{read:?}");
        read.unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What larger tools leave in corners stands beside the shank of the one that comes last.
    #[test]
    fn small_balls_have_shanks_no_thicker_than_they_are() {
        let library = Library::shipped();
        let balls = library.tools.iter().map(|tool| tool.tool).filter(|tool| tool.is_ball());
        let small: Vec<_> = balls.filter(|ball| ball.radius_mm() <= 10.0).collect();
        assert!(small.len() >= 7, "{small:?}");
        for ball in small {
            assert!(ball.shank_radius_mm() <= ball.radius_mm(), "{ball:?}");
        }
    }
}
