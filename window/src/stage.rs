//! The picture of a desk, drawn into a texture.

use std::ops::Range;

use claymill_nurbs::Aabb;
use claymill_viewer::{DEPTH_FORMAT, Gpu, PosedTool, Scene, SurfaceMesh, SurfaceVertex};
use wgpu::util::DeviceExt;
use wgpu::{BufferUsages, TextureFormat, TextureUsages, TextureView};

use crate::accents::{self, Accents};
use crate::desk::Desk;
use crate::frame::frame;
use crate::layers::{Layers, LineLook};
use crate::lines::{LineVertex, Lines};
use crate::pick::Section;
use crate::pipelines::{COLOUR_FORMAT, Layouts, Pipelines};

/// Samples a pixel of a fine picture; every adapter can do four.
const FINE_SAMPLES: u32 = 4;
/// Vertices of lines in one buffer: 64 MB.
const BLOCK: usize = 4_000_000;
/// Looks in a row of their texture, as in the shader.
const TAGS_PER_ROW: usize = 2048;
/// How much trouble is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Care {
    /// One sample a pixel, while something moves.
    Quick,
    /// Several, and shade in corners.
    Fine,
}

struct Target {
    size: [u32; 2],
    /// Only with several samples.
    colour: Option<TextureView>,
    depth: TextureView,
    shown: wgpu::Texture,
}

struct SurfaceBuffers {
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    /// Of the faces that are shown.
    count: u32,
}

struct LineBuffers {
    blocks: Vec<(Range<usize>, wgpu::Buffer)>,
    looks: Option<wgpu::BindGroup>,
}

/// Draws a desk. Buffers are kept from picture to picture and renewed when what they hold has changed.
pub struct Stage {
    layouts: Layouts,
    quick: Pipelines,
    fine: Pipelines,
    targets: [Option<Target>; 2],
    surfaces: Vec<SurfaceBuffers>,
    /// Of the material.
    skin: Vec<SurfaceBuffers>,
    tracks: LineBuffers,
    seams: LineBuffers,
    layers: Option<Layers>,
    paintings: u64,
    /// Of the section, and what it depends on.
    outline: Vec<[[f32; 3]; 2]>,
    outlined: Option<(Section, Vec<bool>, bool)>,
}

impl Stage {
    /// Puts what does not change on the graphics card.
    #[must_use]
    pub fn new(gpu: &Gpu, desk: &Desk<'_>) -> Self {
        let layouts = Layouts::new(&gpu.device);
        Stage {
            quick: Pipelines::new(&gpu.device, &layouts, 1),
            fine: Pipelines::new(&gpu.device, &layouts, FINE_SAMPLES),
            layouts,
            targets: [None, None],
            surfaces: Vec::new(),
            skin: Vec::new(),
            tracks: LineBuffers::new(gpu, &desk.tracks.lines),
            seams: LineBuffers::new(gpu, &desk.seam_lines),
            layers: None,
            paintings: 0,
            outline: Vec::new(),
            outlined: None,
        }
    }

    /// Draws what the desk shows, in `size` pixels; the returned texture holds it.
    pub fn draw(&mut self, gpu: &Gpu, desk: &Desk<'_>, size: [u32; 2], care: Care) -> &wgpu::Texture {
        self.renew(gpu, desk);
        let slot = usize::from(care == Care::Fine);
        if self.targets[slot].as_ref().is_none_or(|t| t.size != size) {
            self.targets[slot] = Some(Target::new(gpu, size, care));
        }
        let accents = Accents::of(desk, &self.outline);
        let accents = (
            buffer(gpu, &accents.vertices, BufferUsages::VERTEX),
            accents.vertices.len(),
            look_texture(gpu, &self.layouts, &accents.looks),
        );
        let tool = tool(desk).map(|mesh| SurfaceBuffers::new(gpu, &mesh));
        let chosen = chosen(desk).map(|mesh| SurfaceBuffers::new(gpu, &mesh));

        let target = self.targets[slot].as_ref().expect("made above");
        let pipelines = if care == Care::Fine { &self.fine } else { &self.quick };
        let constants = buffer(gpu, &[frame(desk, size)], BufferUsages::UNIFORM);
        let constants = wgpu::BindGroupEntry { binding: 0, resource: constants.as_entire_binding() };
        let group = |layout, entries: &[wgpu::BindGroupEntry<'_>]| {
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries })
        };
        let frame_group = group(&self.layouts.frame.frame, std::slice::from_ref(&constants));
        let shown = target.shown.create_view(&Default::default());
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = target.begin(&mut encoder, &shown, Part::First);
            pass.set_bind_group(0, &frame_group, &[]);
            pass.set_pipeline(&pipelines.backdrop);
            pass.draw(0..3, 0..1);
            pass.set_pipeline(&pipelines.surface);
            let skin = self.skin.iter().filter(|_| desk.layers.surfaces);
            for s in self.surfaces.iter().chain(skin).chain(&tool).filter(|s| s.count > 0) {
                s.draw(&mut pass);
            }
            if let Some(chosen) = &chosen {
                pass.set_pipeline(&pipelines.tint);
                chosen.draw(&mut pass);
            }
        }
        if let Some(occlusion) = &pipelines.occlusion {
            let depth = wgpu::BindGroupEntry {
                binding: 1,
                resource: wgpu::BindingResource::TextureView(&target.depth),
            };
            let depth_group = group(&self.layouts.frame.depth, &[constants, depth]);
            let mut pass = target.begin(&mut encoder, &shown, Part::Shade);
            pass.set_bind_group(0, &depth_group, &[]);
            pass.set_pipeline(occlusion);
            pass.draw(0..3, 0..1);
        }
        {
            let mut pass = target.begin(&mut encoder, &shown, Part::Last);
            pass.set_bind_group(0, &frame_group, &[]);
            pass.set_pipeline(&pipelines.line);
            let in_sight = |b: &Aabb| box_in_sight(b, desk, size);
            self.seams.draw(&mut pass, desk.seam_lines.visible(0.0, (u32::MAX, 1.0), in_sight));
            // Every other pass of those is enough for a moment.
            let spacing_mm = if care == Care::Quick { 2.0 * desk.spacing_mm() } else { desk.spacing_mm() };
            self.tracks.draw(&mut pass, desk.tracks.lines.visible(spacing_mm, desk.until(), in_sight));
            if let (vertices, count @ 1.., Some(looks)) = &accents {
                pass.set_bind_group(1, looks, &[]);
                pass.set_vertex_buffer(0, vertices.slice(..));
                pass.set_vertex_buffer(1, vertices.slice(size_of::<LineVertex>() as u64..));
                pass.draw(0..4, 0..*count as u32 - 1);
            }
        }
        gpu.queue.submit([encoder.finish()]);
        &self.targets[slot].as_ref().expect("made above").shown
    }

    /// Segments that the lines of the last layers have in all: what a picture of everything draws.
    #[must_use]
    pub fn segments(desk: &Desk<'_>) -> [usize; 2] {
        let of = |spacing_mm: f32| {
            let visible = desk.tracks.lines.visible(spacing_mm, (u32::MAX, 1.0), |_| true);
            visible.map(|r| r.len()).sum()
        };
        [of(0.0), of(desk.spacing_mm())]
    }

    fn renew(&mut self, gpu: &Gpu, desk: &Desk<'_>) {
        let before = self.layers.replace(desk.layers.clone());
        let repainted = self.paintings != desk.paintings;
        self.paintings = desk.paintings;
        if repainted {
            self.surfaces = desk.scene.surfaces.iter().map(|s| SurfaceBuffers::new(gpu, s)).collect();
            self.skin = desk.skin().iter().map(|s| SurfaceBuffers::new(gpu, s)).collect();
        }
        let changed = before.as_ref() != Some(&desk.layers);
        if changed || repainted {
            for (buffers, indices) in self.surfaces.iter_mut().zip(shown_indices(desk)) {
                buffers.count = indices.len() as u32;
                gpu.queue.write_buffer(&buffers.indices, 0, bytemuck::cast_slice(&indices));
            }
        }
        if changed {
            self.tracks.looks = look_texture(gpu, &self.layouts, &desk.move_looks());
            self.seams.looks = look_texture(gpu, &self.layouts, &desk.seam_looks());
        }
        let section = desk.section().map(|s| (s, desk.layers.regions.clone(), desk.layers.surfaces));
        if section != self.outlined {
            self.outline = section.as_ref().map_or_else(Vec::new, |(s, ..)| accents::outline(desk, s));
            self.outlined = section;
        }
    }
}

/// Indices of the faces that are shown, by surface buffer.
fn shown_indices(desk: &Desk<'_>) -> Vec<Vec<u32>> {
    let exhibit = desk.exhibit();
    let mut faces = exhibit.meshes.iter().enumerate();
    let of_surface = |s: &SurfaceMesh| {
        let mut shown = Vec::with_capacity(s.indices.len());
        let (mut first, mut vertex) = (0, 0);
        while vertex < s.vertices.len() {
            let Some((face, mesh)) = faces.next() else { break };
            let count = 3 * mesh.triangles.len();
            if desk.layers.shows_face(exhibit, face) {
                shown.extend_from_slice(&s.indices[first..first + count]);
            }
            first += count;
            vertex += mesh.points.len();
        }
        shown
    };
    desk.scene.surfaces.iter().map(of_surface).collect()
}

/// The tool where it is, with its holder where the job has one.
fn tool(desk: &Desk<'_>) -> Option<SurfaceMesh> {
    let place = desk.tool_place().filter(|_| desk.layers.tool)?;
    let mut scene = Scene::new(desk.scene.origin);
    match desk.tool_record(&place) {
        Some(record) => {
            scene.add_posed_tool(&PosedTool { record: &record, tip: place.tip, axis: place.axis });
        }
        None => scene.add_tool(&place.tip, &place.axis, place.radius_mm),
    }
    scene.surfaces.pop()
}

/// The picked face.
fn chosen(desk: &Desk<'_>) -> Option<SurfaceMesh> {
    let face = desk.picked()?.spot?.face;
    if !desk.layers.shows_face(desk.exhibit(), face) {
        return None;
    }
    let mesh = &desk.exhibit().meshes[face];
    let origin = desk.scene.origin;
    let vertex = |p: &claymill_nurbs::Point3| {
        let q = p - origin;
        SurfaceVertex {
            position: [q.x as f32, q.y as f32, q.z as f32],
            normal: [0.0, 0.0, 1.0],
            colour: [0; 4],
        }
    };
    Some(SurfaceMesh {
        vertices: mesh.points.iter().map(vertex).collect(),
        indices: mesh.triangles.iter().flatten().copied().collect(),
    })
}

fn box_in_sight(bounds: &Aabb, desk: &Desk<'_>, size: [u32; 2]) -> bool {
    let corners = bounds.vertices().map(|c| desk.sight.project(&(c + desk.scene.origin.coords)));
    corners.iter().any(Option::is_none)
        || (0..2).all(|i| {
            let along = corners.iter().flatten().map(|c| c[i]);
            along.clone().any(|x| x >= 0.0) && along.clone().any(|x| x <= f64::from(size[i]))
        })
}

/// Which part of a picture is drawn.
#[derive(Clone, Copy, PartialEq)]
enum Part {
    First,
    Shade,
    Last,
}

impl Target {
    fn new(gpu: &Gpu, size: [u32; 2], care: Care) -> Self {
        let texture = |format: TextureFormat, sample_count, usage| {
            gpu.device.create_texture(&wgpu::TextureDescriptor {
                label: None,
                size: extent(size),
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            })
        };
        let view = |t: &wgpu::Texture| t.create_view(&Default::default());
        let (drawn, read) = (TextureUsages::RENDER_ATTACHMENT, TextureUsages::TEXTURE_BINDING);
        let samples = if care == Care::Fine { FINE_SAMPLES } else { 1 };
        Target {
            size,
            colour: (samples > 1).then(|| view(&texture(COLOUR_FORMAT, samples, drawn))),
            depth: view(&texture(DEPTH_FORMAT, samples, if samples > 1 { drawn | read } else { drawn })),
            shown: texture(COLOUR_FORMAT, 1, drawn | read | TextureUsages::COPY_SRC),
        }
    }

    fn begin<'e>(
        &self,
        encoder: &'e mut wgpu::CommandEncoder,
        shown: &TextureView,
        part: Part,
    ) -> wgpu::RenderPass<'e> {
        let load = match part {
            Part::First => wgpu::LoadOp::Clear(wgpu::Color::BLACK),
            Part::Shade | Part::Last => wgpu::LoadOp::Load,
        };
        let depth_load = if part == Part::First { wgpu::LoadOp::Clear(1.0) } else { wgpu::LoadOp::Load };
        let depth = wgpu::RenderPassDepthStencilAttachment {
            view: &self.depth,
            depth_ops: Some(wgpu::Operations { load: depth_load, store: wgpu::StoreOp::Store }),
            stencil_ops: None,
        };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: None,
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: self.colour.as_ref().unwrap_or(shown),
                depth_slice: None,
                resolve_target: self.colour.as_ref().and((part == Part::Last).then_some(shown)),
                ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: (part != Part::Shade).then_some(depth),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        })
    }
}

impl SurfaceBuffers {
    fn new(gpu: &Gpu, mesh: &SurfaceMesh) -> Self {
        SurfaceBuffers {
            vertices: buffer(gpu, &mesh.vertices, BufferUsages::VERTEX),
            indices: buffer(gpu, &mesh.indices, BufferUsages::INDEX),
            count: mesh.indices.len() as u32,
        }
    }

    fn draw(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..self.count, 0, 0..1);
    }
}

impl LineBuffers {
    fn new(gpu: &Gpu, lines: &Lines) -> Self {
        let mut blocks = Vec::new();
        let mut from = 0;
        for (i, chunk) in lines.chunks.iter().enumerate() {
            let last = i + 1 == lines.chunks.len();
            if last || lines.chunks[i + 1].vertices.end - from > BLOCK {
                let range = from..chunk.vertices.end;
                blocks.push((range.clone(), buffer(gpu, &lines.vertices[range], BufferUsages::VERTEX)));
                from = chunk.vertices.end;
            }
        }
        LineBuffers { blocks, looks: None }
    }

    fn draw(&self, pass: &mut wgpu::RenderPass<'_>, ranges: impl Iterator<Item = Range<usize>>) {
        let Some(looks) = &self.looks else { return };
        pass.set_bind_group(1, looks, &[]);
        let mut bound = usize::MAX;
        let mut waiting: Option<Range<usize>> = None;
        let mut draw = |range: Range<usize>| {
            let Some(b) = self.blocks.iter().position(|(r, _)| r.contains(&range.start)) else { return };
            let (block, buffer) = &self.blocks[b];
            if bound != b {
                pass.set_vertex_buffer(0, buffer.slice(..));
                pass.set_vertex_buffer(1, buffer.slice(size_of::<LineVertex>() as u64..));
                bound = b;
            }
            let end = range.end.min(block.end);
            pass.draw(0..4, (range.start - block.start) as u32..(end - block.start) as u32 - 1);
        };
        for range in ranges {
            match &mut waiting {
                // Neighbours in one go, as far as one buffer reaches.
                Some(w)
                    if w.end == range.start && !self.blocks.iter().any(|(b, _)| b.start == range.start) =>
                {
                    w.end = range.end;
                }
                _ => {
                    if let Some(ready) = waiting.replace(range) {
                        draw(ready);
                    }
                }
            }
        }
        if let Some(ready) = waiting {
            draw(ready);
        }
    }
}

fn look_texture(gpu: &Gpu, layouts: &Layouts, looks: &[LineLook]) -> Option<wgpu::BindGroup> {
    let rows = looks.len().div_ceil(TAGS_PER_ROW);
    if rows == 0 || rows > gpu.device.limits().max_texture_dimension_2d as usize {
        return None;
    }
    let mut texels = looks.to_vec();
    texels.resize(rows * TAGS_PER_ROW, LineLook::NONE);
    let texture = gpu.device.create_texture_with_data(
        &gpu.queue,
        &wgpu::TextureDescriptor {
            label: None,
            size: extent([TAGS_PER_ROW as u32, rows as u32]),
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: TextureFormat::Rg32Uint,
            usage: TextureUsages::TEXTURE_BINDING | TextureUsages::COPY_DST,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        bytemuck::cast_slice(&texels),
    );
    let view = texture.create_view(&Default::default());
    let entry = wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) };
    Some(gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &layouts.tags,
        entries: &[entry],
    }))
}

/// A buffer that can be written again; never an empty one, which some drivers refuse. Filled through the queue: a
/// buffer that is mapped as it is made panics when the device is gone.
fn buffer<T: bytemuck::Pod>(gpu: &Gpu, contents: &[T], usage: BufferUsages) -> wgpu::Buffer {
    let bytes: &[u8] = bytemuck::cast_slice(contents);
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: (bytes.len().max(32) as u64).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT),
        usage: usage | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    gpu.queue.write_buffer(&buffer, 0, bytes);
    buffer
}

fn extent([width, height]: [u32; 2]) -> wgpu::Extent3d {
    wgpu::Extent3d { width, height, depth_or_array_layers: 1 }
}
