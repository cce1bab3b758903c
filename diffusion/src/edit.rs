//! A terrain whose curves are changed one at a time: only the rows that a curve reaches are drawn anew, and every solve starts from the
//! fields as they were.

use crate::curve::Curve;
use crate::fields::{Fields, Settings, converge};
use crate::raster::{Domain, Raster, rasterise, rows_of};
use crate::solver::SolveError;
use crate::solver::engine::Processor;

/// See the module. It solves with [`Settings::solver`] converged; the paper's schedule has no first guess and is not for editing.
#[derive(Clone, Debug)]
pub struct Editor {
    curves: Vec<Curve>,
    settings: Settings,
    raster: Raster,
    fields: Fields,
}

impl Editor {
    /// Diffuses what `curves` give over `domain`.
    ///
    /// # Errors
    /// As [`crate::fields::diffuse`].
    pub fn new(curves: Vec<Curve>, domain: Domain, settings: Settings) -> Result<Editor, SolveError> {
        let raster = rasterise(&curves, &domain);
        let fields = converge(&raster, domain, &settings, None, &mut Processor)?;
        Ok(Editor { curves, settings, raster, fields })
    }
    /// The curves as they are.
    pub fn curves(&self) -> &[Curve] {
        &self.curves
    }
    /// The fields of the curves as they are.
    pub fn fields(&self) -> &Fields {
        &self.fields
    }
    /// Puts `curve` in the place of the `index`-th; past the last it is added.
    ///
    /// # Errors
    /// As [`crate::fields::diffuse`]; then everything stays as it was.
    pub fn put(&mut self, index: usize, curve: Curve) -> Result<(), SolveError> {
        let mut curves = self.curves.clone();
        match curves.get_mut(index) {
            Some(place) => *place = curve,
            None => curves.push(curve),
        }
        self.take_on(curves, index.min(self.curves.len()))
    }
    /// Takes the `index`-th curve away; one that is not there is no error.
    ///
    /// # Errors
    /// As [`crate::fields::diffuse`]; then everything stays as it was.
    pub fn remove(&mut self, index: usize) -> Result<(), SolveError> {
        if index >= self.curves.len() {
            return Ok(());
        }
        let mut curves = self.curves.clone();
        curves.remove(index);
        self.take_on(curves, index)
    }

    /// Takes on `curves`, which differ from those before at `index`, by a curve changed, added or taken away.
    fn take_on(&mut self, curves: Vec<Curve>, index: usize) -> Result<(), SolveError> {
        let domain = self.fields.domain;
        let removed = curves.len() < self.curves.len();
        let changed = [self.curves.get(index), curves.get(index).filter(|_| !removed)];
        let rows = changed.into_iter().flatten().map(|curve| rows_of(curve, &domain)).filter(|rows| !rows.is_empty());
        let Some(rows) = rows.reduce(|a, b| a.start.min(b.start)..a.end.max(b.end)) else {
            // Nothing of it lies in the domain.
            self.curves = curves;
            return Ok(());
        };
        let before = self.raster.redraw(&curves, &domain, rows.clone());
        match converge(&self.raster, domain, &self.settings, Some(&self.fields), &mut Processor) {
            Ok(fields) => {
                (self.curves, self.fields) = (curves, fields);
                Ok(())
            }
            Err(error) => {
                self.raster.restore(rows, before);
                Err(error)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::curve::{ConstraintPoint, Elevation, Gradient, Noise, Side};
    use crate::fields::diffuse;
    use crate::solver::krylov::Stop;
    use glam::DVec2;

    fn ridge(y: f64, height: f64) -> Curve {
        let side = Side { extent: 60.0, angle: -0.5 };
        let point = |place| ConstraintPoint {
            place,
            elevation: Some(Elevation { height, radius: 8.0 }),
            gradient: Some(Gradient { left: side, right: side }),
            noise: Some(Noise { amplitude: height / 20.0, roughness: 0.4 }),
        };
        let control = [100.0, 300.0, 600.0, 850.0].map(|x| DVec2::new(x, y + x / 10.0)).to_vec();
        Curve::new(control, vec![point(0.0), point(1.0)]).unwrap()
    }
    fn differs(a: &Fields, b: &Fields) -> f64 {
        let pairs = [(&a.elevation, &b.elevation), (&a.amplitude, &b.amplitude), (&a.roughness, &b.roughness)];
        let differences = pairs.into_iter().flat_map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a - b).abs()));
        differences.fold(0.0, f64::max)
    }

    #[test]
    fn edited_fields_are_those_of_a_fresh_start_in_fewer_iterations() {
        let domain = Domain::square(1000.0, 161);
        let stop = Stop { relative_residual: 1e-10, iterations: 60 };
        for solver in [crate::fields::Solver::Multigrid, crate::fields::Solver::Variational] {
            let settings = Settings { solver, stop, ..Settings::default() };
            let mut editor = Editor::new(vec![ridge(200.0, 100.0), ridge(700.0, 300.0)], domain, settings).unwrap();
            let first = editor.fields().clone();
            editor.put(1, ridge(702.0, 300.0)).unwrap();
            let fresh = diffuse(editor.curves(), domain, &settings).unwrap();
            assert!(differs(editor.fields(), &fresh) < 1e-5, "{}", differs(editor.fields(), &fresh));
            assert!(differs(editor.fields(), &first) > 1.0, "the edit is seen");
            let iterations = |fields: &Fields| fields.reports.iter().map(|report| report.iterations).sum::<usize>();
            assert!(iterations(editor.fields()) < iterations(&fresh));
            editor.put(9, ridge(450.0, 50.0)).unwrap();
            assert_eq!(editor.curves().len(), 3);
            editor.remove(2).unwrap();
            assert!(differs(editor.fields(), &fresh) < 1e-5, "{}", differs(editor.fields(), &fresh));
        }
    }

    #[test]
    fn what_cannot_be_solved_leaves_everything_as_it_was() {
        let domain = Domain::square(1000.0, 65);
        let mut editor = Editor::new(vec![ridge(200.0, 100.0)], domain, Settings::default()).unwrap();
        let before = editor.clone();
        assert!(editor.remove(0).is_err());
        assert_eq!((editor.curves(), differs(editor.fields(), before.fields())), (before.curves(), 0.0));
        assert!((0..65).all(|j| editor.raster.row(j) == before.raster.row(j)));
        assert!(editor.remove(7).is_ok());
    }
}
