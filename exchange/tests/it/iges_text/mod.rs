//! Small IGES files for tests.

use std::fmt::Write;

/// One entity: type, form, pointer to a matrix, parameters without the type number.
pub(crate) struct Entity {
    pub(crate) kind: u32,
    pub(crate) form: u32,
    pub(crate) matrix: u32,
    pub(crate) status: &'static str,
    pub(crate) parameters: String,
}

pub(crate) fn entity(kind: u32, parameters: impl Into<String>) -> Entity {
    Entity { kind, form: 0, matrix: 0, status: "00000000", parameters: parameters.into() }
}

/// A file in millimetres; entity `i` is `DE 2 i + 1`.
pub(crate) fn file(entities: &[Entity]) -> String {
    file_in("2,2HMM", entities)
}

/// A file with its unit flag and name given.
pub(crate) fn file_in(unit: &str, entities: &[Entity]) -> String {
    let mut text = String::new();
    let mut card = |body: &str, letter: char, number: usize| {
        writeln!(text, "{body:<72}{letter}{number:>7}").unwrap();
    };
    card("small test file", 'S', 1);
    card("1H,,1H;,4Htest,5Ha.igs,4Htest,1H1,32,38,6,308,15,4Htest,", 'G', 1);
    card(&format!("1.,{unit},1,0.1,15H20000101.000000,1D-3,100.,,,11,0;"), 'G', 2);
    let mut data = Vec::new();
    let (mut d, mut p) = (0, 0);
    for e in entities {
        let first = p + 1;
        let body = format!("{},{};", e.kind, e.parameters);
        for chunk in body.as_bytes().chunks(64) {
            p += 1;
            data.push(format!("{:<64}{:>8}", std::str::from_utf8(chunk).unwrap(), d + 1));
        }
        let (kind, form, matrix, status, count) = (e.kind, e.form, e.matrix, e.status, p + 1 - first);
        let zero = 0;
        d += 2;
        card(
            &format!(
                "{kind:>8}{first:>8}{zero:>8}{zero:>8}{zero:>8}{zero:>8}{matrix:>8}{zero:>8}{status:>8}"
            ),
            'D',
            d - 1,
        );
        card(
            &format!("{kind:>8}{zero:>8}{zero:>8}{count:>8}{form:>8}{zero:>8}{zero:>8}{zero:>8}{zero:>8}"),
            'D',
            d,
        );
    }
    for (i, line) in data.iter().enumerate() {
        card(line, 'P', i + 1);
    }
    card(&format!("S{:>7}G{:>7}D{d:>7}P{p:>7}", 1, 2), 'T', 1);
    text
}

/// A flat bilinear B-spline surface over `[0, w] × [0, h]`, parameters equal to `x` and `y`.
pub(crate) fn flat(w: f64, h: f64) -> Entity {
    entity(
        128,
        format!(
            "1,1,1,1,0,0,1,0,0,0.,0.,{w:?},{w:?},0.,0.,{h:?},{h:?},1.,1.,1.,1.,0.,0.,0.,{w:?},0.,0.,0.,{h:?},0.,{w:?},{h:?},0.,0.,{w:?},0.,{h:?}"
        ),
    )
}

/// A line in space.
pub(crate) fn line(a: [f64; 3], b: [f64; 3]) -> Entity {
    entity(110, format!("{:?},{:?},{:?},{:?},{:?},{:?}", a[0], a[1], a[2], b[0], b[1], b[2]))
}
