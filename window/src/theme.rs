//! Letters and colours of the panels.

use std::sync::Arc;

use claymill_viewer::Rgb;
use egui::{
    Color32, CornerRadius, FontData, FontDefinitions, FontFamily, FontId, Stroke, TextStyle, Theme, Vec2,
};

/// Headings are set in this family.
pub(crate) fn medium() -> FontFamily {
    FontFamily::Name("medium".into())
}

/// What the eye is led to: what is picked, what is on.
pub(crate) const ACCENT: Color32 = Color32::from_rgb(0, 100, 170);
const ACCENT_ON_DARK: Color32 = Color32::from_rgb(90, 170, 230);

/// Sets letters, sizes and colours of both themes.
pub(crate) fn install(ctx: &egui::Context) {
    let mut fonts = FontDefinitions::empty();
    let files: [(&str, &[u8]); 2] = [
        ("regular", include_bytes!("../assets/Roboto-Regular.ttf")),
        ("medium", include_bytes!("../assets/Roboto-Medium.ttf")),
    ];
    for (name, bytes) in files {
        fonts.font_data.insert(name.to_owned(), Arc::new(FontData::from_static(bytes)));
    }
    for (family, name) in
        [(FontFamily::Proportional, "regular"), (FontFamily::Monospace, "regular"), (medium(), "medium")]
    {
        fonts.families.insert(family, vec![name.to_owned()]);
    }
    ctx.set_fonts(fonts);
    for theme in [Theme::Light, Theme::Dark] {
        ctx.style_mut_of(theme, |style| adjust(style, theme == Theme::Dark));
    }
}

fn adjust(style: &mut egui::Style, dark: bool) {
    let proportional = FontFamily::Proportional;
    style.text_styles = [
        (TextStyle::Small, FontId::new(11.0, proportional.clone())),
        (TextStyle::Body, FontId::new(13.0, proportional.clone())),
        (TextStyle::Button, FontId::new(13.0, proportional.clone())),
        (TextStyle::Monospace, FontId::new(13.0, proportional)),
        (TextStyle::Heading, FontId::new(13.0, medium())),
    ]
    .into();
    let spacing = &mut style.spacing;
    spacing.item_spacing = Vec2::new(6.0, 3.0);
    spacing.button_padding = Vec2::new(7.0, 3.0);
    spacing.interact_size.y = 21.0;
    spacing.icon_width = 14.0;
    spacing.icon_width_inner = 8.0;
    spacing.indent = 14.0;
    style.animation_time = 0.0;
    style.interaction.tooltip_delay = 0.4;

    let visuals = &mut style.visuals;
    let grey = Color32::from_gray;
    let (panel, text, weak, line, hover, field) = match dark {
        true => (Color32::from_rgb(38, 41, 46), grey(222), grey(160), grey(66), grey(62), grey(30)),
        false => (Color32::from_rgb(247, 248, 249), grey(28), grey(96), grey(210), grey(226), grey(255)),
    };
    visuals.panel_fill = panel;
    visuals.window_fill = panel;
    visuals.extreme_bg_color = field;
    visuals.faint_bg_color = if dark { grey(44) } else { grey(240) };
    visuals.weak_text_color = Some(weak);
    visuals.selection.bg_fill = accent(dark);
    visuals.selection.stroke = Stroke::new(1.0, Color32::WHITE);
    visuals.hyperlink_color = accent(dark);
    visuals.slider_trailing_fill = true;
    let widgets = &mut visuals.widgets;
    widgets.noninteractive.bg_stroke = Stroke::new(1.0, line);
    widgets.noninteractive.fg_stroke = Stroke::new(1.0, text);
    for (w, fill) in [
        (&mut widgets.inactive, if dark { grey(54) } else { grey(232) }),
        (&mut widgets.hovered, hover),
        (&mut widgets.active, hover),
        (&mut widgets.open, hover),
    ] {
        w.weak_bg_fill = fill;
        w.bg_fill = fill;
        w.bg_stroke = Stroke::new(1.0, line);
        w.fg_stroke = Stroke::new(1.2, text);
        w.corner_radius = CornerRadius::same(3);
        w.expansion = 0.0;
    }
    visuals.widgets.hovered.bg_stroke = Stroke::new(1.0, weak);
}

/// What the eye is led to, on this ground.
pub(crate) fn accent(dark: bool) -> Color32 {
    if dark { ACCENT_ON_DARK.gamma_multiply(0.8) } else { ACCENT }
}

pub(crate) fn colour([r, g, b]: Rgb) -> Color32 {
    Color32::from_rgb(r, g, b)
}
