//! Sums and products of blocks so small that their sizes are best known to the compiler.

// Left to itself the compiler calls what is marked so in the middle of a loop, which then knows no size.
#![allow(clippy::inline_always)]

use super::elimination::{Incidence, Pair};
use nalgebra::{SMatrix, SVector, linalg::Cholesky};

/// Calls a function with a number of degrees of freedom, 1 to 9, for its constant.
macro_rules! with_size {
    ($size:expr, $function:ident($($argument:expr),* $(,)?)) => {
        match $size {
            6 => $function::<6>($($argument),*),
            3 => $function::<3>($($argument),*),
            4 => $function::<4>($($argument),*),
            9 => $function::<9>($($argument),*),
            2 => $function::<2>($($argument),*),
            5 => $function::<5>($($argument),*),
            7 => $function::<7>($($argument),*),
            8 => $function::<8>($($argument),*),
            _ => $function::<1>($($argument),*),
        }
    };
}
pub(super) use with_size;

/// Calls a function with the sizes of a tie, rows and columns, for its constants where they are usual, and another where not.
macro_rules! with_tie {
    ($rows:expr, $columns:expr, $function:ident($($argument:expr),* $(,)?), $else:expr) => {
        match ($rows, $columns) {
            (3, 6) => $function::<3, 6>($($argument),*),
            (6, 3) => $function::<6, 3>($($argument),*),
            (4, 6) => $function::<4, 6>($($argument),*),
            (6, 4) => $function::<6, 4>($($argument),*),
            (2, 6) => $function::<2, 6>($($argument),*),
            (6, 2) => $function::<6, 2>($($argument),*),
            (3, 9) => $function::<3, 9>($($argument),*),
            _ => $else,
        }
    };
}

/// `Σ aᵢ bᵢ`.
#[inline(always)]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `N` numbers from a place on.
#[inline(always)]
fn at<const N: usize>(numbers: &[f64], place: usize) -> &[f64; N] {
    numbers[place..].first_chunk().unwrap_or(&[0.0; N])
}

/// A block row by row.
#[inline(always)]
fn rows_of<const E: usize, const R: usize>(block: &[f64]) -> &[[f64; R]; E] {
    block.as_chunks().0.first_chunk().unwrap_or(&[[0.0; R]; E])
}

/// As [`rows_of`], to be written; a block that is too short has none.
#[inline(always)]
fn rows_of_mut<const E: usize, const R: usize>(block: &mut [f64]) -> Option<&mut [[f64; R]; E]> {
    block.as_chunks_mut().0.first_chunk_mut()
}

/// `Σ JᵀJ` and `Σ Jᵀr` of one variable.
pub(super) fn sum_diagonal<const N: usize>(
    incidences: &[Incidence],
    residuals: &[f64],
    jacobians: &[f64],
    gradient: &mut [f64],
    block: &mut [f64],
) {
    let (mut sum, mut side) = ([[0.0; N]; N], [0.0; N]);
    for Incidence { jacobian, residual, rows, columns, column } in incidences {
        for k in 0..*rows as usize {
            let line: &[f64; N] = at(jacobians, jacobian + k * *columns as usize + *column as usize);
            let r = residuals[residual + k];
            for a in 0..N {
                side[a] += line[a] * r;
                for b in 0..N {
                    sum[a][b] += line[a] * line[b];
                }
            }
        }
    }
    gradient.copy_from_slice(&side);
    block.copy_from_slice(sum.as_flattened());
}

/// `Jᵀ y` of one variable.
pub(super) fn pull<const N: usize>(
    incidences: &[Incidence],
    y: &[f64],
    jacobians: &[f64],
    target: &mut [f64],
) {
    let mut sum = [0.0; N];
    for Incidence { jacobian, residual, rows, columns, column } in incidences {
        for k in 0..*rows as usize {
            let line: &[f64; N] = at(jacobians, jacobian + k * *columns as usize + *column as usize);
            let factor = y[residual + k];
            for a in 0..N {
                sum[a] += line[a] * factor;
            }
        }
    }
    target.copy_from_slice(&sum);
}

impl Pair {
    /// Adds `J_aᵀ J_b` of one factor to a block, row by row.
    ///
    /// * `size`, `other` — degrees of freedom of the first and of the second variable.
    pub(super) fn add_product(&self, jacobians: &[f64], size: usize, other: usize, block: &mut [f64]) {
        with_tie!(
            size,
            other,
            add_product(self, jacobians, block),
            add_any_product(self, jacobians, [size, other], block)
        );
    }
}

fn add_product<const E: usize, const R: usize>(pair: &Pair, jacobians: &[f64], block: &mut [f64]) {
    let Some(block) = rows_of_mut::<E, R>(block) else { return };
    let Incidence { jacobian, rows, columns, column, .. } = pair.incidence;
    for k in 0..rows as usize {
        let line = &jacobians[jacobian + k * columns as usize..][..columns as usize];
        let mine: &[f64; E] = at(line, column as usize);
        let other: &[f64; R] = at(line, pair.other_column as usize);
        for a in 0..E {
            for b in 0..R {
                block[a][b] += mine[a] * other[b];
            }
        }
    }
}

fn add_any_product(pair: &Pair, jacobians: &[f64], [size, other]: [usize; 2], block: &mut [f64]) {
    let Incidence { jacobian, rows, columns, column, .. } = pair.incidence;
    for k in 0..rows as usize {
        let line = &jacobians[jacobian + k * columns as usize..][..columns as usize];
        let mine = &line[column as usize..][..size];
        for (factor, target) in mine.iter().zip(block.chunks_exact_mut(other)) {
            let entries = &line[pair.other_column as usize..][..other];
            target.iter_mut().zip(entries).for_each(|(target, entry)| *target += factor * entry);
        }
    }
}

/// Inverts a block, row by row, after adding to its diagonal; `false` where it is not positive.
pub(super) fn invert<const N: usize>(diagonal: &[f64], damping: f64, block: &mut [f64]) -> bool {
    let mut matrix = SMatrix::<f64, N, N>::from_row_slice(block);
    for k in 0..N {
        matrix[(k, k)] += damping * diagonal[k];
    }
    let Some(factor) = Cholesky::new(matrix) else { return false };
    let Some(block) = rows_of_mut::<N, N>(block) else { return false };
    for column in 0..N {
        let mut solution = SVector::<f64, N>::zeros();
        solution[column] = 1.0;
        factor.solve_mut(&mut solution);
        // Symmetric: a column is a row.
        block[column].copy_from_slice(solution.as_slice());
    }
    block.as_flattened().iter().all(|entry| entry.is_finite())
}

/// A square matrix times a tie, both row by row.
pub(super) fn multiply(matrix: &[f64], tie: &[f64], size: usize, columns: usize, product: &mut [f64]) {
    with_tie!(
        size,
        columns,
        multiply_fixed(matrix, tie, product),
        for (line, factors) in product.chunks_exact_mut(columns).zip(matrix.chunks_exact(size)) {
            line.fill(0.0);
            for (factor, entries) in factors.iter().zip(tie.chunks_exact(columns)) {
                line.iter_mut().zip(entries).for_each(|(target, entry)| *target += factor * entry);
            }
        }
    );
}

fn multiply_fixed<const E: usize, const R: usize>(matrix: &[f64], tie: &[f64], product: &mut [f64]) {
    let Some(product) = rows_of_mut::<E, R>(product) else { return };
    let (matrix, tie) = (rows_of::<E, E>(matrix), rows_of::<E, R>(tie));
    for a in 0..E {
        let mut line = [0.0; R];
        for k in 0..E {
            for b in 0..R {
                line[b] += matrix[a][k] * tie[k][b];
            }
        }
        product[a] = line;
    }
}

/// Takes `Wᵀ Y` of two ties to one block off it, row by row.
pub(super) fn take_square<const N: usize>(tie: &[f64], solved: &[f64], block: &mut [f64]) {
    let Some(block) = rows_of_mut::<N, N>(block) else { return };
    for k in 0..tie.len() / N {
        let (tie, solved): (&[f64; N], &[f64; N]) = (at(tie, k * N), at(solved, k * N));
        for a in 0..N {
            for b in 0..N {
                block[a][b] -= tie[a] * solved[b];
            }
        }
    }
}

/// Adds `W x` of a tie.
#[inline]
pub(super) fn add_tie_times(tie: &[f64], x: &[f64], into: &mut [f64]) {
    with_tie!(
        into.len(),
        x.len(),
        add_fixed_times(tie, x, into),
        for (target, line) in into.iter_mut().zip(tie.chunks_exact(x.len())) {
            *target += dot(line, x);
        }
    );
}

#[inline]
fn add_fixed_times<const E: usize, const R: usize>(tie: &[f64], x: &[f64], into: &mut [f64]) {
    let Some(into) = into.first_chunk_mut::<E>() else { return };
    let (x, tie): (&[f64; R], _) = (at(x, 0), rows_of::<E, R>(tie));
    for a in 0..E {
        let mut sum = 0.0;
        for b in 0..R {
            sum += tie[a][b] * x[b];
        }
        into[a] += sum;
    }
}

/// Adds `Wᵀ x` of a tie.
#[inline]
pub(super) fn add_tie_transposed_times(tie: &[f64], x: &[f64], into: &mut [f64]) {
    with_tie!(
        x.len(),
        into.len(),
        add_fixed_transposed_times(tie, x, into),
        for (factor, line) in x.iter().zip(tie.chunks_exact(into.len())) {
            into.iter_mut().zip(line).for_each(|(target, entry)| *target += factor * entry);
        }
    );
}

#[inline]
fn add_fixed_transposed_times<const E: usize, const R: usize>(tie: &[f64], x: &[f64], into: &mut [f64]) {
    let Some(into) = into.first_chunk_mut::<R>() else { return };
    let (x, tie): (&[f64; E], _) = (at(x, 0), rows_of::<E, R>(tie));
    for a in 0..E {
        for b in 0..R {
            into[b] += tie[a][b] * x[a];
        }
    }
}

/// Takes `Wᵀ Y` off the block of a row in a reduced system; `Y` is the tie of the column.
///
/// * `is_diagonal` — only the lower triangle is there; `place` — where each column of the block begins.
#[inline]
pub(super) fn subtract<const E: usize, const R: usize, const C: usize>(
    tie: &[f64],
    solved: &[f64],
    values: &mut [f64],
    is_diagonal: bool,
    place: impl Fn(usize) -> usize,
) {
    let mut product = [[0.0; R]; C];
    for k in 0..E {
        let (line, mine): (&[f64; R], &[f64; C]) = (at(tie, k * R), at(solved, k * C));
        for c in 0..C {
            for r in 0..R {
                product[c][r] += mine[c] * line[r];
            }
        }
    }
    for (c, product) in product.iter().enumerate() {
        let from = if is_diagonal { c } else { 0 };
        let begin = place(c);
        for (target, entry) in values[begin + from..begin + R].iter_mut().zip(&product[from..]) {
            *target -= entry;
        }
    }
}

/// As [`subtract`], for any sizes: of the eliminated variable, of the row and of the column.
pub(super) fn subtract_any(
    [inner, rows, columns]: [usize; 3],
    tie: &[f64],
    solved: &[f64],
    values: &mut [f64],
    is_diagonal: bool,
    place: impl Fn(usize) -> usize,
) {
    for c in 0..columns {
        let begin = place(c);
        let from = if is_diagonal { c } else { 0 };
        for k in 0..inner {
            let factor = solved[k * columns + c];
            for r in from..rows {
                values[begin + r] -= factor * tie[k * rows + r];
            }
        }
    }
}
