//! Reinforcing bars: cylinders with flat ends, one by one, on a grid, or from a CSV file; all of them one body.

use tremie_geometry::{Body, Shape, Union};
use tremie_numerics::DVec3;

use crate::document::Value;
use crate::fault::Fault;

/// Columns of a CSV file of bars: both ends and the diameter, all in one unit.
pub(crate) const COLUMNS: [&str; 7] = ["x1", "y1", "z1", "x2", "y2", "z2", "diameter"];

/// The body of several bars.
pub(crate) fn body(bars: Vec<Shape>) -> Body {
    Body::Union(Union::new(bars.into_iter().map(Body::Shape).collect()))
}

/// A bar, repeated `count` times along each axis at the distances `spacing` in m.
pub(crate) fn grid([start, end]: [DVec3; 2], radius: f64, spacing: DVec3, count: [usize; 3]) -> Vec<Shape> {
    let [nx, ny, nz] = count;
    let place = |n: usize| {
        let steps = [n % nx, n / nx % ny, n / nx / ny].map(|i| i as f64);
        spacing * DVec3::from(steps)
    };
    let all = (0..nx * ny * nz).map(place);
    all.map(|way| Shape::Bar { start: start + way, end: end + way, radius }).collect()
}

/// Reads the bars in the CSV file at `path`, written in a unit of `length` m; `value` is where the case names it.
pub(crate) fn read(value: &Value<'_>, path: &str, length: f64) -> Result<Body, Fault> {
    let bytes = value.files.read(value, path, ".csv", "a CSV file")?;
    let text = std::str::from_utf8(&bytes)
        .map_err(|_| value.fault(format!("is no text: {path}"), "save it again as CSV"))?;
    table(text, length).map(body).map_err(|(line, problem, advice)| {
        let place = line.map(|line| format!(", line {line}")).unwrap_or_default();
        value.fault(format!("holds no bars: {path}{place}: {problem}"), advice)
    })
}

/// The bars of a table; or the number of the line where something is wrong, what it is, and what to write.
fn table(text: &str, length: f64) -> Result<Vec<Shape>, (Option<usize>, String, String)> {
    let header = COLUMNS.join(",");
    // Some programs begin text files with a mark of their encoding.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let lines = text.lines().enumerate().map(|(n, line)| (n + 1, line.trim()));
    let mut lines = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let cells = |line: &str| line.split(',').map(|cell| cell.trim().to_lowercase()).collect::<Vec<_>>();
    match lines.next() {
        Some((_, line)) if cells(line) == COLUMNS => {}
        Some((n, _)) => {
            return Err((
                Some(n),
                "the columns are not those of bars".to_owned(),
                format!("write {header} in the first line, with commas"),
            ));
        }
        None => {
            return Err((None, "it is empty".to_owned(), format!("write {header} and a line for each bar")));
        }
    }
    let mut bars = Vec::new();
    for (n, line) in lines {
        let cells = cells(line);
        if cells.len() != COLUMNS.len() {
            let found = format!("it has {} values, not {}", cells.len(), COLUMNS.len());
            return Err((Some(n), found, format!("write {header}")));
        }
        let mut values = [0.0; COLUMNS.len()];
        for ((value, cell), name) in values.iter_mut().zip(&cells).zip(COLUMNS) {
            *value = match cell.parse::<f64>() {
                Ok(number) if (number * length).is_finite() => number * length,
                _ => {
                    let advice = "write a number without its unit, with a decimal point".to_owned();
                    return Err((Some(n), format!("{name} is \"{cell}\", not a number"), advice));
                }
            };
        }
        let [x1, y1, z1, x2, y2, z2, diameter] = values;
        let (start, end) = (DVec3::new(x1, y1, z1), DVec3::new(x2, y2, z2));
        if diameter <= 0.0 {
            return Err((
                Some(n),
                "the diameter is not positive".to_owned(),
                "write a larger one".to_owned(),
            ));
        }
        if start == end {
            return Err((Some(n), "both ends are the same point".to_owned(), "move one of them".to_owned()));
        }
        bars.push(Shape::Bar { start, end, radius: 0.5 * diameter });
    }
    if bars.is_empty() {
        return Err((None, "it has no bar".to_owned(), "write a line for each bar".to_owned()));
    }
    Ok(bars)
}
