// What a page must be for people who cannot see it, or see it badly: the part of WCAG 2.2 AA that a document shows of
// itself. An expression: the list of what is wrong.
(() => {
  const wrong = [];
  const all = (selector) => [...document.querySelectorAll(selector)];
  const shown = (element) => element.getClientRects().length > 0 && getComputedStyle(element).visibility !== "hidden";
  const name = (element) => `<${element.tagName.toLowerCase()}${element.id ? `#${element.id}` : ""}> ${element.textContent.trim().slice(0, 40)}`;
  const say = (what, element) => wrong.push(`${what}: ${name(element)}`);

  // Structure.
  if (!document.documentElement.lang) wrong.push("the page has no language");
  if (!document.title) wrong.push("the page has no title");
  if (all("h1").length !== 1) wrong.push(`${all("h1").length} h1`);
  for (const landmark of ["main", "header", "footer"]) {
    if (all(landmark).length !== 1) wrong.push(`${all(landmark).length} ${landmark}`);
  }
  let level = 0;
  for (const heading of all("h1, h2, h3, h4")) {
    const own = Number(heading.tagName[1]);
    if (own > level + 1) say("a level of headings is left out before", heading);
    level = own;
  }
  const seen = new Set();
  for (const element of all("[id]")) {
    if (seen.has(element.id)) say("an id twice", element);
    seen.add(element.id);
  }
  for (const table of all("table")) {
    if (!table.querySelector("th[scope]")) say("a table without headings", table);
  }

  // Names.
  const labelled = (element) =>
    element.labels?.length > 0 || element.getAttribute("aria-label") || element.getAttribute("aria-labelledby");
  for (const input of all("input:not([type=hidden]), select, textarea")) if (!labelled(input)) say("no label", input);
  for (const element of all("a[href], button, summary")) {
    if (!element.textContent.trim() && !element.getAttribute("aria-label")) say("no name", element);
  }
  for (const picture of all("svg[role], canvas, img")) {
    if (!picture.getAttribute("aria-label") && !picture.getAttribute("alt")) say("a picture without words", picture);
  }
  for (const region of all("[tabindex='0']")) {
    if (!region.getAttribute("aria-label")) say("a place to go without a name", region);
  }

  // Contrast: the colour of each text against what lies behind it.
  const channels = (colour) => colour.match(/[\d.]+/g).map(Number);
  const luminance = (rgb) =>
    rgb.slice(0, 3)
      .map((c) => c / 255)
      .map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4))
      .reduce((sum, c, i) => sum + c * [0.2126, 0.7152, 0.0722][i], 0);
  const behind = (element) => {
    for (let e = element; e; e = e.parentElement) {
      const colour = channels(getComputedStyle(e).backgroundColor);
      if ((colour[3] ?? 1) === 1) return colour;
    }
    return [255, 255, 255];
  };
  const words = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = words.nextNode(); node; node = words.nextNode()) {
    const element = node.parentElement;
    if (!node.textContent.trim() || !shown(element) || element.closest("svg, .unseen, option, meter, noscript")) continue;
    const style = getComputedStyle(element);
    const [text, ground] = [luminance(channels(style.color)), luminance(behind(element))];
    const contrast = (Math.max(text, ground) + 0.05) / (Math.min(text, ground) + 0.05);
    const size = parseFloat(style.fontSize);
    const large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
    if (contrast < (large ? 3 : 4.5)) say(`contrast ${contrast.toFixed(2)}`, element);
  }

  // Size of what is pressed (2.5.8: 24 px), apart from words within a sentence.
  for (const element of all("button, .button, select, input:not([type=hidden], [type=radio], [type=checkbox], [type=range])")) {
    const box = element.getBoundingClientRect();
    if (shown(element) && (box.width < 24 || box.height < 24)) say("too small to press", element);
  }
  return wrong;
})()
