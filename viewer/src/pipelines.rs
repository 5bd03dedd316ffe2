use wgpu::{
    BindGroupLayout, BlendComponent, BlendFactor, BlendOperation, BlendState, CompareFunction, Device,
    RenderPipeline, ShaderModule, ShaderStages, TextureFormat, VertexBufferLayout, VertexStepMode,
};

use crate::scene::SurfaceVertex;
use crate::segments::Segment;

pub(crate) const COLOUR_FORMAT: TextureFormat = TextureFormat::Rgba8UnormSrgb;
pub(crate) const DEPTH_FORMAT: TextureFormat = TextureFormat::Depth32Float;
/// Samples a pixel; every adapter can do four.
pub(crate) const SAMPLES: u32 = 4;

/// The fixed part of drawing: one pipeline a pass.
pub(crate) struct Pipelines {
    pub(crate) backdrop: RenderPipeline,
    pub(crate) surface: RenderPipeline,
    pub(crate) occlusion: RenderPipeline,
    pub(crate) line: RenderPipeline,
    /// Binding 0: the frame's constants.
    pub(crate) frame_layout: BindGroupLayout,
    /// The same and binding 1: the depth buffer.
    pub(crate) depth_layout: BindGroupLayout,
}

/// What differs between the pipelines.
struct Pass<'a> {
    name: &'a str,
    layout: &'a BindGroupLayout,
    buffer: Option<VertexBufferLayout<'a>>,
    strip: bool,
    blend: Option<BlendState>,
    /// `None`: the pass has no depth buffer; else test and whether it is written.
    depth: Option<(CompareFunction, bool)>,
}

impl Pipelines {
    pub(crate) fn new(device: &Device) -> Self {
        let shaders = device.create_shader_module(wgpu::include_wgsl!("shaders.wgsl"));
        let constants = wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: ShaderStages::VERTEX_FRAGMENT,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        };
        let depth = wgpu::BindGroupLayoutEntry {
            binding: 1,
            visibility: ShaderStages::FRAGMENT,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Depth,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: true,
            },
            count: None,
        };
        let layout = |entries: &[wgpu::BindGroupLayoutEntry]| {
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries })
        };
        let frame_layout = layout(&[constants]);
        let depth_layout = layout(&[constants, depth]);
        let pipeline = |pass: Pass<'_>| build(device, &shaders, pass);
        Pipelines {
            backdrop: pipeline(Pass {
                name: "backdrop",
                layout: &frame_layout,
                buffer: None,
                strip: false,
                blend: None,
                depth: Some((CompareFunction::Always, false)),
            }),
            surface: pipeline(Pass {
                name: "surface",
                layout: &frame_layout,
                buffer: Some(VertexBufferLayout {
                    array_stride: size_of::<SurfaceVertex>() as u64,
                    step_mode: VertexStepMode::Vertex,
                    attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Unorm8x4],
                }),
                strip: false,
                blend: None,
                depth: Some((CompareFunction::Less, true)),
            }),
            occlusion: pipeline(Pass {
                name: "occlusion",
                layout: &depth_layout,
                buffer: None,
                strip: false,
                blend: Some(MULTIPLY),
                depth: None,
            }),
            line: pipeline(Pass {
                name: "line",
                layout: &frame_layout,
                buffer: Some(VertexBufferLayout {
                    array_stride: size_of::<Segment>() as u64,
                    step_mode: VertexStepMode::Instance,
                    attributes: &LINE_ATTRIBUTES,
                }),
                strip: true,
                blend: Some(BlendState::ALPHA_BLENDING),
                depth: Some((CompareFunction::LessEqual, false)),
            }),
            frame_layout,
            depth_layout,
        }
    }
}

const LINE_ATTRIBUTES: [wgpu::VertexAttribute; 5] = wgpu::vertex_attr_array![
    0 => Float32x3, 1 => Float32, 2 => Float32x3, 3 => Float32, 4 => Unorm8x4
];

/// Multiplies what is there and leaves its opacity.
const MULTIPLY: BlendState = BlendState {
    color: BlendComponent {
        src_factor: BlendFactor::Dst,
        dst_factor: BlendFactor::Zero,
        operation: BlendOperation::Add,
    },
    alpha: BlendComponent {
        src_factor: BlendFactor::Zero,
        dst_factor: BlendFactor::One,
        operation: BlendOperation::Add,
    },
};

fn build(device: &Device, shaders: &ShaderModule, pass: Pass<'_>) -> RenderPipeline {
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(pass.name),
        bind_group_layouts: &[Some(pass.layout)],
        immediate_size: 0,
    });
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(pass.name),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: shaders,
            entry_point: Some(&format!("{}_vertex", pass.name)),
            compilation_options: Default::default(),
            buffers: &[pass.buffer],
        },
        primitive: wgpu::PrimitiveState {
            topology: if pass.strip {
                wgpu::PrimitiveTopology::TriangleStrip
            } else {
                wgpu::PrimitiveTopology::TriangleList
            },
            ..Default::default()
        },
        depth_stencil: pass.depth.map(|(compare, write)| wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(write),
            depth_compare: Some(compare),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState { count: SAMPLES, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module: shaders,
            entry_point: Some(&format!("{}_fragment", pass.name)),
            compilation_options: Default::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: COLOUR_FORMAT,
                blend: pass.blend,
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}
