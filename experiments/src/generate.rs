//! Scenes of any number of primitives at equal overlap: discs of one radius on a jittered lattice whose density does not
//! depend on their number, so that what lies over a point is the same in a scene of ten and of a hundred thousand.

use crate::genevaux2015::rays::Random;
use glam::DVec2;
use std::f64::consts::PI;
use std::fmt::Write;

/// A scene of scattered discs.
#[derive(Clone, Copy, Debug)]
pub struct Scatter {
    /// How many primitives.
    pub primitives: u32,
    /// Mean number of them over a point.
    pub overlap: f64,
    /// Chooses the places and elevations.
    pub seed: u64,
}

/// Metres.
const RADIUS: f64 = 100.0;

impl Scatter {
    /// Columns and rows of the lattice.
    fn lattice(&self) -> [u32; 2] {
        let columns = f64::from(self.primitives).sqrt().ceil().max(1.0) as u32;
        [columns, self.primitives.div_ceil(columns).max(1)]
    }
    fn spacing(&self) -> f64 {
        RADIUS * (PI / self.overlap).sqrt()
    }
    /// North-east corner of what is covered, metres; the south-west one is the origin.
    pub fn extent(&self) -> DVec2 {
        let [columns, rows] = self.lattice();
        self.spacing() * DVec2::new(f64::from(columns), f64::from(rows))
    }
    /// The scene file: one blend of `primitives` discs, level, of fractal noise and of ridges in turn.
    pub fn text(&self) -> String {
        let ([columns, _], spacing) = (self.lattice(), self.spacing());
        let mut random = Random(self.seed);
        let mut text = format!(
            "// {} discs, {} over a point on average.\n(\n    format: \"terrain-scene/1\",\n    seed: {},\n    layers: {{\n        \"bedrock\": blend([\n",
            self.primitives,
            self.overlap,
            self.seed & 0xFFFF_FFFF,
        );
        for k in 0..self.primitives {
            let cell = DVec2::new(f64::from(k % columns), f64::from(k / columns));
            let jitter = DVec2::new(random.range(0.0, 1.0), random.range(0.0, 1.0));
            let at = (cell + jitter) * spacing;
            let elevation = random.range(0.0, 40.0);
            let noise = match k % 3 {
                0 => String::new(),
                1 => format!(", noise: (kind: sum, wavelength: 80, amplitude: 12, octaves: 4, seed: {k})"),
                _ => format!(
                    ", noise: (kind: ridged(offset: 0.62, sharpness: 2), wavelength: 90, amplitude: 25, octaves: 4, seed: {k})"
                ),
            };
            let _ = writeln!(
                text,
                "            disc(centre: ({:.3}, {:.3}), elevation: {elevation:.3}, radius: {RADIUS:?}{noise}),",
                at.x, at.y
            );
        }
        let extent = self.extent();
        let (eye, target) = (DVec2::new(0.5 * extent.x, -0.6 * extent.y), 0.5 * extent);
        let _ = write!(
            text,
            "        ]),\n    }},\n    cameras: {{\n        \"main\": (eye: ({:.1}, {:.1}, {:.1}), target: ({:.1}, {:.1}, 0), field_of_view_degrees: 45),\n    }},\n)\n",
            eye.x,
            eye.y,
            0.8 * extent.y,
            target.x,
            target.y,
        );
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes::parse;

    #[test]
    fn scenes_of_any_size_have_their_count_and_the_same_overlap() {
        for primitives in [1, 10, 1000] {
            let scatter = Scatter { primitives, overlap: 4.0, seed: 7 };
            let scene = parse("generated", &scatter.text()).unwrap();
            let root = scene.layers[scene.ground()];
            assert_eq!(scene.tree.count(root), (primitives as usize, 1));
        }
        let scatter = Scatter { primitives: 1000, overlap: 4.0, seed: 7 };
        let program = parse("generated", &scatter.text()).unwrap();
        let program = program.program(program.ground()).unwrap();
        // Counted by pruning to points, away from the border.
        let mut random = Random(1);
        let mut over = 0;
        for _ in 0..400 {
            let (lo, hi) = (DVec2::splat(2.0 * RADIUS), scatter.extent() - 2.0 * RADIUS);
            let p = DVec2::new(random.range(lo.x, hi.x), random.range(lo.y, hi.y));
            over += program.prune(terrain_model::bounds::Region::rectangle(p, p)).primitive_instructions();
        }
        let mean = f64::from(over as u32) / 400.0;
        assert!((mean - 4.0).abs() < 0.3, "{mean}");
    }
}
