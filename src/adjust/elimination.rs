//! Which variables are eliminated first, and which factors touch which variable.

use super::error::Error;
use super::minimise::SolverOptions;
use super::panels::Panels;
use super::plan::{Eliminate, Plan};
use super::problem::Problem;
use super::reduced_system::ReducedSystem;
use super::weighing::{Candidate, Outline, weigh};
use rayon::prelude::*;

/// Pairs of blocks above which an elimination is not looked at, unless there is no better one.
const MOST_PAIRS: f64 = 2e8;

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

impl Elimination {
    /// Where the columns of a variable stand, by its place in a step: reduced blocks first, then eliminated variables.
    pub(super) fn incidences_of(&self, place: usize) -> &[Incidence] {
        match place.checked_sub(self.reduced.len()) {
            None => self.incidences_of_reduced.of(place),
            Some(eliminated) => self.incidences_of_eliminated.of(eliminated),
        }
    }

    /// Where the numbers of an edge's block stand among those of all.
    pub(super) fn numbers_of(&self, edge: usize) -> std::ops::Range<usize> {
        self.edge_start[edge]..self.edge_start[edge + 1]
    }

    /// Where the numbers of an eliminated variable's first edge begin.
    pub(super) fn first_tie(&self, at: usize) -> usize {
        self.edge_start[self.edges.start[at]]
    }

    /// Chooses what to eliminate, and makes the reduced system for it.
    ///
    /// # Errors
    /// [`Error::TooLarge`], and [`Error::Elimination`] where what the options ask for cannot go first.
    pub(super) fn new(
        problem: &Problem,
        options: &SolverOptions,
    ) -> Result<(Self, ReducedSystem, Plan), Error> {
        let mut choices = choices(problem);
        if options.eliminate != Eliminate::Cheapest {
            choices.retain(|choice| kind_of(problem, choice) == options.eliminate);
            if choices.is_empty() {
                return Err(Error::Elimination { asked: options.eliminate.name() });
            }
        }
        let pairs = |choice: &Vec<bool>| pairs(problem, choice);
        let eliminations = choices.iter().filter(|choice| choice.contains(&true));
        let fewest = eliminations.map(pairs).fold(f64::INFINITY, f64::min);
        choices.retain(|choice| pairs(choice) <= fewest.max(MOST_PAIRS));
        let outlines: Vec<Outline> =
            choices.into_par_iter().map(|choice| Outline::of(problem, choice)).collect();
        let (best, plan) = weigh(problem, outlines, options.factorisation)
            .ok_or(Error::TooLarge { most: u32::MAX as usize, found: problem.len() })?;
        let Candidate { outline, ordering, pattern, .. } = best;
        let reduced: Vec<usize> = ordering.order.iter().map(|block| outline.blocks[*block]).collect();
        let sizes: Vec<usize> = reduced.iter().map(|variable| freedom(problem, *variable)).collect();
        let factorisation = plan.choice().factorisation;
        let (system, structure) = rayon::join(
            || ReducedSystem::new(pattern.reordered(&ordering.order), &sizes, factorisation),
            || Self::of(problem, &outline.eliminate, &outline.groups, reduced, sizes.clone()),
        );
        Ok((structure, system?, plan))
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

pub(super) fn freedom(problem: &Problem, variable: usize) -> usize {
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

/// Part of a kind that is independent at least, where not all of it is.
const MOST_OF_A_KIND: f64 = 0.75;

/// Sets of variables that may be eliminated, no two of which meet in a factor: whole kinds, most of a kind, and none.
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
    let of_most = (0..kinds).filter(|kind| meets[*kind][*kind]).filter_map(|kind| most_of(problem, kind));
    sets.into_iter().map(of_set).chain(of_most).collect()
}

/// Variables of a kind of which few meet others of it, as poses do where motion carries some: those of them that do not meet, as many as
/// are found by beginning with those that meet the fewest. `None` where that leaves too many.
fn most_of(problem: &Problem, kind: usize) -> Option<Vec<bool>> {
    let is_of_kind = |variable: usize| !problem.held[variable] && problem.space_of[variable] as usize == kind;
    let mut met: Vec<Vec<usize>> = vec![Vec::new(); problem.len()];
    for layout in &problem.layout.batches {
        for variables in layout.variables.chunks_exact(layout.arity.max(1)) {
            for (at, a) in variables.iter().enumerate().filter(|(_, a)| is_of_kind(a.index())) {
                for b in variables[at + 1..].iter().filter(|b| is_of_kind(b.index())) {
                    met[a.index()].push(b.index());
                    met[b.index()].push(a.index());
                }
            }
        }
    }
    let mut order: Vec<usize> = (0..problem.len()).filter(|variable| is_of_kind(*variable)).collect();
    order.sort_by_key(|variable| met[*variable].len());
    let (mut set, mut count) = (vec![false; problem.len()], 0);
    for variable in &order {
        set[*variable] = met[*variable].iter().all(|other| !set[*other]);
        count += usize::from(set[*variable]);
    }
    (count as f64 >= MOST_OF_A_KIND * order.len() as f64).then_some(set)
}

/// Sets of variables that do not meet in a factor: whole kinds, or most of one.
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
pub(super) fn kind_of(problem: &Problem, eliminate: &[bool]) -> Eliminate {
    let is_pose = |variable: usize| problem.spaces[problem.space_of[variable] as usize].is_pose();
    let mut chosen = (0..problem.len()).filter(|variable| eliminate[*variable]).peekable();
    match chosen.peek().copied() {
        None => Eliminate::Nothing,
        Some(_) if chosen.any(is_pose) => Eliminate::Poses,
        Some(_) => Eliminate::Landmarks,
    }
}
