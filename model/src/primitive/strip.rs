//! Images along a curve (Génevaux 2015 §4.2, Fig. 9): a chain of quadrangles over cross-sections of the curve, on which
//! one or several images are laid end to end. Neighbours share a cross-section and a row of samples, so elevation and
//! weight pass from one to the next without a jump.

pub use super::quad::Code;

use super::Authored;
use super::image::Image;
use super::quad::{Section, Spread, chain, point, tenth, unit};
use crate::program::Layout;
use crate::scene::{Finite, Point, Positive, Scope, one};
use glam::DVec2;
use serde::Deserialize;
use std::sync::Arc;

/// Images along a curve. Rows of the image run across it, the first at its start; sample 0 of a row lies on the left bank
/// of one who looks from start to end.
#[derive(Clone, Debug)]
pub struct Strip {
    /// What is spread.
    pub spread: Spread,
    /// Left and right end of each cross-section, two or more, metres.
    pub sections: Vec<[DVec2; 2]>,
}

impl Strip {
    /// Cross-sections `half_width` metres to each side of a polyline; at a bend along the bisector.
    pub fn sections_along(points: &[DVec2], half_width: f64) -> Vec<[DVec2; 2]> {
        let direction = |k: usize| (points[k + 1] - points[k]).normalize_or_zero();
        let count = points.len();
        (0..count)
            .map(|k| {
                let before = if k > 0 { direction(k - 1) } else { direction(0) };
                let after = if k + 1 < count { direction(k) } else { before };
                let along = (before + after).normalize_or_zero();
                // The bisector is longer than the half-width by 1/cos of half the bend.
                let reach = half_width / along.dot(before).max(0.5);
                let left = DVec2::new(-along.y, along.x) * reach;
                [points[k] + left, points[k] - left]
            })
            .collect()
    }
}

/// Lays rasters end to end: the last row of one is the first of the next, counted once.
///
/// # Errors
/// When widths or the rows at a joint differ, or a raster has unknown samples.
pub fn joined(images: &[Arc<Image>]) -> Result<Arc<Image>, String> {
    let Some(first) = images.first() else { return Err("images along a curve need at least one file".to_owned()) };
    if images.len() == 1 {
        return Ok(first.clone());
    }
    let width = first.width();
    let row = |image: &Image, j: usize| -> Vec<f32> { (0..width).map(|i| image.sample(i, j)).collect() };
    let mut samples = row(first, 0);
    for (k, image) in images.iter().enumerate() {
        if image.width() != width || image.hole_count() > 0 {
            return Err(format!("image {k} along a curve needs {width} known samples across, as the first has"));
        }
        let joint = samples.len() - width;
        if samples[joint..] != row(image, 0) {
            return Err(format!(
                "image {k} along a curve does not begin with the last row of the one before; repeat that row in both"
            ));
        }
        (1..image.height()).for_each(|j| samples.extend(row(image, j)));
    }
    let height = samples.len() / width;
    Image::new(width, height, samples).map(Arc::new).ok_or_else(|| "images along a curve are too large".to_owned())
}

/// A strip in a scene file: cross-sections, or a polyline with a half-width.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    files: Vec<String>,
    #[serde(default)]
    points: Vec<Point>,
    #[serde(default)]
    half_width: Option<Positive>,
    #[serde(default)]
    sections: Vec<(Point, Point)>,
    #[serde(default = "tenth")]
    margin: Positive,
    /// Share of the length over which the weight rises from either end.
    #[serde(default = "tenth")]
    end_margin: Positive,
    #[serde(default = "one")]
    weight: Positive,
    #[serde(default)]
    weight_file: Option<String>,
    #[serde(default = "unit")]
    elevation_scale: Finite,
    #[serde(default)]
    elevation_offset: Finite,
}

impl File {
    pub(crate) fn build(&self, scope: &mut Scope<'_>) -> Result<Strip, String> {
        let images =
            self.files.iter().map(|file| Ok(scope.image(file, None)?.image)).collect::<Result<Vec<_>, String>>()?;
        let points: Vec<DVec2> = self.points.iter().copied().map(point).collect();
        let sections = match self.half_width {
            Some(half_width) if self.sections.is_empty() && points.len() > 1 => {
                Strip::sections_along(&points, half_width.into())
            }
            None if points.is_empty() => self.sections.iter().map(|(a, b)| [point(*a), point(*b)]).collect(),
            _ => return Err("a strip needs `points` and a `half_width`, or `sections`".to_owned()),
        };
        let spread = Spread {
            image: joined(&images)?,
            weights: self.weight_file.as_deref().map(|file| scope.image(file, None)).transpose()?.map(|w| w.image),
            weight: self.weight.into(),
            margin: [self.margin.into(), self.end_margin.into()],
            elevation_scale: self.elevation_scale.into(),
            elevation_offset: self.elevation_offset.into(),
        };
        Ok(Strip { spread, sections })
    }
}

/// The most cross-sections of one strip; longer ones are written as a blend of several.
pub const MAX_SECTIONS: usize = 65;

impl Authored for Strip {
    type Code = Code;
    fn compile(&self, out: &mut Layout) -> Result<Code, String> {
        let count = self.sections.len();
        if !(2..=MAX_SECTIONS).contains(&count) {
            return Err(format!("a strip needs 2 to {MAX_SECTIONS} cross-sections, this one has {count}"));
        }
        // Rows are spread by the length of the middle line.
        let middle = |k: usize| (self.sections[k][0] + self.sections[k][1]) * 0.5;
        let mut lengths = vec![0.0];
        for k in 1..count {
            lengths.push(lengths[k - 1] + middle(k).distance(middle(k - 1)));
        }
        let whole = lengths[count - 1];
        if !(whole > 0.0 && whole.is_finite()) {
            return Err("a strip needs cross-sections at different, finite places".to_owned());
        }
        for k in 0..count - 1 {
            if let Some(other) = (k + 2..count - 1).find(|other| overlap(self.quad(k), self.quad(*other))) {
                return Err(format!("quadrangles {k} and {other} of a strip overlap; write two strips and blend them"));
            }
        }
        let sections: Vec<Section> = (0..count)
            .map(|k| {
                let [left, right] = self.sections[k];
                Section { left, right, at: if k + 1 == count { 1.0 } else { lengths[k] / whole } }
            })
            .collect();
        chain(&self.spread, &sections, out)
    }
}

impl Strip {
    fn quad(&self, k: usize) -> [DVec2; 4] {
        let ([a, b], [d, c]) = (self.sections[k], self.sections[k + 1]);
        [a, b, c, d]
    }
}

/// Do two convex quadrangles share more than a border? They do not when an edge of one separates them.
fn overlap(p: [DVec2; 4], q: [DVec2; 4]) -> bool {
    let separated = |p: [DVec2; 4], q: [DVec2; 4]| {
        (0..4).any(|k| {
            let edge = p[(k + 1) % 4] - p[k];
            q.iter().all(|corner| edge.perp_dot(*corner - p[k]) <= 0.0)
        })
    };
    !separated(p, q) && !separated(q, p)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::Program;
    use crate::tree::{Node, Tree};

    fn image(seed: u32, width: usize, height: usize) -> Arc<Image> {
        let samples = (0..width * height).map(|k| (crate::noise::mix(seed, k as u32) >> 24) as f32).collect();
        Arc::new(Image::new(width, height, samples).expect("a valid image"))
    }
    fn spread(image: Arc<Image>) -> Spread {
        Spread { image, weights: None, weight: 1.0, margin: [0.2, 0.1], elevation_scale: 1.0, elevation_offset: 5.0 }
    }
    fn bent() -> Strip {
        let points = [(0.0, 0.0), (300.0, 40.0), (500.0, 260.0), (430.0, 520.0), (700.0, 800.0)].map(DVec2::from);
        Strip { spread: spread(image(3, 9, 40)), sections: Strip::sections_along(&points, 60.0) }
    }
    fn program(strip: Strip) -> Result<Program, String> {
        let mut tree = Tree::new();
        let root = tree.push(strip);
        Program::compile(&tree, root).map_err(|error| error.problem)
    }

    #[test]
    fn elevation_and_weight_do_not_jump_across_a_joint() {
        let strip = bent();
        let program = program(strip.clone()).expect("it compiles");
        let mut moved = 0.0f64;
        for [left, right] in &strip.sections[1..4] {
            let across = (*right - *left).perp().normalize();
            for k in 1..400 {
                let at = *left + (*right - *left) * (f64::from(k) / 400.0);
                let (a, b) = (program.height(at - across * 1e-9), program.height(at + across * 1e-9));
                // The joint is met from both sides within 1e-9 m; slopes are below 255 m in 1.8 m, rounding far below.
                assert!((a.0 - b.0).abs() < 1e-6 && (a.1 - b.1).abs() < 1e-9, "{a:?} {b:?}");
                assert!(program.height(at).1 > 0.0, "a gap in the joint at {at}");
                let control = program.height(at + across * 0.5);
                moved = moved.max((control.0 - a.0).abs());
            }
        }
        // Control: half a metre further the elevation has moved.
        assert!(moved > 1.0, "{moved}");
    }

    #[test]
    fn pieces_are_joined_where_their_rows_agree_and_refused_elsewhere() {
        let whole = image(7, 5, 21);
        let rows = |from: usize, to: usize| {
            let samples =
                (from..=to).flat_map(|j| (0..5).map(move |i| (i, j))).map(|(i, j)| whole.sample(i, j)).collect();
            Arc::new(Image::new(5, to - from + 1, samples).expect("a valid image"))
        };
        let again = joined(&[rows(0, 8), rows(8, 12), rows(12, 20)]).expect("rows agree");
        assert_eq!(again.height(), 21);
        assert!((0..21).all(|j| (0..5).all(|i| again.sample(i, j) == whole.sample(i, j))));
        assert!(joined(&[rows(0, 8), rows(9, 20)]).unwrap_err().contains("last row"));
    }

    #[test]
    fn a_strip_that_meets_itself_or_folds_is_refused() {
        let points = [(0.0, 0.0), (300.0, 0.0), (300.0, 300.0), (100.0, 300.0), (100.0, -200.0)].map(DVec2::from);
        let crossing = Strip { spread: spread(image(1, 4, 9)), sections: Strip::sections_along(&points, 20.0) };
        assert!(program(crossing).unwrap_err().contains("overlap"));
        let tight = [(0.0, 0.0), (30.0, 0.0), (30.0, 30.0)].map(DVec2::from);
        let folded = Strip { spread: spread(image(1, 4, 9)), sections: Strip::sections_along(&tight, 90.0) };
        assert!(program(folded).unwrap_err().contains("convex"));
    }

    #[test]
    fn a_confluence_is_a_blend_without_a_jump() {
        let main = bent();
        let end = (main.sections[2][0] + main.sections[2][1]) * 0.5;
        let tributary = [DVec2::new(900.0, 100.0), DVec2::new(700.0, 250.0), end];
        let tributary = Strip { spread: spread(image(9, 9, 30)), sections: Strip::sections_along(&tributary, 40.0) };
        let mut tree = Tree::new();
        let (a, b) = (tree.push(main), tree.push(tributary));
        let both = tree.push(Node::Blend(vec![a, b]));
        let program = Program::compile(&tree, both).expect("it compiles");
        let main = Program::compile(&tree, a).expect("it compiles");
        // Down the tributary and across the main stem, in steps of 1 mm.
        let direction = (end - DVec2::new(700.0, 250.0)).normalize();
        let (mut on, mut mixed) = (0, 0);
        for k in 0..120_000 {
            let at = end - direction * (80.0 - 0.001 * f64::from(k));
            let (here, next) = (program.height(at), program.height(at + direction * 0.001));
            if here.1 >= 0.5 && next.1 >= 0.5 {
                // The steepest cell: 255 m over 120/8 m across, times what the bend stretches; and the blend of two.
                assert!((here.0 - next.0).abs() < 0.2, "{here:?} {next:?}");
                on += 1;
                mixed += usize::from(main.height(at).1 > 0.0 && (here.0 - main.height(at).0).abs() > 1.0);
            }
        }
        assert!(on > 50_000 && mixed > 1000, "{on} {mixed}");
    }
}
