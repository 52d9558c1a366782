//! The guides of `docs/`, embedded into the binary, so that a lab without internet has them.

use crate::page_error::{Page, page};
use crate::problem::Refusal;
use crate::responded_to::RespondedTo;
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
#[folder = "../../docs"]
struct Files;

/// The guides in the order of the table of contents, with their titles.
const GUIDES: [(&str, &str); 9] = [
    ("clinician", "Guide for clinicians"),
    ("rater", "Guide for raters"),
    ("lab-session", "Guide for lab sessions"),
    ("lab-script", "Guide for lab scripts"),
    ("unattended", "Guide for unattended runs"),
    ("administrator", "Guide for administrators"),
    ("method", "Method"),
    ("benchmarks", "Benchmarks"),
    ("glossary", "Glossary"),
];

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
    guides: [(&'static str, &'static str); 9],
}

/// `GET /help`.
pub(super) async fn contents(caller: Option<Extension<Caller>>) -> Page {
    let to = caller.map(|Extension(caller)| RespondedTo(caller.role));
    page(&Help { to, title: "Help".to_owned(), guide: String::new(), guides: GUIDES })
}

/// `GET /help/{name}`.
pub(super) async fn guide(caller: Option<Extension<Caller>>, Path(name): Path<String>) -> Page {
    let to = caller.map(|Extension(caller)| RespondedTo(caller.role));
    let unknown = || Error::NotFound { what: "guide".to_owned(), id: name.clone() };
    let (file, title) = GUIDES.iter().find(|(guide, _)| *guide == name).ok_or_else(unknown)?;
    let text = Files::get(&format!("{file}.md")).ok_or_else(unknown)?;
    let guide = html_of(&String::from_utf8_lossy(&text.data));
    page(&Help { to, title: (*title).to_owned(), guide, guides: GUIDES })
}

/// `GET /help/images/{name}`.
pub(super) async fn image(Path(name): Path<String>) -> Result<Response, Refusal> {
    let file = Files::get(&format!("images/{name}"));
    let file = file.ok_or_else(|| Error::NotFound { what: "image".to_owned(), id: name })?;
    Ok(([(header::CONTENT_TYPE, file.metadata.mimetype().to_owned())], file.data).into_response())
}

/// Converts a guide to HTML with anchors and links between guides; links into the repository become plain text.
fn html_of(markdown: &str) -> String {
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
                if let Some(name) = dest_url.strip_prefix("images/") {
                    *dest_url = format!("{IMAGES}{name}").into();
                }
            }
            Event::Start(Tag::Link { dest_url, .. }) => {
                let served = served(dest_url);
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

/// The address of a link's target in the service; `None` for a file that only the repository has.
fn served<'a>(target: &CowStr<'a>) -> Option<CowStr<'a>> {
    if target.starts_with("https://") || target.starts_with('#') {
        return Some(target.clone());
    }
    let (file, fragment) = target.split_once(".md").unwrap_or((target, ""));
    let known = GUIDES.iter().any(|(guide, _)| *guide == file);
    known.then(|| format!("/help/{file}{fragment}").into())
}
