//! Right isosceles triangles on an integer grid: an apex and one end of the base say everything, the third corner
//! follows by a quarter turn, and a bisection stays on the grid. Integers alone decide which vertices are the same.

/// Side of the square domain, in grid units: 1 cm on 164 km.
pub const SIDE: u32 = 1 << 24;
/// Bisections of a leaf into its lattice of 16 triangles; every edge of the leaf becomes 4.
pub const LATTICE: u32 = 4;
/// The finest level of a leaf: its lattice still lies on the grid.
pub const FINEST: u32 = 42;

/// A point of the grid: x east, y north, each at most [`SIDE`].
pub type Vertex = [u32; 2];

/// A triangle by its apex and the first end of its long edge; counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Triangle {
    /// Bisections since the domain's own two triangles.
    pub level: u32,
    /// The right angle.
    pub apex: Vertex,
    /// The first end of the long edge.
    pub base: Vertex,
}

impl Triangle {
    /// The two halves of the domain, which share its diagonal.
    pub const ROOTS: [Triangle; 2] = [
        Triangle { level: 0, apex: [0, 0], base: [SIDE, 0] },
        Triangle { level: 0, apex: [SIDE, SIDE], base: [0, SIDE] },
    ];

    /// Apex and both ends of the long edge, counter-clockwise.
    pub fn corners(&self) -> [Vertex; 3] {
        let [ax, ay] = self.apex.map(i64::from);
        let [bx, by] = self.base.map(i64::from);
        // A quarter turn about the apex. The third corner of a triangle of the domain lies in the domain.
        [self.apex, self.base, [(ax - (by - ay)) as u32, (ay + (bx - ax)) as u32]]
    }
    /// Middle of the long edge; on the grid while `level` is below 47.
    pub fn middle(&self) -> Vertex {
        let [_, b, c] = self.corners();
        [(b[0] + c[0]) / 2, (b[1] + c[1]) / 2]
    }
    /// The two halves.
    pub fn children(&self) -> [Triangle; 2] {
        let [a, _, c] = self.corners();
        let (level, apex) = (self.level + 1, self.middle());
        [Triangle { level, apex, base: a }, Triangle { level, apex, base: c }]
    }
    /// All descendants `depth` levels below: a lattice of 2^depth triangles.
    pub fn lattice(&self, depth: u32) -> Vec<Triangle> {
        let mut triangles = vec![*self];
        for _ in 0..depth {
            triangles = triangles.iter().flat_map(Triangle::children).collect();
        }
        triangles
    }
    /// Shares of the corners at `vertex`; one is negative outside. Cross products of the grid's integers are exact in `f64`.
    pub fn shares(&self, vertex: Vertex) -> [f64; 3] {
        let [a, b, c] = self.corners().map(|corner| corner.map(i64::from));
        let p = vertex.map(i64::from);
        let cross =
            |o: [i64; 2], p: [i64; 2], q: [i64; 2]| (p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0]);
        let whole = cross(a, b, c) as f64;
        [cross(p, b, c), cross(a, p, c), cross(a, b, p)].map(|part| part as f64 / whole)
    }
    /// The descendant `depth` levels below that holds `vertex`, which this one holds.
    pub fn down_to(&self, vertex: Vertex, depth: u32) -> Triangle {
        (0..depth).fold(*self, |triangle, _| {
            let [first, second] = triangle.children();
            if first.shares(vertex).iter().all(|share| *share >= 0.0) { first } else { second }
        })
    }
    /// Half the side, in grid units, of a square about [`Triangle::middle`] that holds this triangle and, with the
    /// same rule, the squares of all triangles that a split here can force or allow.
    ///
    /// With legs of `w` along the axes (even levels) it is 3w/2; with legs along the diagonals, `w` along each axis,
    /// it is 2w. A child's middle lies w/2 away along each axis at most, and its own `w` is w/2 after an even level,
    /// w after an odd one: 3w/2 = w/2 + 2(w/2), and 2w = w/2 + 3w/2. So the squares nest, exactly, in integers.
    pub fn reach(&self) -> i64 {
        let w = i64::from(self.apex[0].abs_diff(self.base[0]).max(self.apex[1].abs_diff(self.base[1])));
        if self.level.is_multiple_of(2) { 3 * w / 2 } else { 2 * w }
    }
}
