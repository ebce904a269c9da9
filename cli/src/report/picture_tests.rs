use super::*;

/// A unit square in the plane z = 0, right side towards +z.
fn square() -> (ReportMesh, Vec<Point>) {
    let mesh = ReportMesh {
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..ReportMesh::default()
    };
    let points = vec![
        [-0.5, -0.5, 0.0],
        [0.5, -0.5, 0.0],
        [0.5, 0.5, 0.0],
        [-0.5, 0.5, 0.0],
    ];
    (mesh, points)
}

fn pixels(png: &[u8]) -> Vec<u8> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(png))
        .read_info()
        .unwrap();
    let mut out = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut out).unwrap();
    out
}

fn draw(subject: &Subject<'_>, view: View) -> Vec<u8> {
    let style = PictureStyle {
        margin: 0.25,
        ..PictureStyle::default()
    };
    pixels(&picture_png(subject, view, [40, 40], &style).unwrap())
}

fn pixel(image: &[u8], x: usize, y: usize) -> [u8; 4] {
    std::array::from_fn(|k| image[4 * (40 * y + x) + k])
}

/// The square covers the middle half of the picture and nothing else; its two
/// sides are told apart; the scale is exact.
#[test]
fn coverage_sides_and_scale() {
    let (mesh, points) = square();
    let subject = Subject {
        mesh: &mesh,
        positions: &points,
        bodies: &[],
        paint: Paint::Fabric,
    };
    let front = draw(&subject, View::Front);
    for y in 0..40 {
        for x in 0..40 {
            let inside = (10..30).contains(&x) && (10..30).contains(&y);
            assert_eq!(
                pixel(&front, x, y)[3],
                if inside { 255 } else { 0 },
                "{x} {y}"
            );
        }
    }
    let warm = pixel(&front, 20, 20);
    let cool = pixel(&draw(&subject, View::Back), 20, 20);
    assert!(warm[0] > warm[2] && cool[2] > cool[0], "{warm:?} {cool:?}");
    let style = PictureStyle {
        margin: 0.25,
        ..PictureStyle::default()
    };
    let p = picture(&subject, View::Front, [40, 40], &style).unwrap();
    assert!((p.metres_per_pixel - 0.05).abs() < 1e-12);
}

/// What is nearer to the viewer hides what is behind, whatever the order.
#[test]
fn nearer_surfaces_hide() {
    let (mesh, points) = square();
    let body = |z: f32| ReportSurface {
        points: points.iter().map(|p| [p[0], p[1], z]).collect(),
        triangles: mesh.triangles.clone(),
        ..ReportSurface::default()
    };
    let seen = |z: f32| {
        let bodies = [body(z)];
        let subject = Subject {
            mesh: &mesh,
            positions: &points,
            bodies: &bodies,
            paint: Paint::Fabric,
        };
        let p = pixel(&draw(&subject, View::Front), 20, 20);
        i32::from(p[0]) - i32::from(p[2])
    };
    assert!(seen(-0.1) > 40, "cloth in front is warm: {}", seen(-0.1));
    assert!(seen(0.1).abs() < 20, "body in front is grey: {}", seen(0.1));
}

/// Field colours follow the scale; NaN is drawn as missing.
#[test]
fn fields_are_coloured() {
    let (mesh, points) = square();
    let field = |values: Vec<f32>| Field {
        values,
        range: Some((0.0, 1.0)),
        ..Field::default()
    };
    let at = |field: &Field, x, y| {
        let paint = Paint::Triangles(field);
        let subject = Subject {
            mesh: &mesh,
            positions: &points,
            bodies: &[],
            paint,
        };
        pixel(&draw(&subject, View::Front), x, y).map(i32::from)
    };
    let f = field(vec![0.0, 1.0]);
    let (low, high) = (at(&f, 26, 26), at(&f, 13, 13));
    assert!(high[1] > low[1] + 80, "dark {low:?}, light {high:?}");
    let missing = at(&field(vec![f32::NAN, 0.0]), 26, 26);
    assert!((missing[0] - missing[1]).abs() < 12, "{missing:?}");
}

/// Bad input is an error or an omission, never a panic; the result is repeatable.
#[test]
fn robust_and_repeatable() {
    let (mut mesh, mut points) = square();
    mesh.triangles.push([0, 1, 99]);
    points.push([f32::NAN, 0.0, 0.0]);
    points.push([f32::INFINITY, 1e30, 0.0]);
    mesh.triangles.push([0, 4, 5]);
    let style = PictureStyle {
        ground_shadow: true,
        ..PictureStyle::default()
    };
    let subject = Subject {
        mesh: &mesh,
        positions: &points,
        bodies: &[],
        paint: Paint::Panels,
    };
    let a = picture_png(&subject, View::THREE_QUARTER, [64, 48], &style).unwrap();
    let b = picture_png(&subject, View::THREE_QUARTER, [64, 48], &style).unwrap();
    assert_eq!(a, b);
    let one = Subject {
        positions: &points[..1],
        ..subject
    };
    assert!(picture_png(&one, View::Top, [8, 8], &style).is_ok());
    let none = Subject {
        positions: &[],
        ..subject
    };
    let error = picture_png(&none, View::Top, [8, 8], &style);
    assert!(matches!(
        error,
        Err(ReportError::NothingToDraw { points: 0 })
    ));
    let error = picture_png(&subject, View::Top, [0, 8], &style);
    assert!(matches!(
        error,
        Err(ReportError::PictureSize { width: 0, .. })
    ));
}
