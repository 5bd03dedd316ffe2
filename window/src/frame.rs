//! What the shaders are told of a picture.

use claymill_nurbs::Vector3;

use crate::desk::Desk;

/// How far occlusion reaches, as a part of the shorter side.
const OCCLUSION_REACH: f32 = 0.03;

/// Constants of one picture, laid out as `Frame` in `stage.wgsl`.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(crate) struct Frame {
    clip: [[f32; 4]; 4],
    eye: [f32; 4],
    basis: [[f32; 4]; 3],
    sky: [f32; 4],
    viewport: [f32; 4],
    section: [f32; 4],
    depth: [f32; 4],
    backdrop: [[f32; 4]; 2],
    tint: [f32; 4],
}

/// For a picture of `size` pixels.
pub(crate) fn frame(desk: &Desk<'_>, size: [u32; 2]) -> Frame {
    let origin = desk.scene.origin;
    let [width, height] = size.map(|s| s as f32);
    // The sight may be for another size of the same shape: its scale follows.
    let sight = &desk.sight;
    let scale = sight.mm_per_px() * f64::from(sight.size()[1]) / f64::from(size[1].max(1));
    let range = sight.depth_range(&desk.bounds().inflated(60.0 * desk.bounds().diagonal().max(1.0) / 1000.0));
    let wide = |v: Vector3| [v.x as f32, v.y as f32, v.z as f32, 0.0];
    let eye = match sight.eye_mm() {
        Some(eye) => {
            let e = sight.target() - sight.forward() * eye - origin;
            [e.x as f32, e.y as f32, e.z as f32, 1.0]
        }
        None => wide(-sight.forward()),
    };
    let mut sky = wide(desk.exhibit().axes.up);
    sky[3] = f32::from(u8::from(desk.layers.zebra));
    let section = desk.section().map_or([0.0, 0.0, 0.0, 1.0], |s| {
        let mut plane = wide(s.normal);
        plane[3] = (s.at_mm - s.normal.dot(&origin.coords)) as f32;
        plane
    });
    let [near, far] = range;
    let decode = match sight.eye_mm() {
        None => [far - near, near, 0.0],
        Some(e) => {
            let (n, f) = (near + e, far + e);
            let c = -(f - n) / f;
            [-e * c, n - e, c]
        }
    };
    let backdrop = match desk.dark {
        true => [[0.150, 0.162, 0.180, 1.0], [0.235, 0.247, 0.267, 1.0]],
        false => [[0.836, 0.859, 0.886, 1.0], [0.965, 0.969, 0.973, 1.0]],
    };
    Frame {
        clip: sight.clip_matrix(&origin, range).map(|v| v as f32).into(),
        eye,
        basis: [wide(sight.right()), wide(sight.up()), wide(-sight.forward())],
        sky,
        viewport: [width, height, scale as f32, desk.scene.deviation_mm as f32],
        section,
        depth: [decode[0] as f32, decode[1] as f32, decode[2] as f32, OCCLUSION_REACH * width.min(height)],
        backdrop,
        tint: [1.0, 0.55, 0.1, 0.38],
    }
}
