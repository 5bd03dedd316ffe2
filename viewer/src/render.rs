//! Renders a scene into a picture without a window: render passes, ambient occlusion,
//! supersampling, then annotations.

use std::path::Path;

use nalgebra::Vector3;
use wgpu::{BufferUsages, TextureFormat, TextureUsages, TextureView};

use crate::ViewError;
use crate::adapter::{self, Gpu};
use crate::camera::{Camera, View};
use crate::overlay::{self, Places};
use crate::passes::DEPTH_FORMAT;
use crate::picture::Picture;
use crate::pipelines::{COLOUR_FORMAT, Pipelines, SAMPLES};
use crate::placement::Covered;
use crate::scene::Scene;
use crate::segments::{VisibleLines, visible_lines};

/// What is behind the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Backdrop {
    /// A light neutral gradient.
    Studio,
    /// White, for print.
    White,
    /// Nothing: the PNG is transparent there.
    Transparent,
}

/// How a picture is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureOptions {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Draw at twice the size and average: finer lines, four times the work.
    pub supersampling: bool,
    /// Darken corners and gaps as daylight does.
    pub occlusion: bool,
    /// What is behind the model.
    pub backdrop: Backdrop,
    /// Light and dark stripes, level around the model, are mirrored in the surfaces: they jump where the
    /// surface has an edge, kink where its curvature jumps, and run smoothly where it is smooth.
    pub reflection_lines: bool,
    /// Caption, legend, scale bar and axes.
    pub annotations: bool,
    /// Size of their letters, 1 as usual: larger for pictures that are shown small.
    pub lettering: f32,
    /// The model axis that the sky light comes from.
    pub sky: Vector3<f64>,
}

impl Default for PictureOptions {
    /// 1920 x 1080 in the studio, annotated.
    fn default() -> Self {
        PictureOptions {
            size: [1920, 1080],
            supersampling: false,
            occlusion: true,
            backdrop: Backdrop::Studio,
            reflection_lines: false,
            annotations: true,
            lettering: 1.0,
            sky: Vector3::z(),
        }
    }
}

/// Constants of one picture, laid out as `Frame` in `shaders.wgsl`.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Frame {
    clip: [[f32; 4]; 4],
    eye: [f32; 4],
    basis: [[f32; 4]; 3],
    sky: [f32; 4],
    viewport: [f32; 4],
    depth: [f32; 4],
    occlusion: [f32; 4],
    backdrop: [[f32; 4]; 2],
}

/// Segments a buffer holds at most: 72 MB, below the smallest limit of any adapter.
const SEGMENTS_PER_BUFFER: usize = 2_000_000;

/// Makes pictures of scenes, without a window.
pub struct Renderer {
    gpu: Gpu,
    pipelines: Pipelines,
}

impl Renderer {
    /// Opens the best graphics adapter. The environment may choose: `WGPU_BACKEND`, `WGPU_ADAPTER_NAME`,
    /// `WGPU_FORCE_FALLBACK_ADAPTER=1` for the software driver.
    ///
    /// # Errors
    /// There is none, or it refuses to work.
    pub fn new() -> Result<Self, ViewError> {
        let gpu = adapter::open()?;
        let invalid = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let pipelines = Pipelines::new(&gpu.device);
        match pollster::block_on(invalid.pop()) {
            Some(error) => Err(failed(&gpu, &error)),
            None => Ok(Renderer { gpu, pipelines }),
        }
    }

    /// The adapter's name, for reports.
    #[must_use]
    pub fn adapter(&self) -> &str {
        &self.gpu.name
    }

    /// Draws the scene.
    ///
    /// # Errors
    /// The scene is empty, the size is absurd, or the adapter fails.
    pub fn render(&self, scene: &Scene, view: &View, options: &PictureOptions) -> Result<Picture, ViewError> {
        self.render_next(scene, view, options, &mut Places::default())
    }

    /// Draws the next picture of a series: caption and legend stay where they are in the first one.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn render_next(
        &self,
        scene: &Scene,
        view: &View,
        options: &PictureOptions,
        places: &mut Places,
    ) -> Result<Picture, ViewError> {
        let factor = if options.supersampling { 2 } else { 1 };
        let [width, height] = options.size;
        let largest = self.gpu.largest_side_px / factor;
        if width == 0 || height == 0 || width > largest || height > largest {
            return Err(ViewError::Size { width, height, largest });
        }
        if scene.is_empty() {
            return Err(ViewError::EmptyScene);
        }
        let camera = Camera::frame(view, scene.points(), options.size);
        let device = &self.gpu.device;
        let invalid = device.push_error_scope(wgpu::ErrorFilter::Validation);
        let memory = device.push_error_scope(wgpu::ErrorFilter::OutOfMemory);
        let drawn = self.draw(scene, &camera, options, factor);
        let failure = pollster::block_on(memory.pop()).or(pollster::block_on(invalid.pop()));
        let (mut picture, share) = match failure {
            Some(error) => Err(failed(&self.gpu, &error)),
            None => drawn,
        }?;
        if options.supersampling {
            picture = picture.halved();
        }
        let model = Covered::of(&picture);
        if options.backdrop == Backdrop::Transparent {
            picture.unmultiply();
        } else {
            picture.make_opaque();
        }
        if options.annotations {
            let look = (share, options.lettering);
            overlay::annotate(&mut picture, scene, &camera, &model, look, places);
        }
        Ok(picture)
    }

    /// The picture, and the least part of a layer's lines that is drawn.
    fn draw(
        &self,
        scene: &Scene,
        camera: &Camera,
        options: &PictureOptions,
        factor: u32,
    ) -> Result<(Picture, f32), ViewError> {
        let device = &self.gpu.device;
        let size = options.size.map(|s| s * factor);
        let attachment = TextureUsages::RENDER_ATTACHMENT;
        let colour = self.texture(size, COLOUR_FORMAT, SAMPLES, attachment);
        let depth = self.texture(size, DEPTH_FORMAT, SAMPLES, attachment | TextureUsages::TEXTURE_BINDING);
        let resolved = self.texture(size, COLOUR_FORMAT, 1, attachment | TextureUsages::COPY_SRC);
        let [colour_view, depth_view, resolved_view] =
            [&colour, &depth, &resolved].map(|t| t.create_view(&Default::default()));

        let frame = frame_constants(scene, camera, options, factor);
        let constants = self.buffer(&[frame], BufferUsages::UNIFORM)?;
        let constants = wgpu::BindGroupEntry { binding: 0, resource: constants.as_entire_binding() };
        let group = |layout, entries: &[wgpu::BindGroupEntry<'_>]| {
            device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries })
        };
        let frame_group = group(&self.pipelines.layouts.frame, std::slice::from_ref(&constants));
        let depth_entry =
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&depth_view) };
        let depth_group = group(&self.pipelines.layouts.depth, &[constants, depth_entry]);

        let mut encoder = device.create_command_encoder(&Default::default());
        {
            let depth_attachment = depth_attachment(&depth_view, wgpu::LoadOp::Clear(1.0));
            let mut pass = begin(&mut encoder, &colour_view, None, true, Some(depth_attachment));
            pass.set_bind_group(0, &frame_group, &[]);
            if options.backdrop != Backdrop::Transparent {
                pass.set_pipeline(&self.pipelines.backdrop);
                pass.draw(0..3, 0..1);
            }
            pass.set_pipeline(&self.pipelines.surface);
            for surface in scene.surfaces.iter().filter(|s| !s.indices.is_empty()) {
                let vertices = self.buffer(&surface.vertices, BufferUsages::VERTEX)?;
                let indices = self.buffer(&surface.indices, BufferUsages::INDEX)?;
                pass.set_vertex_buffer(0, vertices.slice(..));
                pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed(0..surface.indices.len() as u32, 0, 0..1);
            }
        }
        if options.occlusion {
            let mut pass = begin(&mut encoder, &colour_view, None, false, None);
            pass.set_bind_group(0, &depth_group, &[]);
            pass.set_pipeline(&self.pipelines.occlusion);
            pass.draw(0..3, 0..1);
        }
        // A software driver draws those while the lines are chosen.
        self.gpu.queue.submit([encoder.finish()]);
        let choose = |layer| visible_lines(scene, layer, camera, options.size);
        let lines: Vec<VisibleLines> = scene.lines.iter().map(choose).collect();
        let mut encoder = device.create_command_encoder(&Default::default());
        {
            let depth_attachment = depth_attachment(&depth_view, wgpu::LoadOp::Load);
            let mut pass =
                begin(&mut encoder, &colour_view, Some(&resolved_view), false, Some(depth_attachment));
            pass.set_bind_group(0, &frame_group, &[]);
            pass.set_pipeline(&self.pipelines.line);
            for layer in &lines {
                for chunk in layer.segments.chunks(SEGMENTS_PER_BUFFER) {
                    let instances = self.buffer(chunk, BufferUsages::VERTEX)?;
                    pass.set_vertex_buffer(0, instances.slice(..));
                    pass.draw(0..4, 0..chunk.len() as u32);
                }
            }
        }
        let share = lines.iter().map(|l| l.share).fold(1.0, f32::min);
        self.gpu.queue.submit([encoder.finish()]);
        Ok((self.gpu.read(&resolved)?, share))
    }

    fn texture(
        &self,
        size: [u32; 2],
        format: TextureFormat,
        samples: u32,
        usage: TextureUsages,
    ) -> wgpu::Texture {
        self.gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: extent(size),
            mip_level_count: 1,
            sample_count: samples,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        })
    }

    /// A buffer with these contents. `create_buffer_init` would panic where the device is lost.
    fn buffer<T: bytemuck::Pod>(
        &self,
        contents: &[T],
        usage: BufferUsages,
    ) -> Result<wgpu::Buffer, ViewError> {
        let bytes: &[u8] = bytemuck::cast_slice(contents);
        let size = (bytes.len() as u64).next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT);
        let buffer = self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: size.max(wgpu::COPY_BUFFER_ALIGNMENT),
            usage,
            mapped_at_creation: true,
        });
        buffer
            .get_mapped_range_mut(..)
            .map_err(|e| failed(&self.gpu, &e))?
            .slice(..bytes.len())
            .copy_from_slice(bytes);
        buffer.unmap();
        Ok(buffer)
    }
}

/// Draws the scene into a PNG file.
///
/// # Errors
/// As [`Renderer::render`] and [`Picture::save`]; nothing is left at `path` then.
pub fn render_png(
    renderer: &Renderer,
    scene: &Scene,
    view: &View,
    options: &PictureOptions,
    path: &Path,
) -> Result<(), ViewError> {
    renderer.render(scene, view, options)?.save(path).map(drop)
}

fn extent([width, height]: [u32; 2]) -> wgpu::Extent3d {
    wgpu::Extent3d { width, height, depth_or_array_layers: 1 }
}

fn depth_attachment(
    view: &TextureView,
    load: wgpu::LoadOp<f32>,
) -> wgpu::RenderPassDepthStencilAttachment<'_> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(wgpu::Operations { load, store: wgpu::StoreOp::Store }),
        stencil_ops: None,
    }
}

fn begin<'e>(
    encoder: &'e mut wgpu::CommandEncoder,
    colour: &TextureView,
    resolve_target: Option<&TextureView>,
    clear: bool,
    depth_stencil_attachment: Option<wgpu::RenderPassDepthStencilAttachment<'_>>,
) -> wgpu::RenderPass<'e> {
    let load = if clear { wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT) } else { wgpu::LoadOp::Load };
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: None,
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: colour,
            depth_slice: None,
            resolve_target,
            ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
        })],
        depth_stencil_attachment,
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    })
}

fn frame_constants(scene: &Scene, camera: &Camera, options: &PictureOptions, factor: u32) -> Frame {
    // Occlusion reaches a fixed part of the picture, so that all sizes look alike.
    let [width, height] = options.size.map(|s| s as f32);
    let reach_px = 0.035 * width.min(height);
    let mm_per_px = camera.mm_per_px() as f32;
    let wide = |v: &Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32, 0.0];
    let mut sky = wide(&options.sky.try_normalize(0.0).unwrap_or(Vector3::z()));
    sky[3] = match (options.reflection_lines, scene.is_map) {
        (true, _) => 1.0,
        (false, true) => 2.0,
        (false, false) => 0.0,
    };
    let depth = camera.depth_decode().map(|v| v as f32);
    let backdrop = match options.backdrop {
        Backdrop::Studio => [[0.855, 0.875, 0.9, 1.0], [0.975, 0.975, 0.97, 1.0]],
        Backdrop::White | Backdrop::Transparent => [[1.0; 4]; 2],
    };
    Frame {
        clip: camera.clip_matrix(&scene.origin).map(|v| v as f32).into(),
        eye: camera.eye(&scene.origin).map(|v| v as f32),
        basis: camera.basis().each_ref().map(wide),
        sky,
        viewport: [width, height, factor as f32, mm_per_px],
        depth: [depth[0], depth[1], depth[2], 0.0],
        occlusion: [reach_px * factor as f32, reach_px * mm_per_px, 0.95, 0.0],
        backdrop,
    }
}

fn failed(gpu: &Gpu, reason: &dyn std::fmt::Display) -> ViewError {
    ViewError::Device { adapter: gpu.name.clone(), reason: reason.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Axes;
    use crate::shapes::SurfaceVertex;

    #[test]
    fn a_lost_device_is_an_error_with_the_adapter_s_name() {
        let renderer = match Renderer::new() {
            Ok(renderer) => renderer,
            Err(e) => return claymill_tests::leave_out(claymill_tests::Need::Vulkan, e),
        };
        let mut scene = Scene::default();
        let corner =
            |x, y| SurfaceVertex { position: [x, y, 0.0], normal: [0.0, 0.0, 1.0], colour: [200; 4] };
        scene.add_triangles(&[corner(0.0, 0.0), corner(1.0, 0.0), corner(0.0, 1.0)], &[[0, 1, 2]]);
        let view = View::top(&Axes::default());
        let options = PictureOptions { size: [64, 48], ..PictureOptions::default() };
        assert!(renderer.render(&scene, &view, &options).is_ok());
        renderer.gpu.device.destroy();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lost.png");
        let error = render_png(&renderer, &scene, &view, &options, &path).unwrap_err();
        assert!(
            matches!(&error, ViewError::Device { adapter, .. } if adapter == renderer.adapter()),
            "{error}"
        );
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
