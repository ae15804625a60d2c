// The parts of a report that move: diagrams in the page's colors, and the mesh viewer, begun when the first mesh comes near.

const dark = matchMedia("(prefers-color-scheme: dark)");

function drawPlots() {
  const style = getComputedStyle(document.documentElement);
  const color = (name) => style.getPropertyValue(name).trim();
  const axis = { gridcolor: color("--rule"), linecolor: color("--strong") };
  for (const figure of document.querySelectorAll("figure.plot")) {
    const plot = JSON.parse(figure.querySelector("script").textContent);
    const layout = { ...plot.layout, paper_bgcolor: color("--paper"), plot_bgcolor: color("--paper") };
    layout.font = { ...layout.font, color: color("--ink") };
    for (const key of Object.keys(layout).filter((name) => /^[xy]axis/.test(name))) layout[key] = { ...layout[key], ...axis };
    Plotly.react(figure.querySelector("div"), plot.data, layout, { responsive: true, displaylogo: false });
  }
}

if (document.querySelector("figure.plot")) {
  drawPlots();
  dark.addEventListener("change", drawPlots);
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
