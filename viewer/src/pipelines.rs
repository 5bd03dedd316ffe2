//! The render pipelines of still pictures: backdrop, surfaces, ambient occlusion, lines. The window
//! has its own.

use wgpu::{
    BlendState, CompareFunction, Device, RenderPipeline, TextureFormat, VertexBufferLayout, VertexStepMode,
};

use crate::passes::{FrameLayouts, MULTIPLY, Pass, Press, surface_layout};
use crate::segments::Segment;

pub(crate) const COLOUR_FORMAT: TextureFormat = TextureFormat::Rgba8UnormSrgb;
/// Samples a pixel; every adapter can do four.
pub(crate) const SAMPLES: u32 = 4;

/// The fixed part of drawing: one pipeline a pass.
pub(crate) struct Pipelines {
    pub(crate) backdrop: RenderPipeline,
    pub(crate) surface: RenderPipeline,
    pub(crate) occlusion: RenderPipeline,
    pub(crate) line: RenderPipeline,
    pub(crate) layouts: FrameLayouts,
}

impl Pipelines {
    pub(crate) fn new(device: &Device) -> Self {
        let press = Press::new(device, include_str!("shaders.wgsl"), COLOUR_FORMAT, SAMPLES);
        let layouts = FrameLayouts::new(device);
        let frame = [Some(&layouts.frame)];
        let segments = [Some(VertexBufferLayout {
            array_stride: size_of::<Segment>() as u64,
            step_mode: VertexStepMode::Instance,
            attributes: &LINE_ATTRIBUTES,
        })];
        let backdrop = Pass::backdrop(&frame);
        Pipelines {
            backdrop: press.pipeline(&backdrop),
            surface: press.pipeline(&Pass {
                name: "surface",
                buffers: &[Some(surface_layout())],
                depth: Some((CompareFunction::Less, true)),
                ..backdrop
            }),
            occlusion: press.pipeline(&Pass {
                name: "occlusion",
                layouts: &[Some(&layouts.depth)],
                blend: Some(MULTIPLY),
                depth: None,
                ..backdrop
            }),
            line: press.pipeline(&Pass {
                name: "line",
                buffers: &segments,
                strip: true,
                blend: Some(BlendState::ALPHA_BLENDING),
                depth: Some((CompareFunction::LessEqual, false)),
                ..backdrop
            }),
            layouts,
        }
    }
}

const LINE_ATTRIBUTES: [wgpu::VertexAttribute; 5] = wgpu::vertex_attr_array![
    0 => Float32x3, 1 => Float32, 2 => Float32x3, 3 => Float32, 4 => Unorm8x4
];
