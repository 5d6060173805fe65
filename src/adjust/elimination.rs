//! Which variables are eliminated first, and which factors touch which variable.

use super::block_pattern::{BlockPattern, Ordering};
use super::error::Error;
use super::minimise::SolverOptions;
use super::panels::{Panels, groups};
use super::plan::{Choice, Eliminate, Factorisation, Plan};
use super::problem::Problem;
use super::reduced_system::ReducedSystem;

/// Pairs of blocks above which an elimination is not looked at, unless there is no other.
const MOST_PAIRS: f64 = 2e8;

/// How many times slower than in a dense factorisation multiplications run: those of the elimination, of a sparse factorisation, and of one
/// whose leaves are single variables. Measured on the sequences of the first release.
const SMALL_BLOCKS: f64 = 17.0;
const SPARSE: f64 = 2.0;
const SPARSE_LEAVES: f64 = 6.5;

/// Unknowns up to which a system is always dense.
const ALWAYS_DENSE: usize = 200;

/// Where a variable stands in the normal equations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// Not in them.
    Held,
    /// A block of the reduced system.
    Reduced(usize),
    /// Eliminated before; no two of these share a factor.
    Eliminated(usize),
}

/// One variable's columns in one factor's Jacobian.
#[derive(Clone, Copy, Debug)]
pub(super) struct Incidence {
    pub(super) jacobian: usize,
    pub(super) residual: usize,
    pub(super) rows: u8,
    pub(super) columns: u8,
    pub(super) column: u8,
}

/// Two variables of one factor: the second's columns and where their product goes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair {
    pub(super) incidence: Incidence,
    pub(super) other_column: u8,
    /// Edge (for an eliminated variable) or block row (for a reduced one).
    pub(super) other: u32,
}

/// Lists of things by variable, one after the other.
#[derive(Clone, Debug, Default)]
pub(super) struct Lists<T> {
    pub(super) start: Vec<usize>,
    pub(super) items: Vec<T>,
}

impl<T: Copy> Lists<T> {
    pub(super) fn of(&self, index: usize) -> &[T] {
        &self.items[self.start[index]..self.start[index + 1]]
    }

    /// Lists from pairs of owner and item; items keep their order.
    pub(super) fn gather(owners: usize, pairs: &[(usize, T)]) -> Self {
        let mut start = vec![0; owners + 1];
        pairs.iter().for_each(|(owner, _)| start[owner + 1] += 1);
        for owner in 0..owners {
            start[owner + 1] += start[owner];
        }
        let mut order = vec![0_usize; pairs.len()];
        let mut next = start.clone();
        for (at, (owner, _)) in pairs.iter().enumerate() {
            order[next[*owner]] = at;
            next[*owner] += 1;
        }
        Self { start, items: order.into_iter().map(|at| pairs[at].1).collect() }
    }
}

/// The structure of the normal equations of a problem; it stays the same while values change.
pub(super) struct Elimination {
    /// For each variable of the problem.
    pub(super) places: Vec<Place>,
    /// Variables of the reduced system, in its order.
    pub(super) reduced: Vec<usize>,
    pub(super) reduced_sizes: Vec<usize>,
    pub(super) eliminated: Vec<usize>,
    pub(super) eliminated_sizes: Vec<usize>,
    pub(super) incidences_of_reduced: Lists<Incidence>,
    pub(super) pairs_of_reduced: Lists<Pair>,
    pub(super) incidences_of_eliminated: Lists<Incidence>,
    pub(super) pairs_of_eliminated: Lists<Pair>,
    /// Edges of an eliminated variable: the reduced blocks it is tied to, ascending. An edge's number is its place in here.
    pub(super) edges: Lists<u32>,
    /// For each reduced block, its edges: eliminated variable and edge.
    pub(super) edges_of_reduced: Lists<(u32, u32)>,
    /// Eliminated variables whose products are made together.
    pub(super) panels: Panels,
    /// Where the numbers of each edge's block begin, and how many there are at the end.
    pub(super) edge_start: Vec<usize>,
}

/// A choice of what to eliminate, with the cost of it.
struct Candidate {
    eliminate: Vec<bool>,
    pattern: BlockPattern,
    blocks: Vec<usize>,
    ordering: Ordering,
    /// Eliminated variables whose products are made together.
    groups: Vec<Vec<usize>>,
    choice: Choice,
}

impl Elimination {
    /// Where the columns of a variable stand, by its place in a step: reduced blocks first, then eliminated variables.
    pub(super) fn incidences_of(&self, place: usize) -> &[Incidence] {
        match place.checked_sub(self.reduced.len()) {
            None => self.incidences_of_reduced.of(place),
            Some(eliminated) => self.incidences_of_eliminated.of(eliminated),
        }
    }

    /// Chooses what to eliminate, and makes the reduced system for it.
    ///
    /// # Errors
    /// [`Error::TooLarge`], and [`Error::Elimination`] where what the options ask for cannot go first.
    pub(super) fn new(
        problem: &Problem,
        options: &SolverOptions,
    ) -> Result<(Self, ReducedSystem, Plan), Error> {
        let mut best: Option<Candidate> = None;
        let mut plan = Plan::default();
        let mut choices = choices(problem);
        if options.eliminate != Eliminate::Cheapest {
            choices.retain(|choice| kind_of(problem, choice) == options.eliminate);
            if choices.is_empty() {
                return Err(Error::Elimination { asked: options.eliminate.name() });
            }
        }
        let pairs: Vec<f64> = choices.iter().map(|choice| pairs(problem, choice)).collect();
        let fewest = pairs.iter().copied().fold(f64::INFINITY, f64::min);
        for (choice, pairs) in choices.into_iter().zip(pairs) {
            if pairs > MOST_PAIRS && pairs > fewest {
                continue;
            }
            let Some(candidate) = Candidate::of(problem, choice, options.factorisation) else { continue };
            plan.choices.push(candidate.choice.clone());
            if best.as_ref().is_none_or(|best| candidate.choice.cost() < best.choice.cost()) {
                plan.taken = plan.choices.len() - 1;
                best = Some(candidate);
            }
        }
        let best = best.ok_or(Error::TooLarge { most: u32::MAX as usize, found: problem.len() })?;
        let blocks: Vec<usize> = best.ordering.order.iter().map(|block| best.blocks[*block]).collect();
        let sizes: Vec<usize> = blocks.iter().map(|variable| freedom(problem, *variable)).collect();
        let pattern = best.pattern.reordered(&best.ordering.order);
        let is_dense = best.choice.factorisation == Factorisation::Dense;
        let system = ReducedSystem::new(pattern, &sizes, is_dense)?;
        Ok((Self::of(problem, &best.eliminate, &best.groups, blocks, sizes), system, plan))
    }

    fn of(
        problem: &Problem,
        eliminate: &[bool],
        groups: &[Vec<usize>],
        reduced: Vec<usize>,
        reduced_sizes: Vec<usize>,
    ) -> Self {
        let eliminated: Vec<usize> =
            (0..problem.len()).filter(|v| eliminate[*v] && !problem.held[*v]).collect();
        let eliminated_sizes: Vec<usize> = eliminated.iter().map(|v| freedom(problem, *v)).collect();
        let mut places = vec![Place::Held; problem.len()];
        reduced.iter().enumerate().for_each(|(at, v)| places[*v] = Place::Reduced(at));
        eliminated.iter().enumerate().for_each(|(at, v)| places[*v] = Place::Eliminated(at));

        // Edges first: pairs name them.
        let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); eliminated.len()];
        for_each_factor(problem, |factor| {
            for first in factor {
                if let Place::Eliminated(at) = places[first.0] {
                    neighbours[at].extend(factor.iter().filter_map(|other| match places[other.0] {
                        Place::Reduced(block) => u32::try_from(block).ok(),
                        _ => None,
                    }));
                }
            }
        });
        let mut edges = Lists { start: vec![0], items: Vec::new() };
        for mut list in neighbours {
            list.sort_unstable();
            list.dedup();
            edges.items.append(&mut list);
            edges.start.push(edges.items.len());
        }
        let mut edge_start = Vec::with_capacity(edges.items.len() + 1);
        let mut by_block = Vec::with_capacity(edges.items.len());
        let mut numbers = 0;
        for (at, size) in eliminated_sizes.iter().enumerate() {
            for edge in edges.start[at]..edges.start[at + 1] {
                let block = edges.items[edge] as usize;
                edge_start.push(numbers);
                numbers += size * reduced_sizes[block];
                let name = |index: usize| u32::try_from(index).unwrap_or(u32::MAX);
                by_block.push((block, (name(at), name(edge))));
            }
        }
        edge_start.push(numbers);
        let place = |variable: &usize| match places[*variable] {
            Place::Eliminated(at) => u32::try_from(at).ok(),
            _ => None,
        };
        let groups = groups.iter().map(|group| group.iter().filter_map(place).collect()).collect();
        let panels = Panels::new(groups, &edges, &eliminated_sizes, &reduced_sizes);

        let (mut of_reduced, mut of_eliminated) = (Vec::new(), Vec::new());
        let (mut pairs_reduced, mut pairs_eliminated) = (Vec::new(), Vec::new());
        for_each_factor(problem, |factor| {
            for (variable, incidence) in factor {
                match places[*variable] {
                    Place::Held => {}
                    Place::Reduced(block) => {
                        of_reduced.push((block, *incidence));
                        for (other, other_incidence) in factor {
                            if let Place::Reduced(row) = places[*other]
                                && row > block
                            {
                                pairs_reduced.push((block, pair(incidence, other_incidence, row)));
                            }
                        }
                    }
                    Place::Eliminated(at) => {
                        of_eliminated.push((at, *incidence));
                        for (other, other_incidence) in factor {
                            if let Place::Reduced(block) = places[*other] {
                                let mine = edges.of(at);
                                let found = mine.partition_point(|edge| (*edge as usize) < block);
                                let edge = edges.start[at] + found;
                                pairs_eliminated.push((at, pair(incidence, other_incidence, edge)));
                            }
                        }
                    }
                }
            }
        });
        Self {
            incidences_of_reduced: Lists::gather(reduced.len(), &of_reduced),
            pairs_of_reduced: Lists::gather(reduced.len(), &pairs_reduced),
            incidences_of_eliminated: Lists::gather(eliminated.len(), &of_eliminated),
            pairs_of_eliminated: Lists::gather(eliminated.len(), &pairs_eliminated),
            edges_of_reduced: Lists::gather(reduced.len(), &by_block),
            panels,
            edges,
            edge_start,
            places,
            reduced,
            reduced_sizes,
            eliminated,
            eliminated_sizes,
        }
    }
}

fn pair(incidence: &Incidence, other: &Incidence, named: usize) -> Pair {
    Pair {
        incidence: *incidence,
        other_column: other.column,
        other: u32::try_from(named).unwrap_or(u32::MAX),
    }
}

fn freedom(problem: &Problem, variable: usize) -> usize {
    problem.spaces[problem.space_of[variable] as usize].freedom()
}

/// Calls with every factor: its variables, each with its columns.
pub(super) fn for_each_factor(problem: &Problem, mut each: impl FnMut(&[(usize, Incidence)])) {
    let mut factor = Vec::new();
    for layout in &problem.layout.batches {
        for (index, variables) in layout.variables.chunks_exact(layout.arity.max(1)).enumerate() {
            factor.clear();
            let mut column = 0;
            for variable in variables {
                // A factor has at most 8 rows and some variables of at most 6 columns.
                let small = |number: usize| u8::try_from(number).unwrap_or(u8::MAX);
                let incidence = Incidence {
                    jacobian: layout.jacobian_start + index * layout.rows * layout.columns,
                    residual: layout.residual_start + index * layout.rows,
                    rows: small(layout.rows),
                    columns: small(layout.columns),
                    column: small(column),
                };
                factor.push((variable.index(), incidence));
                column += problem.freedom(*variable);
            }
            each(&factor);
        }
    }
}

/// Sets of variables that may be eliminated: whole kinds, no two of which meet in a factor; and none.
fn choices(problem: &Problem) -> Vec<Vec<bool>> {
    let kinds = problem.spaces.len();
    // meets[a][b]: a factor has free variables of both kinds, or two of the one.
    let mut meets = vec![vec![false; kinds]; kinds];
    for layout in &problem.layout.batches {
        for variables in layout.variables.chunks_exact(layout.arity.max(1)) {
            for (at, a) in variables.iter().enumerate() {
                for b in &variables[at + 1..] {
                    if !problem.held[a.index()] && !problem.held[b.index()] {
                        let (a, b) =
                            (problem.space_of[a.index()] as usize, problem.space_of[b.index()] as usize);
                        meets[a][b] = true;
                        meets[b][a] = true;
                    }
                }
            }
        }
    }
    let mut sets: Vec<Vec<bool>> = vec![vec![false; kinds]];
    for first in (0..kinds).filter(|kind| !meets[*kind][*kind]) {
        let mut set = vec![false; kinds];
        set[first] = true;
        for other in (0..kinds).filter(|kind| !meets[*kind][*kind]) {
            set[other] |= (0..kinds).all(|kind| !set[kind] || !meets[kind][other]);
        }
        if !sets.contains(&set) {
            sets.push(set);
        }
    }
    let of_set = |set: Vec<bool>| problem.space_of.iter().map(|kind| set[*kind as usize]).collect();
    sets.into_iter().map(of_set).collect()
}

/// Sets of variables that do not meet in a factor: whole kinds.
pub(super) fn independent_sets(problem: &Problem) -> Vec<Vec<bool>> {
    choices(problem).into_iter().filter(|set| set.contains(&true)).collect()
}

/// Pairs of reduced blocks that a choice ties, counted as often as they are.
fn pairs(problem: &Problem, eliminate: &[bool]) -> f64 {
    let mut factors = vec![0_u32; problem.len()];
    for layout in &problem.layout.batches {
        layout.variables.iter().for_each(|variable| factors[variable.index()] += 1);
    }
    let count =
        |(factors, eliminate): (&u32, &bool)| if *eliminate { f64::from(*factors).powi(2) } else { 0.0 };
    factors.iter().zip(eliminate).map(count).sum::<f64>() / 2.0
}

/// What a choice is called.
fn kind_of(problem: &Problem, eliminate: &[bool]) -> Eliminate {
    let is_pose = |variable: usize| problem.spaces[problem.space_of[variable] as usize].is_pose();
    let mut chosen = (0..problem.len()).filter(|variable| eliminate[*variable]).peekable();
    match chosen.peek().copied() {
        None => Eliminate::Nothing,
        Some(_) if chosen.any(is_pose) => Eliminate::Poses,
        Some(_) => Eliminate::Landmarks,
    }
}

impl Candidate {
    fn of(problem: &Problem, eliminate: Vec<bool>, factorisation: Factorisation) -> Option<Self> {
        let blocks: Vec<usize> = (0..problem.len()).filter(|v| !eliminate[*v] && !problem.held[*v]).collect();
        let mut block_of = vec![usize::MAX; problem.len()];
        blocks.iter().enumerate().for_each(|(at, v)| block_of[*v] = at);
        let sizes: Vec<usize> = blocks.iter().map(|v| freedom(problem, *v)).collect();
        // Cliques: the reduced blocks around each eliminated variable, and those of factors without one.
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
        let mut cliques_of = vec![Vec::new(); blocks.len()];
        for (variable, clique) in around.iter_mut().enumerate() {
            clique.sort_unstable();
            clique.dedup();
            clique.iter().for_each(|block| cliques_of[*block as usize].push(variable));
        }
        // Poses are alike when they follow each other, landmarks when the same frames see them.
        let mut order: Vec<usize> =
            (0..problem.len()).filter(|v| eliminate[*v] && !around[*v].is_empty()).collect();
        if kind_of(problem, &eliminate) != Eliminate::Poses {
            order.sort_by_key(|v| (around[*v][0], around[*v][around[*v].len() - 1], *v));
        }
        let (groups, large, small) = groups(&order, |v| &around[v], |v| freedom(problem, v), &sizes);
        let pattern = BlockPattern::of(blocks.len(), |column, add| {
            direct[column].iter().for_each(|row| add(*row as usize));
            for clique in &cliques_of[column] {
                let clique = &around[*clique];
                let from = clique.partition_point(|row| (*row as usize) <= column);
                clique[from..].iter().for_each(|row| add(*row as usize));
            }
        });
        let ordering = pattern.ordering(&sizes)?;
        let rows: usize = sizes.iter().sum();
        let has_leaves = !eliminate.contains(&true);
        let slower = if has_leaves { SPARSE_LEAVES } else { SPARSE };
        let [dense, sparse] = [(rows as f64).powi(3) / 6.0, slower * ordering.sparse];
        let is_dense = match factorisation {
            Factorisation::Cheapest => rows <= ALWAYS_DENSE || dense < sparse,
            Factorisation::Dense => true,
            Factorisation::Sparse => false,
        };
        let choice = Choice {
            eliminate: kind_of(problem, &eliminate),
            eliminated: (0..problem.len()).filter(|v| eliminate[*v] && !problem.held[*v]).count(),
            reduced: rows,
            factorisation: if is_dense { Factorisation::Dense } else { Factorisation::Sparse },
            elimination_cost: large + SMALL_BLOCKS * small,
            factorisation_cost: if is_dense { dense } else { sparse },
        };
        Some(Self { eliminate, pattern, blocks, ordering, groups, choice })
    }
}
