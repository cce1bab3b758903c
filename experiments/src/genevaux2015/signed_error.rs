//! A picture of how far each answer of a tracer lies from the certified bracket: before it (a hit is reported where 0 ≤ h < ε, so a
//! grazing ray stops early), within it, or beyond it, which is a miss.

use rayon::prelude::*;
use terrain_model::program::{Cells, Evidence};
use terrain_model::trace::camera::Camera;
use terrain_model::trace::certified::{Certified, CertifiedTracer, Effort};
use terrain_model::trace::{Answer, HeightRay, Settings, Surface, Tracer};

/// One pixel's answer against the proof.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Agreement {
    /// Both say that nothing is met.
    Clear,
    /// Metres along the ray from the certified bracket: negative before it, 0 within it.
    Met(f64),
    /// The answer lies beyond the bracket by more than τ, or is none.
    Missed,
    /// A surface is reported where a miss is certified, or the ray was given up.
    Wrong,
    /// The proof did not end within its budget.
    Undecided,
}

/// One answer against its proof; what is within `bracket` beyond the proof is no miss.
pub fn agreement(answer: Answer, truth: Certified, bracket: f64) -> Agreement {
    match (truth, answer.distance()) {
        (Certified::Undecided { .. }, _) => Agreement::Undecided,
        (Certified::Miss, None) if answer == Answer::Miss => Agreement::Clear,
        (Certified::Miss, _) => Agreement::Wrong,
        (Certified::Hit { t0, t1 } | Certified::Wall { t0, t1 }, Some(t)) if t <= t1 + bracket => {
            Agreement::Met((t - t0).min(0.0) + (t - t1).max(0.0))
        }
        (Certified::Hit { .. } | Certified::Wall { .. }, _) => Agreement::Missed,
    }
}

/// The agreement of a tracer's picture, row by row from the top. τ is a thousandth of ε over the steepest ray.
pub fn against_certified(
    surface: &Surface<'_>,
    camera: &Camera,
    tracer: Tracer,
    settings: &Settings,
) -> Vec<Agreement> {
    let slope = surface.global().slope;
    let effort = Effort { bracket: 1e-3 * settings.epsilon / (1.0 + slope * slope).sqrt(), ..Effort::default() };
    let cells = Cells::new(surface.program(), Evidence::Enclosures);
    let rows: Vec<Vec<Agreement>> = (0..camera.height())
        .into_par_iter()
        .map(|row| {
            let mut oracle = CertifiedTracer::over(&cells);
            let mut field = HeightRay::new(surface);
            let of_column = |column: usize| {
                let ray = camera.ray(column as f64 + 0.5, row as f64 + 0.5);
                field.aim(ray);
                let answer = tracer.trace(surface, &mut field, settings);
                agreement(answer, oracle.trace(&ray, &effort), effort.bracket)
            };
            (0..camera.width()).map(of_column).collect()
        })
        .collect();
    rows.concat()
}

/// The largest distance before a certified bracket, metres.
pub fn largest_lead(pixels: &[Agreement]) -> f64 {
    pixels.iter().fold(0.0, |most, pixel| if let Agreement::Met(error) = pixel { most.max(-error) } else { most })
}

/// White within the bracket, blue before it (full at `lead` metres, by the square root, so that small leads show), red beyond it;
/// grey where nothing is met, magenta missed, orange wrong, green undecided.
pub fn colours(pixels: &[Agreement], lead: f64) -> Vec<u8> {
    pixels
        .iter()
        .flat_map(|pixel| match *pixel {
            Agreement::Clear => [205, 205, 205],
            Agreement::Met(error) if error < 0.0 => {
                let fade = 1.0 - (-error / lead.max(f64::MIN_POSITIVE)).min(1.0).sqrt();
                [(fade * 255.0) as u8, (90.0 + fade * 165.0) as u8, 255]
            }
            Agreement::Met(error) if error > 0.0 => [225, 40, 40],
            Agreement::Met(_) => [255, 255, 255],
            Agreement::Missed => [255, 0, 255],
            Agreement::Wrong => [255, 140, 0],
            Agreement::Undecided => [0, 160, 60],
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_is_before_within_beyond_or_past_the_bracket() {
        let hit = Certified::Hit { t0: 10.0, t1: 10.5 };
        let at = |t| agreement(Answer::Hit { t }, hit, 0.25);
        assert_eq!([at(9.0), at(10.25), at(10.75)], [Agreement::Met(-1.0), Agreement::Met(0.0), Agreement::Met(0.25)]);
        assert_eq!([at(11.0), agreement(Answer::Miss, hit, 0.25)], [Agreement::Missed; 2]);
        assert_eq!(agreement(Answer::Miss, Certified::Miss, 0.25), Agreement::Clear);
        let given_up = Answer::GaveUp { t: 3.0 };
        assert_eq!(agreement(given_up, Certified::Miss, 0.25), Agreement::Wrong);
        assert_eq!(agreement(Answer::Hit { t: 3.0 }, Certified::Miss, 0.25), Agreement::Wrong);
        let undecided = Certified::Undecided { t0: 1.0, t1: 2.0 };
        assert_eq!(agreement(Answer::Hit { t: 1.5 }, undecided, 0.25), Agreement::Undecided);
        assert_eq!(largest_lead(&[at(9.0), at(10.75), Agreement::Missed]), 1.0);
    }

    #[test]
    fn every_kind_of_pixel_has_its_colour() {
        let kinds = [
            Agreement::Clear,
            Agreement::Met(-1.0),
            Agreement::Met(0.0),
            Agreement::Met(0.1),
            Agreement::Missed,
            Agreement::Wrong,
            Agreement::Undecided,
        ];
        let drawn = colours(&kinds, 1.0);
        let mut distinct: Vec<&[u8]> = drawn.chunks(3).collect();
        distinct.sort_unstable();
        distinct.dedup();
        assert_eq!(distinct.len(), kinds.len());
    }
}
