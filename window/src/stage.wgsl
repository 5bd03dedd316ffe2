// The model and its lines. Positions are mm relative to the scene's origin. Colours are drawn as they are shown, since
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

fn covering(i: u32) -> vec2<f32> {
    return vec2(f32(i & 1u) * 4.0 - 1.0, f32(i >> 1u) * 4.0 - 1.0);
}

// --- backdrop ---------------------------------------------------------------------------------------------

struct Backdrop {
    @builtin(position) position: vec4<f32>,
    @location(0) height: f32,
}

@vertex
fn backdrop_vertex(@builtin(vertex_index) i: u32) -> Backdrop {
    let xy = covering(i);
    return Backdrop(vec4(xy, 1.0, 1.0), 0.5 + 0.5 * xy.y);
}

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
    let stripes = zebra(acos(clamp(dot(mirrored, frame.sky.xyz), -1.0, 1.0)));
    let plain = colour * light + vec3(shine);
    return mix(plain, (0.3 + 0.7 * colour) * mix(0.05, 0.95, stripes) * (0.6 + 0.4 * light), frame.sky.w);
}

// Stripes of 7.5 degrees, grey where a pixel holds several.
fn zebra(angle: f32) -> f32 {
    let phase = angle * 24.0 / 6.2831853;
    let width = max(fwidth(phase), 1e-5);
    let ramp = abs(fract(phase) - 0.5) * 2.0 - 0.5;
    return mix(clamp(ramp / (2.0 * width) + 0.5, 0.0, 1.0), 0.5, smoothstep(0.35, 0.7, width));
}

fn cut_away(p: vec3<f32>) -> bool {
    return dot(p, frame.section.xyz) > frame.section.w;
}

@fragment
fn surface_fragment(in: Surface) -> @location(0) vec4<f32> {
    let e = normalize(frame.eye.xyz - in.place * frame.eye.w);
    let colour = shown(lit(in.colour.rgb, normalize(in.normal), e));
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

@group(0) @binding(1) var depth_buffer: texture_depth_multisampled_2d;

fn depth_mm(p: vec2<i32>) -> f32 {
    let size = vec2<i32>(textureDimensions(depth_buffer));
    let d = textureLoad(depth_buffer, clamp(p, vec2(0), size - vec2(1)), 0);
    return (frame.depth.x * d + frame.depth.y) / (frame.depth.z * d + 1.0);
}

fn smaller(a: f32, b: f32) -> f32 {
    return select(b, a, abs(a) < abs(b));
}

@vertex
fn occlusion_vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4<f32> {
    return vec4(covering(i), 0.0, 1.0);
}

// How much of what the surface could see of the sky stands in front of it, over a spiral of places.
@fragment
fn occlusion_fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let p = vec2<i32>(position.xy);
    if (textureLoad(depth_buffer, p, 0) >= 1.0) {
        return vec4(1.0);
    }
    let z = depth_mm(p);
    let slope = vec2(
        smaller(depth_mm(p + vec2(1, 0)) - z, z - depth_mm(p - vec2(1, 0))),
        smaller(depth_mm(p + vec2(0, 1)) - z, z - depth_mm(p - vec2(0, 1))),
    );
    let reach_mm = frame.depth.w * frame.viewport.z;
    let count = 14;
    var taken = 0.0;
    for (var i = 0; i < count; i++) {
        let s = (f32(i) + 0.5) / f32(count);
        let angle = 2.399963 * f32(i);
        let offset = vec2<i32>(round(vec2(cos(angle), sin(angle)) * (s * frame.depth.w + 1.0)));
        let away_mm = length(vec2<f32>(offset)) / frame.depth.w * reach_mm;
        let in_front = z + dot(slope, vec2<f32>(offset)) - depth_mm(p + offset);
        taken += clamp(in_front / away_mm - 0.08, 0.0, 1.0) * (1.0 - smoothstep(0.3 * reach_mm, 1.2 * reach_mm, in_front));
    }
    return vec4(vec3(pow(clamp(1.0 - 0.9 * taken / f32(count), 0.0, 1.0), 0.6)), 1.0);
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

// In pixels, and depth; lifted toward the eye along the line of sight, which moves nothing in the picture.
fn seen(p: vec3<f32>, lift_mm: f32) -> vec3<f32> {
    let toward_eye = normalize(frame.eye.xyz - p * frame.eye.w);
    let clip = frame.clip * vec4(p + toward_eye * lift_mm, 1.0);
    return vec3(clip.xy / clip.w * 0.5 * frame.viewport.xy, select(clip.z / clip.w, 2.0, clip.w <= 0.0));
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
    let from_px = seen(a, lift_mm);
    let to_px = seen(b, lift_mm);
    if (max(from_px.z, to_px.z) > 1.5) {
        return nothing;
    }
    let delta = to_px.xy - from_px.xy;
    let length_px = length(delta);
    let along = select(vec2(1.0, 0.0), delta / length_px, length_px > 1e-4);
    let across = vec2(-along.y, along.x);
    let reach = half_width + 1.0;
    let s = mix(-reach, length_px + reach, f32(i & 1u));
    let side = f32(i >> 1u) * 2.0 - 1.0;
    let px = from_px.xy + along * s + across * (side * reach);
    let t = clamp(s / max(length_px, 1e-4), 0.0, 1.0);
    let position = vec4(px / (0.5 * frame.viewport.xy), mix(from_px.z, to_px.z, t), 1.0);
    return Line(position, vec2(s, side * reach), vec2(length_px, half_width), colour, mix(a, b, t));
}

@fragment
fn line_fragment(in: Line) -> @location(0) vec4<f32> {
    if (cut_away(in.place)) {
        discard;
    }
    let s = in.along_across.x;
    let past = max(max(-s, s - in.length_half_width.x), 0.0);
    // Translucent lines end square, so that the joints of a polyline are not painted twice.
    if (in.colour.a < 0.99 && past > 0.0) {
        discard;
    }
    let distance = length(vec2(past, in.along_across.y));
    return vec4(in.colour.rgb, in.colour.a * clamp(in.length_half_width.y - distance + 0.5, 0.0, 1.0));
}
