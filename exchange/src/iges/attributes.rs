//! Names, colours and levels.

use claymill_nurbs::Source;

use super::directory::Entry;
use super::file::File;

/// Standard colours by number (IGES 5.3, 2.2.4.4.13).
const COLOURS: [[u8; 3]; 8] = [
    [0, 0, 0],
    [255, 0, 0],
    [0, 255, 0],
    [0, 0, 255],
    [255, 255, 0],
    [255, 0, 255],
    [0, 255, 255],
    [255, 255, 255],
];

/// Where a face came from. What the face itself does not say, its surface may (`fallback`).
pub(crate) fn source(file: &File, de: i64, properties: &[i64], fallback: Option<(i64, &[i64])>) -> Source {
    let own = described(file, de, properties);
    let under = fallback.map_or_else(Source::default, |(de, props)| described(file, de, props));
    Source {
        name: own.name.or(under.name),
        layer: own.layer.or(under.layer),
        colour: own.colour.or(under.colour),
        ..own
    }
}

fn described(file: &File, de: i64, properties: &[i64]) -> Source {
    let Ok(entry) = file.entry(de) else {
        return Source::default();
    };
    let label = Some(entry.label.clone()).filter(|l| !l.is_empty());
    Source {
        entity: format!("DE {de}"),
        name: name(file, properties).or(label),
        layer: (entry.level > 0).then(|| entry.level.to_string()),
        colour: colour(file, entry),
    }
}

/// The name property (406, form 15).
pub(crate) fn name(file: &File, properties: &[i64]) -> Option<String> {
    let named = |de: &&i64| file.entry(**de).is_ok_and(|e| e.kind == 406 && e.form == 15);
    let mut record = file.record(*properties.iter().find(named)?).ok()?;
    record.skip(1).ok()?;
    record.text().ok().filter(|name| !name.is_empty()).map(crate::shortened)
}

fn colour(file: &File, entry: &Entry) -> Option<[u8; 3]> {
    if entry.colour > 0 {
        return COLOURS.get(usize::try_from(entry.colour).ok()? - 1).copied();
    }
    if entry.colour == 0 || file.entry(-entry.colour).ok()?.kind != 314 {
        return None;
    }
    // Percentages of red, green and blue.
    let rgb = file.record(-entry.colour).ok()?.reals::<3>().ok()?;
    Some(rgb.map(|c| (c.clamp(0.0, 100.0) * 2.55).round() as u8))
}
