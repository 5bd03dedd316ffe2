// What all pictures have in common, whoever draws them. Their own part follows, with the constants `frame`, of which
// this knows: clip, eye (w = 1: a point; w = 0: the direction toward the eye), viewport.xy (width and height, px),
// depth.xyz (mm = (x·d + y) / (z·d + 1)).

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

// --- surfaces ---------------------------------------------------------------------------------------------

// Stripes of 7.5 degrees, smooth over a pixel, grey where a pixel holds several.
fn stripes(angle: f32) -> f32 {
    let phase = angle * 24.0 / 6.2831853;
    let width = max(fwidth(phase), 1e-5);
    let ramp = abs(fract(phase) - 0.5) * 2.0 - 0.5;
    let sharp = clamp(ramp / (2.0 * width) + 0.5, 0.0, 1.0);
    return mix(sharp, 0.5, smoothstep(0.35, 0.7, width));
}

// Whether it is the material's side that is seen: marks 254 and 253 of 255 say which side is free.
fn is_material(mark: f32, front: bool) -> bool {
    let free_against = mark < 253.5 / 255.0;
    return mark < 254.5 / 255.0 && front == free_against;
}

// Dull, and hatched as sections of material are in drawings.
fn material(rgb: vec3<f32>, at_px: vec2<f32>) -> vec3<f32> {
    let phase = fract((at_px.x - at_px.y) / 9.0);
    let line = 1.0 - smoothstep(0.10, 0.22, abs(phase - 0.5));
    return mix(mix(rgb, vec3(0.21, 0.11, 0.07), 0.72), vec3(0.045, 0.022, 0.015), 0.75 * line);
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

struct Reach {
    px: f32,
    mm: f32,
    samples: i32,
    least: f32,         // slopes up to here take nothing
    fading: vec2<f32>,  // what stands farther in front, mm, counts less and less
}

// How much of the tangent plane's sky is taken by what stands in front of it, over a spiral of samples; nothing where
// there is no surface.
fn taken(p: vec2<i32>, reach: Reach) -> f32 {
    if (textureLoad(depth_buffer, p, 0) >= 1.0) {
        return 0.0;
    }
    let z = depth_mm(p);
    // The smaller difference is the one that does not cross a silhouette.
    let slope = vec2(
        smaller(depth_mm(p + vec2(1, 0)) - z, z - depth_mm(p - vec2(1, 0))),
        smaller(depth_mm(p + vec2(0, 1)) - z, z - depth_mm(p - vec2(0, 1))),
    );
    var sum = 0.0;
    for (var i = 0; i < reach.samples; i++) {
        let s = (f32(i) + 0.5) / f32(reach.samples);
        let angle = 2.399963 * f32(i);
        let offset = vec2<i32>(round(vec2(cos(angle), sin(angle)) * (s * reach.px + 1.0)));
        let away_mm = length(vec2<f32>(offset)) / reach.px * reach.mm;
        let in_front = z + dot(slope, vec2<f32>(offset)) - depth_mm(p + offset);
        let near = 1.0 - smoothstep(reach.fading.x, reach.fading.y, in_front);
        sum += clamp(in_front / away_mm - reach.least, 0.0, 1.0) * near;
    }
    return sum / f32(reach.samples);
}

// --- lines ------------------------------------------------------------------------------------------------

struct Band {
    position: vec4<f32>,
    along_across: vec2<f32>,        // px
    length_half_width: vec2<f32>,   // px
    t: f32,                         // share of the segment
}

// In pixels, and depth; lifted toward the eye along the ray of sight, which moves nothing in the picture.
fn seen(p: vec3<f32>, lift_mm: f32) -> vec3<f32> {
    let toward_eye = normalize(frame.eye.xyz - p * frame.eye.w);
    let clip = frame.clip * vec4(p + toward_eye * lift_mm, 1.0);
    return vec3(clip.xy / clip.w * 0.5 * frame.viewport.xy, select(clip.z / clip.w, 2.0, clip.w <= 0.0));
}

// Corner `i` of the strip in which a segment is drawn, with room for round caps and for the soft edge.
fn band(i: u32, a: vec3<f32>, b: vec3<f32>, half_width: f32, soft_px: f32, lift_mm: f32) -> Band {
    let from_px = seen(a, lift_mm);
    let to_px = seen(b, lift_mm);
    if (max(from_px.z, to_px.z) > 1.5) {
        return Band(vec4(2.0, 2.0, 2.0, 1.0), vec2(0.0), vec2(0.0), 0.0);
    }
    let delta = to_px.xy - from_px.xy;
    let length_px = length(delta);
    let along = select(vec2(1.0, 0.0), delta / length_px, length_px > 1e-4);
    let across = vec2(-along.y, along.x);
    let reach = half_width + soft_px;
    let s = mix(-reach, length_px + reach, f32(i & 1u));
    let side = f32(i >> 1u) * 2.0 - 1.0;
    let px = from_px.xy + along * s + across * (side * reach);
    // Depth goes on along the caps, or the middle would sink; not where the line points at the eye.
    let t = s / max(length_px, 1e-4);
    let within = clamp(t, 0.0, 1.0);
    let depth = mix(from_px.z, to_px.z, select(within, t, length_px > reach));
    let position = vec4(px / (0.5 * frame.viewport.xy), depth, 1.0);
    return Band(position, vec2(s, side * reach), vec2(length_px, half_width), within);
}

// How far outside the line a place is, px; translucent lines end square, so that the joints of a polyline are not
// painted twice.
fn beside(along_across: vec2<f32>, length_half_width: vec2<f32>, opacity: f32) -> f32 {
    let past = max(max(-along_across.x, along_across.x - length_half_width.x), 0.0);
    let distance = length(vec2(past, along_across.y)) - length_half_width.y;
    return select(distance, 1e9, opacity < 0.99 && past > 0.0);
}
