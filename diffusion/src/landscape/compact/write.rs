//! Writes the compact form.

use super::{EVEN, Frame, HEIGHT, MAGIC, NOISE, RADIUS, Ranges, SAME_NOISE, SAME_SLOPES, SLOPES, UNIT};
use crate::detail::{Basis, Scaling};
use crate::landscape::{Feature, Path};
use glam::DVec2;

pub(super) fn write(frame: &Frame, features: &[Feature]) -> Vec<u8> {
    let mut ranges = Ranges::of(frame, features);
    let mut bytes = MAGIC.to_vec();
    write_frame(&mut bytes, frame);
    bytes.extend(ranges.all().into_iter().flat_map(|range| [range.low, range.high]).flat_map(f32::to_le_bytes));
    write_count(&mut bytes, features.len());
    for feature in features {
        write_feature(&mut bytes, feature, &ranges, frame.origin);
    }
    bytes
}

pub(super) fn write_frame(bytes: &mut Vec<u8>, frame: &Frame) {
    let Frame { title, origin, extent, water, detail } = frame;
    write_count(bytes, title.len());
    bytes.extend(title.as_bytes());
    let flags = u8::from(water.is_some())
        | u8::from(detail.from_slope.is_some()) << 1
        | u8::from(detail.basis == Basis::Gradient) << 2
        | u8::from(detail.scaling == Scaling::Printed) << 3;
    bytes.extend([flags, detail.octaves as u8]);
    bytes.extend(detail.seed.to_le_bytes());
    let mut exact = vec![origin.x, origin.y, extent.x, extent.y, detail.wavelength, detail.lacunarity];
    exact.extend(water);
    exact.extend(detail.from_slope.iter().flat_map(|from| [from.amplitude, from.roughness]).flatten());
    bytes.extend(exact.into_iter().flat_map(f64::to_le_bytes));
}

fn write_feature(bytes: &mut Vec<u8>, feature: &Feature, ranges: &Ranges, origin: DVec2) {
    let word = |bytes: &mut Vec<u8>, code: u16| bytes.extend(code.to_le_bytes());
    let kind = match feature.path {
        Path::Bezier(_) => 0,
        Path::Smooth(_) => 1,
        Path::Ring(_) => 2,
    };
    let path = feature.path.points();
    write_count(bytes, 4 * path.len() + kind);
    for point in path {
        word(bytes, ranges.x.code(point.x - origin.x));
        word(bytes, ranges.y.code(point.y - origin.y));
    }
    let last = feature.points.len() - 1;
    write_count(bytes, feature.points.len());
    let (mut radius, mut slopes, mut noise, mut place) = (0.0, None, None, 0);
    for (k, point) in feature.points.iter().enumerate() {
        let flags_at = bytes.len();
        let mut flags = 0;
        bytes.push(0);
        if k > 0 && k < last {
            // Places stay in order.
            place = UNIT.code(point.place).max(place + 1).min((65_535 - (last - k)) as u16);
            word(bytes, place);
        }
        if let Some(elevation) = point.elevation {
            flags |= HEIGHT;
            word(bytes, ranges.height.code(elevation.height));
            if elevation.radius != radius {
                flags |= RADIUS;
                word(bytes, ranges.radius.code(elevation.radius));
                radius = elevation.radius;
            }
        }
        if let Some(gradient) = point.gradient {
            flags |= SLOPES;
            if slopes == point.gradient {
                flags |= SAME_SLOPES;
            } else {
                let even = gradient.left == gradient.right;
                flags |= if even { EVEN } else { 0 };
                for side in [Some(gradient.left), (!even).then_some(gradient.right)].into_iter().flatten() {
                    word(bytes, ranges.extent.code(side.extent));
                    word(bytes, ranges.angle_code(side.angle));
                }
                slopes = point.gradient;
            }
        }
        if let Some(given) = point.noise {
            flags |= NOISE;
            if noise == point.noise {
                flags |= SAME_NOISE;
            } else {
                word(bytes, ranges.amplitude.code(given.amplitude));
                word(bytes, UNIT.code(given.roughness));
                noise = point.noise;
            }
        }
        bytes[flags_at] = flags;
    }
}

/// Seven bits a byte, the lowest first, the top bit set in all but the last.
fn write_count(bytes: &mut Vec<u8>, mut count: usize) {
    while count >= 128 {
        bytes.push(count as u8 | 128);
        count >>= 7;
    }
    bytes.push(count as u8);
}
