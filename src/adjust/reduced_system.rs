//! The reduced system and its Cholesky factor, dense or sparse.

use super::block_pattern::BlockPattern;
use super::error::Error;
use super::parts::starts;
use super::plan::Factorisation;
use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt;
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Conj, MatMut, MatRef, Par, Side};
use std::num::NonZero;

/// How work is cut for several cores: always the same way, so that results do not depend on how many there are.
const PARALLEL: Par = Par::Rayon(PARTS);
const PARTS: NonZero<usize> = NonZero::new(4).unwrap();

/// Most unknowns of a dense system: 20000 squared are 3.2 GB.
const MOST_DENSE: usize = 20_000;

/// A symmetric positive matrix by its lower triangle in block columns, and its factor `L Lᵀ`.
pub(super) struct ReducedSystem {
    /// First row of each block, and the number of rows at the end.
    pub(super) start: Vec<usize>,
    pub(super) pattern: BlockPattern,
    /// Columns of the lower triangle, as `storage` says; the dense factor takes their place.
    pub(super) values: Vec<f64>,
    storage: Storage,
}

enum Storage {
    /// Whole columns.
    Dense { memory: MemBuffer },
    /// Only what is not zero.
    Sparse(Box<Sparse>),
    /// No columns: the system is never made.
    Absent,
}

struct Sparse {
    matrix: SymbolicSparseColMat<u32>,
    symbolic: SymbolicCholesky<u32>,
    factor: Vec<f64>,
    memory: MemBuffer,
}

impl ReducedSystem {
    /// Makes room for a matrix of this pattern.
    ///
    /// * `sizes` — rows of each block; `factorisation` — whether it is a full matrix, a sparse one, or not made at all.
    pub(super) fn new(
        pattern: BlockPattern,
        sizes: &[usize],
        factorisation: Factorisation,
    ) -> Result<Self, Error> {
        let start = starts(sizes.iter().copied());
        let rows = start[sizes.len()];
        if factorisation == Factorisation::Iterative {
            return Ok(Self { start, pattern, values: Vec::new(), storage: Storage::Absent });
        }
        if factorisation == Factorisation::Dense {
            if rows > MOST_DENSE {
                return Err(Error::TooLarge { most: MOST_DENSE, found: rows });
            }
            let request =
                llt::factor::cholesky_in_place_scratch::<f64>(rows, PARALLEL, faer::Spec::default());
            let memory = MemBuffer::try_new(request).map_err(|_| too_large(rows))?;
            return Ok(Self {
                start,
                pattern,
                values: vec![0.0; rows * rows],
                storage: Storage::Dense { memory },
            });
        }
        let (mut starts, mut indices) = (vec![0_u32], Vec::new());
        for block in 0..pattern.len() {
            for column in start[block]..start[block + 1] {
                indices.extend((column..start[block + 1]).filter_map(|row| u32::try_from(row).ok()));
                for below in pattern.below(block) {
                    let below = *below as usize;
                    indices
                        .extend((start[below]..start[below + 1]).filter_map(|row| u32::try_from(row).ok()));
                }
                starts.push(u32::try_from(indices.len()).map_err(|_| too_large(rows))?);
            }
        }
        let values = vec![0.0; indices.len()];
        let (upper_starts, upper_indices) = transposed(rows, &starts, &indices);
        let upper = SymbolicSparseColMat::new_checked(rows, rows, upper_starts, None, upper_indices);
        let matrix = SymbolicSparseColMat::new_checked(rows, rows, starts, None, indices);
        // The analysis looks at the upper triangle alone.
        let symbolic = factorize_symbolic_cholesky(
            upper.as_ref(),
            Side::Upper,
            SymmetricOrdering::Identity,
            CholeskySymbolicParams::default(),
        )
        .map_err(|_| too_large(rows))?;
        let request = symbolic
            .factorize_numeric_llt_scratch::<f64>(PARALLEL, faer::Spec::default())
            .or(symbolic.solve_in_place_scratch::<f64>(1, PARALLEL));
        let memory = MemBuffer::try_new(request).map_err(|_| too_large(rows))?;
        let factor = vec![0.0; symbolic.len_val()];
        let storage = Storage::Sparse(Box::new(Sparse { matrix, symbolic, factor, memory }));
        Ok(Self { start, pattern, values, storage })
    }

    /// Rows of the matrix.
    pub(super) fn rows(&self) -> usize {
        self.start[self.start.len() - 1]
    }

    /// Where the values of each block column begin, and their number at the end.
    pub(super) fn column_starts(&self) -> Vec<usize> {
        let rows = self.rows();
        match &self.storage {
            Storage::Dense { .. } => self.start.iter().map(|first| first * rows).collect(),
            Storage::Sparse(sparse) => {
                self.start.iter().map(|first| sparse.matrix.col_ptr()[*first] as usize).collect()
            }
            Storage::Absent => vec![0; self.start.len()],
        }
    }

    /// A walk down the block rows of a block column.
    pub(super) fn walk(&self, column: usize) -> Walk<'_> {
        let below = self.pattern.below(column);
        let (first, size) = (self.start[column], self.start[column + 1] - self.start[column]);
        match &self.storage {
            Storage::Dense { .. } | Storage::Absent => {
                let rows = self.rows();
                Walk {
                    system: self,
                    column,
                    below,
                    base: first * rows,
                    offset: first,
                    stride: rows,
                    packed: false,
                }
            }
            Storage::Sparse(sparse) => {
                let starts = sparse.matrix.col_ptr();
                let (base, stride) = (starts[first] as usize, (starts[first + 1] - starts[first]) as usize);
                Walk { system: self, column, below, base, offset: size, stride, packed: true }
            }
        }
    }

    /// Where the rows of a block column stand: see [`Places`].
    pub(super) fn places<'a>(&self, column: usize, local: &'a mut Vec<usize>) -> Places<'a> {
        local.resize(self.pattern.len(), 0);
        match &self.storage {
            Storage::Dense { .. } | Storage::Absent => {
                for row in self.pattern.below(column) {
                    local[*row as usize] = self.start[*row as usize];
                }
                local[column] = self.start[column];
                Places { local, stride: self.rows(), packed: false }
            }
            Storage::Sparse(_) => {
                let size = self.start[column + 1] - self.start[column];
                let mut next = size;
                local[column] = 0;
                for row in self.pattern.below(column) {
                    let row = *row as usize;
                    local[row] = next;
                    next += self.start[row + 1] - self.start[row];
                }
                Places { local, stride: next, packed: true }
            }
        }
    }

    /// Factorises the values; `false` where the matrix is not positive.
    pub(super) fn factorise(&mut self) -> bool {
        let rows = self.rows();
        if rows == 0 {
            return true;
        }
        match &mut self.storage {
            Storage::Absent => false,
            Storage::Dense { memory } => {
                let matrix = MatMut::from_column_major_slice_mut(&mut self.values, rows, rows);
                let stack = MemStack::new(memory);
                let regularisation = LltRegularization::default();
                llt::factor::cholesky_in_place(matrix, regularisation, PARALLEL, stack, faer::Spec::default())
                    .is_ok()
            }
            Storage::Sparse(sparse) => {
                let Sparse { matrix, symbolic, factor, memory } = &mut **sparse;
                let matrix = SparseColMatRef::new(matrix.as_ref(), &self.values[..]);
                let stack = MemStack::new(memory);
                let regularisation = LltRegularization::default();
                // The simplicial factorisation adds to what is there.
                factor.fill(0.0);
                symbolic
                    .factorize_numeric_llt(
                        factor,
                        matrix,
                        Side::Lower,
                        regularisation,
                        PARALLEL,
                        stack,
                        faer::Spec::default(),
                    )
                    .is_ok()
            }
        }
    }

    /// Room for solving with some right sides at once.
    pub(super) fn room(&self, sides: usize) -> MemBuffer {
        MemBuffer::new(match &self.storage {
            Storage::Absent => StackReq::EMPTY,
            Storage::Dense { .. } => llt::solve::solve_in_place_scratch::<f64>(self.rows(), sides, PARALLEL),
            Storage::Sparse(sparse) => sparse.symbolic.solve_in_place_scratch::<f64>(sides, PARALLEL),
        })
    }

    /// Solves with the factor for one or several right sides, column by column.
    ///
    /// * `room` — of [`ReducedSystem::room`] for as many sides.
    pub(super) fn solve(&self, sides: &mut [f64], room: &mut MemBuffer) {
        let rows = self.rows();
        if rows == 0 || sides.is_empty() {
            return;
        }
        let columns = sides.len() / rows;
        let sides = MatMut::from_column_major_slice_mut(sides, rows, columns);
        match &self.storage {
            Storage::Absent => {}
            Storage::Dense { .. } => {
                let factor = MatRef::from_column_major_slice(&self.values, rows, rows);
                llt::solve::solve_in_place(factor, sides, PARALLEL, MemStack::new(room));
            }
            Storage::Sparse(sparse) => {
                let factor = LltRef::new(&sparse.symbolic, &sparse.factor);
                factor.solve_in_place_with_conj(Conj::No, sides, PARALLEL, MemStack::new(room));
            }
        }
    }
}

/// Starts and row indices of the transposed pattern, ascending.
fn transposed(rows: usize, starts: &[u32], indices: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let mut upper = vec![0_u32; rows + 1];
    indices.iter().for_each(|row| upper[*row as usize + 1] += 1);
    for row in 0..rows {
        upper[row + 1] += upper[row];
    }
    let (mut next, mut found) = (upper.clone(), vec![0_u32; indices.len()]);
    for (column, window) in (0_u32..).zip(starts.windows(2)) {
        for row in &indices[window[0] as usize..window[1] as usize] {
            let at = &mut next[*row as usize];
            found[*at as usize] = column;
            *at += 1;
        }
    }
    (upper, found)
}

fn too_large(found: usize) -> Error {
    Error::TooLarge { most: MOST_DENSE, found }
}

/// Where numbers of one block column stand among its values.
pub(super) struct Places<'a> {
    local: &'a [usize],
    stride: usize,
    packed: bool,
}

impl Places<'_> {
    /// The place of the first number of a block row in a column of the block.
    ///
    /// Of the diagonal block only the lower triangle has a place.
    #[inline]
    pub(super) fn at(&self, row: usize, column: usize) -> usize {
        if self.packed {
            // Column c leaves out the c numbers above the diagonal, and so did the ones before it.
            self.local[row] + column * self.stride - column * (column + 1) / 2
        } else {
            self.local[row] + column * self.stride
        }
    }
}

/// A walk down the block rows of a block column.
pub(super) struct Walk<'a> {
    system: &'a ReducedSystem,
    column: usize,
    below: &'a [u32],
    /// Where the block column begins among all values.
    base: usize,
    /// The next block row's first number in the first column.
    offset: usize,
    stride: usize,
    packed: bool,
}

/// A block of a block column.
pub(super) struct Spot {
    first: usize,
    stride: usize,
    packed: bool,
}

impl Spot {
    /// The place of the block's first row in one of its columns, among all values; of a diagonal block the rows above have none.
    #[inline]
    pub(super) fn column(&self, column: usize) -> usize {
        let above = if self.packed { column * (column + 1) / 2 } else { 0 };
        self.first + column * self.stride - above
    }
}

impl Walk<'_> {
    /// The block of a row that lies further down than the one before; `None` where the pattern has none.
    #[inline]
    pub(super) fn advance(&mut self, row: usize) -> Option<Spot> {
        let (start, Self { base, stride, packed, .. }) = (&self.system.start, &*self);
        let (base, stride, packed) = (*base, *stride, *packed);
        if row == self.column {
            let first = base + if packed { 0 } else { start[row] };
            return Some(Spot { first, stride, packed });
        }
        while let [next, rest @ ..] = self.below {
            let next = *next as usize;
            if next > row {
                return None;
            }
            let offset = if packed { self.offset } else { start[next] };
            self.below = rest;
            self.offset += start[next + 1] - start[next];
            if next == row {
                return Some(Spot { first: base + offset, stride, packed });
            }
        }
        None
    }
}
