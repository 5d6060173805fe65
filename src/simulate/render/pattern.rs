//! Patterns: floors, walls, ceilings, furniture, and what lies, hangs and sticks on them.

use super::lattice::Lattice;
use super::paint::{Color, Place, square};

/// Sizes are in units of the paint: metres in a room.
const LARGE: f64 = 2.2;

/// Turns of patches: cosine and sine, half of them along the sides of the face.
const TURNS: [[f64; 2]; 8] =
    [[1.0, 0.0], [1.0, 0.0], [1.0, 0.0], [1.0, 0.0], [0.8, 0.6], [0.6, 0.8], [0.96, 0.28], [0.96, -0.28]];

/// The colour of a place on a face.
pub(super) fn color(lattice: &Lattice, place: &Place) -> Color {
    let is_large = place.size.is_none_or(|[width, height]| width.min(height) > LARGE);
    let mut color = if !is_large {
        furniture(lattice, place)
    } else if place.up > 0.75 {
        floor(lattice, place)
    } else if place.up < -0.75 {
        ceiling(lattice, place)
    } else {
        wall(lattice, place)
    };
    // Stickers and small things, by size; of the ceiling's there are few.
    let few = if place.up < -0.75 { 0.3 } else { 1.0 };
    for (level, size, share) in [(1, 0.46, 0.3), (2, 0.19, 0.26), (3, 0.083, 0.3)] {
        if let Some(on_top) = patch(lattice, place, level, size, share * few) {
            color = on_top;
        }
    }
    let grain = grain(lattice, place);
    color.map(|part| part * grain)
}

/// Brightness that varies from place to place, in several sizes; what is smaller than pixels is left out.
fn grain(lattice: &Lattice, place: &Place) -> f64 {
    let mut brightness = 1.0;
    for (level, size, amount) in [(0, 0.7, 0.10), (1, 0.22, 0.09), (2, 0.07, 0.08), (3, 0.022, 0.08)] {
        let sharpness = (size / place.pixel / 4.0 - 0.25).clamp(0.0, 1.0);
        if sharpness > 0.0 {
            let at = place.at.map(|part| part / size);
            brightness += sharpness * amount * lattice.noise(at, place.key * 4 + level);
        }
    }
    brightness
}

/// A colour from its hue (0 to 1), how strong it is, and its brightness.
fn hue(hue: f64, strength: f64, brightness: f64) -> Color {
    [0.0, 2.0, 4.0].map(|shift| {
        let at = (hue * 6.0 + shift) % 6.0;
        let full = ((at - 3.0).abs() - 1.0).clamp(0.0, 1.0);
        brightness * (1.0 - strength + strength * full)
    })
}

/// Any colour of a place, bright or dark.
fn any(lattice: &Lattice, place: &[i64]) -> Color {
    let part = |which: i64| f64::from(lattice.hash(place).rotate_left(8) >> (8 * which) & 255) / 255.0;
    let [first, second, third] = [part(0), part(1), part(2)];
    // Away from the middle greys, which walls and floors have.
    let brightness = if third < 0.5 { 0.08 + 0.5 * third } else { 0.5 + 0.5 * third };
    hue(first, 0.75 * second, brightness)
}

/// Boards: long, narrow, each of a tone of its own.
fn floor(lattice: &Lattice, place: &Place) -> Color {
    let [s, t] = place.at;
    let (width, length) = (0.24, 1.7);
    let row = super::lattice::floor(t / width);
    let shift = lattice.uniform(&[place.key, row, 91]) * length;
    let ([board, _], [along, _]) = square([s + shift, t], length);
    let (_, [_, across]) = square(place.at, width);
    let tone = 0.72 + 0.4 * lattice.uniform(&[place.key, row, board, 92]);
    let gap = (0.5 - across.abs()) * width < 0.006_f64.max(0.5 * place.pixel)
        || (0.5 - along.abs()) * length < 0.006_f64.max(0.5 * place.pixel);
    let tone = if gap { 0.25 } else { tone };
    [0.66 * tone, 0.50 * tone, 0.36 * tone]
}

/// Light panels in a dark grid, some of them lamps.
fn ceiling(lattice: &Lattice, place: &Place) -> Color {
    let size = 0.6;
    let ([i, j], [along, across]) = square(place.at, size);
    let edge = (0.5 - along.abs().max(across.abs())) * size;
    if edge < 0.012_f64.max(0.5 * place.pixel) {
        return [0.42, 0.42, 0.43];
    }
    let chance = lattice.uniform(&[place.key, i, j, 81]);
    if chance < 0.12 && edge > 0.06 { [1.0, 1.0, 0.96] } else { [0.74 + 0.08 * chance; 3] }
}

/// Wallpaper with pictures, and a skirting board where the wall has an end.
fn wall(lattice: &Lattice, place: &Place) -> Color {
    let base = hue(lattice.uniform(&[place.key, 71]), 0.18, 0.86);
    if let Some([_, height]) = place.size {
        let low = place.at[1].min(height - place.at[1]);
        if low < 0.1 {
            let dark = if low < 0.085 { 0.42 } else { 0.2 };
            return [dark, dark * 0.9, dark * 0.8];
        }
    }
    let size = 1.25;
    let ([i, j], [along, across]) = square(place.at, size);
    let draw = |which: i64| lattice.uniform(&[place.key, i, j, 72 + which]);
    if draw(0) < 0.72 {
        let half = [0.2 + 0.2 * draw(1), 0.16 + 0.22 * draw(2)];
        let from_middle = [along + 0.08 * (draw(3) - 0.5), across + 0.08 * (draw(4) - 0.5)];
        let inside = half[0] - from_middle[0].abs();
        let inside = inside.min(half[1] - from_middle[1].abs());
        if inside > 0.0 {
            return picture(lattice, place, [i, j], from_middle, inside * size);
        }
    }
    // Faint stripes.
    let stripe = if place.at[0].rem_euclid(0.5) < 0.25 { 1.0 } else { 0.93 };
    base.map(|part| part * stripe)
}

/// A picture in a frame, or shelves with books.
fn picture(lattice: &Lattice, place: &Place, [i, j]: [i64; 2], at: [f64; 2], inside: f64) -> Color {
    let kind = lattice.hash(&[place.key, i, j, 79]) % 3;
    if inside < 0.035 {
        return if kind == 0 { [0.15, 0.12, 0.1] } else { [0.45, 0.3, 0.15] };
    }
    if inside < 0.075 && kind != 2 {
        return [0.93, 0.93, 0.9];
    }
    match kind {
        // Fields of colour.
        0 => {
            let ([k, l], _) = square(at, 0.11);
            any(lattice, &[place.key, i, j, k, l])
        }
        // Four large fields and a square across them.
        1 => {
            let center = at[0].abs().max(at[1].abs()) < 0.12;
            any(
                lattice,
                &[place.key, i, j, i64::from(at[0] > 0.02), i64::from(at[1] > -0.03), i64::from(center)],
            )
        }
        // Books on shelves.
        _ => {
            let (shelf, [_, height]) = square(at, 0.2);
            if height.abs() > 0.44 {
                return [0.35, 0.24, 0.14];
            }
            let ([book, _], [edge, _]) = square([at[0], 0.0], 0.036);
            let tall = 0.12 + 0.3 * lattice.uniform(&[place.key, i, j, shelf[1], book, 5]);
            if height > tall || edge.abs() > 0.45 {
                return [0.09, 0.07, 0.06];
            }
            any(lattice, &[place.key, i, j, shelf[1], book])
        }
    }
}

/// Boards with doors or drawers and handles.
fn furniture(lattice: &Lattice, place: &Place) -> Color {
    let chance = lattice.uniform(&[place.object, 61]);
    let base = if chance < 0.5 {
        hue(lattice.uniform(&[place.object, 62]), 0.55, 0.8)
    } else {
        let tone = 0.6 + 0.5 * lattice.uniform(&[place.object, 63]);
        [0.72 * tone, 0.55 * tone, 0.4 * tone]
    };
    let Some([width, height]) = place.size else { return base };
    let count = |size: f64| (size / 0.75).round().clamp(1.0, 64.0);
    let door = [width / count(width), height / count(height)];
    let local = [place.at[0].rem_euclid(door[0]), place.at[1].rem_euclid(door[1])];
    let edge = local[0].min(door[0] - local[0]).min(local[1].min(door[1] - local[1]));
    let inset = 0.12 * door[0].min(door[1]);
    let handle = [(local[0] - 0.8 * door[0]).abs() / door[0], (local[1] - 0.5 * door[1]).abs() / door[1]];
    if edge < 0.008_f64.max(0.5 * place.pixel) {
        base.map(|part| part * 0.3)
    } else if place.up.abs() > 0.75 {
        base
    } else if handle[0] < 0.02 && handle[1] < 0.1 {
        [0.12, 0.12, 0.13]
    } else if edge > inset && edge < inset + 0.012_f64.max(place.pixel) {
        base.map(|part| part * 0.55)
    } else if edge > inset {
        base.map(|part| (part * 1.12).min(1.0))
    } else {
        base
    }
}

/// The patch that covers a place, if one does: at most one in each square of a size.
///
/// * `share` — of the squares that have one.
fn patch(lattice: &Lattice, place: &Place, level: i64, size: f64, share: f64) -> Option<Color> {
    // Smaller than two pixels it would only flicker.
    if size < 6.0 * place.pixel {
        return None;
    }
    let ([i, j], [along, across]) = square(place.at, size);
    let key = [place.key, level, i, j];
    let draw = |which: i64| lattice.uniform(&[key[0], key[1], key[2], key[3], which]);
    if draw(0) >= share {
        return None;
    }
    let [cosine, sine] = TURNS[lattice.hash(&[key[0], key[1], key[2], key[3], 9]) as usize % TURNS.len()];
    let (x, y) = (along + 0.16 * (draw(1) - 0.5), across + 0.16 * (draw(2) - 0.5));
    let (x, y) = (cosine * x + sine * y, cosine * y - sine * x);
    // Turned by any angle it stays in its square.
    let half = [0.13 + 0.16 * draw(3), 0.11 + 0.16 * draw(4)];
    let color = |which: i64| any(lattice, &[key[0], key[1], key[2], key[3], 20 + which]);
    if draw(5) < 0.15 {
        return (x * x + y * y < half[0] * half[0]).then(|| color(0));
    }
    if x.abs() > half[0] || y.abs() > half[1] {
        return None;
    }
    Some(match lattice.hash(&[key[0], key[1], key[2], key[3], 8]) % 4 {
        // A border.
        0 if half[0] - x.abs() < 0.05 || half[1] - y.abs() < 0.05 => color(1),
        // Fields of a board.
        1 if (x > 0.02) == (y > -0.03) => color(1),
        // A corner cut out.
        2 if x > 0.3 * half[0] && y > 0.2 * half[1] => return None,
        _ => color(0),
    })
}
