//! The reduced system solved without being made: conjugate gradients, preconditioned by its diagonal blocks.
//!
//! Far from the end a step need not be exact, and then some products with `S = H_rr − Wᵀ H_ee⁻¹ W` cost less than making and factorising
//! it. A product goes over the ties `W` once, eliminated variable by eliminated variable.

use super::elimination::{Elimination, Lists};
use super::parts::{AllTrue, for_each_part, starts};
use super::schur::Schur;
use super::small_blocks::{add_tie_times, add_tie_transposed_times, dot, with_size};
use super::tie_sums::TieSums;

/// Reduced blocks that one task preconditions.
const CHUNK: usize = 8;

/// How exactly a system is solved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exactness {
    /// Stop when the last iteration gained less than this part of all gains, times the number of iterations.
    pub(super) tolerance: f64,
    /// Iterations at most.
    pub(super) most: usize,
}

/// Conjugate gradients over the reduced unknowns.
pub(super) struct IterativeSchur {
    /// Inverses of the diagonal blocks of `S`, row by row, and where they begin.
    preconditioner: Vec<f64>,
    preconditioner_start: Vec<usize>,
    /// Pairs of reduced blocks that meet in a factor: for each block those after it.
    beside: Lists<u32>,
    /// `H_rr` of each pair, a row for each number of the first block, and where it begins.
    beside_blocks: Vec<f64>,
    beside_start: Vec<usize>,
    residual: Vec<f64>,
    direction: Vec<f64>,
    product: Vec<f64>,
    preconditioned: Vec<f64>,
}

impl IterativeSchur {
    /// Room for a structure.
    ///
    /// * `start` — first row of each reduced block, and the number of rows at the end.
    pub(super) fn new(structure: &Elimination, start: &[usize]) -> Self {
        let rows = start[start.len() - 1];
        let sizes = &structure.reduced_sizes;
        let mut beside = Lists { start: vec![0], items: Vec::new() };
        let mut beside_sizes = Vec::new();
        for block in 0..sizes.len() {
            let mut rows: Vec<u32> =
                structure.pairs_of_reduced.of(block).iter().map(|pair| pair.other).collect();
            rows.sort_unstable();
            rows.dedup();
            beside_sizes.extend(rows.iter().map(|row| sizes[block] * sizes[*row as usize]));
            beside.items.append(&mut rows);
            beside.start.push(beside.items.len());
        }
        let preconditioner_start = starts(sizes.iter().map(|size| size * size));
        let beside_start = starts(beside_sizes);
        Self {
            preconditioner: vec![0.0; preconditioner_start[sizes.len()]],
            preconditioner_start,
            beside_blocks: vec![0.0; beside_start[beside.items.len()]],
            beside_start,
            beside,
            residual: vec![0.0; rows],
            direction: vec![0.0; rows],
            product: vec![0.0; rows],
            preconditioned: vec![0.0; rows],
        }
    }

    /// Makes the preconditioner; `false` where a diagonal block is not positive.
    pub(super) fn prepare(&mut self, schur: &Schur<'_>) -> bool {
        let structure = schur.structure;
        let Self { preconditioner, preconditioner_start, beside, beside_blocks, beside_start, .. } = self;
        for block in 0..structure.reduced.len() {
            let own = beside.of(block);
            let first = beside.start[block];
            let numbers = beside_start[first]..beside_start[first + own.len()];
            beside_blocks[numbers].fill(0.0);
            for pair in structure.pairs_of_reduced.of(block) {
                let at = first + own.partition_point(|row| *row < pair.other);
                let size = structure.reduced_sizes[block];
                let other = structure.reduced_sizes[pair.other as usize];
                pair.add_product(schur.jacobians, size, other, &mut beside_blocks[beside_start[at]..]);
            }
        }
        let all = AllTrue::new();
        let start = |block: usize| [preconditioner_start[block]];
        for_each_part(0..structure.reduced.len(), CHUNK, [preconditioner], &start, &|range, [inverses]| {
            let first = preconditioner_start[range.start];
            for block in range {
                let numbers = preconditioner_start[block] - first..preconditioner_start[block + 1] - first;
                all.and(schur.invert_diagonal(block, &mut inverses[numbers]));
            }
        });
        all.get()
    }

    /// Solves `S x = b` from zero, in place; whether it came as near as was asked.
    ///
    /// What it stops at is, of all vectors that were spanned, the best one for the quadratic model: a step that is as good as its model
    /// says, though not the longest one.
    pub(super) fn solve(
        &mut self,
        schur: &Schur<'_>,
        sums: &mut TieSums,
        exactness: Exactness,
        x: &mut [f64],
    ) -> bool {
        self.residual.copy_from_slice(x);
        x.fill(0.0);
        self.precondition(schur);
        self.direction.copy_from_slice(&self.preconditioned);
        let mut slope = dot(&self.residual, &self.preconditioned);
        let mut gained = 0.0;
        for iteration in 1..=exactness.most {
            if slope <= 0.0 {
                return true;
            }
            self.multiply(schur, sums);
            let length = slope / dot(&self.direction, &self.product);
            if !(length > 0.0 && length.is_finite()) {
                return false;
            }
            for ((x, residual), (direction, product)) in
                x.iter_mut().zip(&mut self.residual).zip(self.direction.iter().zip(&self.product))
            {
                *x += length * direction;
                *residual -= length * product;
            }
            // Nash and Sofer: what the quadratic model still gains.
            let gain = 0.5 * length * slope;
            gained += gain;
            if iteration as f64 * gain <= exactness.tolerance * gained {
                return true;
            }
            self.precondition(schur);
            let next = dot(&self.residual, &self.preconditioned);
            let turn = next / slope;
            slope = next;
            for (direction, preconditioned) in self.direction.iter_mut().zip(&self.preconditioned) {
                *direction = preconditioned + turn * *direction;
            }
        }
        false
    }

    /// `S` times the direction.
    fn multiply(&mut self, schur: &Schur<'_>, sums: &mut TieSums) {
        let Self { direction, product, beside, beside_blocks, beside_start, .. } = self;
        let (structure, start) = (schur.structure, schur.start);
        let direction = &direction[..];
        sums.collect(&|at, sum| {
            with_size!(structure.eliminated_sizes[at], add_eliminated(schur, at, direction, sum));
        });
        for (block, size) in structure.reduced_sizes.iter().enumerate() {
            let (first, size) = (start[block], *size);
            let entries = &schur.blocks[schur.block_start[block]..][..size * size];
            for (a, line) in entries.chunks_exact(size).enumerate() {
                let row = first + a;
                let mut sum = schur.damping * schur.diagonal[row] * direction[row];
                sum += dot(line, &direction[first..first + size]);
                product[row] = sum - sums.total(row);
            }
        }
        for block in 0..structure.reduced.len() {
            for edge in beside.start[block]..beside.start[block + 1] {
                let other = beside.items[edge] as usize;
                let (mine, theirs) = (start[block]..start[block + 1], start[other]..start[other + 1]);
                let entries = &beside_blocks[beside_start[edge]..beside_start[edge + 1]];
                for (row, line) in mine.zip(entries.chunks_exact(theirs.len())) {
                    product[row] += dot(line, &direction[theirs.clone()]);
                    for (column, entry) in theirs.clone().zip(line) {
                        product[column] += entry * direction[row];
                    }
                }
            }
        }
    }

    fn precondition(&mut self, schur: &Schur<'_>) {
        for (block, size) in schur.structure.reduced_sizes.iter().enumerate() {
            let inverse = &self.preconditioner[self.preconditioner_start[block]..][..size * size];
            let range = schur.start[block]..schur.start[block + 1];
            let residual = &self.residual[range.clone()];
            for (target, line) in self.preconditioned[range].iter_mut().zip(inverse.chunks_exact(*size)) {
                *target = dot(line, residual);
            }
        }
    }
}

/// Adds `Wᵀ H_ee⁻¹ W x` of one eliminated variable of `E` degrees of freedom.
fn add_eliminated<const E: usize>(schur: &Schur<'_>, at: usize, x: &[f64], into: &mut [f64]) {
    let structure = schur.structure;
    let edges = structure.edges.start[at]..structure.edges.start[at + 1];
    let tie = |edge: usize| &schur.ties[structure.numbers_of(edge)];
    let rows = |edge: usize| {
        let block = structure.edges.items[edge] as usize;
        schur.start[block]..schur.start[block + 1]
    };
    let mut moved = [0.0; E];
    for edge in edges.clone() {
        let (tie, x) = (tie(edge), &x[rows(edge)]);
        add_tie_times(tie, x, &mut moved);
    }
    let mut solved = [0.0; E];
    add_tie_times(schur.inverse(at), &moved, &mut solved);
    for edge in edges {
        let (tie, into) = (tie(edge), &mut into[rows(edge)]);
        add_tie_transposed_times(tie, &solved, into);
    }
}
