//! A part of the page: a drawing to scale between two columns of labels, each joined by a line to
//! the point that it names.

use super::canvas::{Canvas, LINE, Px, Rect, TEXT, text_width, truncated};

/// Longest label, in characters.
const LABEL_MOST: usize = 30;
/// Longest title, in characters: it fits half of the page.
const TITLE_MOST: usize = 85;
/// Distance between labels, their lines and the drawing \[px\].
const GAP: f64 = 10.0;
/// Room around the drawing for its dimension lines \[px\].
const MARGIN: f64 = 34.0;
/// Height of the title of a panel \[px\].
const TITLE: f64 = 28.0;

/// Text that names a point of a drawing.
pub(super) struct Label {
    /// Point \[px\].
    pub at: Px,
    /// Text.
    pub text: String,
}

/// Extent of a drawing, in its own coordinates: x to the right, z up \[m\].
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    pub least: [f64; 2],
    pub greatest: [f64; 2],
}

impl Extent {
    /// Returns the extent of points; that of one point is widened to a millimetre.
    pub fn of(points: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let mut extent = Self {
            least: [f64::INFINITY; 2],
            greatest: [f64::NEG_INFINITY; 2],
        };
        for point in points {
            for (axis, value) in point.into_iter().enumerate() {
                extent.least[axis] = extent.least[axis].min(value);
                extent.greatest[axis] = extent.greatest[axis].max(value);
            }
        }
        extent
    }

    fn size(&self) -> [f64; 2] {
        [0, 1].map(|axis| (self.greatest[axis] - self.least[axis]).max(1e-3))
    }
}

/// Scale of a drawing and place of its origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    /// Place of the origin \[px\].
    pub origin: Px,
    /// Scale \[px/m\].
    pub scale: f64,
}

impl Frame {
    /// Returns the place of a point: x to the right, z up \[m\].
    pub fn at(&self, [x, z]: [f64; 2]) -> Px {
        [
            self.origin[0] + self.scale * x,
            self.origin[1] - self.scale * z,
        ]
    }
}

/// Part of the page.
pub(super) struct Panel {
    area: Rect,
    column: f64,
}

impl Panel {
    /// Creates a panel whose columns are as wide as the widest of `texts`.
    pub fn new(area: Rect, texts: &[String]) -> Self {
        let widest = texts
            .iter()
            .map(|text| text_width(&truncated(text, LABEL_MOST)));
        Self {
            area,
            column: widest.fold(0.0, f64::max) + 2.0 * GAP,
        }
    }

    /// Returns the height that a panel with so many labels needs \[px\].
    pub fn height(labels: usize) -> f64 {
        TITLE + LINE * (labels.div_ceil(2) + 2) as f64
    }

    /// Returns the greatest scale at which a drawing fits \[px/m\].
    pub fn scale(&self, extent: &Extent) -> f64 {
        let [width, height] = extent.size();
        let room = self.room();
        (room.width() / width).min(room.height() / height)
    }

    /// Returns the frame that centres a drawing of this extent.
    pub fn frame(&self, extent: &Extent, scale: f64) -> Frame {
        let middle = [0, 1].map(|axis| 0.5 * (extent.least[axis] + extent.greatest[axis]));
        let room = self.room();
        Frame {
            origin: [
                0.5 * (room.left + room.right) - scale * middle[0],
                0.5 * (room.top + room.bottom) + scale * middle[1],
            ],
            scale,
        }
    }

    fn room(&self) -> Rect {
        let side = self.column + MARGIN;
        Rect {
            left: self.area.left + side,
            top: self.area.top + TITLE + MARGIN,
            right: self.area.right - side,
            bottom: self.area.bottom - MARGIN,
        }
    }

    /// Writes title and labels: the left half of the points to the left, the others to the right,
    /// each column in the order of the points' heights.
    pub fn label(&self, canvas: &mut Canvas, title: &str, mut labels: Vec<Label>) {
        let area = self.area;
        let at = [area.left + GAP, area.top + LINE];
        canvas.label("title", at, &truncated(title, TITLE_MOST));
        labels.sort_by(|a, b| a.at[0].total_cmp(&b.at[0]));
        let right = labels.split_off(labels.len().div_ceil(2));
        self.column(canvas, labels, true);
        self.column(canvas, right, false);
        canvas.rectangle("frame", area);
    }

    fn column(&self, canvas: &mut Canvas, mut labels: Vec<Label>, left: bool) {
        labels.sort_by(|a, b| a.at[1].total_cmp(&b.at[1]));
        let (top, bottom) = (self.area.top + TITLE + TEXT, self.area.bottom - GAP);
        let mut places: Vec<f64> = labels
            .iter()
            .map(|label| label.at[1] + 0.35 * TEXT)
            .collect();
        // Downwards past the one above, then upwards from the end of the column.
        let mut least = top;
        for place in &mut places {
            *place = place.max(least);
            least = *place + LINE;
        }
        let mut most = bottom;
        for place in places.iter_mut().rev() {
            *place = place.min(most);
            most = *place - LINE;
        }
        for (label, y) in labels.iter().zip(places) {
            let text = truncated(&label.text, LABEL_MOST);
            let (x, end) = if left {
                let end = self.area.left + self.column - GAP;
                (end - text_width(&text), end + 3.0)
            } else {
                let start = self.area.right - self.column + GAP;
                (start, start - 3.0)
            };
            canvas.line("leader", &[[end, y - 0.35 * TEXT], label.at]);
            canvas.circle("anchor", label.at, 1.8);
            canvas.label("label", [x, y], &text);
        }
    }
}
