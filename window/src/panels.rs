//! The panels around the picture.

use claymill_viewer::{MATERIAL_SIDE, Rgb, Stock, heat_legend, kind_colour};
use egui::{Align, ComboBox, DragValue, Layout, RichText, ScrollArea, Slider, Ui};

use crate::crests::Crests;
use crate::desk::{Desk, Tool};
use crate::facts;
use crate::inspector::kind_name;
use crate::joints::JointClass;
use crate::layers::{self, KINDS, Paint, PathPaint, class_colour};
use crate::theme;
use crate::widgets::{PlayerSign, figure_right, heading, layer, player, sign, toggle};

/// Speeds of the player, seconds of the machine a second.
const SPEEDS: [f64; 6] = [1.0, 10.0, 60.0, 300.0, 1200.0, 3600.0];

/// Views, tools and theme.
pub(crate) fn toolbar(ui: &mut Ui, desk: &mut Desk<'_>) {
    ui.horizontal(|ui| {
        let views = [
            ("Iso", "iso", "I"),
            ("Top", "top", "T"),
            ("Left", "left", "L"),
            ("Right", "right", "R"),
            ("Front", "front", "F"),
            ("Rear", "rear", "B"),
        ];
        for (label, view, key) in views {
            if ui.button(label).on_hover_text(format!("View {view} ({key})")).clicked() {
                desk.look(view);
            }
        }
        if ui.button("Fit").on_hover_text("Show everything (Home)").clicked() {
            desk.fit();
        }
        ui.separator();
        let perspective = desk.sight.is_perspective();
        if toggle(ui, perspective, "Perspective", "Near things are larger (P)") {
            desk.sight.set_perspective(!perspective);
        }
        if toggle(ui, desk.cutting.on, "Section", "Cut the view open along a plane (X)") {
            desk.cutting.on = !desk.cutting.on;
        }
        if toggle(
            ui,
            desk.layers.zebra,
            "Zebra",
            "Stripes mirrored in the surfaces show their continuity (Z)",
        ) {
            desk.layers.zebra = !desk.layers.zebra;
        }
        ui.separator();
        for (tool, label, hint) in [
            (Tool::Select, "Select", "A click shows what is known of the place (Esc)"),
            (Tool::Measure, "Measure", "Two clicks measure on the exact surfaces (M)"),
        ] {
            if toggle(ui, desk.tool == tool, label, hint) {
                desk.tool = tool;
            }
        }
        if desk.cutting.on {
            ui.separator();
            section(ui, desk);
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let hint = "Light or dark surroundings (D)";
            if toggle(ui, desk.dark, "Dark", hint) {
                desk.dark = !desk.dark;
            }
        });
    });
}

fn section(ui: &mut Ui, desk: &mut Desk<'_>) {
    for (axis, label) in ["Length", "Width", "Height"].into_iter().enumerate() {
        if toggle(ui, desk.cutting.axis == axis, label, "Direction of the section plane's normal") {
            desk.cutting.axis = axis;
        }
    }
    let [low, high] = desk.cutting_range();
    let mut at_mm = low + (high - low) * desk.cutting.share;
    let slider = Slider::new(&mut at_mm, low..=high).suffix(" mm").fixed_decimals(1);
    if ui.add(slider).changed() {
        desk.cutting.share = ((at_mm - low) / (high - low).max(1e-9)).clamp(0.0, 1.0);
    }
    if ui.button("Flip").on_hover_text("Show the other side").clicked() {
        desk.cutting.flipped = !desk.cutting.flipped;
    }
}

/// The layer tree.
pub(crate) fn tree(ui: &mut Ui, desk: &mut Desk<'_>) {
    ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
        surfaces(ui, desk);
        edges(ui, desk);
        if desk.exhibit().job.is_some() {
            paths(ui, desk);
        }
        if !desk.marks().is_empty() {
            heading(ui, "Findings");
            let count = desk.marks().len().to_string();
            layer(ui, &mut desk.layers.marks, None, "Marks", &count);
        }
        regions(ui, desk);
        ui.add_space(8.0);
    });
}

fn surfaces(ui: &mut Ui, desk: &mut Desk<'_>) {
    heading(ui, "Model");
    let faces = format!("{} faces", desk.exhibit().model.faces.len());
    layer(ui, &mut desk.layers.surfaces, None, "Surfaces", &faces);
    let job = desk.exhibit().job.is_some();
    let names = [
        (Paint::Regions, "Regions"),
        (Paint::Clay, "Clay"),
        (Paint::File, "Colours of the file"),
        (Paint::Coverage, "Cut and not cut"),
        (Paint::Scallop, "Scallop height"),
        (Paint::Stock, "Material left"),
    ];
    let of_job = |p: Paint| matches!(p, Paint::Coverage | Paint::Scallop | Paint::Stock);
    let current = names.iter().find(|n| n.0 == desk.layers.paint).map_or("", |n| n.1);
    ui.horizontal(|ui| {
        ui.label(RichText::new("Coloured by").weak());
        ComboBox::from_id_salt("paint").width(ui.available_width() - 8.0).selected_text(current).show_ui(
            ui,
            |ui| {
                for (paint, name) in names.into_iter().filter(|n| job || !of_job(n.0)) {
                    ui.selectable_value(&mut desk.layers.paint, paint, name);
                }
            },
        );
    });
    if !desk.exhibit().free_sides.is_empty() {
        legend(ui, MATERIAL_SIDE, "hatched: side of the material");
    }
    match desk.layers.paint {
        Paint::Coverage => {
            for (colour, text) in [
                (layers::CUT, "cut"),
                (layers::HIDDEN, "hidden from every setup"),
                (layers::TOO_TIGHT, "too tight for the ball"),
                (layers::EXCLUDED, "left out on request"),
            ] {
                legend(ui, colour, text);
            }
        }
        Paint::Scallop => scallops(ui, desk),
        Paint::Stock => material(ui, desk),
        _ => {}
    }
}

fn legend(ui: &mut Ui, colour: Rgb, text: &str) {
    ui.horizontal(|ui| {
        ui.add_space(4.0);
        sign(ui, theme::colour(colour));
        ui.label(RichText::new(text).weak());
    });
}

fn material(ui: &mut Ui, desk: &mut Desk<'_>) {
    ui.horizontal(|ui| {
        ui.label(RichText::new("Over the model at first").weak());
        let range = DragValue::new(&mut desk.allowance_mm).range(0.1..=200.0).speed(0.1);
        ui.add(range.suffix(" mm").fixed_decimals(1));
    });
    let [to_go, done] = Stock::palette();
    legend(ui, to_go, "still to go");
    legend(ui, done, "cut by the time shown");
    if desk.is_cutting_material() {
        ui.label(RichText::new("cutting …").weak());
    }
}

fn scallops(ui: &mut Ui, desk: &mut Desk<'_>) {
    match desk.crests().clone() {
        Crests::Unknown => desk.measure_crests(),
        Crests::Measuring(stage, share) => {
            ui.add(egui::ProgressBar::new(share as f32).desired_height(6.0));
            ui.label(RichText::new(format!("{stage} …")).weak());
        }
        Crests::Failed(why) => {
            ui.label(RichText::new(why).color(ui.visuals().error_fg_color));
        }
        Crests::Known(_) => {
            let asked = desk.exhibit().job.as_ref().map_or(0.1, |j| j.job.request.scallop_mm);
            for (colour, text) in heat_legend(asked) {
                legend(ui, colour, &text);
            }
            legend(ui, layers::HIDDEN, "no passes");
        }
    }
}

fn edges(ui: &mut Ui, desk: &mut Desk<'_>) {
    heading(ui, "Joints");
    for (i, class) in JointClass::ALL.into_iter().enumerate() {
        let colour = theme::colour(class_colour(class, false));
        let count = desk.joint_counts()[i].to_string();
        layer(ui, &mut desk.layers.seams[i], Some(colour), class.name(), &count);
    }
}

fn paths(ui: &mut Ui, desk: &mut Desk<'_>) {
    let Some(shown) = &desk.exhibit().job else { return };
    heading(ui, "Tool paths");
    let length = &shown.job.totals.length;
    let of_kind = [length.cut_mm, length.link_mm, length.lead_mm, length.rapid_mm];
    for (i, (name, kinds)) in KINDS.into_iter().enumerate() {
        let colour = theme::colour(kind_colour(kinds[0]));
        layer(ui, &mut desk.layers.kinds[i], Some(colour), name, &facts::length(of_kind[i]));
    }
    let names = [
        (PathPaint::Region, "Regions"),
        (PathPaint::Kind, "Kinds of moves"),
        (PathPaint::Feed, "Feed"),
        (PathPaint::Setup, "Setups"),
    ];
    let current = names.iter().find(|n| n.0 == desk.layers.path_paint).map_or("", |n| n.1);
    ui.horizontal(|ui| {
        ui.label(RichText::new("Coloured by").weak());
        ComboBox::from_id_salt("paths").width(ui.available_width() - 8.0).selected_text(current).show_ui(
            ui,
            |ui| {
                for (paint, name) in names {
                    ui.selectable_value(&mut desk.layers.path_paint, paint, name);
                }
            },
        );
    });
    layer(ui, &mut desk.layers.tool, None, "Tool", &shown.job.request.tool.to_string());
    heading(ui, "Setups");
    for (i, setup) in shown.job.setups.iter().enumerate() {
        let by_setup = desk.layers.path_paint == PathPaint::Setup;
        let swatch = by_setup.then(|| theme::colour(layers::setup_colour(i)));
        layer(ui, &mut desk.layers.setups[i], swatch, &setup.name, &facts::duration(setup.time_s));
    }
}

fn regions(ui: &mut Ui, desk: &mut Desk<'_>) {
    heading(ui, "Regions");
    let count = desk.layers.regions.len();
    ui.horizontal(|ui| {
        for (label, on) in [("All", true), ("None", false)] {
            if ui.small_button(label).clicked() {
                desk.layers.regions.fill(on);
            }
        }
        figure_right(ui, &count.to_string());
    });
    let exhibit = desk.exhibit();
    for region in 0..count {
        let area = exhibit.regions.regions.get(region).map_or(String::new(), |r| facts::area(r.area_mm2));
        let swatch = desk.region_colours().get(region).map(|c| theme::colour(*c));
        let name = format!("Region {region}");
        let response = layer(ui, &mut desk.layers.regions[region], swatch, &name, &area);
        if response.double_clicked() {
            desk.layers.regions[region] = true;
            desk.fit_region(region);
        }
        if response.secondary_clicked() {
            desk.layers.regions.fill(false);
            desk.layers.regions[region] = true;
        }
        response.on_hover_text("Double click: show large. Right click: show alone.");
    }
}

/// Player and clock.
pub(crate) fn timeline(ui: &mut Ui, desk: &mut Desk<'_>) {
    let Some(shown) = &desk.exhibit().job else { return };
    ui.horizontal(|ui| {
        if player(ui, PlayerSign::Start, "To the start") {
            (desk.clock.now_s, desk.clock.playing) = (0.0, false);
        }
        if player(ui, PlayerSign::Back, "One move back (left arrow)") {
            desk.step(false);
        }
        let (sign, hint) = match desk.clock.playing {
            true => (PlayerSign::Pause, "Stop (space)"),
            false => (PlayerSign::Play, "Run along the paths (space)"),
        };
        if player(ui, sign, hint) {
            desk.play();
        }
        if player(ui, PlayerSign::Forward, "One move on (right arrow)") {
            desk.step(true);
        }
        if player(ui, PlayerSign::End, "To the end: everything is cut") {
            (desk.clock.now_s, desk.clock.playing) = (desk.duration_s(), false);
        }
        ComboBox::from_id_salt("speed").width(64.0).selected_text(format!("× {}", desk.clock.speed)).show_ui(
            ui,
            |ui| {
                for speed in SPEEDS {
                    ui.selectable_value(&mut desk.clock.speed, speed, format!("× {speed}"));
                }
            },
        );
        let total = desk.duration_s();
        ui.label(format!("{} / {}", facts::clock(desk.clock.now_s), facts::clock(total)));
        let now = desk.now().and_then(|(of, _)| shown.program.moves.get(of));
        let text = now.map_or_else(
            || "job done".to_owned(),
            |m| {
                let (kind, feed) = (kind_name(m.kind), m.feed);
                format!(
                    "{} · region {} · pass {} · {kind} {feed:.0} mm/min · move {}",
                    m.setup, m.region, m.pass, m.seq
                )
            },
        );
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            ui.add_sized([330.0, 18.0], egui::Label::new(RichText::new(text).weak()).truncate());
            let width = (ui.available_width() - 8.0).max(60.0);
            ui.spacing_mut().slider_width = width;
            let slider = Slider::new(&mut desk.clock.now_s, 0.0..=total).show_value(false);
            if ui.add(slider).changed() {
                desk.clock.playing = false;
            }
        });
    });
}
