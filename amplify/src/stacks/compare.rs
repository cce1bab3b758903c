//! Stacks against a field: at points whose surroundings along the column are proved to be of one material, the stack must
//! have it.

use super::convert::class;
use super::{Material, Stacks};
use crate::field::{Box3, Density, THRESHOLD};
use crate::geology::Geology;
use glam::DVec3;

/// What a comparison found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Comparison {
    /// Points farther than the precision from every transition, whose material was compared.
    pub compared: u64,
    /// Points that may be nearer, or stand off the region.
    pub skipped: u64,
    /// Points where the stack has another material than the field.
    pub wrong: u64,
}

impl Stacks {
    /// Compares materials at `points`, each moved to the axis of its column.
    pub fn compare(
        &self,
        field: &impl Density,
        geology: Option<&Geology>,
        points: impl IntoIterator<Item = DVec3>,
    ) -> Comparison {
        let mut found = Comparison::default();
        for p in points {
            let column = self.column_at(p.x, p.y);
            let at = column.map_or(p, |[i, j]| self.position(i, j).extend(p.z));
            match (self.material_around(field, geology, at), column.and_then(|column| self.material_in(column, p.z))) {
                (Some(right), Some(ours)) => {
                    found.compared += 1;
                    found.wrong += u64::from(right != ours);
                }
                _ => found.skipped += 1,
            }
        }
        found
    }

    /// The material of the field from the precision below `p` to the precision above it, if it is one.
    fn material_around(&self, field: &impl Density, geology: Option<&Geology>, p: DVec3) -> Option<Material> {
        let region = Box3 { low: p - DVec3::Z * self.precision, high: p + DVec3::Z * self.precision };
        let range = field.bounds(&region).range;
        if range.hi() <= THRESHOLD {
            return Some(Material::Air);
        }
        if range.lo() <= THRESHOLD {
            return None;
        }
        let Some(geology) = geology else { return Some(Material::Rock(0)) };
        let range = geology.resistance(region.intervals());
        let [least, most] = [range.lo(), range.hi()].map(|rho| class(rho, self.classes));
        (least == most).then_some(least)
    }
}
