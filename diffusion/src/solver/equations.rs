//! The equations of a raster: ΔF = 0 at every node but where a value is given or something else is asked.
//!
//! Rows are written as differences, Σ w·(F − F_neighbour) + d·F = c: they vanish on constants exactly, so that weights may be rounded to
//! `f32` without moving the ground. With c = 0 and values given as they stand in F there is no right-hand side to be kept: A·F = c reads
//! the given values, and a correction, which is 0 at them, sees the operator between the others. Nodes of the plain kind have
//! weight 1 for each of the four neighbours that exist, which makes the raster's border a natural one (no flow across it).

use super::rows::{Rows, SELF, STEPS, index_of};
use crate::plane::{Float, Plane, dot, sum, wide};
use rayon::prelude::*;

const BESIDE: [(isize, isize); 4] = [(0, -1), (-1, 0), (1, 0), (0, 1)];

/// The coefficients of a plain node all of whose neighbours are solved for.
const PLAIN: [f32; 9] = [0.0, -1.0, 0.0, -1.0, 4.0, -1.0, 0.0, -1.0, 0.0];

/// What holds at a node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Equation {
    /// F is the mean of the neighbours that exist.
    #[default]
    Laplace,
    /// F is given.
    Given,
    /// Something else.
    Other(Other),
}

/// An equation of its own: Σ w·(F − F_neighbour) + d·F = c.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Other {
    /// w of the neighbours from the south-west, row by row; d in the place of the node itself. 0 where a neighbour is missing.
    pub weights: [f32; 9],
    /// c.
    pub constant: f64,
}

impl Other {
    /// Adds `weight`·(F − F_neighbour).
    pub fn add(&mut self, step: (isize, isize), weight: f64) {
        self.weights[index_of(step)] += weight as f32;
    }
    /// The coefficient of the node itself.
    pub fn own(&self) -> f32 {
        self.weights.iter().sum()
    }
    /// Σ w·(F − F_neighbour) + d·F at padded column `i`; `across`: whether weights across corners count.
    #[inline(always)]
    fn product<T: Float>(&self, i: usize, beside: [&[T]; 3], across: bool) -> T {
        let [south, own, north]: [[T; 3]; 3] = beside.map(|row| [row[i], row[i + 1], row[i + 2]]);
        let value = own[1];
        let w = self.weights.map(T::of_single);
        let sides = (w[3] * (value - own[0]) + w[5] * (value - own[2]))
            + (w[1] * (value - south[1]) + w[7] * (value - north[1]));
        let total = sides + w[SELF] * value;
        if !across {
            return total;
        }
        let corners = (w[0] * (value - south[0]) + w[2] * (value - south[2]))
            + (w[6] * (value - north[0]) + w[8] * (value - north[2]));
        total + corners
    }
}

/// See the module.
#[derive(Clone, Debug)]
pub struct Equations {
    width: usize,
    height: usize,
    /// 1 / the coefficient of the node itself; 0 where the value is given.
    inverse: Vec<f32>,
    /// The nodes that are not plain, by row.
    others: Vec<Vec<(u32, Other)>>,
    /// Whether any of them has weights across corners.
    across: bool,
    /// Whether they carry values along a direction.
    directed: bool,
}

impl Equations {
    /// The equations of `width × height` nodes, row by row: `fill(j, equations of the row, all Laplace)`.
    pub fn new(width: usize, height: usize, fill: impl Fn(usize, &mut [Equation]) + Sync) -> Equations {
        let mut inverse = vec![0.0; width * height];
        let others: Vec<Vec<(u32, Other)>> = inverse
            .par_chunks_mut(width)
            .enumerate()
            .map_init(Vec::new, |row, (j, inverse)| {
                row.clear();
                row.resize(width, Equation::Laplace);
                fill(j, row);
                let vertical = usize::from(j > 0) + usize::from(j + 1 < height);
                let mut others = Vec::new();
                for (i, equation) in row.iter().enumerate() {
                    inverse[i] = match equation {
                        Equation::Given => 0.0,
                        Equation::Laplace => {
                            1.0 / (vertical + usize::from(i > 0) + usize::from(i + 1 < width)).max(1) as f32
                        }
                        Equation::Other(other) => {
                            others.push((i as u32, *other));
                            1.0 / other.own()
                        }
                    };
                }
                others
            })
            .collect();
        let corner = |(_, other): &(u32, Other)| [0, 2, 6, 8].iter().any(|&k| other.weights[k] != 0.0);
        let across = others.par_iter().any(|row| row.iter().any(corner));
        Equations { width, height, inverse, others, across, directed: false }
    }
    /// The same; equations of their own carry values along a direction, and relaxation follows it.
    pub fn directed(self) -> Equations {
        Equations { directed: true, ..self }
    }
    /// Whether the value of a node is given.
    pub fn is_given(&self, i: usize, j: usize) -> bool {
        self.inverse[j * self.width + i] == 0.0
    }
    /// Whether any value is given.
    pub fn any_given(&self) -> bool {
        self.inverse.contains(&0.0)
    }
    /// Nodes from west to east, and rows from south to north.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }
    /// The nodes of row `j` that are neither plain nor given, with their columns, from the west.
    pub fn others(&self, j: usize) -> &[(u32, Other)] {
        &self.others[j]
    }
    /// What it takes, bytes.
    pub fn bytes(&self) -> usize {
        let others: usize = self.others.iter().map(|row| row.capacity() * size_of::<(u32, Other)>()).sum();
        4 * self.inverse.len() + others
    }
    /// `residual` = c − A·F, 0 where values are given; returns Σ residual² of each field.
    pub fn residual<T: Float, const K: usize>(&self, values: &Plane<f64, K>, residual: &mut Plane<T, K>) -> [f64; K] {
        let squares = residual.update(|j, fields, _| {
            let mut product = vec![0.0; self.width];
            let mut squares = [0.0; K];
            for (k, row) in fields.into_iter().enumerate() {
                self.product(j, values.beside(j, k), &mut product);
                for (i, other) in &self.others[j] {
                    product[*i as usize] -= other.constant;
                }
                squares[k] = wide(
                    #[inline(always)]
                    || {
                        row[1..].iter_mut().zip(&product).for_each(|(to, product)| *to = T::of(-product));
                        dot(&product, &product)
                    },
                );
            }
            squares
        });
        sum(&squares)
    }
    /// ‖b‖² of each field, b what is known: a value that is given, and elsewhere c and what given neighbours contribute.
    pub fn known<const K: usize>(&self, values: &Plane<f64, K>) -> [f64; K] {
        let rows: Vec<[f64; K]> = (0..self.height)
            .into_par_iter()
            .map(|j| {
                std::array::from_fn(|k| {
                    let mut rows = values.beside(j, k).map(<[f64]>::to_vec);
                    for (row, q) in rows.iter_mut().zip([j.wrapping_sub(1), j, j + 1]) {
                        for i in (0..self.width).filter(|_| q < self.height) {
                            row[i + 1] = if self.is_given(i, q) { row[i + 1] } else { 0.0 };
                        }
                    }
                    let mut known = vec![0.0; self.width];
                    self.product(j, std::array::from_fn(|k| &rows[k][..]), &mut known);
                    self.others[j].iter().for_each(|(i, other)| known[*i as usize] -= other.constant);
                    let given = &rows[1][1..=self.width];
                    dot(&known, &known) + dot(given, given)
                })
            })
            .collect();
        sum(&rows)
    }
    /// A·x on row `j` as if all nodes were plain or given.
    #[inline(always)]
    fn plain<T: Float>(&self, j: usize, beside: [&[T]; 3], out: &mut [T]) {
        let n = self.width;
        // Where a neighbour is missing the node itself stands in: the difference is 0.
        let south = if j > 0 { beside[0] } else { beside[1] };
        let north = if j + 1 < self.height { beside[2] } else { beside[1] };
        let [x, west, east, south, north] =
            [&beside[1][1..], beside[1], &beside[1][2..], &south[1..], &north[1..]].map(|row| &row[..n]);
        let (inverse, out) = (self.inverse(j), &mut out[..n]);
        let zero = T::default();
        for i in 0..n {
            let sum = ((x[i] - west[i]) + (x[i] - east[i])) + ((x[i] - south[i]) + (x[i] - north[i]));
            out[i] = if inverse[i] == 0.0 { zero } else { sum };
        }
        let vertical = |i: usize| (x[i] - south[i]) + (x[i] - north[i]);
        let only = |i: usize, sum: T| if inverse[i] == 0.0 { zero } else { sum };
        if n == 1 {
            out[0] = only(0, vertical(0));
        } else if n > 1 {
            out[0] = only(0, (x[0] - east[0]) + vertical(0));
            out[n - 1] = only(n - 1, (x[n - 1] - west[n - 1]) + vertical(n - 1));
        }
    }
    /// The first node, by row and column, that no given value reaches along the neighbours that equations name; values are also held
    /// at nodes of which `held` says so.
    pub(super) fn adrift(&self, held: impl Fn(usize, usize) -> bool) -> Option<(usize, usize)> {
        // Nodes that name every neighbour are held as soon as one of them is: only others make a search necessary.
        let names = |i: usize, j: usize, step: (isize, isize)| {
            self.others[j]
                .binary_search_by_key(&(i as u32), |(i, _)| *i)
                .map_or_else(|_| BESIDE.contains(&step), |found| self.others[j][found].1.weights[index_of(step)] != 0.0)
        };
        let neighbour = |i: usize, j: usize, (x, y): (isize, isize)| {
            let place = i.checked_add_signed(x).zip(j.checked_add_signed(y));
            place.filter(|&(p, q)| p < self.width && q < self.height)
        };
        let one_way =
            |j: usize, i: usize| BESIDE.into_iter().any(|step| neighbour(i, j, step).is_some() && !names(i, j, step));
        if !(0..self.height).any(|j| self.others[j].iter().any(|(i, _)| one_way(j, *i as usize))) {
            return None;
        }
        let at = |node: usize| (node % self.width, node / self.width);
        let mut seen: Vec<bool> =
            (0..self.width * self.height).map(at).map(|(i, j)| self.is_given(i, j) || held(i, j)).collect();
        let mut queue: Vec<usize> = (0..seen.len()).filter(|&node| seen[node]).collect();
        while let Some(node) = queue.pop() {
            let (i, j) = at(node);
            for step in STEPS {
                let Some((p, q)) = neighbour(i, j, step) else { continue };
                // (p, q) is held by (i, j) if its equation names it.
                if !seen[q * self.width + p] && names(p, q, (-step.0, -step.1)) {
                    seen[q * self.width + p] = true;
                    queue.push(q * self.width + p);
                }
            }
        }
        seen.iter().position(|seen| !seen).map(at)
    }
}

impl Rows for Equations {
    fn width(&self) -> usize {
        self.width
    }
    fn height(&self) -> usize {
        self.height
    }
    fn inverse(&self, j: usize) -> &[f32] {
        &self.inverse[j * self.width..][..self.width]
    }
    fn product<T: Float>(&self, j: usize, beside: [&[T]; 3], out: &mut [T]) {
        let n = self.width;
        wide(
            #[inline(always)]
            || self.plain(j, beside, &mut out[..n]),
        );
        for (i, other) in &self.others[j] {
            out[*i as usize] = other.product(*i as usize, beside, self.across);
        }
    }
    fn sweep(&self, j: usize, from_east: bool, b: &[f32], [south, north]: [&[f32]; 2], row: &mut [f32]) {
        let mut relax = |(i, other): &(u32, Other)| {
            let i = *i as usize;
            let product = other.product(i, [south, &*row, north], self.across);
            row[i + 1] += (b[i + 1] - product) * self.inverse[j * self.width + i];
        };
        let others = self.others[j].iter();
        if from_east { others.rev().for_each(&mut relax) } else { others.for_each(&mut relax) }
    }
    fn coefficients(&self, j: usize, out: &mut [[f32; 9]]) {
        let inside = |i: usize, (x, y): (isize, isize)| {
            let place = i.checked_add_signed(x).zip(j.checked_add_signed(y));
            place.filter(|&(p, q)| p < self.width && q < self.height)
        };
        let between = |i: usize, step: (isize, isize)| inside(i, step).is_some_and(|(p, q)| !self.is_given(p, q));
        let mut others = self.others[j].iter().peekable();
        let mut uniform = vec![false; self.width];
        self.uniform(j, &mut uniform);
        for (i, out) in out.iter_mut().enumerate() {
            if uniform[i] {
                *out = PLAIN;
                continue;
            }
            *out = [0.0; 9];
            if self.is_given(i, j) {
                out[SELF] = 1.0;
            } else if let Some((_, other)) = others.next_if(|(column, _)| *column as usize == i) {
                for (k, step) in STEPS.into_iter().enumerate().filter(|&(k, _)| k != SELF) {
                    out[k] = if between(i, step) { -other.weights[k] } else { 0.0 };
                }
                out[SELF] = other.own();
            } else {
                for step in BESIDE {
                    out[SELF] += if inside(i, step).is_some() { 1.0 } else { 0.0 };
                    out[index_of(step)] = if between(i, step) { -1.0 } else { 0.0 };
                }
            }
        }
    }
    fn follows(&self, j: usize, out: &mut [bool]) {
        out.fill(false);
        self.others[j].iter().filter(|_| self.directed).for_each(|(i, _)| out[*i as usize] = true);
    }
    fn uniform(&self, j: usize, out: &mut [bool]) {
        let n = self.width;
        if j == 0 || j + 1 == self.height || n < 3 {
            out.fill(false);
            return;
        }
        let [south, own, north] = [j - 1, j, j + 1].map(|j| self.inverse(j));
        let free = |inverse: f32| inverse > 0.0;
        for i in 1..n - 1 {
            out[i] = free(own[i]) && free(own[i - 1]) && free(own[i + 1]) && free(south[i]) && free(north[i]);
        }
        (out[0], out[n - 1]) = (false, false);
        self.others[j].iter().for_each(|(i, _)| out[*i as usize] = false);
    }
}
