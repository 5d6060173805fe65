//! Colours for numbers from small to large, told apart with any kind of sight and in grey.

/// Colours from dark blue to yellow, evenly spaced (viridis: Smith and van der Walt 2015, public domain).
const STOPS: [[f64; 3]; 9] = [
    [68.0, 1.0, 84.0],
    [71.0, 44.0, 122.0],
    [59.0, 81.0, 139.0],
    [44.0, 113.0, 142.0],
    [33.0, 144.0, 141.0],
    [39.0, 173.0, 129.0],
    [92.0, 200.0, 99.0],
    [170.0, 220.0, 50.0],
    [253.0, 231.0, 37.0],
];

/// How many colours are told apart; strokes of one colour are one element.
pub(super) const SHADES: usize = 48;

/// Which of the shades a part in `[0, 1]` has.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped before")]
pub(super) fn shade(part: f64) -> usize {
    ((part.clamp(0.0, 1.0) * SHADES as f64) as usize).min(SHADES - 1)
}

/// The colour of a shade: `#rrggbb`.
pub(super) fn colour(shade: usize) -> String {
    let place = (shade as f64 + 0.5) / SHADES as f64 * (STOPS.len() - 1) as f64;
    let before = (0..STOPS.len() - 1).rev().find(|stop| *stop as f64 <= place).unwrap_or(0);
    let part = place - before as f64;
    let channel = |index: usize| STOPS[before][index] * (1.0 - part) + STOPS[before + 1][index] * part;
    format!("#{}", [0, 1, 2].map(|index| format!("{:02x}", byte(channel(index)))).concat())
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped before")]
fn byte(channel: f64) -> u8 {
    channel.round().clamp(0.0, 255.0) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shades_grow_lighter() {
        let light = |shade: usize| {
            let text = colour(shade);
            let channel = |at: usize| f64::from(u8::from_str_radix(&text[at..at + 2], 16).unwrap());
            0.2126 * channel(1) + 0.7152 * channel(3) + 0.0722 * channel(5)
        };
        assert!((1..SHADES).all(|shade| light(shade) > light(shade - 1)));
        assert_eq!((shade(-1.0), shade(0.0), shade(1.0), shade(f64::NAN)), (0, 0, SHADES - 1, 0));
    }
}
