//! Products of small matrices, unrolled where they are called.

use nalgebra::SMatrix;

/// `A B`.
///
/// Nalgebra's operator goes by way of BLAS's shape, a call for each column of each factor, which for three or
/// four rows takes longer than the product. Terms are summed in the same order, so every bit is the same.
#[inline(always)]
#[expect(
    clippy::inline_always,
    reason = "the sizes are known where it is called, and unroll the loops there"
)]
#[expect(clippy::needless_range_loop, reason = "iterators over both are calls where they are not inlined")]
pub(crate) fn product<const M: usize, const K: usize, const N: usize>(
    left: &SMatrix<f64, M, K>,
    right: &SMatrix<f64, K, N>,
) -> SMatrix<f64, M, N> {
    let mut product = SMatrix::<f64, M, N>::zeros();
    for column in 0..N {
        let (sums, factors) = (&mut product.data.0[column], &right.data.0[column]);
        for k in 0..K {
            for row in 0..M {
                let term = left.data.0[k][row] * factors[k];
                sums[row] = if k == 0 { term } else { term + sums[row] };
            }
        }
    }
    product
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_bit_is_that_of_the_operator(
            left in prop::array::uniform12(-1e3..1e3_f64), right in prop::array::uniform24(-1e3..1e3_f64),
        ) {
            let (left, right) = (SMatrix::<f64, 3, 4>::from_row_slice(&left), SMatrix::<f64, 4, 6>::from_row_slice(&right));
            let bits = |matrix: SMatrix<f64, 3, 6>| matrix.map(f64::to_bits);
            prop_assert_eq!(bits(product(&left, &right)), bits(left * right));
        }
    }

    #[test]
    fn the_sign_of_zero_stays() {
        let (left, right) = (SMatrix::<f64, 2, 1>::new(-0.0, 1.0), SMatrix::<f64, 1, 2>::new(2.0, -0.0));
        assert_eq!(product(&left, &right).map(f64::to_bits), (left * right).map(f64::to_bits));
    }
}
