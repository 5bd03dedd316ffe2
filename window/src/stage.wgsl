// The model and its lines, after the `optics.wgsl` of all pictures. Positions are mm relative to the scene's origin. Colours are drawn as they are shown, since
// the picture becomes a part of a window whose toolkit mixes them so.

struct Frame {
    clip: mat4x4<f32>,
    eye: vec4<f32>,        // w = 1: a point; w = 0: the direction toward the eye
    right: vec4<f32>,
    up: vec4<f32>,
    back: vec4<f32>,
    sky: vec4<f32>,        // the model's up; w = 1: reflection lines
    viewport: vec4<f32>,   // width px, height px, mm per px, mm by which the triangles are off
    section: vec4<f32>,    // shown where dot(xyz, p) <= w
    depth: vec4<f32>,      // mm = (x·d + y) / (z·d + 1); w: px that occlusion reaches
    backdrop_top: vec4<f32>,
    backdrop_bottom: vec4<f32>,
    tint: vec4<f32>,       // what is selected
}
@group(0) @binding(0) var<uniform> frame: Frame;

fn linear(c: vec3<f32>) -> vec3<f32> {
    return pow(c, vec3(2.2));
}

fn shown(c: vec3<f32>) -> vec3<f32> {
    return pow(clamp(c, vec3(0.0), vec3(1.0)), vec3(1.0 / 2.2));
}

// --- backdrop ---------------------------------------------------------------------------------------------

@fragment
fn backdrop_fragment(in: Backdrop) -> @location(0) vec4<f32> {
    return vec4(mix(frame.backdrop_bottom.rgb, frame.backdrop_top.rgb, in.height), 1.0);
}

// --- surfaces ---------------------------------------------------------------------------------------------

struct Surface {
    @builtin(position) @invariant position: vec4<f32>,
    @location(0) normal: vec3<f32>,
    @location(1) place: vec3<f32>,
    @location(2) colour: vec4<f32>,
}

@vertex
fn surface_vertex(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) colour: vec4<f32>,
) -> Surface {
    return Surface(frame.clip * vec4(position, 1.0), normal, position, vec4(linear(colour.rgb), colour.a));
}

fn lit(colour: vec3<f32>, normal: vec3<f32>, e: vec3<f32>) -> vec3<f32> {
    // Files do not agree on which side is out, and curved sheets show both: the side toward the eye is lit.
    let n = normal * select(-1.0, 1.0, dot(normal, e) > 0.0);
    let right = frame.right.xyz;
    let up = frame.up.xyz;
    let back = frame.back.xyz;
    let key = normalize(-0.45 * right + 0.75 * up + 0.8 * back);
    let fill = normalize(0.9 * right + 0.15 * up + 0.55 * back);
    let sky = 0.5 + 0.5 * dot(n, frame.sky.xyz);
    let ambient = mix(vec3(0.17, 0.165, 0.16), vec3(0.34, 0.35, 0.37), sky);
    let light = ambient + vec3(0.66, 0.65, 0.63) * max(0.0, (dot(n, key) + 0.12) / 1.12)
        + vec3(0.15, 0.16, 0.17) * max(0.0, dot(n, fill));
    let shine = 0.10 * pow(max(0.0, dot(n, normalize(key + e))), 60.0)
        + 0.10 * pow(1.0 - max(0.0, dot(n, e)), 4.0);
    let mirrored = reflect(-e, n);
    let lines = stripes(acos(clamp(dot(mirrored, frame.sky.xyz), -1.0, 1.0)));
    let plain = colour * light + vec3(shine);
    return mix(plain, (0.3 + 0.7 * colour) * mix(0.05, 0.95, lines) * (0.6 + 0.4 * light), frame.sky.w);
}

fn cut_away(p: vec3<f32>) -> bool {
    return dot(p, frame.section.xyz) > frame.section.w;
}

@fragment
fn surface_fragment(in: Surface, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    let e = normalize(frame.eye.xyz - in.place * frame.eye.w);
    let rgb = select(in.colour.rgb, material(in.colour.rgb, in.position.xy), is_material(in.colour.a, front));
    let colour = shown(lit(rgb, normalize(in.normal), e));
    if (cut_away(in.place)) {
        discard;
    }
    return vec4(colour, 1.0);
}

// Over the same triangles, at the same depth.
@fragment
fn tint_fragment(in: Surface) -> @location(0) vec4<f32> {
    if (cut_away(in.place)) {
        discard;
    }
    return frame.tint;
}

// --- occlusion --------------------------------------------------------------------------------------------

@fragment
fn occlusion_fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let mm = frame.depth.w * frame.viewport.z;
    let sky = taken(vec2<i32>(position.xy), Reach(frame.depth.w, mm, 14, 0.08, vec2(0.3 * mm, 1.2 * mm)));
    return vec4(vec3(pow(clamp(1.0 - 0.9 * sky, 0.0, 1.0), 0.6)), 1.0);
}

// --- lines ------------------------------------------------------------------------------------------------

@group(1) @binding(0) var tags: texture_2d<u32>;   // packed colour, width in 1/16 px

struct Line {
    @builtin(position) position: vec4<f32>,
    @location(0) along_across: vec2<f32>,
    @location(1) @interpolate(flat) length_half_width: vec2<f32>,
    @location(2) @interpolate(flat) colour: vec4<f32>,
    @location(3) place: vec3<f32>,
}

@vertex
fn line_vertex(
    @builtin(vertex_index) i: u32,
    @location(0) a: vec3<f32>,
    @location(1) tag: u32,
    @location(2) b: vec3<f32>,
) -> Line {
    var nothing: Line;
    nothing.position = vec4(2.0, 2.0, 2.0, 1.0);
    if (tag >= 0x80000000u) {
        return nothing;
    }
    let look = textureLoad(tags, vec2<u32>(tag % 2048u, tag / 2048u), 0).xy;
    let colour = unpack4x8unorm(look.x);
    let half_width = f32(look.y) / 32.0;
    if (colour.a == 0.0) {
        return nothing;
    }
    let lift_mm = frame.viewport.w + (1.0 + half_width) * frame.viewport.z;
    let strip = band(i, a, b, half_width, 1.0, lift_mm);
    return Line(strip.position, strip.along_across, strip.length_half_width, colour, mix(a, b, strip.t));
}

@fragment
fn line_fragment(in: Line) -> @location(0) vec4<f32> {
    if (cut_away(in.place)) {
        discard;
    }
    let beside_px = beside(in.along_across, in.length_half_width, in.colour.a);
    return vec4(in.colour.rgb, in.colour.a * clamp(0.5 - beside_px, 0.0, 1.0));
}
