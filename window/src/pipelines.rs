use claymill_viewer::SurfaceVertex;
use wgpu::{
    BindGroupLayout, BlendComponent, BlendFactor, BlendOperation, BlendState, CompareFunction, Device,
    RenderPipeline, ShaderModule, ShaderStages, TextureFormat, VertexBufferLayout, VertexStepMode,
};

use crate::lines::LineVertex;

/// Plain values: the shaders and the toolkit both mean them as shown.
pub(crate) const COLOUR_FORMAT: TextureFormat = TextureFormat::Rgba8Unorm;
pub(crate) const DEPTH_FORMAT: TextureFormat = TextureFormat::Depth32Float;

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
    /// The frame's constants.
    pub(crate) frame: BindGroupLayout,
    /// The same and the depth buffer.
    pub(crate) depth: BindGroupLayout,
    /// Looks by tag.
    pub(crate) tags: BindGroupLayout,
}

impl Layouts {
    pub(crate) fn new(device: &Device) -> Self {
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
        let texture = |binding, visibility, sample_type, multisampled| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty: wgpu::BindingType::Texture {
                sample_type,
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled,
            },
            count: None,
        };
        let layout = |entries: &[wgpu::BindGroupLayoutEntry]| {
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries })
        };
        let depth = texture(1, ShaderStages::FRAGMENT, wgpu::TextureSampleType::Depth, true);
        Layouts {
            frame: layout(&[constants]),
            depth: layout(&[constants, depth]),
            tags: layout(&[texture(0, ShaderStages::VERTEX, wgpu::TextureSampleType::Uint, false)]),
        }
    }
}

struct Pass<'a> {
    name: &'a str,
    layouts: &'a [Option<&'a BindGroupLayout>],
    buffers: &'a [Option<VertexBufferLayout<'a>>],
    strip: bool,
    blend: Option<BlendState>,
    depth: Option<(CompareFunction, bool)>,
}

impl Pipelines {
    pub(crate) fn new(device: &Device, layouts: &Layouts, samples: u32) -> Self {
        let shaders = device.create_shader_module(wgpu::include_wgsl!("stage.wgsl"));
        let pipeline = |pass: Pass<'_>| build(device, &shaders, samples, &pass);
        let frame = [Some(&layouts.frame)];
        let surface = [Some(VertexBufferLayout {
            array_stride: size_of::<SurfaceVertex>() as u64,
            step_mode: VertexStepMode::Vertex,
            attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Unorm8x4],
        })];
        // One buffer twice, the second time a vertex further on.
        let end = |attributes| {
            let array_stride = size_of::<LineVertex>() as u64;
            Some(VertexBufferLayout { array_stride, step_mode: VertexStepMode::Instance, attributes })
        };
        let ends = [end(&BEGIN), end(&END)];
        let over = Some(BlendState::ALPHA_BLENDING);
        let whole = Pass { name: "", layouts: &frame, buffers: &[], strip: false, blend: None, depth: None };
        Pipelines {
            backdrop: pipeline(Pass {
                name: "backdrop",
                depth: Some((CompareFunction::Always, false)),
                ..whole
            }),
            surface: pipeline(Pass {
                name: "surface",
                buffers: &surface,
                depth: Some((CompareFunction::Less, true)),
                ..whole
            }),
            tint: pipeline(Pass {
                name: "tint",
                buffers: &surface,
                blend: over,
                depth: Some((CompareFunction::Equal, false)),
                ..whole
            }),
            line: pipeline(Pass {
                name: "line",
                layouts: &[Some(&layouts.frame), Some(&layouts.tags)],
                buffers: &ends,
                strip: true,
                blend: over,
                depth: Some((CompareFunction::LessEqual, false)),
            }),
            occlusion: (samples > 1).then(|| {
                pipeline(Pass {
                    name: "occlusion",
                    layouts: &[Some(&layouts.depth)],
                    blend: Some(MULTIPLY),
                    ..whole
                })
            }),
        }
    }
}

const BEGIN: [wgpu::VertexAttribute; 2] = wgpu::vertex_attr_array![0 => Float32x3, 1 => Uint32];
const END: [wgpu::VertexAttribute; 1] = wgpu::vertex_attr_array![2 => Float32x3];

/// Multiplies what is there.
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

fn build(device: &Device, shaders: &ShaderModule, samples: u32, pass: &Pass<'_>) -> RenderPipeline {
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(pass.name),
        bind_group_layouts: pass.layouts,
        immediate_size: 0,
    });
    let vertex = format!("{}_vertex", pass.name);
    let topology = match pass.strip {
        true => wgpu::PrimitiveTopology::TriangleStrip,
        false => wgpu::PrimitiveTopology::TriangleList,
    };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(pass.name),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: shaders,
            // A tint lies at the very depth of the surface under it.
            entry_point: Some(match pass.name {
                "tint" => "surface_vertex",
                _ => &vertex,
            }),
            compilation_options: Default::default(),
            buffers: pass.buffers,
        },
        primitive: wgpu::PrimitiveState { topology, ..Default::default() },
        depth_stencil: pass.depth.map(|(compare, write)| wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(write),
            depth_compare: Some(compare),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: wgpu::MultisampleState { count: samples, ..Default::default() },
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
