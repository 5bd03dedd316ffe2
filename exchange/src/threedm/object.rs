//! From an object of the archive to its faces, by its class.

use super::body::{Body, RawFace};
use super::class::{Class, Object};
use super::context::Context;
use super::fault::Fault;
use super::{brep, extrusion, surfaces};

/// Reads the body of an object.
pub(super) fn read(object: Object, context: &Context) -> Result<Body, Fault> {
    match object.class {
        Class::Brep => brep::read(object.data, context),
        Class::Extrusion => extrusion::read(object.data, context),
        class if surfaces::is_surface(class) => {
            let face = RawFace { surface: 0, loops: Vec::new(), reversed: false, colour: None };
            let surface = surfaces::read(object, context)?;
            Ok(Body { surfaces: vec![Ok(surface)], faces: vec![Ok(face)] })
        }
        class => Err(Fault::Unsupported(class.name())),
    }
}
