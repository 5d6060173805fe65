//! Which blocks of a reduced system are not zero, the order in which it is solved, and what that costs.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::simplicial;

/// The lower triangle of a symmetric block matrix: for each block column the block rows below the diagonal, ascending.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct BlockPattern {
    pub(super) start: Vec<usize>,
    pub(super) rows: Vec<u32>,
}

/// An order of elimination and its cost.
pub(super) struct Ordering {
    /// The block that comes at each place.
    pub(super) order: Vec<usize>,
    /// What a sparse factorisation in this order takes.
    pub(super) sparse: Work,
}

/// What a sparse factorisation takes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Work {
    pub(super) multiplications: f64,
    /// Numbers of the factor below its diagonal blocks.
    pub(super) entries: f64,
}

impl BlockPattern {
    /// Blocks on the diagonal.
    pub(super) fn len(&self) -> usize {
        self.start.len().saturating_sub(1)
    }

    /// The block rows below the diagonal of a block column.
    pub(super) fn below(&self, column: usize) -> &[u32] {
        &self.rows[self.start[column]..self.start[column + 1]]
    }

    /// The pattern of the rows that a function names for each column, in any order and several times.
    pub(super) fn of(blocks: usize, mut each: impl FnMut(usize, &mut dyn FnMut(usize))) -> Self {
        let mut pattern = Self { start: Vec::with_capacity(blocks + 1), rows: Vec::new() };
        pattern.start.push(0);
        let mut seen = vec![usize::MAX; blocks];
        for column in 0..blocks {
            let begin = pattern.rows.len();
            each(column, &mut |row| {
                if row > column && seen[row] != column {
                    seen[row] = column;
                    pattern.rows.push(u32::try_from(row).unwrap_or(u32::MAX));
                }
            });
            pattern.rows[begin..].sort_unstable();
            pattern.start.push(pattern.rows.len());
        }
        pattern
    }

    /// The same matrix with its blocks in another order.
    pub(super) fn reordered(&self, order: &[usize]) -> Self {
        let mut place = vec![0; order.len()];
        order.iter().enumerate().for_each(|(at, block)| place[*block] = at);
        let mut columns = vec![Vec::new(); order.len()];
        for column in 0..self.len() {
            for row in self.below(column) {
                let (a, b) = (place[column], place[*row as usize]);
                columns[a.min(b)].push(a.max(b));
            }
        }
        Self::of(order.len(), |column, name| columns[column].iter().for_each(|row| name(*row)))
    }

    /// An order with little fill (approximate minimum degree), and the cost of factorising in it.
    ///
    /// * `sizes` — rows of each block.
    ///
    /// `None` where the pattern is too large to be indexed.
    pub(super) fn ordering(&self, sizes: &[usize]) -> Option<Ordering> {
        let blocks = self.len();
        if blocks == 0 {
            return Some(Ordering { order: Vec::new(), sparse: Work::default() });
        }
        // The upper triangle, column by column, is the lower one row by row.
        let (starts, rows) = self.upper(None);
        let upper = SymbolicSparseColMatRef::<u32>::new_checked(blocks, blocks, &starts, None, &rows);
        let (mut order, mut place) = (vec![0_u32; blocks], vec![0_u32; blocks]);
        let request = amd::order_maybe_unsorted_scratch::<u32>(blocks, rows.len());
        let mut memory = MemBuffer::try_new(request).ok()?;
        let stack = MemStack::new(&mut memory);
        amd::order_maybe_unsorted(&mut order, &mut place, upper, amd::Control::default(), stack).ok()?;
        let order: Vec<usize> = order.iter().map(|block| *block as usize).collect();
        let sparse = self.work(&order, sizes)?;
        Some(Ordering { order, sparse })
    }

    /// What a sparse factorisation takes at least, in whatever order: fill only adds to the pattern, and columns of one length cost
    /// least.
    ///
    /// * `sizes` — rows of each block.
    pub(super) fn least_work(&self, sizes: &[usize]) -> Work {
        let rows: usize = sizes.iter().sum();
        let entries = |column: usize| {
            let below: usize = self.below(column).iter().map(|row| sizes[*row as usize]).sum();
            sizes[column] * below
        };
        let entries = (0..self.len()).map(entries).sum::<usize>() as f64;
        Work { multiplications: 0.5 * entries * entries / (rows as f64).max(1.0), entries }
    }

    /// Starts and row indices of the upper triangle with its diagonal, its blocks at other places.
    fn upper(&self, place: Option<&[usize]>) -> (Vec<u32>, Vec<u32>) {
        let blocks = self.len();
        let at = |block: usize| place.map_or(block, |place| place[block]);
        let mut columns: Vec<Vec<u32>> = (0..blocks).map(|_| Vec::new()).collect();
        for column in 0..blocks {
            columns[at(column)].push(u32::try_from(at(column)).unwrap_or(u32::MAX));
            for row in self.below(column) {
                let (a, b) = (at(column), at(*row as usize));
                columns[a.max(b)].push(u32::try_from(a.min(b)).unwrap_or(u32::MAX));
            }
        }
        let (mut starts, mut rows) = (vec![0_u32], Vec::with_capacity(self.rows.len() + blocks));
        for column in &mut columns {
            column.sort_unstable();
            rows.append(column);
            starts.push(u32::try_from(rows.len()).unwrap_or(u32::MAX));
        }
        (starts, rows)
    }

    /// What a sparse factorisation with the blocks in an order takes: `½ Σ |column of L|²` multiplications, column by column of numbers.
    fn work(&self, order: &[usize], sizes: &[usize]) -> Option<Work> {
        let blocks = self.len();
        let mut place = vec![0; blocks];
        order.iter().enumerate().for_each(|(at, block)| place[*block] = at);
        let (starts, rows) = self.upper(Some(&place));
        let upper = SymbolicSparseColMatRef::<u32>::new_checked(blocks, blocks, &starts, None, &rows);
        let (mut tree, mut counts) = (vec![0_i32; blocks], vec![0_u32; blocks]);
        let request = simplicial::prefactorize_symbolic_cholesky_scratch::<u32>(blocks, rows.len())
            .or(simplicial::factorize_simplicial_symbolic_cholesky_scratch::<u32>(blocks));
        let mut memory = MemBuffer::try_new(request).ok()?;
        let stack = MemStack::new(&mut memory);
        let tree = simplicial::prefactorize_symbolic_cholesky(&mut tree, &mut counts, upper, stack);
        // The fill of blocks of unequal size needs the rows, not only their count.
        let factor = simplicial::factorize_simplicial_symbolic_cholesky(upper, tree, &counts, stack).ok()?;
        let (starts, rows) = (factor.col_ptr(), factor.row_idx());
        let mut work = Work::default();
        for (column, block) in order.iter().enumerate() {
            let below = &rows[starts[column] as usize..starts[column + 1] as usize];
            let height: usize = below.iter().map(|row| sizes[order[*row as usize]]).sum();
            let entries = (sizes[*block] * height) as f64;
            work.entries += entries;
            work.multiplications += 0.5 * entries * height as f64;
        }
        Some(work)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chain(blocks: usize) -> BlockPattern {
        BlockPattern::of(blocks, |column, name| name(column + 1 - usize::from(column + 1 == blocks)))
    }

    #[test]
    fn a_chain_has_no_fill_in_the_order_that_is_found() {
        let sizes = vec![6; 40];
        let ordering = chain(40).ordering(&sizes).unwrap();
        let mut sorted = ordering.order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..40).collect::<Vec<_>>());
        // Columns of two blocks, the last of one.
        let expected = 0.5 * 6.0 * (39.0 * 144.0 + 36.0);
        let found = ordering.sparse.multiplications;
        assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    }

    #[test]
    fn an_order_and_its_inverse_give_the_pattern_back() {
        let pattern =
            BlockPattern::of(5, |column, name| [1, 3, 4].iter().for_each(|row| name(column.max(*row))));
        let order = [3, 1, 4, 0, 2];
        let mut back = [0; 5];
        order.iter().enumerate().for_each(|(at, block)| back[*block] = at);
        assert_eq!(pattern.reordered(&order).reordered(&back), pattern);
    }
}
