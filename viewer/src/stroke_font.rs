//! A vector font of strokes: ASCII, the letters of Latin-1 and what technical captions need.
//!
//! Letters with marks are composed of a letter and a mark, whether they come as one character (`ü`) or as two, as
//! in the names of files on some systems.

/// A point, grid units or pixels.
pub(crate) type Xy = [f32; 2];

/// The strokes of a character, in the manner of engineering lettering. Each point is two digits, x and y, on
/// a grid with the baseline at y = 2, small letters up to 7 and capitals up to 9. A dot after a point makes
/// it a quadratic control point (two in a row have a curve point midway); a slash starts a new stroke.
fn strokes(c: char) -> &'static str {
    match c {
        ' ' | '\u{a0}' => "",
        'A' => "02 29 42/15 35",
        'B' => "02 09 29 49. 46. 26 06/26 46. 42. 22 02",
        'C' => "47 49. 29 09. 06 05 02. 22 42. 44",
        'D' => "02 09 19 49. 46 45 42. 12 02",
        'E' => "49 09 02 42/06 36",
        'F' => "49 09 02/06 36",
        'G' => "47 49. 29 09. 06 05 02. 22 42. 45 25",
        'H' => "02 09/42 49/06 46",
        'I' => "02 09",
        'J' => "39 34 32. 22 02. 04",
        'K' => "02 09/49 05/16 42",
        'L' => "09 02 42",
        'M' => "02 09 34 69 62",
        'N' => "02 09 42 49",
        'O' | '0' => "29 09. 06 05 02. 22 42. 45 46 49. 29",
        'P' => "02 09 29 49. 45. 25 05",
        'Q' => "29 09. 06 05 02. 22 42. 45 46 49. 29/34 51",
        'R' => "02 09 29 49. 45. 25 05/25 42",
        'S' => "48 49. 29 09. 07 06. 26 46. 44 42. 22 02. 03",
        'T' => "09 49/29 22",
        'U' => "09 05 02. 22 42. 45 49",
        'V' => "09 22 49",
        'W' => "09 12 37 52 69",
        'X' => "09 42/02 49",
        'Y' => "09 25 49/25 22",
        'Z' => "09 49 02 42",
        'a' => "45 47. 27 07. 05 04 02. 22 42. 44/47 42",
        'b' => "09 02/05 07. 27 47. 45 44 42. 22 02. 04",
        'c' => "46 47. 27 07. 05 04 02. 22 42. 43",
        'd' => "49 42/45 47. 27 07. 05 04 02. 22 42. 44",
        'e' => "05 45 47. 27 07. 05 04 02. 22 42. 43",
        'f' => "39 19. 17 12/07 37",
        'g' => "47 42 40. 20 00. 01/45 47. 27 07. 05 04 02. 22 42. 44",
        'h' => "09 02/05 07. 27 47. 45 42",
        'i' => "02 07/09 09",
        'j' => "17 12 10. 00/19 19",
        'k' => "09 02/37 04/15 42",
        'l' => "09 02",
        'm' => "02 07/05 07. 17 37. 35 32/35 37. 47 67. 65 62",
        'n' => "02 07/05 07. 27 47. 45 42",
        'o' => "27 07. 05 04 02. 22 42. 44 45 47. 27",
        'p' => "07 00/05 07. 27 47. 45 44 42. 22 02. 04",
        'q' => "47 40/45 47. 27 07. 05 04 02. 22 42. 44",
        'r' => "02 07/05 07. 27 37",
        's' => "37 17 07. 06 05. 15 25 35. 34 32. 22 02",
        't' => "19 14 12. 32/07 37",
        'u' => "07 04 02. 22 42. 44/47 42",
        'v' => "07 22 47",
        'w' => "07 12 36 52 67",
        'x' => "07 42/02 47",
        'y' => "07 22/47 10",
        'z' => "07 47 02 42",
        'Æ' => "02 39 69/39 32 62/36 56/15 35",
        'Ð' => "02 09 19 49. 46 45 42. 12 02/05 25",
        'Ø' => "29 09. 06 05 02. 22 42. 45 46 49. 29/02 49",
        'Þ' => "02 09/07 27 47. 43. 23 03",
        'Œ' => "39 29 09. 06 05 02. 22 32/39 32 62/39 69/36 56",
        'ß' | 'ẞ' => "02 07 09. 29 39. 38 36. 16/16 26 46. 44 42. 22",
        'æ' => "35 37. 17 07. 05 04 02. 12 32. 34/35 65 67. 47 37. 35 34 32. 52 62. 63",
        'ð' => "27 07. 05 04 02. 22 42. 44 45 47. 27/45 48. 19/17 39",
        'ø' => "27 07. 05 04 02. 22 42. 44 45 47. 27/02 47",
        'þ' => "09 00/05 07. 27 47. 45 44 42. 22 02. 04",
        'œ' => "27 07. 05 04 02. 22 32. 34 35 37. 27/35 65 67. 47 37. 35 34 32. 52 62. 63",
        'ı' => "02 07",
        '1' => "17 29 22",
        '2' => "07 09. 29 49. 47 45. 02 42",
        '3' => "08 09. 29 49. 46. 26 16/26 46. 42. 22 02. 03",
        '4' => "32 39 04 44",
        '5' => "49 09 06 26 46. 44 42. 22 02. 03",
        '6' => "48 49. 29 09. 06 04 02. 22 42. 44 46. 26 06. 04",
        '7' => "09 49 12",
        '8' => "29 09. 06. 26 46. 49. 29/26 06. 02. 22 42. 46. 26",
        '9' => "03 02. 22 42. 45 47 49. 29 09. 07 05. 25 45. 47",
        '.' => "02 02",
        ',' => "12 01",
        ':' => "02 02/06 06",
        ';' => "12 01/16 16",
        '-' | '–' => "05 35",
        '—' => "05 55",
        '+' => "05 45/23 27",
        '±' => "06 46/24 28/03 43",
        '=' => "04 44/06 46",
        '/' => "01 49",
        '\\' => "09 41",
        '(' => "29 05. 21",
        ')' => "09 25. 01",
        '[' => "29 09 01 21",
        ']' => "09 29 21 01",
        '<' => "48 05 42",
        '>' => "08 45 02",
        '%' => "19 29. 27. 17 07. 09. 19/34 44. 42. 32 22. 24. 34/02 49",
        '°' => "19 29. 27. 17 07. 09. 19",
        '×' => "03 47/07 43",
        '²' => "08 09. 19 29. 28 06 26",
        '³' => "09 29 17 27. 25. 15 05",
        'µ' => "07 00/04 02. 22 42. 44/47 42",
        '·' => "05 05",
        '_' => "01 41",
        '\'' | '‘' | '’' => "09 07",
        '"' | '“' | '”' => "09 07/29 27",
        '„' => "11 02/31 22",
        '«' => "27 05 23/47 25 43",
        '»' => "07 25 03/27 45 23",
        '€' => "48 49. 29 09. 07 04 02. 22 42. 43/06 36/05 35",
        '÷' => "05 45/27 27/23 23",
        '#' => "13 18/33 38/04 44/06 46",
        '…' => "02 02/22 22/42 42",
        '!' => "09 05/02 02",
        '$' => "48 49. 29 09. 07 06. 26 46. 44 42. 22 02. 03/29 22",
        '&' => "52 17 09. 29 38. 26 05. 03 02. 22 42. 45",
        '*' => "27 23/06 44/04 46",
        '@' => "36 34 44. 46 49. 29 09. 05 02. 22 42/36 16. 15 14. 34",
        '^' => "07 29 47",
        '`' => "09 17",
        '{' => "29 19. 17 15. 05 15. 13 11. 21",
        '|' => "09 01",
        '}' => "09 19. 17 15. 25 15. 13 11. 01",
        '~' => "05 07. 25 43. 45",
        _ => "07 09. 29 49. 47 46. 25 24/22 22",
    }
}

/// Grid units of a space.
const SPACE: f32 = 1.6;

/// What stands above a letter, or hangs below it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mark {
    Grave,
    Acute,
    Circumflex,
    Tilde,
    Diaeresis,
    Ring,
    Caron,
    Cedilla,
}

/// Each mark: its combining character, letters that have it, and the same letters with it.
const MARKED: [(Mark, char, &str, &str); 8] = [
    (Mark::Grave, '\u{300}', "AEIOUaeiou", "ÀÈÌÒÙàèìòù"),
    (Mark::Acute, '\u{301}', "AEIOUYaeiouy", "ÁÉÍÓÚÝáéíóúý"),
    (Mark::Circumflex, '\u{302}', "AEIOUaeiou", "ÂÊÎÔÛâêîôû"),
    (Mark::Tilde, '\u{303}', "ANOano", "ÃÑÕãñõ"),
    (Mark::Diaeresis, '\u{308}', "AEIOUYaeiouy", "ÄËÏÖÜŸäëïöüÿ"),
    (Mark::Ring, '\u{30a}', "Aa", "Åå"),
    (Mark::Caron, '\u{30c}', "SZsz", "ŠŽšž"),
    (Mark::Cedilla, '\u{327}', "Cc", "Çç"),
];

impl Mark {
    /// Its strokes in grid units, from the middle of the letter's top; those of a cedilla from the middle of its foot.
    fn lines(self) -> Vec<Vec<Xy>> {
        match self {
            Mark::Grave => vec![vec![[-0.8, 2.2], [0.3, 1.1]]],
            Mark::Acute => vec![vec![[-0.3, 1.1], [0.8, 2.2]]],
            Mark::Circumflex => vec![vec![[-1.1, 1.1], [0.0, 2.2], [1.1, 1.1]]],
            Mark::Caron => vec![vec![[-1.1, 2.2], [0.0, 1.1], [1.1, 2.2]]],
            Mark::Tilde => vec![vec![[-1.4, 1.2], [-0.7, 1.9], [0.7, 1.3], [1.4, 2.0]]],
            Mark::Diaeresis => vec![vec![[-1.0, 1.6], [-1.0, 1.6]], vec![[1.0, 1.6], [1.0, 1.6]]],
            Mark::Ring => {
                let corner = |k: u8| {
                    let (sin, cos) = (f32::from(k) * std::f32::consts::FRAC_PI_4).sin_cos();
                    [0.75 * cos, 1.6 + 0.75 * sin]
                };
                vec![(0..=8).map(corner).collect()]
            }
            Mark::Cedilla => vec![vec![[0.0, 0.0], [0.0, -0.6], [0.7, -1.0], [0.3, -1.7], [-0.6, -1.7]]],
        }
    }
}

/// A character as its letter and mark.
fn letter_and_mark(c: char) -> (char, Option<Mark>) {
    for (mark, _, letters, marked) in MARKED {
        if let Some((letter, _)) = letters.chars().zip(marked.chars()).find(|(_, m)| *m == c) {
            return (letter, Some(mark));
        }
    }
    (c, None)
}

/// The characters of `text`: strokes as line segments in grid units (baseline at 0, y up), and width.
pub(crate) fn outlines(text: &str) -> impl Iterator<Item = (Vec<[Xy; 2]>, f32)> {
    let mut rest = text.chars().peekable();
    std::iter::from_fn(move || {
        let (letter, mut mark) = letter_and_mark(rest.next()?);
        // A letter has one mark; further ones are left out.
        while let Some(next) = rest.peek().and_then(|c| MARKED.iter().find(|m| m.1 == *c)) {
            mark = mark.or(Some(next.0));
            rest.next();
        }
        Some(outline(letter, mark))
    })
}

/// The strokes and the width of a letter with its mark.
fn outline(letter: char, mark: Option<Mark>) -> (Vec<[Xy; 2]>, f32) {
    let Some(mark) = mark else { return plain(letter) };
    let (mut segments, width) = match letter {
        // The mark takes the place of the dot.
        'i' if mark != Mark::Cedilla => plain('ı'),
        _ => plain(letter),
    };
    let highest = segments.iter().flatten().map(|p| p[1]).fold(0.0, f32::max);
    let foot = if mark == Mark::Cedilla { 0.0 } else { highest };
    for line in mark.lines() {
        let at = |p: &Xy| [0.5 * width + p[0], foot + p[1]];
        segments.extend(line.windows(2).map(|ends| [at(&ends[0]), at(&ends[1])]));
    }
    // Marks are wider than narrow letters.
    let x = || segments.iter().flatten().map(|p| p[0]);
    let (left, right) = (x().fold(0.0, f32::min), x().fold(width, f32::max));
    segments.iter_mut().flatten().for_each(|p| p[0] -= left);
    (segments, right - left)
}

/// The character's strokes as line segments in grid units (baseline at 0, y up), and its width.
fn plain(c: char) -> (Vec<[Xy; 2]>, f32) {
    let mut segments = Vec::new();
    let mut width: f32 = if matches!(c, ' ' | '\u{a0}') { SPACE } else { 0.0 };
    for stroke in strokes(c).split('/').filter(|s| !s.is_empty()) {
        let points: Vec<(Xy, bool)> = stroke
            .split(' ')
            .map(|p| {
                let digit = |i: usize| f32::from(p.as_bytes()[i] - b'0');
                ([digit(0), digit(1) - 2.0], p.ends_with('.'))
            })
            .collect();
        width = points.iter().filter(|p| !p.1).fold(width, |w, p| w.max(p.0[0]));
        let mut from = points[0].0;
        for i in 1..points.len() {
            let (p, soft) = points[i];
            if !soft {
                if !points[i - 1].1 {
                    segments.push([from, p]);
                }
                from = p;
                continue;
            }
            let (next, next_soft) = points[i + 1];
            let to = if next_soft { middle(p, next) } else { next };
            let start = from;
            for k in 1..=6 {
                let t = k as f32 / 6.0;
                let at = middle_at(middle_at(start, p, t), middle_at(p, to, t), t);
                segments.push([from, at]);
                from = at;
            }
        }
    }
    // Digits share one width, so that figures stand under each other.
    (segments, if c.is_ascii_digit() { 4.0 } else { width })
}

fn middle_at(a: Xy, b: Xy, t: f32) -> Xy {
    [a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t]
}

fn middle(a: Xy, b: Xy) -> Xy {
    middle_at(a, b, 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The letters of Latin-1 and those that German, French and Swedish have beyond it.
    fn letters() -> impl Iterator<Item = char> {
        ('À'..='ÿ').filter(|c| c.is_alphabetic()).chain("ŒœŸẞ".chars())
    }

    fn of(text: &str) -> Vec<(Vec<[Xy; 2]>, f32)> {
        outlines(text).collect()
    }

    #[test]
    fn every_character_is_well_formed_and_inside_its_box() {
        let all = (' '..='~').chain("–—±°×÷²³µ·…«»„“”‘’€ŠŽšž".chars()).chain(letters());
        for c in all {
            let (segments, width) = of(&c.to_string()).remove(0);
            assert!(c == ' ' || !segments.is_empty(), "{c}");
            for p in segments.iter().flatten() {
                assert!((0.0..=6.0).contains(&p[0]) && (-2.0..=9.5).contains(&p[1]), "{c}: {p:?}");
                assert!(!c.is_ascii() || p[1] <= 7.0, "{c}: {p:?}");
            }
            assert!(width <= 6.0, "{c}");
            assert!(c == '?' || (segments, width) != plain('?'), "{c} is unknown");
        }
        assert_eq!(of("字"), of("?"));
    }

    #[test]
    fn every_letter_differs_from_every_other_and_from_its_base() {
        let all: Vec<char> = letters().chain(('A'..='Z').chain('a'..='z')).filter(|c| *c != 'ẞ').collect();
        for (i, a) in all.iter().enumerate() {
            for b in &all[..i] {
                assert_ne!(of(&a.to_string()), of(&b.to_string()), "{a} {b}");
            }
        }
    }

    #[test]
    fn a_mark_may_be_a_character_of_its_own() {
        for (_, mark, letters, marked) in MARKED {
            assert_eq!(letters.chars().count(), marked.chars().count());
            for (letter, whole) in letters.chars().zip(marked.chars()) {
                assert_eq!(of(&format!("x{letter}{mark}y")), of(&format!("x{whole}y")), "{whole}");
            }
        }
        assert_eq!(of("Kotflügel\u{301}").len(), 9);
        // One without a letter before it is unknown, and harmless.
        assert_eq!(of("\u{308}"), of("?"));
    }
}
