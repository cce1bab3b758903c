//! From the authored tree to the one that evaluates, checking every value on the way.

use super::node::{GeologyError, Local, Node};
use super::noise::{Turbulence, channels, fold_slope, seed};
use super::rock::{Polyline, Rock};
use glam::DVec3;

/// `scene` is the scene's seed, `place` the path of `node`.
pub(super) fn compile(node: &Node, scene: u32, place: &str) -> Result<Rock, GeologyError> {
    let check = Check { place };
    let noise = |wavelength: f64, octaves: u32, own: u32| -> Result<Turbulence, GeologyError> {
        check.waves(wavelength, octaves)?;
        Ok(Turbulence::new(wavelength, octaves, seed(scene, own)))
    };
    let below = |name: &str, node: &Node| compile(node, scene, &format!("{place}.{name}.child")).map(Box::new);
    Ok(match node {
        Node::Constant(value) => {
            check.within("constant", *value, 0.0, 1.0)?;
            Rock::Constant(*value)
        }
        Node::Strata { wavelength, octaves, seed } => Rock::Strata(noise(*wavelength, *octaves, *seed)?),
        Node::Turbulence { wavelength, octaves, seed } => Rock::Turbulence(noise(*wavelength, *octaves, *seed)?),
        Node::Plane { point, normal, radius, resistance, roughness, wavelength, octaves, seed } => {
            check.finite("point", *point)?;
            check.direction(*normal)?;
            check.positive("radius", *radius)?;
            check.within("resistance", *resistance, 0.0, 1.0)?;
            check.within("roughness", *roughness, 0.0, 1.0)?;
            Rock::Plane {
                point: *point,
                normal: normal.normalize(),
                radius: *radius,
                sheet: (1.0 - roughness) * resistance,
                roughness: *roughness,
                noise: noise(*wavelength, *octaves, *seed)?,
            }
        }
        Node::Blend(parts) => {
            if parts.is_empty() {
                return check.fail("blend", "expected at least one (weight, node)".to_owned());
            }
            for (weight, _) in parts {
                check.positive("blend weight", *weight)?;
            }
            let total: f64 = parts.iter().map(|(weight, _)| weight).sum();
            let part = |(k, (weight, node)): (usize, &(f64, Node))| {
                Ok((weight / total, compile(node, scene, &format!("{place}.blend[{k}]"))?))
            };
            Rock::Blend(parts.iter().enumerate().map(part).collect::<Result<_, GeologyError>>()?)
        }
        Node::Change { child, by } => {
            Rock::Change(below("change", child)?, by.iter().map(|l| check.local(l)).collect::<Result<_, _>>()?)
        }
        Node::Fold { amplitude, wavelength, octaves, seed: own, allow_overturned, child } => {
            check.waves(*wavelength, *octaves)?;
            check.positive("amplitude", *amplitude)?;
            let noise = Box::new(channels(*wavelength, *octaves, seed(scene, *own)));
            let channel = amplitude / 3.0_f64.sqrt();
            let slope = fold_slope(channel, &noise);
            // `>=` alone would let a NaN pass.
            if !(slope < 1.0 || *allow_overturned) {
                let problem = format!(
                    "may overturn the rock, its slope bound is {slope:.3}: expected below 1, so an amplitude below {:.6}, or allow_overturned: true",
                    amplitude / slope
                );
                return check.fail("fold", problem);
            }
            Rock::Fold { amplitude: channel, noise, child: below("fold", child)? }
        }
        Node::Taper { centre, radius, height, compression, child } => {
            check.finite("centre", *centre)?;
            check.positive("radius", *radius)?;
            check.positive("height", *height)?;
            // d/du of u(1 − u²)³ has minimum −32/49 and maximum 1.
            if !(*compression > -1.0 && *compression < 49.0 / 32.0) {
                let problem = format!("expected above -1 and below 49/32 = 1.53125, found {compression}");
                return check.fail("compression", problem);
            }
            let (centre, radius, height, compression) = (*centre, *radius, *height, *compression);
            Rock::Taper { centre, radius, height, compression, child: below("taper", child)? }
        }
        Node::Fault { point, normal, translation, child, against } => {
            check.finite("point", *point)?;
            check.direction(*normal)?;
            check.finite("translation", *translation)?;
            let (point, normal, translation) = (*point, *normal, *translation);
            let against = against.as_ref().map(|node| below("fault.against", node)).transpose()?;
            Rock::Fault { point, normal, translation, child: below("fault", child)?, against }
        }
    })
}

struct Check<'a> {
    place: &'a str,
}

impl Check<'_> {
    fn fail<T>(&self, name: &str, problem: String) -> Result<T, GeologyError> {
        Err(GeologyError::Value { place: format!("{}, {name}", self.place), problem })
    }
    fn within(&self, name: &str, value: f64, low: f64, high: f64) -> Result<(), GeologyError> {
        if (low..=high).contains(&value) {
            return Ok(());
        }
        self.fail(name, format!("expected {low} to {high}, found {value}"))
    }
    /// Squares and reciprocals of the accepted numbers are finite and above 0.
    fn positive(&self, name: &str, value: f64) -> Result<(), GeologyError> {
        if (1e-6..=1e9).contains(&value) {
            return Ok(());
        }
        self.fail(name, format!("expected 1e-6 to 1e9, found {value}"))
    }
    fn waves(&self, wavelength: f64, octaves: u32) -> Result<(), GeologyError> {
        self.positive("wavelength", wavelength)?;
        if (1..=16).contains(&octaves) {
            return Ok(());
        }
        self.fail("octaves", format!("expected 1 to 16, found {octaves}"))
    }
    fn finite(&self, name: &str, v: DVec3) -> Result<(), GeologyError> {
        if v.abs().max_element() <= 1e9 && v.is_finite() {
            return Ok(());
        }
        self.fail(name, format!("expected components within ±1e9, found {v}"))
    }
    fn direction(&self, normal: DVec3) -> Result<(), GeologyError> {
        self.finite("normal", normal)?;
        self.positive("length of normal", normal.length())
    }
    fn local(&self, local: &Local) -> Result<Polyline, GeologyError> {
        let (points, radius, change) = match local {
            Local::Sphere { centre, radius, change } => (vec![*centre], *radius, *change),
            Local::Curve { points, radius, change } => {
                if points.len() < 2 {
                    return self.fail("curve", format!("expected two or more points, found {}", points.len()));
                }
                (points.clone(), *radius, *change)
            }
        };
        for p in &points {
            self.finite("points", *p)?;
        }
        for ends in points.windows(2) {
            self.positive("distance of neighbouring points", ends[0].distance(ends[1]))?;
        }
        self.positive("radius", radius)?;
        self.within("change", change, -1.0, 1.0)?;
        Ok(Polyline { points, radius, change })
    }
}
