//! What drawing with wgpu is made of, for all who do.

use wgpu::{
    BindGroupLayout, BlendComponent, BlendFactor, BlendOperation, BlendState, CompareFunction, Device,
    RenderPipeline, ShaderModule, ShaderStages, TextureFormat, VertexBufferLayout, VertexStepMode,
};

use crate::shapes::SurfaceVertex;

/// Of depth buffers.
pub const DEPTH_FORMAT: TextureFormat = TextureFormat::Depth32Float;

/// Multiplies what is there and leaves its opacity.
pub const MULTIPLY: BlendState = BlendState {
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

/// Group 0 of the shaders.
pub struct FrameLayouts {
    /// Binding 0: the frame's constants.
    pub frame: BindGroupLayout,
    /// The same and binding 1: the depth buffer.
    pub depth: BindGroupLayout,
}

impl FrameLayouts {
    /// On a device.
    #[must_use]
    pub fn new(device: &Device) -> Self {
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
        FrameLayouts { frame: layout(&[constants]), depth: layout(&[constants, depth]) }
    }
}

/// How vertices of surfaces lie in a buffer: position, normal and colour at locations 0, 1 and 2.
#[must_use]
pub fn surface_layout() -> VertexBufferLayout<'static> {
    const ATTRIBUTES: [wgpu::VertexAttribute; 3] =
        wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Unorm8x4];
    VertexBufferLayout {
        array_stride: size_of::<SurfaceVertex>() as u64,
        step_mode: VertexStepMode::Vertex,
        attributes: &ATTRIBUTES,
    }
}

/// What differs between the pipelines of a picture.
#[derive(Clone, Copy)]
pub struct Pass<'a> {
    /// Entry points: `NAME_vertex` and `NAME_fragment`.
    pub name: &'a str,
    /// The pass whose `_vertex` it has, if not its own.
    pub vertex_of: Option<&'a str>,
    /// Of its groups.
    pub layouts: &'a [Option<&'a BindGroupLayout>],
    /// Of its vertices.
    pub buffers: &'a [Option<VertexBufferLayout<'a>>],
    /// Whether they make a strip; else three make a triangle.
    pub strip: bool,
    /// With what is there already.
    pub blend: Option<BlendState>,
    /// `None`: the pass has no depth buffer; else test and whether it is written.
    pub depth: Option<(CompareFunction, bool)>,
}

impl<'a> Pass<'a> {
    /// The first pass: behind everything, without vertices of its own.
    #[must_use]
    pub fn backdrop(layouts: &'a [Option<&'a BindGroupLayout>]) -> Self {
        Pass {
            name: "backdrop",
            vertex_of: None,
            layouts,
            buffers: &[],
            strip: false,
            blend: None,
            depth: Some((CompareFunction::Always, false)),
        }
    }
}

/// What the pipelines of a picture have in common.
pub struct Press<'a> {
    device: &'a Device,
    shaders: ShaderModule,
    format: TextureFormat,
    samples: u32,
}

impl<'a> Press<'a> {
    /// For pictures of a format with so many samples a pixel. `own` is WGSL that follows `optics.wgsl`, and declares
    /// `frame` for it.
    #[must_use]
    pub fn new(device: &'a Device, own: &str, format: TextureFormat, samples: u32) -> Self {
        let shaders = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl([include_str!("optics.wgsl"), own].concat().into()),
        });
        Press { device, shaders, format, samples }
    }

    /// The pipeline of a pass.
    #[must_use]
    pub fn pipeline(&self, pass: &Pass<'_>) -> RenderPipeline {
        let layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(pass.name),
            bind_group_layouts: pass.layouts,
            immediate_size: 0,
        });
        let topology = match pass.strip {
            true => wgpu::PrimitiveTopology::TriangleStrip,
            false => wgpu::PrimitiveTopology::TriangleList,
        };
        self.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(pass.name),
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &self.shaders,
                entry_point: Some(&format!("{}_vertex", pass.vertex_of.unwrap_or(pass.name))),
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
            multisample: wgpu::MultisampleState { count: self.samples, ..Default::default() },
            fragment: Some(wgpu::FragmentState {
                module: &self.shaders,
                entry_point: Some(&format!("{}_fragment", pass.name)),
                compilation_options: Default::default(),
                targets: &[Some(wgpu::ColorTargetState {
                    format: self.format,
                    blend: pass.blend,
                    write_mask: wgpu::ColorWrites::ALL,
                })],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}
