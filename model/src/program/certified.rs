//! Slopes that compilations have certified. Branch and bound over a curve takes far longer than the rest of its compilation, so
//! what is compiled again after a change elsewhere, a scene that is edited above all, need not do it again.

use crate::primitive::Leaf;
use std::any::type_name;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Certified slopes by what they were certified of, shared by its clones. It grows with each new primitive and forgets nothing.
#[derive(Clone, Debug, Default)]
pub struct Certified(Arc<Mutex<BTreeMap<Key, Vec<f64>>>>);

/// The kind of primitive, its fields, the bits of its parameters.
type Key = (&'static str, Vec<u32>, Vec<u64>);

impl Certified {
    /// The slopes of a primitive with these fields and parameters, by `certify` where they are not known.
    pub(crate) fn slopes<C: Leaf>(&self, code: &C, parameters: &[f64], certify: impl FnOnce() -> Vec<f64>) -> Vec<f64> {
        let mut fields = Vec::new();
        code.fields(&mut fields);
        let key = (type_name::<C>(), fields, parameters.iter().map(|x| x.to_bits()).collect());
        let known = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(slopes) = known().get(&key) {
            return slopes.clone();
        }
        // Not under the lock: two threads may certify the same, with the same result.
        let slopes = certify();
        known().insert(key, slopes.clone());
        slopes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::primitive::contour::{Contour, Ray};
    use crate::primitive::curve::Curve;
    use crate::profile::Knot;
    use crate::program::Program;
    use crate::spline::Path;
    use crate::tree::{Node, Tree};
    use glam::DVec3;

    /// A curve that passes at `y`, and a contour.
    fn tree(y: f64) -> (Tree, crate::tree::NodeId) {
        let knot = |distance: f64, height: f64| Knot { distance, height, slope: 0.0 };
        let mut tree = Tree::new();
        let path = vec![DVec3::new(0.0, y, 5.0), DVec3::new(60.0, y + 20.0, 3.0), DVec3::new(100.0, y, 1.0)];
        let curve = tree.push(Curve::new(Path::Polyline(path), 30.0, vec![knot(0.0, -2.0), knot(10.0, 4.0)]));
        let profile = || vec![knot(-5.0, 0.0), knot(30.0, 8.0)];
        let rays = [80.0, 120.0, 70.0].map(|radius| Ray { angle: None, radius, profile: profile() }).to_vec();
        let contour = tree.push(Contour { centre: DVec3::ZERO, orientation: 0.3, rays, reach: 60.0, weight: 1.2 });
        let root = tree.push(Node::Blend(vec![curve, contour]));
        (tree, root)
    }

    #[test]
    fn what_is_known_gives_the_same_bits_and_is_read() {
        let certified = Certified::default();
        let compiled = |y: f64| {
            let (tree, root) = tree(y);
            let [plain, with] = [
                Program::compile(&tree, root).unwrap().parameters,
                Program::compile_with(&tree, root, &certified).unwrap().parameters,
            ];
            (plain == with, certified.0.lock().unwrap().len())
        };
        assert_eq!(compiled(0.0), (true, 2));
        assert_eq!(compiled(0.0), (true, 2));
        assert_eq!(compiled(1.0), (true, 3));
        // Control: what is kept is what the next program has.
        certified.0.lock().unwrap().values_mut().flatten().for_each(|slope| *slope += 1.0);
        assert_eq!(compiled(0.0), (false, 3));
    }
}
