//! Which representations are the shape of a product, and which describe a property of one.
//!
//! A SHAPE_DEFINITION_REPRESENTATION may hold more than the shape of a part: with a PROPERTY_DEFINITION of a
//! SHAPE_ASPECT ("shape for solid data with which properties are associated") it names once more what validation
//! properties were measured on.

use std::collections::BTreeSet;

use super::part21::{Part21, name_length};

/// Representations that a definition names.
#[derive(Debug, Default)]
pub(super) struct Products {
    shapes: BTreeSet<u64>,
    of_properties: BTreeSet<u64>,
}

impl Products {
    pub(super) fn read(file: &Part21) -> Self {
        let mut products = Products::default();
        let shape_definition = |name: &[u8]| name == b"SHAPE_DEFINITION_REPRESENTATION";
        let other_definition = |name: &[u8]| name == b"PROPERTY_DEFINITION_REPRESENTATION";
        for (definition, representation) in named(file, shape_definition) {
            let of_product = is_of_product(file, definition);
            let named = if of_product { &mut products.shapes } else { &mut products.of_properties };
            named.insert(representation);
        }
        products
            .of_properties
            .extend(named(file, other_definition).map(|(_, representation)| representation));
        products
    }

    /// Whether the representations of a part only describe a property of what others are the shape of.
    pub(super) fn is_property(&self, part: &[u64]) -> bool {
        !part.iter().any(|id| self.shapes.contains(id))
            && part.iter().any(|id| self.of_properties.contains(id))
    }

    /// Whether one of the representations is the shape of a product.
    pub(super) fn is_shape(&self, part: &[u64]) -> bool {
        part.iter().any(|id| self.shapes.contains(id))
    }
}

/// Definition and representation of the instances of one type: both kinds have these two attributes in front.
fn named(file: &Part21, of_type: impl Fn(&[u8]) -> bool) -> impl Iterator<Item = (u64, u64)> {
    file.of_type(of_type).filter_map(|id| {
        let entity = file.get(id).ok()?;
        let record = entity.only().ok()?;
        Some((record.reference(0).ok()?, record.reference(1).ok()?))
    })
}

/// Whether a definition is that of a product: PRODUCT_DEFINITION_SHAPE, or a PROPERTY_DEFINITION(name, description,
/// definition) of a PRODUCT_DEFINITION.
fn is_of_product(file: &Part21, id: u64) -> bool {
    let Ok(entity) = file.get(id) else { return false };
    let of_product = |definition: u64| {
        let text = file.text(definition);
        let name = &text[..name_length(text)];
        name.starts_with(b"PRODUCT_DEFINITION") && name != b"PRODUCT_DEFINITION_SHAPE"
    };
    entity.is("PRODUCT_DEFINITION_SHAPE")
        || entity.part("PROPERTY_DEFINITION").and_then(|r| r.reference(2)).is_ok_and(of_product)
}
