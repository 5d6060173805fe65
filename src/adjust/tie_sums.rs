//! Sums over eliminated variables for the reduced unknowns, on all cores: their ties are read in the order in which they lie.

use super::elimination::Elimination;
use rayon::prelude::*;

/// Sums that are made beside each other, and added one after the other: always as many, so that bits do not depend on threads.
const PARTS: usize = 4;

/// Room for sums over eliminated variables, a number for each reduced unknown.
#[derive(Default)]
pub(super) struct TieSums {
    /// Where the eliminated variables of each part begin, about as many ties in each.
    bounds: [usize; PARTS + 1],
    /// One after the other.
    sums: Vec<f64>,
    rows: usize,
}

impl TieSums {
    /// Room for a structure with some reduced unknowns.
    pub(super) fn new(structure: &Elimination, rows: usize) -> Self {
        let edges = structure.edges.items.len();
        let bound = |part: usize| match part {
            PARTS => structure.eliminated.len(),
            _ => structure.edges.start[1..].partition_point(|edge| *edge <= edges * part / PARTS),
        };
        Self { bounds: std::array::from_fn(bound), sums: vec![0.0; PARTS * rows], rows }
    }

    /// Begins at zero and calls for each eliminated variable, which adds to the sum that it is given.
    pub(super) fn collect(&mut self, add: &(impl Fn(usize, &mut [f64]) + Sync)) {
        let Self { bounds, sums, rows } = self;
        sums.par_chunks_mut((*rows).max(1)).with_max_len(1).enumerate().for_each(|(part, sum)| {
            sum.fill(0.0);
            (bounds[part]..bounds[part + 1]).for_each(|at| add(at, sum));
        });
    }

    /// What was summed for an unknown.
    #[inline]
    pub(super) fn total(&self, row: usize) -> f64 {
        (0..PARTS).map(|part| self.sums[part * self.rows + row]).sum()
    }
}
