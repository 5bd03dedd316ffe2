/// Where passes run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Strategy {
    /// Parallel rows over whole regions, seen along the tool axis, closer where the surface asks for it.
    Planar,
    /// Parameter lines of every patch by itself.
    IsoPatch,
}

impl Strategy {
    /// All strategies.
    pub const ALL: [Strategy; 2] = [Strategy::Planar, Strategy::IsoPatch];
}

impl std::fmt::Display for Strategy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Strategy::Planar => "planar",
            Strategy::IsoPatch => "iso-patch",
        })
    }
}
