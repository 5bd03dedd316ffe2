// All passes of a picture, after `optics.wgsl`. Positions are mm relative to the scene's origin; colours are linear inside.

struct Frame {
    clip: mat4x4<f32>,
    eye: vec4<f32>,        // w = 1: a point; w = 0: the direction toward the eye
    right: vec4<f32>,
    up: vec4<f32>,
    back: vec4<f32>,
    sky: vec4<f32>,        // the model's up; w = 1: reflection lines, w = 2: a map, in the colours of its legend
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

// --- backdrop ---------------------------------------------------------------------------------------------

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
    let rgb = select(in.colour.rgb, material(in.colour.rgb, in.position.xy / frame.viewport.z), is_material(in.colour.a, front));
    if (frame.sky.w > 1.5) {
        // Darker only where the surface turns away, so that its form shows.
        return vec4(rgb * (0.85 + 0.15 * smoothstep(0.0, 0.5, dot(n, e))), 1.0);
    }
    let mirrored = reflect(-e, n);
    let lines = stripes(acos(clamp(dot(mirrored, frame.sky.xyz), -1.0, 1.0)));
    let zebra = (0.25 + 0.75 * rgb) * mix(0.04, 0.9, lines) * (0.6 + 0.4 * light);
    return vec4(mix(rgb * light + vec3(shine), zebra, frame.sky.w), 1.0);
}

// --- ambient occlusion from the depth buffer --------------------------------------------------------------

// The result multiplies what is already drawn.
@fragment
fn occlusion_fragment(@builtin(position) position: vec4<f32>) -> @location(0) vec4<f32> {
    let mm = frame.occlusion.y;
    let sky = taken(vec2<i32>(position.xy), Reach(frame.occlusion.x, mm, 36, 0.05, vec2(mm, 3.0 * mm)));
    return vec4(vec3(clamp(1.0 - frame.occlusion.z * sky, 0.0, 1.0)), 1.0);
}

// --- lines ------------------------------------------------------------------------------------------------

struct Line {
    @builtin(position) position: vec4<f32>,
    @location(0) along_across: vec2<f32>,   // px
    @location(1) @interpolate(flat) length_half_width: vec2<f32>,
    @location(2) @interpolate(flat) colour: vec4<f32>,
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
    let strip = band(i, a, b, 0.5 * width_px, 1.0 / frame.viewport.z, lift_mm);
    return Line(strip.position, strip.along_across, strip.length_half_width, vec4(linear(colour.rgb), colour.a));
}

@fragment
fn line_fragment(in: Line) -> @location(0) vec4<f32> {
    let beside_px = beside(in.along_across, in.length_half_width, in.colour.a);
    return vec4(in.colour.rgb, in.colour.a * clamp(0.5 - beside_px * frame.viewport.z, 0.0, 1.0));
}
