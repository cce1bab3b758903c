//! What can be measured of what the figures show.

use crate::experiment::ExperimentError;
use crate::hnaidi2010::models::{load, terrain};
use glam::DVec2;
use std::ops::Range;
use terrain_diffusion::curve::Curve;
use terrain_diffusion::fields::{Fields, Settings, Solver};
use terrain_diffusion::raster::Domain;

/// A measured value, and what the same measure says of a broken input.
pub struct Measure {
    pub value: f64,
    pub control: f64,
}

fn solved(
    name: &str,
    nodes: usize,
    settings: &Settings,
) -> Result<(Vec<Curve>, Domain, Fields, Vec<f64>), ExperimentError> {
    let landscape = load(name)?;
    let domain = landscape.domain(nodes);
    let (fields, detail) = terrain(&landscape, domain, settings)?;
    Ok((landscape.curves().to_vec(), domain, fields, detail))
}

/// Places and wanted elevations along a curve, within the domain and two cells from its ends, where nodes before it count as well.
fn along(curve: &Curve, domain: &Domain) -> Vec<(DVec2, f64)> {
    let most = DVec2::new((domain.width - 1) as f64, (domain.height - 1) as f64);
    let line = curve.polyline(0.25 * domain.spacing).into_iter();
    line.filter_map(|(p, place)| {
        let q = (p - domain.origin) / domain.spacing;
        let inside = q.cmpge(DVec2::ONE).all() && q.cmple(most - 1.0).all();
        let inside = inside && place.min(1.0 - place) * curve.length() > 2.0 * domain.spacing;
        Some((q, curve.wanted(place).elevation?)).filter(|_| inside)
    })
    .collect()
}

/// Fig. 5: the largest distance of the ground from the elevation wanted along the crest, metres. Broken: the approximating mode.
pub fn crest(nodes: usize) -> Result<Measure, ExperimentError> {
    let of = |smoothing: f64| {
        let (curves, domain, fields, _) = solved("fig5_ridge", nodes, &Settings { smoothing, ..Settings::default() })?;
        let off = |(q, wanted): (DVec2, f64)| {
            (crate::hnaidi2010::rasters::value(&fields.elevation, &domain, q) - wanted).abs()
        };
        Ok::<f64, ExperimentError>(along(&curves[0], &domain).into_iter().map(off).fold(0.0, f64::max))
    };
    Ok(Measure { value: of(0.0)?, control: of(0.9)? })
}

/// Fig. 6: the largest rise of the bed going downstream, metres. Broken: with the detail of the banks on it.
pub fn river(nodes: usize) -> Result<Measure, ExperimentError> {
    let (curves, domain, fields, _) = solved("fig6_river", nodes, &Settings::default())?;
    let rise = |bump: f64| {
        let bed = along(&curves[0], &domain).into_iter().enumerate();
        let heights = bed.map(|(k, (q, _))| {
            crate::hnaidi2010::rasters::value(&fields.elevation, &domain, q) + if k % 2 == 0 { bump } else { 0.0 }
        });
        let (mut lowest, mut rise) = (f64::INFINITY, 0.0f64);
        for height in heights {
            rise = rise.max(height - lowest);
            lowest = lowest.min(height);
        }
        rise
    };
    Ok(Measure { value: rise(0.0), control: rise(1.0) })
}

/// Fig. 7: how far the lowest point of a crack's middle line lies below its rims, over the depth asked for; by solver. Broken: without
/// the cracks.
pub fn crack(nodes: usize, solver: Solver) -> Result<Measure, ExperimentError> {
    let (curves, domain, fields, _) = solved("fig7_crack", nodes, &Settings { solver, ..Settings::default() })?;
    // The crack is 110 m wide and 55 m deep.
    let (depth, half) = (55.0, 55.0);
    let of = |fields: &Fields| {
        let line = curves[0].polyline(domain.spacing);
        let middle = line.windows(2).nth(line.len() / 2).map(|pair| (pair[0].0, (pair[1].0 - pair[0].0).normalize()));
        let (p, direction) = middle.unwrap_or_default();
        let at = |p: DVec2| {
            crate::hnaidi2010::rasters::value(&fields.elevation, &domain, (p - domain.origin) / domain.spacing)
        };
        let rim = 0.5 * (at(p + direction.perp() * half) + at(p - direction.perp() * half));
        (rim - at(p)) / depth
    };
    let landscape = load("fig7_crack")?;
    let plain = landscape.curves()[2..].to_vec();
    let without = terrain_diffusion::fields::diffuse(&plain, domain, &Settings { solver, ..Settings::default() });
    Ok(Measure { value: of(&fields), control: of(&without.map_err(ExperimentError::failed)?) })
}

/// Fig. 8: mean |difference| of detail between neighbours in the eastern quarter over that in the western one. Broken: north over south,
/// which have the same noise.
pub fn noise(name: &str, nodes: usize) -> Result<Measure, ExperimentError> {
    let (_, domain, _, detail) = solved(name, nodes, &Settings::default())?;
    let mean = |columns: Range<usize>, rows: Range<usize>| {
        let (mut sum, mut count) = (0.0, 0.0);
        for k in rows.flat_map(|j| columns.clone().map(move |i| j * domain.width + i)) {
            sum += (detail[k + 1] - detail[k]).abs();
            count += 1.0;
        }
        sum / count
    };
    let (last, quarter) = (domain.width - 1, domain.width / 4);
    let (all, high) = (0..last, domain.height - quarter..domain.height);
    let [west, east] = [0..quarter, last - quarter..last].map(|columns| mean(columns, 0..domain.height));
    Ok(Measure { value: east / west, control: mean(all.clone(), high) / mean(all, 0..quarter) })
}

/// Fig. 9: the largest turn of the direction between neighbours where slopes of two ridges meet, degrees, after diffusion. Broken: the
/// direction of one ridge on one side of the diagonal, of the other on the other side.
pub fn crossing(nodes: usize) -> Result<Measure, ExperimentError> {
    let settings = Settings { whole_gradient: true, ..Settings::default() };
    let landscape = load("fig9_crossing")?;
    let domain = landscape.domain(nodes);
    let both = terrain(&landscape, domain, &settings)?.0.gradient;
    let one = |k: usize| {
        let curves = &landscape.curves()[k..=k];
        terrain_diffusion::fields::diffuse(curves, domain, &settings).map(|fields| fields.gradient)
    };
    let (first, second) = (one(0).map_err(ExperimentError::failed)?, one(1).map_err(ExperimentError::failed)?);
    // Where two ridges meet: nodes that both reach, and that neither holds.
    let raster = terrain_diffusion::raster::rasterise(landscape.curves(), &domain);
    let turn = |gradient: &dyn Fn(usize) -> [f32; 3]| {
        let mut largest = 0.0f64;
        for (i, j) in (1..domain.height).flat_map(|j| (1..domain.width).map(move |i| (i, j))) {
            let meets = |i: usize, j: usize| raster.at(i, j).guides > 1 && raster.at(i, j).elevations == 0;
            let direction = |i: usize, j: usize| {
                let [_, x, y] = gradient(j * domain.width + i).map(f64::from);
                DVec2::new(x, y)
            };
            for (p, q) in [(i - 1, j), (i, j - 1)] {
                if meets(i, j) && meets(p, q) {
                    let (a, b) = (direction(i, j), direction(p, q));
                    largest = largest.max(libm::atan2(a.perp_dot(b), a.dot(b)).abs().to_degrees());
                }
            }
        }
        largest
    };
    let checkered =
        |k: usize| if (k % domain.width + k / domain.width).is_multiple_of(2) { first[k] } else { second[k] };
    Ok(Measure { value: turn(&|k| both[k]), control: turn(&checkered) })
}
