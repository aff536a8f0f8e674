//! Plots, as SVG.

use plotters::prelude::*;

const SIZE: (u32, u32) = (520, 300);

/// A line with its name.
pub struct Line {
    pub name: String,
    pub points: Vec<(f32, f32)>,
}

/// Lines over two axes.
pub fn lines(title: &str, axes: [&str; 2], x: [f32; 2], y: [f32; 2], lines: &[Line]) -> String {
    let mut svg = String::new();
    let drawn = draw(&mut svg, title, axes, x, y, lines);
    // Drawing into a string does not fail; a plot that does is missing from the page.
    if drawn.is_err() { String::new() } else { svg }
}

fn draw(
    svg: &mut String,
    title: &str,
    [x_name, y_name]: [&str; 2],
    x: [f32; 2],
    y: [f32; 2],
    lines: &[Line],
) -> Result<(), Box<dyn std::error::Error>> {
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 16))
        .margin(8)
        .x_label_area_size(36)
        .y_label_area_size(48)
        .build_cartesian_2d(x[0]..x[1], y[0]..y[1])?;
    chart
        .configure_mesh()
        .light_line_style(WHITE)
        .x_desc(x_name)
        .y_desc(y_name)
        .draw()?;
    for (i, line) in lines.iter().enumerate() {
        let colour = Palette99::pick(i).stroke_width(2);
        let points = line.points.iter().copied();
        chart
            .draw_series(LineSeries::new(points, colour))?
            .label(&line.name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], colour));
    }
    chart
        .configure_series_labels()
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK.mix(0.3))
        .position(SeriesLabelPosition::UpperRight)
        .draw()?;
    root.present()?;
    Ok(())
}
