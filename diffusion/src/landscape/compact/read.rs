//! Reads the compact form. Nothing it is told is believed before it has been read.

use super::{EVEN, Frame, HEIGHT, MAGIC, NOISE, RADIUS, Range, Ranges, SAME_NOISE, SAME_SLOPES, SLOPES, UNIT};
use crate::curve::{ConstraintPoint, Elevation, Gradient, Noise, Side};
use crate::detail::{Basis, Detail, FromSlope, Scaling};
use crate::landscape::{Feature, Path};
use glam::DVec2;

struct Reader<'a> {
    bytes: &'a [u8],
    offset: usize,
}

type Read<T> = Result<T, &'static str>;

impl Reader<'_> {
    fn take(&mut self, count: usize) -> Read<&[u8]> {
        let rest = &self.bytes[self.offset..];
        let taken = rest.get(..count).ok_or("the landscape ends here: expected more bytes")?;
        self.offset += count;
        Ok(taken)
    }
    fn array<const N: usize>(&mut self) -> Read<[u8; N]> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }
    fn byte(&mut self) -> Read<u8> {
        self.array().map(|[byte]| byte)
    }
    fn word(&mut self) -> Read<u16> {
        self.array().map(u16::from_le_bytes)
    }
    fn single(&mut self) -> Read<f32> {
        self.array().map(f32::from_le_bytes)
    }
    fn double(&mut self) -> Read<f64> {
        self.array().map(f64::from_le_bytes)
    }
    fn pair(&mut self) -> Read<[f64; 2]> {
        Ok([self.double()?, self.double()?])
    }
    fn side(&mut self, ranges: &Ranges) -> Read<Side> {
        Ok(Side { extent: ranges.extent.value(self.word()?), angle: ranges.angle(self.word()?) })
    }
    fn count(&mut self) -> Read<usize> {
        let mut count = 0;
        for shift in [0, 7, 14, 21] {
            let byte = self.byte()?;
            count |= usize::from(byte & 127) << shift;
            if byte < 128 {
                return Ok(count);
            }
        }
        Err("expected a count below 2^28")
    }
}

/// What the bytes hold, or where they stop making sense and why.
pub(super) fn read(bytes: &[u8]) -> Result<(Frame, Vec<Feature>), (usize, &'static str)> {
    let mut reader = Reader { bytes, offset: 0 };
    read_all(&mut reader).map_err(|problem| (reader.offset, problem))
}

fn read_all(reader: &mut Reader<'_>) -> Read<(Frame, Vec<Feature>)> {
    if reader.array().ok().as_ref() != Some(MAGIC) {
        return Err("expected a compact landscape, which starts with TCC1");
    }
    let frame = read_frame(reader)?;
    let mut ranges = Ranges::of(&frame, &[]);
    for range in ranges.all() {
        *range = Range { low: reader.single()?, high: reader.single()? };
    }
    // No count is believed: every item takes at least a byte, so that what is allocated is bounded by what was read.
    let count = reader.count()?;
    let mut features = Vec::new();
    for _ in 0..count {
        features.push(read_feature(reader, &ranges, frame.origin)?);
    }
    if reader.offset < reader.bytes.len() {
        return Err("expected the end of the landscape");
    }
    Ok((frame, features))
}

fn read_frame(reader: &mut Reader<'_>) -> Read<Frame> {
    let length = reader.count()?;
    let title = std::str::from_utf8(reader.take(length)?).map_err(|_| "the title is not UTF-8")?.to_owned();
    let [flags, octaves] = reader.array()?;
    if flags > 15 {
        return Err("expected flags below 16");
    }
    let flag = |bit: u8| flags >> bit & 1 == 1;
    let mut detail = Detail {
        seed: reader.array().map(u32::from_le_bytes)?,
        octaves: octaves.into(),
        basis: if flag(2) { Basis::Gradient } else { Basis::Bilinear },
        scaling: if flag(3) { Scaling::Printed } else { Scaling::Normalised },
        ..Detail::default()
    };
    let (origin, extent) = (DVec2::from(reader.pair()?), DVec2::from(reader.pair()?));
    [detail.wavelength, detail.lacunarity] = reader.pair()?;
    let water = if flag(0) { Some(reader.double()?) } else { None };
    if flag(1) {
        detail.from_slope = Some(FromSlope { amplitude: reader.pair()?, roughness: reader.pair()? });
    }
    Ok(Frame { title, origin, extent, water, detail })
}

fn read_feature(reader: &mut Reader<'_>, ranges: &Ranges, origin: DVec2) -> Read<Feature> {
    let head = reader.count()?;
    let mut path = Vec::new();
    for _ in 0..head / 4 {
        path.push(origin + DVec2::new(ranges.x.value(reader.word()?), ranges.y.value(reader.word()?)));
    }
    let path = match head % 4 {
        0 => Path::Bezier(path),
        1 => Path::Smooth(path),
        2 => Path::Ring(path),
        _ => return Err("expected a path of kind 0, 1 or 2"),
    };
    let count = reader.count()?;
    let mut points = Vec::new();
    let (mut radius, mut slopes, mut noise) = (0.0, None, None);
    for k in 0..count {
        let flags = reader.byte()?;
        let has = |flag: u8| flags & flag != 0;
        let place = match k {
            0 => 0.0,
            k if k + 1 == count => 1.0,
            _ => UNIT.value(reader.word()?),
        };
        let mut point = ConstraintPoint { place, ..ConstraintPoint::default() };
        if has(HEIGHT) {
            let height = ranges.height.value(reader.word()?);
            if has(RADIUS) {
                radius = ranges.radius.value(reader.word()?);
            }
            point.elevation = Some(Elevation { height, radius });
        }
        if has(SLOPES) {
            if !has(SAME_SLOPES) {
                let left = reader.side(ranges)?;
                slopes = Some(Gradient { left, right: if has(EVEN) { left } else { reader.side(ranges)? } });
            }
            point.gradient = slopes;
        }
        if has(NOISE) {
            if !has(SAME_NOISE) {
                let amplitude = ranges.amplitude.value(reader.word()?);
                noise = Some(Noise { amplitude, roughness: UNIT.value(reader.word()?) });
            }
            point.noise = noise;
        }
        points.push(point);
    }
    Ok(Feature { name: String::new(), path, points })
}
