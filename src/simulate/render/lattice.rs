//! Numbers that belong to places: the randomness of painted surfaces.

use crate::simulate::Random;

const SIZE: usize = 4096;

/// A random number for each place of an endless integer grid, the same whenever it is asked for.
#[derive(Clone, Debug)]
pub(super) struct Lattice {
    table: Vec<u32>,
}

impl Lattice {
    pub(super) fn new(seed: u64) -> Self {
        let mut random = Random::new(seed, "texture", 0);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to below 2³²")]
        let table = (0..SIZE).map(|_| (random.uniform() * 4_294_967_296.0) as u32).collect();
        Self { table }
    }

    /// The number of a place: numbers are looked up one after the other, each moved by what was found before.
    pub(super) fn hash(&self, place: &[i64]) -> u32 {
        place.iter().fold(0x9e37_79b9, |found, number| {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "all bits are mixed below"
            )]
            let bits = (*number as u32) ^ ((*number >> 32) as u32).rotate_left(7);
            let mixed = (found ^ bits).wrapping_mul(0x85eb_ca6b);
            let mixed = mixed ^ (mixed >> 15);
            found.rotate_left(5).wrapping_add(mixed) ^ self.table[mixed as usize % SIZE]
        })
    }

    /// A number from 0 to below 1 of a place.
    pub(super) fn uniform(&self, place: &[i64]) -> f64 {
        f64::from(self.hash(place)) / 4_294_967_296.0
    }

    /// Smooth noise from −1 to 1 with a bump about every unit.
    pub(super) fn noise(&self, [s, t]: [f64; 2], key: i64) -> f64 {
        let (i, j) = (floor(s), floor(t));
        let (a, b) = (smooth(s - s.floor()), smooth(t - t.floor()));
        let corner = |di, dj| self.uniform(&[key, i + di, j + dj]);
        let upper = corner(0, 0) * (1.0 - a) + corner(1, 0) * a;
        let lower = corner(0, 1) * (1.0 - a) + corner(1, 1) * a;
        2.0 * (upper * (1.0 - b) + lower * b) - 1.0
    }
}

/// The whole number below.
pub(super) fn floor(value: f64) -> i64 {
    #[expect(clippy::cast_possible_truncation, reason = "saturates far outside every scene")]
    let whole = value.floor() as i64;
    // Room for neighbours.
    whole.clamp(-(1 << 60), 1 << 60)
}

/// From 0 to 1 with level ends: `6 x⁵ − 15 x⁴ + 10 x³`.
fn smooth(x: f64) -> f64 {
    x * x * x * (x * (x * 6.0 - 15.0) + 10.0)
}
