//! What the Schur complement `S = H_rr − Wᵀ H_ee⁻¹ W` is made of, and its columns.

use super::elimination::{Elimination, Incidence};
use super::parametrisation::MOST_FREEDOM;
use super::reduced_system::ReducedSystem;
use super::small_blocks::{invert, multiply, subtract, subtract_any, take_square, with_size};

/// Numbers of a tie at most.
pub(super) const MOST_TIE: usize = MOST_FREEDOM * MOST_FREEDOM;

/// What `S` is made of.
#[derive(Clone, Copy)]
pub(super) struct Schur<'a> {
    pub(super) structure: &'a Elimination,
    /// First row of each reduced block, and the number of rows at the end.
    pub(super) start: &'a [usize],
    pub(super) jacobians: &'a [f64],
    /// `W` and `H_ee⁻¹`.
    pub(super) ties: &'a [f64],
    pub(super) inverses: &'a [f64],
    /// Diagonal blocks of `H`, and where they begin.
    pub(super) blocks: &'a [f64],
    pub(super) block_start: &'a [usize],
    /// Diagonal of `H` by which damping is scaled.
    pub(super) diagonal: &'a [f64],
    pub(super) damping: f64,
}

impl Schur<'_> {
    /// The inverse of a diagonal block of `S`; `false` where it is not positive.
    pub(super) fn invert_diagonal(&self, block: usize, inverse: &mut [f64]) -> bool {
        let structure = self.structure;
        let size = structure.reduced_sizes[block];
        let first = self.start[block];
        inverse.copy_from_slice(&self.blocks[self.block_start[block]..][..size * size]);
        let mut solved = [0.0; MOST_TIE];
        for (at, edge) in structure.edges_of_reduced.of(block) {
            let tie = &self.ties[structure.numbers_of(*edge as usize)];
            let solved = &mut solved[..tie.len()];
            multiply(self.inverse(*at as usize), tie, structure.eliminated_sizes[*at as usize], size, solved);
            with_size!(size, take_square(tie, solved, inverse));
        }
        with_size!(size, invert(&self.diagonal[first..first + size], self.damping, inverse))
    }

    /// `H_ee⁻¹` of an eliminated variable.
    pub(super) fn inverse(&self, at: usize) -> &[f64] {
        let reduced = self.structure.reduced.len();
        let first = self.block_start[reduced];
        &self.inverses[self.block_start[reduced + at] - first..self.block_start[reduced + at + 1] - first]
    }

    /// Sums a block column of `S`, but for what panels bring.
    ///
    /// * `local` — room for where the rows of the column stand.
    pub(super) fn sum_column(
        &self,
        system: &ReducedSystem,
        column: usize,
        local: &mut Vec<usize>,
        values: &mut [f64],
    ) {
        let structure = self.structure;
        values.fill(0.0);
        let places = system.places(column, local);
        let size = structure.reduced_sizes[column];
        let block = &self.blocks[self.block_start[column]..self.block_start[column + 1]];
        for c in 0..size {
            let at = places.at(column, c);
            for r in c..size {
                values[at + r] = block[r * size + c];
            }
            values[at + c] += self.damping * self.diagonal[self.start[column] + c];
        }
        for pair in structure.pairs_of_reduced.of(column) {
            let row = pair.other as usize;
            let other = structure.reduced_sizes[row];
            let Incidence { jacobian, rows, columns, column: mine, .. } = pair.incidence;
            for c in 0..size {
                let target = &mut values[places.at(row, c)..][..other];
                for k in 0..rows as usize {
                    let line = &self.jacobians[jacobian + k * columns as usize..];
                    let factor = line[mine as usize + c];
                    for (target, entry) in target.iter_mut().zip(&line[pair.other_column as usize..]) {
                        *target += factor * entry;
                    }
                }
            }
        }
        let mut solved = [0.0; MOST_TIE];
        for (at, edge) in structure.edges_of_reduced.of(column) {
            let (at, edge) = (*at as usize, *edge as usize);
            if structure.panels.has[at] {
                continue;
            }
            let inner = structure.eliminated_sizes[at];
            let tie = &self.ties[structure.numbers_of(edge)];
            let solved = &mut solved[..tie.len()];
            multiply(self.inverse(at), tie, inner, size, solved);
            let solved = &*solved;
            for other in edge..structure.edges.start[at + 1] {
                let row = structure.edges.items[other] as usize;
                let tie = &self.ties[structure.numbers_of(other)];
                let rows = structure.reduced_sizes[row];
                let (place, is_diagonal) = (|c| places.at(row, c), row == column);
                match (inner, rows, size) {
                    (3, 6, 6) => subtract::<3, 6, 6>(tie, solved, values, is_diagonal, place),
                    (6, 3, 3) => subtract::<6, 3, 3>(tie, solved, values, is_diagonal, place),
                    (3, 9, 9) => subtract::<3, 9, 9>(tie, solved, values, is_diagonal, place),
                    (2, 6, 6) => subtract::<2, 6, 6>(tie, solved, values, is_diagonal, place),
                    (4, 6, 6) => subtract::<4, 6, 6>(tie, solved, values, is_diagonal, place),
                    _ => subtract_any([inner, rows, size], tie, solved, values, is_diagonal, place),
                }
            }
        }
    }
}
