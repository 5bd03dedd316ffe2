// All passes of a picture. Positions are mm relative to the scene's origin; colours are linear inside.

struct Frame {
    clip: mat4x4<f32>,
    eye: vec4<f32>,        // w = 1: a point; w = 0: the direction toward the eye
    right: vec4<f32>,
    up: vec4<f32>,
    back: vec4<f32>,
    sky: vec4<f32>,        // the model's up; w = 1: reflection lines
    viewport: vec4<f32>,   // width px, height px, samples per px, mm per px
    depth: vec4<f32>,      // mm = (x·d + y) / (z·d + 1)
    occlusion: vec4<f32>,  // radius px, radius mm, strength
    backdrop_top: vec4<f32>,
    backdrop_bottom: vec4<f32>,
}
@group(0) @binding(0) var<uniform> frame: Frame;

fn linear(c: vec3<f32>) -> vec3<f32> {
    return select(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, c <= vec3(0.04045));
}

// One triangle that covers the picture.
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
    let c = mix(frame.backdrop_bottom, frame.backdrop_top, in.height);
    // Opacity says where the model is, until the picture is finished.
    return vec4(linear(c.rgb), 0.0);
}

// --- surfaces ---------------------------------------------------------------------------------------------

struct Surface {
    @builtin(position) position: vec4<f32>,
    @location(0) normal: vec3<f32>,
    @location(1) toward_eye: vec3<f32>,
    @location(2) colour: vec4<f32>,
}

@vertex
fn surface_vertex(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) colour: vec4<f32>,
) -> Surface {
    let toward_eye = frame.eye.xyz - position * frame.eye.w;
    return Surface(frame.clip * vec4(position, 1.0), normal, toward_eye, vec4(linear(colour.rgb), colour.a));
}

@fragment
fn surface_fragment(in: Surface, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    let e = normalize(in.toward_eye);
    // Files do not agree on which side is out: the side toward the eye is lit.
    var n = normalize(in.normal) * select(-1.0, 1.0, front);
    let right = frame.right.xyz;
    let up = frame.up.xyz;
    let back = frame.back.xyz;
    let key = normalize(-0.5 * right + 0.8 * up + 0.75 * back);
    let fill = normalize(0.9 * right + 0.1 * up + 0.6 * back);
    let rim = normalize(0.3 * right + 0.7 * up - 0.7 * back);
    let hemisphere = 0.5 + 0.5 * dot(n, frame.sky.xyz);
    let ambient = mix(vec3(0.20, 0.19, 0.18), vec3(0.36, 0.37, 0.39), hemisphere);
    // A little wrap keeps the shadow side readable.
    let key_light = 0.62 * max(0.0, (dot(n, key) + 0.15) / 1.15);
    let fill_light = 0.17 * max(0.0, dot(n, fill));
    let rim_light = 0.12 * max(0.0, dot(n, rim));
    let shine = 0.09 * pow(max(0.0, dot(n, normalize(key + e))), 48.0);
    let light = ambient + vec3(1.0, 0.985, 0.96) * key_light + vec3(0.94, 0.97, 1.0) * (fill_light + rim_light);
    let mirrored = reflect(-e, n);
    let lines = stripes(acos(clamp(dot(mirrored, frame.sky.xyz), -1.0, 1.0)));
    let zebra = (0.25 + 0.75 * in.colour.rgb) * mix(0.04, 0.9, lines) * (0.6 + 0.4 * light);
    return vec4(mix(in.colour.rgb * light + vec3(shine), zebra, frame.sky.w), in.colour.a);
}

// Stripes of 7.5 degrees, smooth over a pixel, grey where a pixel holds several.
fn stripes(angle: f32) -> f32 {
    let phase = angle * 24.0 / 6.2831853;
    let width = max(fwidth(phase), 1e-5);
    let ramp = abs(fract(phase) - 0.5) * 2.0 - 0.5;
    let sharp = clamp(ramp / (2.0 * width) + 0.5, 0.0, 1.0);
    return mix(sharp, 0.5, smoothstep(0.35, 0.7, width));
}

// --- ambient occlusion from the depth buffer --------------------------------------------------------------

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

// How much of the tangent plane's sky is taken by what stands in front of it, over a spiral of samples.
// The result multiplies what is already drawn.
@fragment
fn occlusion_fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let p = vec2<i32>(position.xy);
    if (textureLoad(depth_buffer, p, 0) >= 1.0) {
        return vec4(1.0);
    }
    let z = depth_mm(p);
    // The smaller difference is the one that does not cross a silhouette.
    let slope = vec2(
        smaller(depth_mm(p + vec2(1, 0)) - z, z - depth_mm(p - vec2(1, 0))),
        smaller(depth_mm(p + vec2(0, 1)) - z, z - depth_mm(p - vec2(0, 1))),
    );
    let count = 36;
    var taken = 0.0;
    for (var i = 0; i < count; i++) {
        let s = (f32(i) + 0.5) / f32(count);
        let angle = 2.399963 * f32(i);
        let offset = vec2<i32>(round(vec2(cos(angle), sin(angle)) * (s * frame.occlusion.x + 1.0)));
        let away_mm = length(vec2<f32>(offset)) / frame.occlusion.x * frame.occlusion.y;
        let in_front = z + dot(slope, vec2<f32>(offset)) - depth_mm(p + offset);
        let near = 1.0 - smoothstep(frame.occlusion.y, 3.0 * frame.occlusion.y, in_front);
        taken += clamp(in_front / away_mm - 0.05, 0.0, 1.0) * near;
    }
    let open = clamp(1.0 - frame.occlusion.z * taken / f32(count), 0.0, 1.0);
    return vec4(vec3(open), 1.0);
}

// --- lines ------------------------------------------------------------------------------------------------

struct Line {
    @builtin(position) position: vec4<f32>,
    @location(0) along_across: vec2<f32>,   // px
    @location(1) @interpolate(flat) length_half_width: vec2<f32>,
    @location(2) @interpolate(flat) colour: vec4<f32>,
}

// In pixels, and depth; lifted toward the eye along the ray of sight, which moves nothing in the picture.
fn seen(p: vec3<f32>, lift_mm: f32) -> vec3<f32> {
    let toward_eye = normalize(frame.eye.xyz - p * frame.eye.w);
    let clip = frame.clip * vec4(p + toward_eye * lift_mm, 1.0);
    return vec3(clip.xy / clip.w * 0.5 * frame.viewport.xy, clip.z / clip.w);
}

@vertex
fn line_vertex(
    @builtin(vertex_index) i: u32,
    @location(0) a: vec3<f32>,
    @location(1) width_px: f32,
    @location(2) b: vec3<f32>,
    @location(3) lift_mm: f32,
    @location(4) colour: vec4<f32>,
) -> Line {
    let from_px = seen(a, lift_mm);
    let to_px = seen(b, lift_mm);
    let delta = to_px.xy - from_px.xy;
    let length_px = length(delta);
    let along = select(vec2(1.0, 0.0), delta / length_px, length_px > 1e-4);
    let across = vec2(-along.y, along.x);
    let half_width = 0.5 * width_px;
    let reach = half_width + 1.0 / frame.viewport.z;
    let at_end = f32(i & 1u);
    let side = f32(i >> 1u) * 2.0 - 1.0;
    // Room for round caps and for the soft edge.
    let s = mix(-reach, length_px + reach, at_end);
    let px = from_px.xy + along * s + across * (side * reach);
    // Depth goes on along the caps, or the middle would sink; not where the line points at the eye.
    let t = s / max(length_px, 1e-4);
    let depth = mix(from_px.z, to_px.z, select(clamp(t, 0.0, 1.0), t, length_px > reach));
    let position = vec4(px / (0.5 * frame.viewport.xy), depth, 1.0);
    return Line(position, vec2(s, side * reach), vec2(length_px, half_width), vec4(linear(colour.rgb), colour.a));
}

@fragment
fn line_fragment(in: Line) -> @location(0) vec4<f32> {
    let s = in.along_across.x;
    let past = max(max(-s, s - in.length_half_width.x), 0.0);
    // Translucent lines end square, so that the joints of a polyline are not painted twice.
    if (in.colour.a < 0.99 && past > 0.0) {
        discard;
    }
    let distance = length(vec2(past, in.along_across.y));
    let coverage = clamp((in.length_half_width.y - distance) * frame.viewport.z + 0.5, 0.0, 1.0);
    return vec4(in.colour.rgb, in.colour.a * coverage);
}
