//! The guides of the repository, embedded into the binary, so that a lab without internet has them.

use crate::error_page_reader::RespondedTo;
use crate::page_error::{PageResult, page};
use crate::problem_details::Refusal;
use askama::Template;
use axum::Extension;
use axum::extract::Path;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use gaitwright_service::access::{Caller, Role};
use gaitwright_service::error::Error;
use pulldown_cmark::{CowStr, Event, Options, Parser, Tag, TagEnd};
use rust_embed::Embed;

#[derive(Embed)]
#[folder = "docs"]
struct Guides;

/// The guides in the order of the table of contents: name in addresses, title, and file in the repository.
const GUIDES: [(&str, &str, &str); 15] = [
    ("clinician", "Guide for clinicians", "docs/clinician.md"),
    ("rater", "Guide for raters", "docs/rater.md"),
    ("lab-session", "Guide for lab sessions", "docs/lab-session.md"),
    ("lab-script", "Guide for lab scripts", "docs/lab-script.md"),
    ("unattended", "Guide for unattended runs", "docs/unattended.md"),
    ("administrator", "Guide for administrators", "docs/administrator.md"),
    ("developer", "Guide for developers", "docs/developer.md"),
    ("data-files", "Data files", DATA_FILES),
    ("method", "Method", "docs/method.md"),
    ("learner", "Learner", LEARNER),
    ("benchmarks", "Benchmarks", "docs/benchmarks.md"),
    ("benchmarks-optimizer", "Benchmarks of the optimiser", "docs/benchmarks/optimizer.md"),
    ("benchmarks-learner", "Benchmarks of the learner", "docs/benchmarks/learner.md"),
    ("benchmarks-service", "Benchmarks of the service", "docs/benchmarks/service.md"),
    ("glossary", "Glossary", "docs/glossary.md"),
];

const DATA_FILES: &str = "optimizer/data/README.md";
const LEARNER: &str = "learner/README.md";

/// Where the images of the guides are served.
const IMAGES: &str = "/help/images/";

#[derive(Template)]
#[template(path = "help.html")]
struct Help {
    /// The reader's role decides the navigation; `None` shows none.
    to: Option<RespondedTo>,
    title: String,
    /// HTML made from a guide; empty for the table of contents.
    guide: String,
    guides: [(&'static str, &'static str, &'static str); 15],
}

/// `GET /help`.
pub(super) async fn contents(caller: Option<Extension<Caller>>) -> PageResult {
    let to = caller.map(|Extension(caller)| RespondedTo(caller.role));
    page(&Help { to, title: "Help".to_owned(), guide: String::new(), guides: GUIDES })
}

/// `GET /help/{name}`.
pub(super) async fn guide(caller: Option<Extension<Caller>>, Path(name): Path<String>) -> PageResult {
    let to = caller.map(|Extension(caller)| RespondedTo(caller.role));
    let unknown = || Error::NotFound { what: "guide".to_owned(), id: name.clone() };
    let (_, title, file) = GUIDES.iter().find(|(guide, ..)| *guide == name).ok_or_else(unknown)?;
    let guide = html_of(&text_of(file).ok_or_else(unknown)?, file);
    page(&Help { to, title: (*title).to_owned(), guide, guides: GUIDES })
}

/// `GET /help/images/{name}`.
pub(super) async fn image(Path(name): Path<String>) -> Result<Response, Refusal> {
    let file = Guides::get(&format!("images/{name}"));
    let file = file.ok_or_else(|| Error::NotFound { what: "image".to_owned(), id: name })?;
    Ok(([(header::CONTENT_TYPE, file.metadata.mimetype().to_owned())], file.data).into_response())
}

/// The text of a file of the repository, if it is embedded.
fn text_of(file: &str) -> Option<String> {
    match file {
        DATA_FILES => Some(include_str!("../../data-files.md").to_owned()),
        LEARNER => Some(include_str!("../../learner.md").to_owned()),
        _ => {
            let found = Guides::get(file.strip_prefix("docs/")?)?;
            Some(String::from_utf8_lossy(&found.data).into_owned())
        }
    }
}

/// Converts a guide to HTML with anchors and links between guides; other links into the repository become plain text.
fn html_of(markdown: &str, file: &str) -> String {
    let mut events: Vec<Event<'_>> = Parser::new_ext(markdown, Options::ENABLE_TABLES).collect();
    let mut linked = Vec::new();
    for place in 0..events.len() {
        let text = match &events[place] {
            Event::Start(Tag::Heading { .. }) => anchor(&events[place..]),
            _ => String::new(),
        };
        match &mut events[place] {
            Event::Start(Tag::Heading { id, .. }) => *id = Some(text.into()),
            Event::Start(Tag::Image { dest_url, .. }) => {
                if let Some(name) = resolved(file, dest_url).strip_prefix("docs/images/") {
                    *dest_url = format!("{IMAGES}{name}").into();
                }
            }
            Event::Start(Tag::Link { dest_url, .. }) => {
                let served = served(file, dest_url);
                linked.push(served.is_some());
                match served {
                    Some(address) => *dest_url = address,
                    None => events[place] = Event::Text("".into()),
                }
            }
            Event::End(TagEnd::Link) if linked.pop() == Some(false) => events[place] = Event::Text("".into()),
            _ => {}
        }
    }
    let mut html = String::new();
    pulldown_cmark::html::push_html(&mut html, events.into_iter());
    html.replace("<table>", "<div class=\"scroll\" role=\"region\" aria-label=\"Table\" tabindex=\"0\"><table>")
        .replace("</table>", "</table></div>")
        .replace("<th>", "<th scope=\"col\">")
        .replace("<pre>", "<pre tabindex=\"0\">")
}

/// The anchor of a heading, in the form that code hosts use: `Gait RMSE` is `gait-rmse`.
fn anchor(from_heading: &[Event<'_>]) -> String {
    let inside = from_heading.iter().take_while(|event| !matches!(event, Event::End(TagEnd::Heading(_))));
    let words = inside.filter_map(|event| match event {
        Event::Text(text) | Event::Code(text) => Some(text.to_lowercase()),
        _ => None,
    });
    let words: String = words.collect();
    words.chars().filter(|c| c.is_alphanumeric() || " -".contains(*c)).map(|c| if c == ' ' { '-' } else { c }).collect()
}

/// The target of a relative link in a file of the repository.
fn resolved(file: &str, target: &str) -> String {
    let mut parts: Vec<&str> = file.split('/').collect();
    parts.pop();
    for part in target.split('/') {
        if part == ".." {
            parts.pop();
        } else {
            parts.push(part);
        }
    }
    parts.join("/")
}

/// The address of a link's target in the service; `None` for a file that only the repository has.
fn served<'a>(file: &str, target: &CowStr<'a>) -> Option<CowStr<'a>> {
    if target.starts_with("https://") || target.starts_with('#') {
        return Some(target.clone());
    }
    let (target, fragment) = target.split_at(target.find('#').unwrap_or(target.len()));
    let target = resolved(file, target);
    let (name, ..) = GUIDES.iter().find(|(_, _, file)| *file == target)?;
    Some(format!("/help/{name}{fragment}").into())
}
