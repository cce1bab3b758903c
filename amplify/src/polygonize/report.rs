//! What a polygonisation has cost.

/// What a polygonisation cost and holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// Values of f at corners.
    pub corner_evaluations: u64,
    /// Values of f along edges.
    pub root_evaluations: u64,
    /// Values where f is bare ground, an elevation looked up or the distance to a wall: a column of corners is one.
    pub lookups: u64,
    /// Enclosures of f over boxes.
    pub enclosures: u64,
    /// Gradients for normals.
    pub gradients: u64,
    /// Cubes whose corners were looked at.
    pub cells: u64,
}

impl Report {
    /// Values of f: the paper's #C.
    pub fn evaluations(&self) -> u64 {
        self.corner_evaluations + self.root_evaluations
    }
    pub(super) fn plus(self, other: Report) -> Report {
        Report {
            corner_evaluations: self.corner_evaluations + other.corner_evaluations,
            root_evaluations: self.root_evaluations + other.root_evaluations,
            lookups: self.lookups + other.lookups,
            enclosures: self.enclosures + other.enclosures,
            gradients: self.gradients + other.gradients,
            cells: self.cells + other.cells,
        }
    }
}
