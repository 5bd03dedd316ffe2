//! The render pipelines of the window (backdrop, surfaces, tints, lines, ambient occlusion) for one
//! number of samples a pixel.

use claymill_viewer::{FrameLayouts, MULTIPLY, Pass, Press, surface_layout};
use wgpu::{
    BindGroupLayout, BlendState, CompareFunction, Device, RenderPipeline, ShaderStages, TextureFormat,
    VertexBufferLayout, VertexStepMode,
};

use crate::lines::LineVertex;

/// Plain values: the shaders and the toolkit both mean them as shown.
pub(crate) const COLOUR_FORMAT: TextureFormat = TextureFormat::Rgba8Unorm;

/// The pipelines of pictures with so many samples a pixel.
pub(crate) struct Pipelines {
    pub(crate) backdrop: RenderPipeline,
    pub(crate) surface: RenderPipeline,
    pub(crate) tint: RenderPipeline,
    pub(crate) line: RenderPipeline,
    /// Only with several samples: quick pictures have none.
    pub(crate) occlusion: Option<RenderPipeline>,
}

/// What the pipelines are given.
pub(crate) struct Layouts {
    pub(crate) frame: FrameLayouts,
    /// Looks by tag.
    pub(crate) tags: BindGroupLayout,
}

impl Layouts {
    pub(crate) fn new(device: &Device) -> Self {
        let tags = wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: ShaderStages::VERTEX,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Uint,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        };
        let tags = wgpu::BindGroupLayoutDescriptor { label: None, entries: &[tags] };
        Layouts { frame: FrameLayouts::new(device), tags: device.create_bind_group_layout(&tags) }
    }
}

impl Pipelines {
    pub(crate) fn new(device: &Device, layouts: &Layouts, samples: u32) -> Self {
        let press = Press::new(device, include_str!("stage.wgsl"), COLOUR_FORMAT, samples);
        let frame = [Some(&layouts.frame.frame)];
        let surface = [Some(surface_layout())];
        // A vertex and its successor are the ends of a segment.
        let end = |attributes| {
            let array_stride = size_of::<LineVertex>() as u64;
            Some(VertexBufferLayout { array_stride, step_mode: VertexStepMode::Instance, attributes })
        };
        let over = Some(BlendState::ALPHA_BLENDING);
        let backdrop = Pass::backdrop(&frame);
        Pipelines {
            backdrop: press.pipeline(&backdrop),
            surface: press.pipeline(&Pass {
                name: "surface",
                buffers: &surface,
                depth: Some((CompareFunction::Less, true)),
                ..backdrop
            }),
            // A tint lies at the very depth of the surface under it.
            tint: press.pipeline(&Pass {
                name: "tint",
                vertex_of: Some("surface"),
                buffers: &surface,
                blend: over,
                depth: Some((CompareFunction::Equal, false)),
                ..backdrop
            }),
            line: press.pipeline(&Pass {
                name: "line",
                layouts: &[Some(&layouts.frame.frame), Some(&layouts.tags)],
                buffers: &[end(&BEGIN), end(&END)],
                strip: true,
                blend: over,
                depth: Some((CompareFunction::LessEqual, false)),
                ..backdrop
            }),
            occlusion: (samples > 1).then(|| {
                press.pipeline(&Pass {
                    name: "occlusion",
                    layouts: &[Some(&layouts.frame.depth)],
                    blend: Some(MULTIPLY),
                    depth: None,
                    ..backdrop
                })
            }),
        }
    }
}

const BEGIN: [wgpu::VertexAttribute; 2] = wgpu::vertex_attr_array![0 => Float32x3, 1 => Uint32];
const END: [wgpu::VertexAttribute; 1] = wgpu::vertex_attr_array![2 => Float32x3];
