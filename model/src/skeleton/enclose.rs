//! A tight enclosure of the mean over arcs. Where arcs meet, their distances and elevations differ by little while each varies
//! much, and an interval forgets that. So differences are enclosed by the mean value form: their value at the middle of the
//! box plus their slopes times its half width.

use super::{Chain, arc};
use crate::dual::Dual;
use crate::falloff::wyvill;
use crate::interval::Interval;
use crate::primitive::Parameters;
use crate::profile::Sections;
use crate::real::{Operand, Real};

type Slope = Dual<Interval, 2>;

/// Arcs that are compared pair by pair; a box with more is split before it is worth the effort.
const MOST: usize = 24;

/// A quantity over the box, and in its middle.
#[derive(Clone, Copy)]
struct Over {
    whole: Slope,
    middle: Interval,
}

impl Over {
    /// The difference of two.
    fn less(self, other: Over, from_middle: [Interval; 2]) -> Slope {
        let plain = self.whole - other.whole;
        let [x, y] = from_middle;
        let through_middle = self.middle - other.middle + plain.slope[0] * x + plain.slope[1] * y;
        Dual { value: plain.value.meet(through_middle), slope: plain.slope }
    }
}

impl Chain<'_, f64> {
    /// Elevation over the box `x` with its slopes, tighter than by [`Chain::elevation`]; `None` where too many arcs matter.
    pub fn enclose(&self, x: [Interval; 2], sections: Sections, section: Parameters<f64>) -> Option<Slope> {
        if self.arcs > MOST {
            return None;
        }
        let variables = [Dual::variable(x[0], 0), Dual::variable(x[1], 1)];
        let middle = x.map(|x| Interval::point(x.middle()));
        let from_middle = [x[0] - middle[0], x[1] - middle[1]];
        let reach = self.p.0[1];
        let seen: Vec<[Over; 2]> = (0..self.arcs)
            .map(|k| {
                let (whole, centre) = (arc::place(self.arc(k), variables), arc::place(self.arc(k), middle));
                let (z, s) = arc::elevation(self.arc(k), &whole, Slope::constant(reach));
                let (centre_z, centre_s) = arc::elevation(self.arc(k), &centre, Interval::point(reach));
                let distance = Over { whole: whole.distance_squared, middle: centre.distance_squared };
                let elevation = Over {
                    whole: z + sections.evaluate(section, whole.side, s),
                    middle: centre_z + sections.evaluate(section, centre.side, centre_s),
                };
                [distance, elevation]
            })
            .collect();
        let nearest = (0..seen.len()).min_by(|a, b| seen[*a][0].middle.lo().total_cmp(&seen[*b][0].middle.lo()))?;
        let reference = seen[nearest][1];
        let parts: Vec<Operand<Slope>> = (0..seen.len())
            .map(|k| {
                let excess = self.excess(&seen, k, from_middle);
                let rise = if k == nearest { Slope::zero() } else { seen[k][1].less(reference, from_middle) };
                Operand::new(rise, wyvill(excess * Slope::constant(self.p.0[0])))
            })
            .collect();
        let mean = Slope::weighted_mean(&parts, 1.0).elevation;
        let [x, y] = from_middle;
        let own = reference.whole;
        let through_middle = reference.middle + own.slope[0] * x + own.slope[1] * y;
        Some(Dual { value: own.value.meet(through_middle), slope: own.slope } + mean)
    }
    /// How far the squared distance of arc `k` exceeds the smallest: the largest of its differences to the others.
    fn excess(&self, seen: &[[Over; 2]], k: usize, from_middle: [Interval; 2]) -> Slope {
        let mut differences = vec![Slope::zero()];
        differences.extend((0..seen.len()).filter(|j| *j != k).map(|j| seen[k][0].less(seen[j][0], from_middle)));
        let value = differences.iter().fold(Interval::ZERO, |a, b| Real::max(a, b.value));
        let slopes = |axis: usize| {
            let may = differences.iter().filter(|d| d.value.hi() >= value.lo());
            may.map(|d| d.slope[axis]).reduce(Interval::hull).unwrap_or(Interval::ZERO)
        };
        Dual { value, slope: [slopes(0), slopes(1)] }
    }
}
