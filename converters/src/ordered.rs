//! Work on threads whose results come in order.

/// Makes items on threads and hands them over in order.
///
/// # Errors
/// The first of `take`.
pub fn ordered<T: Send, E>(
    count: usize,
    threads: usize,
    _window: usize,
    make: impl Fn(usize) -> T + Sync,
    mut take: impl FnMut(usize, T) -> Result<(), E>,
) -> Result<(), E> {
    use rayon::prelude::*;
    for begin in (0..count).step_by(threads.max(1) * 4) {
        let made: Vec<T> =
            (begin..(begin + threads.max(1) * 4).min(count)).into_par_iter().map(&make).collect();
        for (index, item) in (begin..).zip(made) {
            take(index, item)?;
        }
    }
    Ok(())
}
