//! Tests of charts.

use super::*;

#[test]
fn chart_is_one_element_and_escapes_text() {
    let chart = Chart::new("a<b>\"c\"", "x & y", "<script>")
        .with("one", 0, Stroke::Solid, vec![(0.0, 1.0), (1.0, f64::NAN), (2.0, 3.0)])
        .with("two", 1, Stroke::Steps, vec![(0.0, 2.0), (2.0, 1.0)]);
    let svg = chart.svg();
    assert!(svg.starts_with("<svg") && svg.ends_with("</svg>"));
    assert!(!svg.contains("<script>") && !svg.contains("NaN"));
    assert_eq!(svg.matches("<circle").count(), 2);
    assert_eq!(chart.legend().len(), 2);
}

#[test]
fn chart_has_position_and_range_of_its_axes() {
    let svg = Chart::new("", "time, s", "angle, °").with("one", 0, Stroke::Solid, vec![(2.0, 1.0), (4.0, 3.0)]).svg();
    for part in ["data-right=\"74 ", " 2 4\"", "data-logarithmic=\"false\"", "data-across=\"time, s\""] {
        assert!(svg.contains(part), "{part}: {svg}");
    }
}

#[test]
fn points_are_links_on_a_page_but_not_in_a_file() {
    let link = PointLink { address: "/trials/1".to_owned(), name: "trial <1>".to_owned() };
    let chart = Chart::new("", "", "").with_links("trials", 0, vec![((0.0, 1.0), link)]);
    let svg = chart.svg();
    assert!(svg.contains("<a href=\"/trials/1\" tabindex=\"-1\" aria-label=\"trial &lt;1&gt;\">"), "{svg}");
    assert!(svg.contains("role=\"group\"") && svg.matches("</a>").count() == 1);
    assert!(!chart.body().contains("<a") && chart.body().contains("<circle"));
}

#[test]
fn legend_names_visible_lines_only() {
    let chart = Chart::new("", "", "")
        .with("seen", 0, Stroke::Points, vec![(0.0, 1.0)])
        .with("empty", 1, Stroke::Steps, vec![])
        .with("nowhere", 2, Stroke::Solid, vec![(0.0, f64::NAN)]);
    assert_eq!(chart.legend(), [("key c0 points".to_owned(), "seen".to_owned())]);
}

#[test]
fn marks_are_numbered_in_the_chart_and_named_in_the_legend() {
    let mut chart = Chart::new("", "", "").with("one", 0, Stroke::Solid, vec![(0.0, 1.0), (9.0, 2.0)]);
    chart.marks = vec![(0.0, "tracking".to_owned()), (3.0, "cost".to_owned())];
    let svg = chart.svg();
    assert!(svg.contains(">1</text>") && svg.contains(">2</text>") && !svg.contains("cost"), "{svg}");
    assert!(!svg.contains("rotate"), "nothing is written along a line");
    assert_eq!(chart.legend()[2], ("key begins".to_owned(), "2 cost".to_owned()));
}

#[test]
fn spans_are_named_if_there_is_room() {
    let mut chart = Chart::new("", "", "").with("one", 0, Stroke::Solid, vec![(0.0, 1.0), (100.0, 2.0)]);
    let span = |from, to, name: &str| Span { from, to, name: name.to_owned(), shaded: from == 0.0 };
    chart.spans = vec![span(0.0, 2.0, "DS2_R"), span(2.0, 30.0, "SS2_R")];
    let svg = chart.svg();
    assert!(svg.contains(">SS2_R</text>") && !svg.contains("DS2_R"), "{svg}");
    assert_eq!((svg.matches("class=\"span\"").count(), svg.matches("class=\"mark\"").count()), (1, 1));
}

#[test]
fn stance_and_swing_of_each_leg_are_marked_on_its_own_cycle() {
    let mut chart = Chart::new("", "", "").with("left", 0, Stroke::Solid, vec![(0.0, 1.0), (100.0, 2.0)]);
    let cycle = |colour, begins_percent, toe_off_percent| LegCycle { colour, begins_percent, toe_off_percent };
    chart.cycles = vec![cycle(Some(0), 49.6, Some(50.0)), cycle(Some(3), 0.0, Some(62.0))];
    let svg = chart.svg();
    assert!(svg.contains("data-cycles=\"c0 49.60,c3 0.00\""), "{svg}");
    // The middle of the axis from 74 to 616.
    assert!(svg.contains("<path class=\"stance c0\" d=\"M74.0 38H345.0\"/>"), "{svg}");
    assert_eq!((svg.matches("class=\"swing").count(), svg.matches("class=\"toe_off").count()), (2, 2));
    assert_eq!(chart.legend()[1].0, "key stance", "{:?}", chart.legend());
    // The bars of four gaits fit between the label of the axis and the plot.
    chart.cycles = (0..4).map(|colour| cycle(Some(colour), 0.0, Some(60.0))).collect();
    let svg = chart.svg();
    for (colour, height) in [(0, "32"), (1, "39"), (2, "46"), (3, "53")] {
        let bar = format!("<path class=\"stance c{colour}\" d=\"M74.0 {height}H");
        assert!(svg.contains(&bar), "{bar}: {svg}");
    }
    chart.cycles = vec![cycle(None, 0.0, None)];
    assert!(chart.svg().contains("data-cycles=\"* 0.00\"") && !chart.svg().contains("class=\"stance"));
}

#[test]
fn places_of_a_line_at_moments_of_the_stride_are_in_units_of_the_drawing() {
    let mut chart = Chart::new("", "", "").with("orbit", 3, Stroke::Solid, vec![(0.0, 0.0), (10.0, 10.0)]);
    chart.moments = vec![(3, vec![(0.0, 0.0), (10.0, 5.0)])];
    let svg = chart.svg();
    assert!(svg.contains("data-moments=\"c3 74.0 270.0 616.0 164.0\""), "{svg}");
}

#[test]
fn logarithmic_axis_has_powers_of_ten() {
    let mut chart = Chart::new("", "", "").with("one", 0, Stroke::Solid, vec![(0.0, 1e-3), (1.0, 10.0)]);
    chart.log_y = true;
    let svg = chart.svg();
    assert!(svg.contains(">10⁻³</text>") && svg.contains(">10¹</text>"), "{svg}");
}

#[test]
fn numbers_of_near_marks_are_merged_and_never_touch() {
    let texts = |places: &[f64]| numbers(places).into_iter().map(|(_, text)| text).collect::<Vec<_>>();
    assert_eq!(texts(&[74.0, 200.0, 300.0]), ["1", "2", "3"]);
    assert_eq!(texts(&[74.0, 76.0, 78.0, 300.0]), ["1\u{2013}3", "4"]);
    // Texts keep their distance however near the marks are.
    let many: Vec<f64> = (0..24).map(|i| 74.0 + 15.0 * f64::from(i) + f64::from(i * i % 7)).collect();
    let written = numbers(&many);
    let half = |text: &str| NAME_CHARACTER * text.chars().count() as f64 / 2.0;
    for pair in written.windows(2) {
        assert!(pair[1].0 - half(&pair[1].1) - pair[0].0 - half(&pair[0].1) >= MARK_GAP, "{written:?}");
    }
}
