//! The essential matrices of two views from five points.

use nalgebra::linalg::Schur;
use nalgebra::{DMatrix, Matrix3, SMatrix, SVector, Vector3};

/// Newton steps on the ten equations, which take off the rounding of the eigenvalues.
const STEPS: usize = 4;

/// Exponents of x, y, z in the order in which equations are eliminated: the ten of degree three, then the basis.
const MONOMIALS: [[usize; 3]; 20] = [
    [3, 0, 0],
    [2, 1, 0],
    [1, 2, 0],
    [0, 3, 0],
    [2, 0, 1],
    [1, 1, 1],
    [0, 2, 1],
    [1, 0, 2],
    [0, 1, 2],
    [0, 0, 3],
    [2, 0, 0],
    [1, 1, 0],
    [0, 2, 0],
    [1, 0, 1],
    [0, 1, 1],
    [0, 0, 2],
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
    [0, 0, 0],
];

/// Place of a monomial by its exponents in base four.
const PLACES: [usize; 64] = {
    let mut places = [20; 64];
    let mut k = 0;
    while k < 20 {
        let [x, y, z] = MONOMIALS[k];
        places[16 * x + 4 * y + z] = k;
        k += 1;
    }
    places
};

/// A polynomial in x, y, z of degree three at most.
#[derive(Clone, Copy)]
struct Polynomial([f64; 20]);

impl Polynomial {
    const ZERO: Self = Self([0.0; 20]);

    fn plus(mut self, other: &Self, factor: f64) -> Self {
        for (mine, theirs) in self.0.iter_mut().zip(&other.0) {
            *mine += factor * theirs;
        }
        self
    }

    /// The product; the degrees must not add up to more than three.
    fn times(&self, other: &Self) -> Self {
        let mut product = Self::ZERO;
        for (a, mine) in self.0.iter().enumerate().filter(|(_, mine)| **mine != 0.0) {
            for (b, theirs) in other.0.iter().enumerate().filter(|(_, theirs)| **theirs != 0.0) {
                let [x, y, z] = [0, 1, 2].map(|axis| MONOMIALS[a][axis] + MONOMIALS[b][axis]);
                product.0[PLACES[16 * x + 4 * y + z]] += mine * theirs;
            }
        }
        product
    }
}

/// All essential matrices `E` with `bᵢᵀ E aᵢ = 0` for five pairs of directions: none to ten, each of norm one.
///
/// `E` lies in the null space of the five equations, `E = x E₁ + y E₂ + z E₃ + E₄`; `det E = 0` and `2 E Eᵀ E − tr(E Eᵀ) E = 0` are ten
/// cubics in x, y, z, whose solutions are eigenvectors of the matrix of multiplication by x. Points in one plane are no obstacle.
///
/// * `first`, `second` — directions of the points in the two cameras, of any length.
///
/// # Source
/// Nistér 2004 for the problem; Stewénius, Engels, Nistér 2006 for the solution by an action matrix.
pub(super) fn five_points(first: &[Vector3<f64>; 5], second: &[Vector3<f64>; 5]) -> Vec<Matrix3<f64>> {
    let mut equations = SMatrix::<f64, 9, 9>::zeros();
    for (row, (a, b)) in first.iter().zip(second).enumerate() {
        for i in 0..3 {
            for j in 0..3 {
                equations[(row, 3 * i + j)] = b[i] * a[j];
            }
        }
    }
    if !equations.iter().all(|entry| entry.is_finite()) {
        return Vec::new();
    }
    let Some(svd) = equations.try_svd(false, true, f64::EPSILON, 1000) else { return Vec::new() };
    let Some(v_t) = svd.v_t else { return Vec::new() };
    let mut order = [0, 1, 2, 3, 4, 5, 6, 7, 8];
    order.sort_by(|a, b| svd.singular_values[*a].total_cmp(&svd.singular_values[*b]));
    let basis = [0, 1, 2, 3].map(|k| {
        let row = v_t.row(order[k]);
        Matrix3::from_fn(|i, j| row[3 * i + j])
    });
    let cubics = cubics(&basis);
    let (high, low) = (cubics.fixed_view::<10, 10>(0, 0), cubics.fixed_view::<10, 10>(0, 10));
    let Some(solved) =
        DMatrix::from_fn(10, 10, |r, c| high[(r, c)])
            .lu()
            .solve(&DMatrix::from_fn(10, 10, |r, c| low[(r, c)]))
    else {
        return Vec::new();
    };
    // x times x², xy, y², xz, yz, z² are cubics; x times x, y, z, 1 are in the basis.
    let mut action = DMatrix::<f64>::zeros(10, 10);
    for (row, cubic) in [0, 1, 2, 4, 5, 7].into_iter().enumerate() {
        action.set_row(row, &(-solved.row(cubic)));
    }
    for (row, column) in [(6, 0), (7, 1), (8, 3), (9, 6)] {
        action[(row, column)] = 1.0;
    }
    if !action.iter().all(|entry| entry.is_finite()) {
        return Vec::new();
    }
    let Some(schur) = Schur::try_new(action.clone(), f64::EPSILON, 1000) else { return Vec::new() };
    let mut found = Vec::new();
    for value in schur.complex_eigenvalues().iter() {
        if value.im.abs() > 1e-6 * (1.0 + value.re.abs()) {
            continue;
        }
        let Some([y, z]) = eigenvector(&action, value.re) else { continue };
        let (place, error) = polished(&cubics, [value.re, y, z]);
        let matrix = basis[0] * place[0] + basis[1] * place[1] + basis[2] * place[2] + basis[3];
        let norm = matrix.norm();
        if norm.is_finite() && norm > 0.0 && error < 1e-8 * (1.0 + norm.powi(3)) {
            found.push(matrix / norm);
        }
    }
    found
}

/// The ten cubics, a row each.
fn cubics(basis: &[Matrix3<f64>; 4]) -> SMatrix<f64, 10, 20> {
    let entry = |i: usize, j: usize| {
        let mut entry = Polynomial::ZERO;
        for (matrix, place) in basis.iter().zip([16, 17, 18, 19]) {
            entry.0[place] = matrix[(i, j)];
        }
        entry
    };
    let e = [0, 1, 2].map(|i| [0, 1, 2].map(|j| entry(i, j)));
    let minor = |a: usize, b: usize| e[1][a].times(&e[2][b]).plus(&e[1][b].times(&e[2][a]), -1.0);
    let determinant = e[0][0]
        .times(&minor(1, 2))
        .plus(&e[0][1].times(&minor(0, 2)), -1.0)
        .plus(&e[0][2].times(&minor(0, 1)), 1.0);
    let mut square = [[Polynomial::ZERO; 3]; 3];
    for (i, row) in square.iter_mut().enumerate() {
        for (j, entry) in row.iter_mut().enumerate() {
            for (mine, theirs) in e[i].iter().zip(&e[j]) {
                *entry = entry.plus(&mine.times(theirs), 1.0);
            }
        }
    }
    let trace = square[0][0].plus(&square[1][1], 1.0).plus(&square[2][2], 1.0);
    let mut rows = SMatrix::<f64, 10, 20>::zeros();
    let mut put = |row: usize, polynomial: &Polynomial| {
        for (column, factor) in polynomial.0.iter().enumerate() {
            rows[(row, column)] = *factor;
        }
    };
    put(9, &determinant);
    for (i, row) in e.iter().enumerate() {
        for (j, entry) in row.iter().enumerate() {
            let mut sum = Polynomial::ZERO.plus(&trace.times(entry), -1.0);
            for (in_square, below) in square[i].iter().zip(&e) {
                sum = sum.plus(&in_square.times(&below[j]), 2.0);
            }
            put(3 * i + j, &sum);
        }
    }
    rows
}

/// y and z that go with an eigenvalue x: inverse iteration.
fn eigenvector(action: &DMatrix<f64>, value: f64) -> Option<[f64; 2]> {
    let shift = value + 1e-9 * (1.0 + value.abs());
    let factor = (action - DMatrix::identity(10, 10) * shift).lu();
    let mut vector = nalgebra::DVector::from_element(10, 1.0);
    for _ in 0..3 {
        vector = factor.solve(&vector)?;
        vector /= vector.amax();
    }
    let one = vector[9];
    let place = [vector[7] / one, vector[8] / one];
    place.iter().all(|number| number.is_finite()).then_some(place)
}

/// x, y, z after Gauss-Newton on the cubics, and what is left of them.
fn polished(cubics: &SMatrix<f64, 10, 20>, start: [f64; 3]) -> ([f64; 3], f64) {
    let powers = |place: &[f64; 3], exponents: &[usize; 3]| -> f64 {
        (0..3).map(|axis| (0..exponents[axis]).map(|_| place[axis]).product::<f64>()).product()
    };
    let values = |place: &[f64; 3]| {
        let monomials = SVector::<f64, 20>::from_fn(|k, _| powers(place, &MONOMIALS[k]));
        cubics * monomials
    };
    let (mut place, mut left) = (start, values(&start).norm());
    for _ in 0..STEPS {
        let slopes = SMatrix::<f64, 20, 3>::from_fn(|k, axis| {
            let mut exponents = MONOMIALS[k];
            if exponents[axis] == 0 {
                return 0.0;
            }
            let factor = exponents[axis] as f64;
            exponents[axis] -= 1;
            factor * powers(&place, &exponents)
        });
        let jacobian = cubics * slopes;
        let Some(factor) = (jacobian.transpose() * jacobian).cholesky() else { break };
        let step = factor.solve(&(jacobian.transpose() * values(&place)));
        let next = [place[0] - step[0], place[1] - step[1], place[2] - step[2]];
        let there = values(&next).norm();
        if there.is_nan() || there >= left {
            break;
        }
        (place, left) = (next, there);
    }
    (place, left)
}
