//! The routes of pages, for tests that check a rule on all of them.

use axum::http::Method;

/// Method and path of every page and every form.
pub fn all() -> Vec<(Method, String)> {
    within(include_str!("../../server/http/src/pages/mod.rs"))
}

/// The routes in the text of a router, whatever their line breaks.
fn within(text: &str) -> Vec<(Method, String)> {
    let known = [("get(", Method::GET), ("post(", Method::POST), ("put(", Method::PUT), ("patch(", Method::PATCH)];
    let mut routes = Vec::new();
    for route in text.split(".route(").skip(1).map(|rest| rest.split(".route_layer(").next().unwrap()) {
        let path = route.split('"').nth(1).unwrap();
        let before = routes.len();
        for (call, method) in &known {
            if route.split([' ', '.']).any(|word| word.trim_start().starts_with(call)) {
                routes.push((method.clone(), path.to_owned()));
            }
        }
        assert!(routes.len() > before, "{path} has no known method");
    }
    routes
}

#[cfg(test)]
mod tests {
    use super::{all, within};
    use axum::http::Method;

    #[test]
    fn route_is_found_on_one_line_and_on_several() {
        let router = "Router::new()
            .route(\"/\", get(home::get))
            .route(
                \"/studies/{id}/safety-reports-of-everybody\",
                get(safety_review::get_every_report)
                    .post(safety_review::post),
            )
            .route(\"/units\", post(units::post))
            .route_layer(from_fn(get(nothing)))";
        let wrapped = "/studies/{id}/safety-reports-of-everybody";
        let expected = [(Method::GET, "/"), (Method::GET, wrapped), (Method::POST, wrapped), (Method::POST, "/units")];
        assert_eq!(within(router), expected.map(|(method, path)| (method, path.to_owned())));
    }

    #[test]
    fn every_route_of_the_router_is_found() {
        let routes = all();
        assert!(routes.len() > 70, "{}", routes.len());
        for known in [(Method::GET, "/"), (Method::POST, "/studies/{id}/do"), (Method::POST, "/account")] {
            assert!(routes.contains(&(known.0.clone(), known.1.to_owned())), "{known:?}");
        }
    }
}
