// A page that is watched: what has changed since is put in place, block by block, so that the rest keeps its focus and place.

const EVERY = 2000; // milliseconds
let tag = null;
let blocks = [...document.querySelector("main").children].map((one) => one.outerHTML); // as they came: diagrams change theirs

const note = document.createElement("p");
note.className = "stale";
note.setAttribute("role", "status");
document.body.prepend(note);

/** The blocks that differ take the place of the old ones. */
function put(text) {
  const written = new DOMParser().parseFromString(`<main>${text}</main>`, "text/html").querySelector("main");
  const fresh = [...written.children].map((one) => one.outerHTML);
  const needs = (what) => written.querySelector(what);
  if ((needs("figure.plot") && !window.Plotly) || (needs("charnerf-mesh") && !document.getElementById("mesh-viewer"))) {
    location.reload(); // what draws them came with no earlier page
    return;
  }
  const main = document.querySelector("main");
  [...written.children].forEach((one, place) => {
    if (fresh[place] === blocks[place]) return;
    if (main.children[place]) main.children[place].replaceWith(one);
    else main.append(one);
  });
  while (main.children.length > fresh.length) main.lastElementChild.remove();
  blocks = fresh;
  if (window.Plotly) drawPlots();
}

async function refresh() {
  try {
    const answer = await fetch("?blocks", { cache: "no-store", headers: tag ? { "If-None-Match": tag } : {} });
    if (answer.ok) {
      tag = answer.headers.get("ETag");
      put(await answer.text());
    }
    note.textContent = answer.ok || answer.status === 304 ? "" : `charnerf watch answered ${answer.status}; the page is as it was.`;
  } catch {
    note.textContent ||= `charnerf watch does not answer; the page is as it was at ${new Date().toLocaleTimeString()}.`;
  }
  setTimeout(refresh, EVERY);
}

refresh();
