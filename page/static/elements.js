// Elements of the page: found, made, and changed only where something is new.

export const byId = (id) => document.getElementById(id);

/** Write a text where it differs, so that nothing is laid out in vain. */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Show an element with this text; without one, hide it. */
export function announce(element, text) {
  say(element, text);
  element.hidden = !text;
}

/** A new element: its class, and the texts or elements in it. */
export function make(tag, className, ...children) {
  const element = document.createElement(tag);
  if (className) element.className = className;
  element.append(...children);
  return element;
}

/** A sentence's parts, with what stands between backticks as code. */
export const worded = (text) => text.split("`").map((part, at) => (at % 2 ? make("code", "", part) : part));

/** A number with its unit for the eye, and a sentence for the ear. */
export function showFigure(element, number, unit, sentence) {
  if (!element.firstChild) {
    const seen = make("span", "seen", make("span", "number"), make("span", "unit"));
    seen.setAttribute("aria-hidden", "true");
    element.append(seen, make("span", "unseen"));
  }
  const [seen, heard] = element.children;
  say(seen.children[0], number);
  say(seen.children[1], unit);
  say(heard, sentence);
}

/** Rows of a table that keep their cells: a row for each entry, the text of each cell set where it changed. */
export function showRows(body, rows, head = 0) {
  while (body.rows.length > rows.length) body.deleteRow(-1);
  rows.forEach((texts, at) => {
    const row = body.rows[at] ?? body.insertRow();
    texts.forEach((text, column) => say(row.cells[column] ?? cell(row, column === head), text));
  });
}

function cell(row, isHead) {
  const made = make(isHead ? "th" : "td");
  if (isHead) made.scope = "row";
  return row.appendChild(made);
}
