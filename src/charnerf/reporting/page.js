// The parts of a report that move: diagrams in the page's colors, and the mesh viewer, begun when the first mesh comes near.

const dark = matchMedia("(prefers-color-scheme: dark)");

const narrow = matchMedia("(max-width: 600px)");

/** Panels that stand side by side one below the other: on a phone their labels would overlap. */
function stack(layout) {
  const panels = Object.keys(layout).filter((name) => /^xaxis/.test(name)).map((name) => name.slice(5));
  if (panels.length < 2) return;
  panels.forEach((number, place) => {
    const top = 1 - place / panels.length;
    layout[`xaxis${number}`] = { ...layout[`xaxis${number}`], domain: [0, 1], anchor: `y${number}` };
    layout[`yaxis${number}`] = { ...layout[`yaxis${number}`], domain: [top - 0.68 / panels.length, top] };
  });
  layout.height = 300 * panels.length;
  layout.legend = { ...layout.legend, y: -0.22 / panels.length };
}

/** A color nearer to white, which stands out on dark paper. */
const lighter = (hex) => `#${hex.match(/[0-9a-f]{2}/gi).map((one) => Math.round(0.6 * parseInt(one, 16) + 102).toString(16)).join("")}`;

function inPaperColors(trace) {
  if (!dark.matches) return trace;
  const paint = (part) => part?.color && { ...part, color: lighter(part.color) };
  return { ...trace, line: paint(trace.line) ?? trace.line, marker: paint(trace.marker) ?? trace.marker };
}

function drawPlots() {
  const style = getComputedStyle(document.documentElement);
  const color = (name) => style.getPropertyValue(name).trim();
  const axis = { gridcolor: color("--rule"), linecolor: color("--strong"), automargin: true };
  for (const figure of document.querySelectorAll("figure.plot")) {
    const plot = JSON.parse(figure.querySelector("script").textContent);
    const layout = { ...plot.layout, paper_bgcolor: color("--paper"), plot_bgcolor: color("--paper") };
    layout.font = { ...layout.font, color: color("--ink") };
    for (const key of Object.keys(layout).filter((name) => /^[xy]axis/.test(name))) layout[key] = { ...layout[key], ...axis };
    const buttons = { bgcolor: color("--block"), bordercolor: color("--rule"), showactive: false }; // the axis says which
    layout.updatemenus = layout.updatemenus?.map((menu) => ({ ...menu, ...buttons }));
    if (narrow.matches) stack(layout);
    Plotly.react(figure.querySelector("div"), plot.data.map(inPaperColors), layout, { responsive: true, displaylogo: false });
  }
}

if (document.querySelector("figure.plot")) {
  drawPlots();
  for (const change of [dark, narrow]) change.addEventListener("change", drawPlots);
}

const viewer = document.getElementById("mesh-viewer");
if (viewer) {
  const near = new IntersectionObserver((seen) => {
    if (!seen.some((one) => one.isIntersecting)) return;
    near.disconnect();
    const script = document.createElement("script");
    script.textContent = viewer.textContent;
    document.head.append(script);
  }, { rootMargin: "300px" });
  for (const mesh of document.querySelectorAll("charnerf-mesh")) near.observe(mesh);
}
