//! Whether a symmetric matrix has no negative eigenvalue.

/// Rounding that the smallest pivot of a matrix may show, relative to the largest entry.
const PIVOT_TOLERANCE: f64 = 1e-9;

/// Whether a symmetric matrix, given by the rows of its upper triangle, has no negative eigenvalue.
///
/// Eliminates with the largest diagonal entry first: of a semi-definite matrix no pivot is negative, and where
/// the largest one is zero nothing is left.
pub(super) fn is_positive(upper: &[f64], dimension: usize) -> bool {
    let mut matrix = vec![0.0; dimension * dimension];
    let mut numbers = upper.iter();
    for row in 0..dimension {
        for column in row..dimension {
            let number = numbers.next().copied().unwrap_or(0.0);
            matrix[row * dimension + column] = number;
            matrix[column * dimension + row] = number;
        }
    }
    let largest = upper.iter().fold(0.0_f64, |largest, number| largest.max(number.abs()));
    if largest == 0.0 {
        return true;
    }
    for entry in &mut matrix {
        *entry /= largest;
    }
    let mut left: Vec<usize> = (0..dimension).collect();
    while let Some(place) = (0..left.len())
        .max_by(|a, b| matrix[left[*a] * (dimension + 1)].total_cmp(&matrix[left[*b] * (dimension + 1)]))
    {
        let pivot = left.swap_remove(place);
        let diagonal = matrix[pivot * (dimension + 1)];
        if diagonal <= PIVOT_TOLERANCE {
            // Nothing larger is left on the diagonal, so nothing may be left at all.
            return diagonal >= -PIVOT_TOLERANCE
                && left.iter().all(|row| {
                    matrix[row * (dimension + 1)] >= -PIVOT_TOLERANCE
                        && matrix[row * dimension + pivot].abs() <= PIVOT_TOLERANCE.sqrt()
                })
                && left.iter().all(|row| {
                    left.iter().all(|column| matrix[row * dimension + column].abs() <= PIVOT_TOLERANCE.sqrt())
                });
        }
        for row in &left {
            let factor = matrix[row * dimension + pivot] / diagonal;
            for column in &left {
                matrix[row * dimension + column] -= factor * matrix[pivot * dimension + column];
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn semi_definite_matrices_are_told_from_others() {
        assert!(is_positive(&[1.0, 0.0, 1.0], 2));
        assert!(is_positive(&[1e-12, 0.0, 1e12], 2));
        assert!(is_positive(&[4.0, 2.0, 1.0], 2), "rank one");
        assert!(is_positive(&[0.0, 0.0, 0.0], 2));
        assert!(is_positive(&[0.0, 0.0, 5.0], 2));
        assert!(is_positive(&[2.0, -1.0, 0.0, 2.0, -1.0, 2.0], 3));
        assert!(!is_positive(&[1.0, 2.0, 1.0], 2));
        assert!(!is_positive(&[0.0, 1.0, 0.0], 2));
        assert!(!is_positive(&[-1.0], 1));
        assert!(!is_positive(&[1.0, 0.0, 0.0, 1.0, 0.0, -1e-3], 3));
    }
}
