//! Writing faces and groups as STEP AP214.

use std::collections::BTreeMap;
use std::path::Path;

use claymill_nurbs::{Curve2, Curve3, Face, KnotVector, Model, NurbsError, Point3, TrimLoop, Vector3};

use super::script::{Script, quoted, real, references};
use crate::export::{Group, WriteError, group_of_face, write_whole};
use crate::lift::lifted;

/// Ends of the uses of one edge may differ by this (or ten times the model's tolerance), mm; else they are two edges.
const SAME_END_MM: f64 = 0.01;
/// Edges that the model does not know to be one are, where they lie on each other within this, mm: each face then reads
/// back with its own trim curves. Wider gaps stay gaps.
const SEWN_MM: f64 = 1e-4;
/// Edges shorter than so many times that are told apart by the model's topology alone.
const SHORT: f64 = 10.0;
/// Pieces of an edge at whose ends it is compared.
const SAMPLES: u8 = 32;
/// Sides shorter than this are points and have no edge, mm.
const POINT_MM: f64 = 1e-7;

/// Writes `model` as STEP AP214: every surface as a B-spline, every edge in space and in the parameter plane of its
/// surfaces. Edges that faces share (see [`claymill_nurbs::TrimEdge::shared`]) are written once, and so are edges of
/// two faces that lie on each other from end to end, so that shells are sewn. Each group becomes an open shell under its
/// name and colour; faces outside all groups share one more. Faces keep names, colours and layers; what is no B-spline keeps its shape but not its kind. Numbers have
/// as many digits as it takes to read back the same bits. The file appears whole or not at all.
///
/// # Errors
/// See [`WriteError`].
pub fn write_step(path: &Path, model: &Model, groups: &[Group]) -> Result<(), WriteError> {
    let group_of = group_of_face(model, groups)?;
    let mut topology = Topology::new(model.tolerance_mm);
    let mut bounds = Vec::with_capacity(model.faces.len());
    for (id, face) in model.faces.iter().enumerate() {
        bounds.push(topology.bounds(id, face).map_err(|source| WriteError::Face { face: id, source })?);
    }
    let mut script = Script::default();
    let context = context(&mut script, model.tolerance_mm);
    let faces = instances(&mut script, model, &mut topology, &bounds);
    let mut styled = Vec::new();
    let mut layers: BTreeMap<&str, Vec<u64>> = BTreeMap::new();
    for (id, face) in model.faces.iter().enumerate() {
        let colour = group_of[id].map_or(face.source.colour, |g| groups[g].colour.or(face.source.colour));
        styled.extend(colour.map(|colour| script.coloured(faces[id], colour)));
        if let Some(layer) = &face.source.layer {
            layers.entry(layer).or_default().push(faces[id]);
        }
    }
    for (layer, faces) in layers {
        script.add(&format!("PRESENTATION_LAYER_ASSIGNMENT({},'',{})", quoted(layer), references(&faces)));
    }
    let named = groups.iter().enumerate().map(|(index, group)| (Some(index), group.name.as_str()));
    let mut shells = Vec::new();
    for (index, name) in named.chain([(None, "")]) {
        let members: Vec<u64> =
            (0..faces.len()).filter(|id| group_of[*id] == index).map(|id| faces[id]).collect();
        if !members.is_empty() {
            let shell = script.add(&format!("OPEN_SHELL({},{})", quoted(name), references(&members)));
            shells.push(script.add(&format!("SHELL_BASED_SURFACE_MODEL({},(#{shell}))", quoted(name))));
        }
    }
    let name = path.file_name().map_or("model.stp".into(), |n| n.to_string_lossy());
    product(&mut script, &name, &shells, &styled, context);
    // No date: the same model gives the same bytes.
    let text = format!(
        "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\n\
         FILE_NAME({},'2000-01-01T00:00:00',(''),(''),'claymill {version}','claymill {version}','');\n\
         FILE_SCHEMA(('AUTOMOTIVE_DESIGN {{ 1 0 10303 214 1 1 1 1 }}'));\nENDSEC;\nDATA;\n\
         {}ENDSEC;\nEND-ISO-10303-21;\n",
        quoted(&name),
        script.text(),
        version = env!("CARGO_PKG_VERSION"),
    );
    write_whole(path, text.as_bytes())
}

/// An edge and all its uses.
struct Edge {
    curve: Curve3,
    /// Face and pcurve of each use, in the edge's direction and on its parameters.
    uses: Vec<(usize, Curve2)>,
}

/// The use of an edge in a loop: its index, and whether the loop runs along it.
type Use = (usize, bool);

/// Edges and vertices of the whole model.
struct Topology {
    edges: Vec<Edge>,
    by_shared: BTreeMap<u64, usize>,
    /// Edges by the cells that they begin and end in.
    by_ends: BTreeMap<[i64; 3], Vec<usize>>,
    /// Vertices are classes of edge ends: end `k` of edge `i` is node `2 i + k`, and points to one of its class.
    nodes: Vec<usize>,
    same_end_mm: f64,
}

impl Topology {
    fn new(tolerance_mm: f64) -> Self {
        let same_end_mm = SAME_END_MM.max(10.0 * tolerance_mm);
        Topology {
            edges: Vec::new(),
            by_shared: BTreeMap::new(),
            by_ends: BTreeMap::new(),
            nodes: Vec::new(),
            same_end_mm,
        }
    }

    /// The loops of a face as uses of edges; the widest loop first.
    fn bounds(&mut self, id: usize, face: &Face) -> Result<Vec<Vec<Use>>, NurbsError> {
        let mut bounds = Vec::new();
        let mut loops = face.boundary();
        loops.sort_by(|a, b| width(b).total_cmp(&width(a)));
        for trim in &loops {
            let mut uses: Vec<Use> = Vec::with_capacity(trim.edges.len());
            for edge in &trim.edges {
                let curve = lifted(&face.surface, &edge.pcurve)?;
                let hull: f64 = curve.points().windows(2).map(|w| (w[1] - w[0]).norm()).sum();
                // Poles are points: the loop goes on behind them.
                if hull > POINT_MM {
                    uses.push(self.use_of(id, curve, &edge.pcurve, edge.shared)?);
                }
            }
            for (k, (edge, forward)) in uses.iter().enumerate() {
                let (next, next_forward) = uses[(k + 1) % uses.len()];
                self.join(2 * edge + usize::from(*forward), 2 * next + usize::from(!next_forward));
            }
            if !uses.is_empty() {
                bounds.push(uses);
            }
        }
        Ok(bounds)
    }

    /// The edge that is known under `shared`, where its ends fit, or a new one.
    fn use_of(
        &mut self,
        face: usize,
        curve: Curve3,
        pcurve: &Curve2,
        shared: Option<u64>,
    ) -> Result<Use, NurbsError> {
        let known = shared.and_then(|id| self.by_shared.get(&id).copied());
        if let Some(index) = known {
            let edge = &mut self.edges[index];
            let (a, b) = (edge.curve.domain(), curve.domain());
            let off = |forward: bool, x: f64| {
                let y = if forward { x } else { 1.0 - x };
                (edge.curve.point(a.0 + (a.1 - a.0) * x) - curve.point(b.0 + (b.1 - b.0) * y)).norm()
            };
            let worst = |forward: bool| off(forward, 0.0).max(off(forward, 1.0));
            // The two uses of a ring have their ends in common either way round.
            let both = worst(true).max(worst(false)) <= self.same_end_mm;
            let forward =
                if both { off(true, 0.25) <= off(false, 0.25) } else { worst(true) <= worst(false) };
            if worst(forward) <= self.same_end_mm {
                let turned = if forward { pcurve.clone() } else { pcurve.reversed() };
                let mapped = on_domain(&turned, a)?;
                edge.uses.push((face, mapped));
                return Ok((index, forward));
            }
        }
        if let Some((index, forward)) = self.lying_on(face, &curve) {
            let edge = &mut self.edges[index];
            let turned = if forward { pcurve.clone() } else { pcurve.reversed() };
            edge.uses.push((face, on_domain(&turned, edge.curve.domain())?));
            return Ok((index, forward));
        }
        let index = self.edges.len();
        for cell in [curve.start(), curve.end()].map(|p| Self::cell(&p)) {
            self.by_ends.entry(cell).or_default().push(index);
        }
        self.edges.push(Edge { curve, uses: vec![(face, pcurve.clone())] });
        self.nodes.extend([2 * index, 2 * index + 1]);
        if let (Some(id), None) = (shared, known) {
            self.by_shared.insert(id, index);
        }
        Ok((index, true))
    }

    fn cell(p: &Point3) -> [i64; 3] {
        [p.x, p.y, p.z].map(|x| (x / (2.0 * SEWN_MM)).floor() as i64)
    }

    /// The edge of one other face that the curve lies on from end to end at the same pace, and whether it runs along it.
    fn lying_on(&self, face: usize, curve: &Curve3) -> Option<Use> {
        let steps = curve.points().windows(2).map(|w| (w[1] - w[0]).norm());
        if steps.sum::<f64>() < SHORT * SEWN_MM {
            return None;
        }
        let [x, y, z] = Self::cell(&curve.start());
        let around = (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |k| (i, j, k))));
        let beside = around.filter_map(|(i, j, k)| {
            self.by_ends.get(&[x.saturating_add(i), y.saturating_add(j), z.saturating_add(k)])
        });
        let fits = |index: usize| {
            let edge = &self.edges[index];
            let [(other, _)] = edge.uses[..] else { return None };
            let (a, b) = (edge.curve.domain(), curve.domain());
            let lies = |forward: bool| {
                (0..=SAMPLES).map(|k| f64::from(k) / f64::from(SAMPLES)).all(|x| {
                    let y = if forward { x } else { 1.0 - x };
                    let (p, q) =
                        (edge.curve.point(a.0 + (a.1 - a.0) * x), curve.point(b.0 + (b.1 - b.0) * y));
                    (p - q).norm() <= SEWN_MM
                })
            };
            (other != face).then(|| [true, false].into_iter().find(|f| lies(*f))).flatten()
        };
        beside.flatten().find_map(|&index| Some((index, fits(index)?)))
    }

    fn class(&mut self, mut node: usize) -> usize {
        while self.nodes[node] != node {
            self.nodes[node] = self.nodes[self.nodes[node]];
            node = self.nodes[node];
        }
        node
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.class(a), self.class(b));
        // Ends across a pole or a bridged gap stay two points.
        if (self.point(a) - self.point(b)).norm() <= self.same_end_mm {
            self.nodes[a.max(b)] = a.min(b);
        }
    }

    fn point(&self, node: usize) -> Point3 {
        let curve = &self.edges[node / 2].curve;
        if node.is_multiple_of(2) { curve.start() } else { curve.end() }
    }
}

/// The curve with its parameter run over another range.
fn on_domain(curve: &Curve2, (low, high): (f64, f64)) -> Result<Curve2, NurbsError> {
    let (a, b) = curve.domain();
    if (a, b) == (low, high) {
        return Ok(curve.clone());
    }
    let knots = curve.knots().as_slice().iter().map(|k| match *k {
        k if k == a => low,
        k if k == b => high,
        k => low + (k - a) / (b - a) * (high - low),
    });
    let knots = KnotVector::new(curve.knots().degree(), knots.collect())?;
    Curve2::new(knots, curve.points().to_vec(), curve.weights().map(<[f64]>::to_vec))
}

/// Width times height of the loop's box in the parameter plane.
fn width(trim: &TrimLoop) -> f64 {
    let inf = f64::INFINITY;
    let mut range = [(inf, -inf); 2];
    for p in trim.edges.iter().flat_map(|e| e.pcurve.points()) {
        for d in 0..2 {
            range[d] = (range[d].0.min(p[d]), range[d].1.max(p[d]));
        }
    }
    (range[0].1 - range[0].0) * (range[1].1 - range[1].0)
}

/// Writes surfaces, vertices, edges and faces; gives the ids of the faces.
fn instances(
    script: &mut Script,
    model: &Model,
    topology: &mut Topology,
    bounds: &[Vec<Vec<Use>>],
) -> Vec<u64> {
    let surfaces: Vec<u64> = model.faces.iter().map(|f| script.surface(&f.surface)).collect();
    let plane = script.add(
        "(GEOMETRIC_REPRESENTATION_CONTEXT(2)PARAMETRIC_REPRESENTATION_CONTEXT()REPRESENTATION_CONTEXT('2D SPACE',''))",
    );
    let mut vertices: BTreeMap<usize, u64> = BTreeMap::new();
    let mut edges = Vec::with_capacity(topology.edges.len());
    for index in 0..topology.edges.len() {
        let ends = [2 * index, 2 * index + 1].map(|node| {
            let class = topology.class(node);
            let at = topology.point(class);
            *vertices.entry(class).or_insert_with(|| script.vertex(&at))
        });
        let edge = &topology.edges[index];
        let curve = script.curve(&edge.curve);
        let mut flats = Vec::with_capacity(edge.uses.len());
        for (face, flat) in &edge.uses {
            let flat = script.curve(flat);
            let flat = script.add(&format!("DEFINITIONAL_REPRESENTATION('',(#{flat}),#{plane})"));
            flats.push(script.add(&format!("PCURVE('',#{},#{flat})", surfaces[*face])));
        }
        let seam = matches!(edge.uses.as_slice(), [a, b] if a.0 == b.0);
        let kind = if seam { "SEAM_CURVE" } else { "SURFACE_CURVE" };
        // The format knows two surfaces of a curve; further uses keep their edge without a pcurve.
        flats.truncate(2);
        let on = script.add(&format!("{kind}('',#{curve},{},.CURVE_3D.)", references(&flats)));
        edges.push(script.add(&format!("EDGE_CURVE('',#{},#{},#{on},.T.)", ends[0], ends[1])));
    }
    let mut faces = Vec::with_capacity(model.faces.len());
    for ((face, bounds), surface) in model.faces.iter().zip(bounds).zip(&surfaces) {
        let flag = |yes: bool| if yes { "T" } else { "F" };
        let mut ids = Vec::with_capacity(bounds.len());
        for (k, uses) in bounds.iter().enumerate() {
            let mut oriented = Vec::with_capacity(uses.len());
            for (edge, forward) in uses {
                let (edge, flag) = (edges[*edge], flag(*forward));
                oriented.push(script.add(&format!("ORIENTED_EDGE('',*,*,#{edge},.{flag}.)")));
            }
            let edge_loop = script.add(&format!("EDGE_LOOP('',{})", references(&oriented)));
            let kind = if k == 0 { "FACE_OUTER_BOUND" } else { "FACE_BOUND" };
            // The loops run anticlockwise about the surface's normal; they must about the face's.
            let flag = flag(!face.reversed);
            ids.push(script.add(&format!("{kind}('',#{edge_loop},.{flag}.)")));
        }
        let name = quoted(face.source.name.as_deref().unwrap_or(""));
        let sense = flag(!face.reversed);
        let ids = references(&ids);
        faces.push(script.add(&format!("ADVANCED_FACE({name},{ids},#{surface},.{sense}.)")));
    }
    faces
}

/// Millimetres, radians, and the model's tolerance.
fn context(script: &mut Script, tolerance_mm: f64) -> u64 {
    let length = script.add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))");
    let angle = script.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))");
    let solid = script.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())");
    let tolerance = real(if tolerance_mm > 0.0 { tolerance_mm } else { 1e-6 });
    let tolerance = script.add(&format!(
        "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({tolerance}),#{length},'distance_accuracy_value','')"
    ));
    script.add(&format!(
        "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{tolerance}))\
         GLOBAL_UNIT_ASSIGNED_CONTEXT((#{length},#{angle},#{solid}))REPRESENTATION_CONTEXT('',''))"
    ))
}

/// The part that the shells are the shape of, and the picture that holds the colours.
fn product(script: &mut Script, name: &str, shells: &[u64], styled: &[u64], context: u64) {
    let name = quoted(name);
    let application =
        script.add("APPLICATION_CONTEXT('core data for automotive mechanical design processes')");
    script.add(&format!(
        "APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#{application})"
    ));
    let discipline = script.add(&format!("PRODUCT_CONTEXT('',#{application},'mechanical')"));
    let product = script.add(&format!("PRODUCT({name},{name},'',(#{discipline}))"));
    script.add(&format!("PRODUCT_RELATED_PRODUCT_CATEGORY('part','',(#{product}))"));
    let formation = script.add(&format!("PRODUCT_DEFINITION_FORMATION('','',#{product})"));
    let stage = script.add(&format!("PRODUCT_DEFINITION_CONTEXT('part definition',#{application},'design')"));
    let definition = script.add(&format!("PRODUCT_DEFINITION('','',#{formation},#{stage})"));
    let shape = script.add(&format!("PRODUCT_DEFINITION_SHAPE('','',#{definition})"));
    let origin = script.point(&[0.0, 0.0, 0.0]);
    let (z, x) = (script.direction(Vector3::z()), script.direction(Vector3::x()));
    let axes = script.add(&format!("AXIS2_PLACEMENT_3D('',#{origin},#{z},#{x})"));
    let items: Vec<u64> = shells.iter().copied().chain([axes]).collect();
    let items = references(&items);
    let representation =
        script.add(&format!("MANIFOLD_SURFACE_SHAPE_REPRESENTATION({name},{items},#{context})"));
    script.add(&format!("SHAPE_DEFINITION_REPRESENTATION(#{shape},#{representation})"));
    if !styled.is_empty() {
        let styled = references(styled);
        script
            .add(&format!("MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',{styled},#{context})"));
    }
}
