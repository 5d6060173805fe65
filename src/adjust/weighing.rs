//! What it would cost to eliminate these variables or those: the model by which the solver chooses.
//!
//! Costs are multiplications at the speed of a dense factorisation. What only shows once an order with little fill is known is looked at
//! for the ways alone that may still be the cheapest.

use super::block_pattern::{BlockPattern, Ordering, Work};
use super::elimination::{freedom, kind_of};
use super::panels::groups;
use super::plan::{Choice, Eliminate, Factorisation, Plan};
use super::problem::Problem;
use rayon::prelude::*;

/// How many times slower than in a dense factorisation multiplications run: those of the elimination, of a sparse factorisation, of one
/// whose leaves are single variables, and of a product with the reduced system; and how many more each entry is worth that such leaves
/// bring to their places. Measured on the sequences of the first release and on
/// problems of Bundle Adjustment in the Large.
const SMALL_BLOCKS: f64 = 17.0;
const SPARSE: f64 = 2.0;
const SPARSE_LEAVES: f64 = 6.5;
const LEAF_ENTRY: f64 = 300.0;
const PRODUCT: f64 = 13.0;

/// Iterations of conjugate gradients below which they are not begun with, and what they are thought to be where nothing else may be.
const LEAST_ITERATIONS: usize = 10;
const USUAL_ITERATIONS: usize = 50;

/// Iterations of a step at most.
const MOST_ITERATIONS: usize = 500;

/// Factors up to which it is quicker to look at two ways side by side than to find first that one of them need not be.
const MOST_BESIDE: usize = 500_000;

/// Unknowns up to which a system is always dense.
const ALWAYS_DENSE: usize = 200;

/// What an elimination ties together.
pub(super) struct Outline {
    pub(super) eliminate: Vec<bool>,
    /// Variables of the reduced system.
    pub(super) blocks: Vec<usize>,
    /// Eliminated variables whose products are made together.
    pub(super) groups: Vec<Vec<usize>>,
    sizes: Vec<usize>,
    /// Reduced blocks around each eliminated variable, ascending: cliques of the reduced system.
    around: Vec<Vec<u32>>,
    /// For each reduced block those after it that it meets in a factor without an eliminated variable.
    direct: Vec<Vec<u32>>,
    /// Multiplications that make the reduced system, and those of a product with it.
    making: f64,
    product: f64,
}

/// A way to solve the normal equations, and what it costs.
pub(super) struct Candidate {
    pub(super) outline: Outline,
    pub(super) pattern: BlockPattern,
    pub(super) ordering: Ordering,
    choice: Choice,
}

/// The cheapest of some ways, and what was weighed; `None` where none can be indexed.
pub(super) fn weigh(
    problem: &Problem,
    mut outlines: Vec<Outline>,
    factorisation: Factorisation,
) -> Option<(Candidate, Plan)> {
    // What is cheap to make mostly is cheap as a whole; of what makes nothing the whole cost shows only at the end.
    outlines.sort_by(|a, b| a.making.total_cmp(&b.making));
    let nothing = outlines.iter().take_while(|outline| outline.making == 0.0).count();
    let mut later = outlines.split_off((nothing + 1).min(outlines.len()));
    if problem.layout.factors > MOST_BESIDE && nothing < outlines.len() {
        later.extend(outlines.drain(..nothing));
    }
    let weighed = |outlines: Vec<Outline>, most: f64| -> Vec<Result<Candidate, Option<Choice>>> {
        outlines.into_par_iter().map(|outline| outline.weighed(problem, factorisation, most)).collect()
    };
    let early = weighed(outlines, f64::INFINITY);
    let most = early.iter().flatten().map(|found| found.choice.cost()).fold(f64::INFINITY, f64::min);
    let late = weighed(later, most);
    let (mut best, mut plan) = (None::<Candidate>, Plan::default());
    for found in early.into_iter().chain(late) {
        match found {
            Ok(candidate) => {
                plan.choices.push(candidate.choice.clone());
                if best.as_ref().is_none_or(|best| candidate.choice.cost() < best.choice.cost()) {
                    plan.taken = plan.choices.len() - 1;
                    best = Some(candidate);
                }
            }
            Err(choice) => plan.choices.extend(choice),
        }
    }
    best.map(|best| (best, plan))
}

impl Outline {
    /// The outline of an elimination.
    ///
    /// * `eliminate` — for each variable, whether it goes first.
    pub(super) fn of(problem: &Problem, eliminate: Vec<bool>) -> Self {
        let blocks: Vec<usize> = (0..problem.len()).filter(|v| !eliminate[*v] && !problem.held[*v]).collect();
        let mut block_of = vec![usize::MAX; problem.len()];
        blocks.iter().enumerate().for_each(|(at, v)| block_of[*v] = at);
        let sizes: Vec<usize> = blocks.iter().map(|v| freedom(problem, *v)).collect();
        let mut around: Vec<Vec<u32>> = vec![Vec::new(); problem.len()];
        let mut direct: Vec<Vec<u32>> = vec![Vec::new(); blocks.len()];
        let name = |block: usize| u32::try_from(block).unwrap_or(u32::MAX);
        for layout in &problem.layout.batches {
            for variables in layout.variables.chunks_exact(layout.arity.max(1)) {
                let centre = variables.iter().find(|v| eliminate[v.index()] && !problem.held[v.index()]);
                for (at, variable) in variables.iter().enumerate() {
                    let block = block_of[variable.index()];
                    if block == usize::MAX {
                        continue;
                    }
                    match centre {
                        Some(centre) => around[centre.index()].push(name(block)),
                        None => {
                            for other in &variables[at + 1..] {
                                let other = block_of[other.index()];
                                if other != usize::MAX {
                                    direct[block.min(other)].push(name(block.max(other)));
                                }
                            }
                        }
                    }
                }
            }
        }
        let mut product = 0.0;
        for (variable, clique) in around.iter_mut().enumerate() {
            clique.sort_unstable();
            clique.dedup();
            let width: usize = clique.iter().map(|block| sizes[*block as usize]).sum();
            product += 2.0 * (width * freedom(problem, variable)) as f64;
        }
        // Poses are alike when they follow each other, landmarks when the same frames see them.
        let mut order: Vec<usize> =
            (0..problem.len()).filter(|v| eliminate[*v] && !around[*v].is_empty()).collect();
        if kind_of(problem, &eliminate) != Eliminate::Poses {
            order.sort_by_key(|v| (around[*v][0], around[*v][around[*v].len() - 1], *v));
        }
        let (groups, large, small) = groups(&order, |v| &around[v], |v| freedom(problem, v), &sizes);
        Self {
            eliminate,
            blocks,
            groups,
            sizes,
            around,
            direct,
            making: large + SMALL_BLOCKS * small,
            product,
        }
    }

    /// Weighs what is left: the factorisation.
    ///
    /// Where it costs more than `most` for certain, what is known of it is the error; `None` where it cannot be indexed.
    fn weighed(
        self,
        problem: &Problem,
        factorisation: Factorisation,
        most: f64,
    ) -> Result<Candidate, Option<Choice>> {
        let mut choice = Choice {
            eliminate: kind_of(problem, &self.eliminate),
            eliminated: (0..problem.len()).filter(|v| self.eliminate[*v] && !problem.held[*v]).count(),
            reduced: self.sizes.iter().sum(),
            factorisation,
            elimination_cost: self.making,
            factorisation_cost: 0.0,
            iterations: 0,
            is_bound: true,
        };
        if factorisation == Factorisation::Iterative {
            let order = (0..self.blocks.len()).collect();
            choice.elimination_cost = 0.0;
            choice.factorisation_cost =
                USUAL_ITERATIONS as f64 * (PRODUCT * self.product + choice.reduced as f64);
            choice.iterations = MOST_ITERATIONS;
            choice.is_bound = false;
            let ordering = Ordering { order, sparse: Work::default() };
            return Ok(Candidate { outline: self, pattern: BlockPattern::default(), ordering, choice });
        }
        if choice.cost() > most {
            return Err(Some(choice));
        }
        let pattern = self.pattern();
        let has_leaves = choice.eliminate == Eliminate::Nothing;
        let sparse = |work: Work| {
            if has_leaves {
                SPARSE_LEAVES * work.multiplications + LEAF_ENTRY * work.entries
            } else {
                SPARSE * work.multiplications
            }
        };
        let dense = (choice.reduced as f64).powi(3) / 6.0;
        choice.factorisation_cost = dense.min(sparse(pattern.least_work(&self.sizes)));
        if choice.cost() > most {
            return Err(Some(choice));
        }
        let Some(ordering) = pattern.ordering(&self.sizes) else { return Err(None) };
        let sparse = sparse(ordering.sparse);
        let is_dense = match factorisation {
            Factorisation::Dense => true,
            Factorisation::Sparse => false,
            _ => choice.reduced <= ALWAYS_DENSE || dense < sparse,
        };
        choice.is_bound = false;
        choice.factorisation_cost = if is_dense { dense } else { sparse };
        choice.factorisation = if is_dense { Factorisation::Dense } else { Factorisation::Sparse };
        if factorisation == Factorisation::Cheapest && !has_leaves {
            let iterations = choice.cost() / (PRODUCT * self.product);
            let counts = LEAST_ITERATIONS..=MOST_ITERATIONS;
            choice.iterations = counts.take_while(|count| *count as f64 <= iterations).last().unwrap_or(0);
        }
        Ok(Candidate { outline: self, pattern, ordering, choice })
    }

    /// The pattern of the reduced system.
    fn pattern(&self) -> BlockPattern {
        let mut cliques_of = vec![Vec::new(); self.blocks.len()];
        for (variable, clique) in self.around.iter().enumerate() {
            clique.iter().for_each(|block| cliques_of[*block as usize].push(variable));
        }
        BlockPattern::of(self.blocks.len(), |column, add| {
            self.direct[column].iter().for_each(|row| add(*row as usize));
            for clique in &cliques_of[column] {
                let clique = &self.around[*clique];
                let from = clique.partition_point(|row| (*row as usize) <= column);
                clique[from..].iter().for_each(|row| add(*row as usize));
            }
        })
    }
}
