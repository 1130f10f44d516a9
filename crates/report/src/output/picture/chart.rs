//! One drawing for all pictures: layers over two axes, and the legend beside or below them.

use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

use super::axis::Axis;
use super::canvas::{self, Canvas, Failure};
use super::form::Form;
use super::ink::Ink;
use super::legend::{self, Entry};
use super::screen::{Screen, TEXT_SIZE};

/// Shortest bar, in pixels: a turn may be short against the whole.
const SHORTEST_BAR: i32 = 3;

/// Points that are drawn alike.
pub(super) struct Layer {
    pub(super) points: Vec<(f64, f64)>,
    pub(super) form: Form,
    pub(super) ink: Ink,
}

/// A picture.
pub(super) struct Chart<'a, X, Y> {
    pub(super) title: &'a str,
    pub(super) x: Axis<'a, X>,
    pub(super) y: Axis<'a, Y>,
    pub(super) layers: Vec<Layer>,
    pub(super) legend: Vec<Entry>,
}

impl<X, Y> Chart<'_, X, Y>
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: ValueFormatter<f64>,
    Y::CoordDescType: ValueFormatter<f64>,
{
    /// The picture as SVG.
    pub(super) fn svg(self, screen: Screen) -> String {
        let (plot, legend) = (screen.plot_height(), legend::height(&self.legend, screen));
        let height = match screen {
            Screen::Wide => plot.max(legend),
            Screen::Narrow => plot + legend,
        };
        canvas::svg((screen.width(), height), |area| self.draw(area, screen))
    }

    fn draw(self, area: &Canvas<'_>, screen: Screen) -> Result<(), Failure> {
        area.fill(&WHITE)?;
        let (plot, rest) = match screen {
            Screen::Wide => area.split_horizontally(screen.width() - legend::width(&self.legend)),
            Screen::Narrow => area.split_vertically(screen.plot_height()),
        };
        let title = legend::shortened(self.title, screen.title_letters());
        let mut chart = ChartBuilder::on(&plot)
            .caption(title, ("sans-serif", screen.title_size()))
            .margin(12)
            .x_label_area_size(46)
            .y_label_area_size(76)
            .build_cartesian_2d(self.x.range, self.y.range)?;
        chart
            .configure_mesh()
            .x_labels(screen.x_labels())
            .x_desc(self.x.says)
            .y_desc(self.y.says)
            .x_label_formatter(self.x.label)
            .y_label_formatter(self.y.label)
            .light_line_style(WHITE)
            .label_style(("sans-serif", TEXT_SIZE))
            .draw()?;
        for Layer { points, form, ink } in self.layers {
            let filled = ShapeStyle { color: ink.colour, filled: true, stroke_width: 1 };
            match (form, ink.dash) {
                (Form::Line(stroke_width), None) => {
                    let style = ShapeStyle { stroke_width, ..ink.colour.into() };
                    chart.draw_series(LineSeries::new(points, style))?;
                }
                (Form::Line(stroke_width), Some((dash, gap))) => {
                    let style = ShapeStyle { stroke_width, ..ink.colour.into() };
                    chart.draw_series(DashedLineSeries::new(points, dash, gap, style))?;
                }
                (Form::Bars(stroke_width), _) => {
                    let style = ShapeStyle { stroke_width, ..ink.colour.into() };
                    for pair in points.as_chunks::<2>().0 {
                        let [(begin, y), (end, _)] =
                            pair.each_ref().map(|p| chart.backend_coord(p));
                        let end = end.max(begin + SHORTEST_BAR);
                        area.draw(&PathElement::new([(begin, y), (end, y)], style))?;
                    }
                }
                (Form::Marks(mark), _) => {
                    for place in &points {
                        mark.draw(area, chart.backend_coord(place), ink)?;
                    }
                }
                (Form::Shade, _) => {
                    if let [one, other, ..] = points.as_slice() {
                        chart.draw_series([Rectangle::new([*one, *other], filled)])?;
                    }
                }
            }
        }
        legend::draw(&rest, &self.legend, screen)?;
        area.present()
    }
}
