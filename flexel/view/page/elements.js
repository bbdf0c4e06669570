// Elements of the page. Texts of files go in as text, never as HTML.

export function element(tag, properties, parent) {
  const made = Object.assign(document.createElement(tag), properties);
  parent.append(made);
  return made;
}

export function button(text, label, act, parent) {
  const made = element("button", {type: "button", textContent: text, title: label, onclick: act}, parent);
  made.setAttribute("aria-label", label);
  return made;
}
