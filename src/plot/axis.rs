//! An axis of a chart: from numbers to places, with round ticks.

/// What is nearer to zero than this is drawn there.
const LEAST_NUMBER: f64 = 1e-280;

/// Where the numbers of a chart lie along one of its sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axis {
    low: f64,
    high: f64,
    logarithmic: bool,
}

/// A tick: its number and how it is written.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    pub(super) number: f64,
    pub(super) words: String,
}

impl Axis {
    /// An axis from one number to another; widened where both are the same.
    pub(super) fn linear(low: f64, high: f64) -> Self {
        let (low, high) = if low.is_finite() && high.is_finite() { (low, high) } else { (0.0, 1.0) };
        // So near to zero, steps between numbers are no longer numbers.
        let [low, high] = [low, high].map(|number| if number.abs() < LEAST_NUMBER { 0.0 } else { number });
        let wide = (high - low).is_finite() && high - low > 1e-12 * low.abs().max(high.abs());
        let half = if low == 0.0 && high == 0.0 { 0.5 } else { 0.5 * low.abs().max(high.abs()) };
        let (low, high) = if wide { (low, high) } else { (low - half, high + half) };
        // Numbers that are too large to be subtracted are not drawn truly.
        if (high - low).is_finite() {
            Self { low, high, logarithmic: false }
        } else {
            Self { low: -1.0, high: 1.0, logarithmic: false }
        }
    }

    /// An axis from 0 to the first tick that is not under a number.
    pub(super) fn from_zero(most: f64) -> Self {
        let most = if most.is_finite() && most > 1e-300 { most.min(1e300) } else { 1.0 };
        let step = round_step(most / 6.0);
        Self { low: 0.0, high: step * (most / step * (1.0 - 1e-12)).ceil(), logarithmic: false }
    }

    /// An axis over powers of ten; both numbers larger than 0.
    pub(super) fn logarithmic(low: f64, high: f64) -> Self {
        let sound = |number: f64| if number.is_finite() { number.clamp(1e-300, 1e300) } else { 1.0 };
        let (low, high) = (libm::log10(sound(low)), libm::log10(sound(high)));
        let (low, high) = if high - low > 1e-3 { (low, high) } else { (low - 0.5, high + 0.5) };
        Self { low, high, logarithmic: true }
    }

    /// The numbers at both ends; exponents where the axis is over powers of ten.
    pub(super) fn ends(&self) -> [f64; 2] {
        [self.low, self.high]
    }

    /// The axis with some room at both ends.
    pub(super) fn with_room(self, part: f64) -> Self {
        let room = (self.high - self.low) * part;
        Self { low: self.low - room, high: self.high + room, ..self }
    }

    /// Where a number lies: 0 at the begin and 1 at the end of the axis; `None` for what has no place on it.
    pub(super) fn place(&self, number: f64) -> Option<f64> {
        let number = if self.logarithmic {
            if number <= 0.0 {
                return None;
            }
            libm::log10(number)
        } else {
            number
        };
        let place = (number - self.low) / (self.high - self.low);
        (place.is_finite() && place.abs() < 1e3).then_some(place)
    }

    /// Round numbers along the axis, about five.
    pub(super) fn ticks(&self) -> Vec<Tick> {
        self.ticks_about(6.0)
    }

    /// Round numbers along the axis, which part it into at most so many parts, or twice as many over a few powers of ten.
    pub(super) fn ticks_about(&self, parts: f64) -> Vec<Tick> {
        if self.logarithmic { self.powers(parts) } else { linear_ticks(self.low, self.high, parts) }
    }

    /// The whole multiples of powers of ten between the ticks of a logarithmic axis over a few powers.
    pub(super) fn minor_ticks(&self) -> Vec<f64> {
        if !self.logarithmic || !(0.7..=6.0).contains(&(self.high - self.low)) {
            return Vec::new();
        }
        let (mut exponent, mut ticks) = (self.low.floor(), Vec::new());
        while exponent <= self.high {
            ticks.extend((2..10).map(|part| f64::from(part) * libm::pow(10.0, exponent)));
            exponent += 1.0;
        }
        ticks
    }

    fn powers(&self, about: f64) -> Vec<Tick> {
        let decades = self.high - self.low;
        if decades < 0.7 {
            let bound = |exponent: f64| libm::pow(10.0, exponent);
            let mut ticks = linear_ticks(bound(self.low), bound(self.high), about);
            ticks.retain(|tick| tick.number > 0.0);
            return ticks;
        }
        let every = (decades / about).ceil().max(1.0);
        let parts: &[f64] = if decades < 2.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let mut ticks = Vec::new();
        let mut exponent = (self.low / every).floor() * every;
        while exponent <= self.high {
            for part in parts {
                let number = part * libm::pow(10.0, exponent);
                if self.place(number).is_some_and(|place| (-1e-9..=1.0 + 1e-9).contains(&place)) {
                    ticks.push(Tick { number, words: written(number, number) });
                }
            }
            exponent += every;
        }
        ticks
    }
}

fn linear_ticks(low: f64, high: f64, parts: f64) -> Vec<Tick> {
    let step = round_step((high - low) / parts);
    let first = (low / step - 1e-9).ceil();
    (0..12)
        .map(|index| (first + f64::from(index)) * step)
        .take_while(|number| *number <= high + 1e-9 * step)
        // Not −0, nor the rounding of a difference.
        .map(|number| if number.abs() < 1e-9 * step { 0.0 } else { number })
        .map(|number| Tick { number, words: written(number, step) })
        .collect()
}

/// 1, 2 or 5 times a power of ten, the nearest that is not smaller.
fn round_step(least: f64) -> f64 {
    let power = libm::pow(10.0, libm::floor(libm::log10(least.max(1e-300))));
    let parts = [1.0, 2.0, 5.0, 10.0];
    parts.into_iter().map(|part| part * power).find(|step| *step >= least * (1.0 - 1e-9)).unwrap_or(power)
}

/// A number with as many digits as its step needs.
fn written(number: f64, step: f64) -> String {
    let largest = number.abs().max(step.abs());
    if number == 0.0 {
        return "0".to_owned();
    }
    if !(1e-3..1e5).contains(&largest) {
        let exponent = libm::floor(libm::log10(number.abs()) + 1e-9);
        let mantissa = number / libm::pow(10.0, exponent);
        let power = format!("10{}", superscript(exponent));
        // What remains of the step decides about the digits of the mantissa.
        let decimals = decimals(step / libm::pow(10.0, exponent));
        return if (mantissa - 1.0).abs() < 1e-9 { power } else { format!("{mantissa:.decimals$}·{power}") };
    }
    format!("{number:.0$}", decimals(step))
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped before")]
fn decimals(step: f64) -> usize {
    (-libm::floor(libm::log10(step.abs().max(1e-12)) + 1e-9)).clamp(0.0, 9.0) as usize
}

fn superscript(exponent: f64) -> String {
    let digit = |character: char| match character {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32('⁰' as u32 + (digit as u32 - '0' as u32)).unwrap_or(digit),
    };
    format!("{exponent:.0}").chars().map(digit).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn words(axis: Axis) -> Vec<String> {
        axis.ticks().into_iter().map(|tick| tick.words).collect()
    }

    #[test]
    fn ticks_are_round_numbers_with_the_digits_they_need() {
        assert_eq!(words(Axis::from_zero(1.0)), ["0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(words(Axis::from_zero(447.0)), ["0", "100", "200", "300", "400", "500"]);
        assert_eq!(words(Axis::linear(-0.03, 0.021)), ["-0.03", "-0.02", "-0.01", "0", "0.01", "0.02"]);
        assert_eq!(words(Axis::logarithmic(1e-3, 1e4)), ["0.01", "1", "100", "10000"]);
        assert_eq!(words(Axis::logarithmic(3.0, 70.0)), ["5", "10", "20", "50"]);
        assert_eq!(words(Axis::logarithmic(1e4, 1e8)), ["10000", "10⁵", "10⁶", "10⁷", "10⁸"]);
        assert_eq!(words(Axis::linear(0.0, 2.5e6)), ["0", "5·10⁵", "10⁶", "1.5·10⁶", "2.0·10⁶", "2.5·10⁶"]);
    }

    proptest! {
        #[test]
        fn any_numbers_have_an_axis_with_few_ticks_on_it(low in any::<f64>(), high in any::<f64>()) {
            for axis in [Axis::linear(low.min(high), high.max(low)), Axis::from_zero(high), Axis::logarithmic(low, high)] {
                let ticks = axis.ticks();
                prop_assert!(ticks.len() <= 14, "{axis:?}: {ticks:?}");
                for tick in ticks {
                    let place = axis.place(tick.number).unwrap_or(f64::NAN);
                    prop_assert!((-1e-6..=1.000_001).contains(&place), "{axis:?}: {tick:?}");
                    prop_assert!(tick.words.chars().count() < 16, "{axis:?}: {tick:?}");
                }
            }
        }

        #[test]
        fn ordinary_numbers_have_two_ticks_at_least(low in 1e-4..1e6_f64, wide in 1.1..1e5_f64) {
            for axis in [Axis::linear(low, low * wide), Axis::from_zero(low), Axis::logarithmic(low, low * wide)] {
                prop_assert!(axis.ticks().len() >= 2, "{axis:?}: {:?}", axis.ticks());
            }
        }
    }
}
