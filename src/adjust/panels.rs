//! Panels: eliminated variables that are tied to much the same blocks, whose products are made together as one large one.

use super::elimination::Lists;
use super::parts::for_each_part;
use super::reduced_system::ReducedSystem;
use super::schur::{MOST_TIE, Schur};
use super::small_blocks::multiply;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::{Accum, MatMut, MatRef, Par};
use rayon::prelude::*;

/// What bringing an entry of a product to its place costs, in multiplications.
const SCATTER: f64 = 40.0;

/// Rows of a panel at most: beyond, more of them make it no faster.
const MOST_ROWS: usize = 240;

/// Rows and columns from which a panel is worth its copies.
const LEAST_ROWS: usize = 18;
const LEAST_COLUMNS: usize = 48;

/// Panels whose products are kept at the same time.
const BATCH: usize = 8;

/// Block columns that one task brings to their places.
const CHUNK: usize = 32;

/// One panel.
struct Panel {
    /// Eliminated variables.
    members: Vec<u32>,
    /// Reduced blocks that they are tied to, ascending.
    blocks: Vec<u32>,
    /// Where the columns of each block begin, and their number.
    columns: Vec<usize>,
    rows: usize,
}

/// All panels of an elimination.
#[derive(Default)]
pub(super) struct Panels {
    all: Vec<Panel>,
    /// For each eliminated variable, whether a panel has it.
    pub(super) has: Vec<bool>,
}

/// Room for the products of some panels, kept from one step to the next.
#[derive(Default)]
pub(super) struct Products(Vec<Product>);

/// What one panel is multiplied with and to.
#[derive(Default)]
struct Product {
    ties: Vec<f64>,
    solved: Vec<f64>,
    entries: Vec<f64>,
}

/// Groups of variables with their cost; `None` for the place of a group stands for a variable that is better alone.
///
/// * `order` — eliminated variables, neighbours in it being alike; `around` — blocks that one is tied to, ascending.
/// * `rows` — degrees of freedom of a variable; `sizes` — of the blocks.
///
/// Gives the groups and, in multiplications at the speed of large ones, what they cost; and the multiplications of the others.
pub(super) fn groups<'a>(
    order: &[usize],
    around: impl Fn(usize) -> &'a [u32],
    rows: impl Fn(usize) -> usize,
    sizes: &[usize],
) -> (Vec<Vec<usize>>, f64, f64) {
    let width = |blocks: &[u32]| blocks.iter().map(|block| sizes[*block as usize]).sum::<usize>();
    let cost = |rows: usize, columns: usize| 0.5 * (rows as f64 + SCATTER) * (columns as f64).powi(2);
    let (mut found, mut large, mut small) = (Vec::new(), 0.0, 0.0);
    let mut group: Vec<usize> = Vec::new();
    let (mut union, mut merged) = (Vec::<u32>::new(), Vec::new());
    let mut height = 0;
    let mut close = |group: &mut Vec<usize>, union: &[u32], height: usize| {
        let columns = width(union);
        if height >= LEAST_ROWS && columns >= LEAST_COLUMNS {
            large += cost(height, columns);
            found.push(std::mem::take(group));
        } else {
            for variable in group.drain(..) {
                small += 0.5 * (width(around(variable)) as f64).powi(2) * rows(variable) as f64;
            }
        }
    };
    for variable in order {
        let (mine, more) = (around(*variable), rows(*variable));
        merge(&union, mine, &mut merged);
        let apart = cost(height, width(&union)) + cost(more, width(mine));
        let joined = cost(height + more, width(&merged));
        if !group.is_empty() && (joined > apart || height + more > MOST_ROWS) {
            close(&mut group, &union, height);
            (union, height) = (mine.to_vec(), 0);
        } else {
            std::mem::swap(&mut union, &mut merged);
        }
        group.push(*variable);
        height += more;
    }
    close(&mut group, &union, height);
    (found, large, small)
}

/// The union of two ascending lists.
fn merge(a: &[u32], b: &[u32], into: &mut Vec<u32>) {
    into.clear();
    let (mut a, mut b) = (a.iter().peekable(), b.iter().peekable());
    while let (Some(x), Some(y)) = (a.peek(), b.peek()) {
        let least = **x.min(y);
        into.push(least);
        a.next_if(|x| **x == least);
        b.next_if(|y| **y == least);
    }
    into.extend(a);
    into.extend(b);
}

impl Panels {
    /// Panels of groups of eliminated variables.
    ///
    /// * `edges` — reduced blocks of each eliminated variable, ascending; `heights` — its degrees of freedom; `sizes` — of the blocks.
    pub(super) fn new(groups: Vec<Vec<u32>>, edges: &Lists<u32>, heights: &[usize], sizes: &[usize]) -> Self {
        let mut has = vec![false; heights.len()];
        let panels = groups.into_iter().map(|members| {
            let (mut blocks, mut merged) = (Vec::new(), Vec::new());
            for member in &members {
                merge(&blocks, edges.of(*member as usize), &mut merged);
                std::mem::swap(&mut blocks, &mut merged);
                has[*member as usize] = true;
            }
            let mut columns = vec![0];
            for block in &blocks {
                columns.push(columns[columns.len() - 1] + sizes[*block as usize]);
            }
            let rows = members.iter().map(|member| heights[*member as usize]).sum();
            Panel { members, blocks, columns, rows }
        });
        Self { all: panels.collect(), has }
    }

    /// Takes `Σ Wᵀ H⁻¹ W` of all panels off the values of a reduced system.
    ///
    /// Every entry is summed in the order of the panels, however many threads there are.
    ///
    /// * `room` — whatever it holds; `values` — of the system, its block columns at `column_starts`.
    pub(super) fn subtract(
        &self,
        schur: &Schur<'_>,
        system: &ReducedSystem,
        room: &mut Products,
        values: &mut [f64],
        column_starts: &[usize],
    ) {
        let batch = &mut room.0;
        batch.resize_with(BATCH.min(self.all.len()), Product::default);
        for panels in self.all.chunks(BATCH) {
            batch.par_iter_mut().zip(panels).with_max_len(1).for_each(|(product, panel)| {
                product.make(panel, schur);
            });
            let start = |column: usize| [column_starts[column]];
            for_each_part(0..column_starts.len() - 1, CHUNK, [&mut *values], &start, &|columns, [part]| {
                let begin = column_starts[columns.start];
                for (panel, product) in panels.iter().zip(&*batch) {
                    let place =
                        |block: usize| panel.blocks.partition_point(|other| (*other as usize) < block);
                    for at in place(columns.start)..place(columns.end) {
                        panel.bring(at, &product.entries, system, part, begin);
                    }
                }
            });
        }
    }
}

impl Product {
    /// `Wᵀ H⁻¹ W` of a panel: its lower triangle, column by column.
    fn make(&mut self, panel: &Panel, schur: &Schur<'_>) {
        let (structure, mut row) = (schur.structure, 0);
        let (rows, columns) = (panel.rows, panel.columns[panel.blocks.len()]);
        for target in [&mut self.ties, &mut self.solved] {
            target.clear();
            target.resize(rows * columns, 0.0);
        }
        let mut room = [0.0; MOST_TIE];
        for member in &panel.members {
            let member = *member as usize;
            let (height, inverse) = (structure.eliminated_sizes[member], schur.inverse(member));
            let mut at = 0;
            for edge in structure.edges.start[member]..structure.edges.start[member + 1] {
                while panel.blocks[at] != structure.edges.items[edge] {
                    at += 1;
                }
                let (first, width) = (panel.columns[at], panel.columns[at + 1] - panel.columns[at]);
                let tie = &schur.ties[structure.numbers_of(edge)];
                let solved = &mut room[..tie.len()];
                multiply(inverse, tie, height, width, solved);
                for (block, target) in [(tie, &mut self.ties), (&*solved, &mut self.solved)] {
                    for (k, line) in block.chunks_exact(width).enumerate() {
                        target[(row + k) * columns + first..][..width].copy_from_slice(line);
                    }
                }
            }
            row += height;
        }
        self.entries.resize(columns * columns, 0.0);
        // Row by row is the transposed, column by column.
        let left = MatRef::from_column_major_slice(&self.ties, columns, rows);
        let right = MatRef::from_column_major_slice(&self.solved, columns, rows).transpose();
        triangular::matmul(
            MatMut::from_column_major_slice_mut(&mut self.entries, columns, columns),
            BlockStructure::TriangularLower,
            Accum::Replace,
            left,
            BlockStructure::Rectangular,
            right,
            BlockStructure::Rectangular,
            1.0,
            Par::Seq,
        );
    }
}

impl Panel {
    /// Takes the columns of one block of the product off a reduced system's.
    ///
    /// * `values` — numbers of some block columns, the first at `begin`.
    fn bring(&self, at: usize, product: &[f64], system: &ReducedSystem, values: &mut [f64], begin: usize) {
        let all = self.columns[self.blocks.len()];
        let column = self.blocks[at] as usize;
        let (first, size) = (self.columns[at], self.columns[at + 1] - self.columns[at]);
        let mut walk = system.walk(column);
        for other in at..self.blocks.len() {
            // A pair that no member is tied to has a product of zero, and no place.
            let Some(place) = walk.advance(self.blocks[other] as usize) else { continue };
            let (row, height) = (self.columns[other], self.columns[other + 1] - self.columns[other]);
            for c in 0..size {
                let from = if other == at { c } else { 0 };
                let source = &product[(first + c) * all + row + from..(first + c) * all + row + height];
                let target = &mut values[place.column(c) - begin + from..][..height - from];
                for (target, entry) in target.iter_mut().zip(source) {
                    *target -= entry;
                }
            }
        }
    }
}
