// The page of `charnerf app`. The server tells the whole state on every change (`/events`); this draws it, and sends what is done.

const $ = (id) => document.getElementById(id);
const LEFT_OUT = "", OTHER = "other";
const LOOK = { moving: 256, still: 448 }; // pixels a side
const REDUCED = matchMedia("(prefers-reduced-motion: reduce)");

let form, session, state, swapping = null, sentReading = "";

/** An element with attributes, listeners (on...) and children. */
function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value != null) element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

/** Text of an element, changed only where it differs: who listens to the page hears it once. */
function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

const at = (path) => `sessions/${session}/${path}`;

/** Ask the server; what it refuses is thrown as its sentence. */
async function ask(method, path, body) {
  let answer;
  try {
    answer = await fetch(path, { method, body });
  } catch {
    throw new Error("The server does not answer. Is charnerf app still running?");
  }
  const content = await answer.json().catch(() => ({ error: `The server answered with status ${answer.status}.` }));
  if (!answer.ok) throw new Error(content.error);
  return content;
}

/** Do something; where it fails, say why. */
async function attempt(what, where = "problem") {
  $(where).hidden = true;
  try {
    await what();
    return true;
  } catch (error) {
    write($(where), error.message);
    $(where).hidden = false;
    return false;
  }
}

// ---- session

async function begin() {
  form = await ask("GET", "form");
  makeExamples();
  makeForm();
  await connect(location.hash.slice(1));
}

async function connect(name) {
  session = name || (await ask("POST", "sessions")).session;
  history.replaceState(null, "", `#${session}`);
  const events = new EventSource(at("events"));
  events.onmessage = (event) => {
    $("lost").hidden = true;
    state = JSON.parse(event.data);
    draw();
  };
  events.onerror = () => {
    if (events.readyState === EventSource.CLOSED) connect("").catch(lost); // the session is gone: a new one
    else lost(new Error("The server does not answer. Is charnerf app still running?"));
  };
}

function lost(error) {
  write($("lost"), error.message);
  $("lost").hidden = false;
}

// ---- pictures in

async function add(files) {
  const pictures = [...files];
  const tooLarge = pictures.filter((one) => one.size > form.limits.upload);
  await attempt(async () => {
    const failed = tooLarge.map((one) => `${one.name}: found ${megabytes(one.size)}, expected at most ${megabytes(form.limits.upload)}. Save it smaller.`);
    const good = pictures.filter((one) => !tooLarge.includes(one));
    $("reading").hidden = !good.length;
    for (const [index, file] of good.entries()) {
      const more = index + 1 < good.length ? "&more" : "";
      await ask("POST", `${at("pictures")}?name=${encodeURIComponent(file.name)}${more}`, file).catch((error) => failed.push(error.message));
    }
    if (failed.length) throw new Error(failed.join(" "));
  });
  $("reading").hidden = !state?.busy;
  $("files").value = "";
}

function makeExamples() {
  for (const [name, title] of Object.entries(form.examples)) {
    const picture = make("img", { src: `examples/${name}`, alt: "" });
    $("examples").append(make("button", { type: "button", "data-example": name, onclick: () => takeExample(name) }, picture, make("span", {}, title)));
  }
}

async function takeExample(name) {
  $("reading").hidden = false;
  await attempt(() => ask("POST", at(`examples/${name}`)));
}

function receiveDrops() {
  const over = (on) => (event) => {
    event.preventDefault();
    $("drop").classList.toggle("over", on);
  };
  document.addEventListener("dragover", over(true));
  document.addEventListener("dragleave", over(false));
  document.addEventListener("drop", (event) => {
    over(false)(event);
    if (event.dataTransfer.files.length) add(event.dataTransfer.files);
  });
  document.addEventListener("paste", (event) => event.clipboardData.files.length && add(event.clipboardData.files));
  $("files").addEventListener("change", () => $("files").files.length && add($("files").files));
}

// ---- options

function makeForm() {
  const groups = new Map();
  for (const field of form.fields) {
    const input = makeInput(field);
    const hint = make("small", { id: `hint-${field.name}` }, field.hint);
    input.id = `field-${field.name}`;
    input.setAttribute("aria-describedby", hint.id);
    const row = make("div", { class: "field" }, make("label", { for: input.id }, field.label), input, hint);
    if (!groups.has(field.group)) groups.set(field.group, make("fieldset", {}, make("legend", {}, field.group)));
    groups.get(field.group).append(row);
  }
  $("fields").append(...groups.values());
  $("settings").addEventListener("change", () => sendReading());
  $("settings").addEventListener("submit", (event) => event.preventDefault());
  sentReading = JSON.stringify(reading());
}

function makeInput({ kind, least, most, choices, default: value }) {
  if (kind === "choice") return make("select", {}, ...choices.map(([name, label]) => make("option", { value: name, selected: name === value }, label)));
  if (kind === "switch") return make("input", { type: "checkbox", checked: value });
  if (kind === "number") return make("input", { type: "number", min: least, max: most, step: 1, value });
  return make("input", { type: "text", value, inputmode: "numeric", maxlength: 100 });
}

/** Values of the form's fields. */
function settings() {
  return Object.fromEntries(form.fields.map(({ name, kind }) => {
    const input = $(`field-${name}`);
    if (kind === "switch") return [name, input.checked];
    return [name, kind === "number" && input.value !== "" ? Number(input.value) : input.value];
  }));
}

/** Those that say how drawings are read. */
function reading() {
  const values = settings();
  return Object.fromEntries(form.fields.filter((one) => one.group === "Drawings").map(({ name }) => [name, values[name]]));
}

function sendReading() {
  const now = JSON.stringify(reading());
  if (now === sentReading) return;
  sentReading = now;
  attempt(() => ask("POST", at("figures"), JSON.stringify({ reading: reading() })));
}

// ---- drawing the state

function draw() {
  document.body.classList.toggle("full", state.pictures.length > 0);
  $("reading").hidden = !state.busy;
  drawSheets();
  drawFigures();
  drawList($("warnings"), state.read?.warnings ?? []);
  $("assumed").hidden = !state.read;
  drawList($("assumed").querySelector("ul"), state.read?.assumptions ?? []);
  drawJob();
  drawProduct();
}

function drawList(list, lines) {
  if (list.dataset.shown === JSON.stringify(lines)) return;
  list.dataset.shown = JSON.stringify(lines);
  list.replaceChildren(...lines.map((line) => make("li", {}, line)));
}

const figuresOf = (picture) => state.figures.filter((one) => one.picture === picture.number);
const nameOf = (figure) => (figure.view === LEFT_OUT ? "left out" : figure.view.match(/^[\d.,-]+$/) ? `${figure.view}°` : figure.view);

function drawSheets() {
  const sheets = state.pictures.filter((one) => one.is_sheet);
  const key = JSON.stringify(sheets.map((one) => [one, figuresOf(one).map((figure) => [figure.box, figure.view])]));
  if ($("sheets").dataset.shown === key) return;
  $("sheets").dataset.shown = key;
  $("sheets").replaceChildren(...sheets.map((picture) => {
    const boxes = figuresOf(picture).map((figure) => {
      const [left, top, right, bottom] = figure.box.map((share) => 100 * share);
      const box = make("div", { class: figure.view === LEFT_OUT ? "box out" : "box" }, make("span", {}, `${figure.part + 1} ${nameOf(figure)}`));
      Object.assign(box.style, { left: `${left}%`, top: `${top}%`, width: `${right - left}%`, height: `${bottom - top}%` });
      return box;
    });
    const image = make("img", { src: at(`pictures/${picture.number}`), alt: `The sheet with ${boxes.length} figures found on it` });
    const remove = make("button", { type: "button", onclick: () => removePicture(picture.number) }, "Remove");
    return make("figure", { class: "sheet" }, make("div", { class: "paper" }, image, ...boxes), make("figcaption", {}, picture.title, remove));
  }));
}

function removePicture(number) {
  attempt(() => ask("DELETE", at(`pictures/${number}`)));
}

function drawFigures() {
  const cards = new Map([...$("figures").children].map((card) => [Number(card.dataset.number), card]));
  for (const [number, card] of cards) if (!state.figures.some((one) => one.number === number)) card.remove();
  for (const figure of state.figures) {
    const card = cards.get(figure.number) ?? makeCard(figure.number);
    if (!cards.has(figure.number)) $("figures").append(card);
    fillCard(card, figure);
  }
}

const figureOf = (number) => state.figures.find((one) => one.number === number);

function makeCard(number) {
  const options = [...form.views.map((view) => make("option", { value: view }, view)), make("option", { value: OTHER }, "another angle …"), make("option", { value: LEFT_OUT }, "left out")];
  const angle = (label, name, least, most) => make("label", {}, label, make("input", { type: "number", name, min: least, max: most, step: 1, value: 0, onchange: () => angles(number) }));
  const tool = (name, label, does) => make("button", { type: "button", "data-tool": name, onclick: does }, label);
  return make("li", { class: "figure", "data-number": number },
    make("div", { class: "picture" }),
    make("div", { class: "body" },
      make("span", { class: "file" }),
      make("label", {}, make("span", { class: "unseen" }, "View"), make("select", { onchange: (event) => choose(number, event.target.value) }, ...options)),
      make("div", { class: "angles", hidden: true }, angle("Azimuth", "azimuth", 0, 359), angle("Elevation", "elevation", -80, 80)),
      make("p", { class: "says" }),
      make("div", { class: "tools" },
        tool("mirror", "Mirror", () => change(number, { mirrored: !figureOf(number).mirrored })),
        tool("swap", "Swap", () => swap(number)),
        tool("drop", "Leave out", () => change(number, { view: figureOf(number).view === LEFT_OUT ? freeView() : LEFT_OUT })),
        tool("before", "As drawn", (event) => compare(number, event.target)))),
    tool("remove", "×", () => removePicture(figureOf(number).picture)));
}

function fillCard(card, figure) {
  const find = (selector) => card.querySelector(selector);
  const tool = (name) => find(`[data-tool="${name}"]`);
  const read = state.read?.views.find((one) => one.number === figure.number);
  const isOut = figure.view === LEFT_OUT;
  const isNamed = isOut || form.views.includes(figure.view);
  const name = figure.part === null ? figure.title : `${figure.title}, figure ${figure.part + 1}`;
  card.classList.toggle("out", isOut);
  write(find(".file"), name);
  find(".file").title = name;
  const select = find("select");
  select.setAttribute("aria-label", `View of ${name}`);
  if (document.activeElement !== select || isNamed) select.value = isNamed ? figure.view : OTHER;
  find(".angles").hidden = isNamed;
  if (!isNamed && !find(".angles").contains(document.activeElement)) {
    const [azimuth, elevation] = figure.view.split(",");
    find("[name=azimuth]").value = azimuth;
    find("[name=elevation]").value = elevation ?? 0;
  }
  for (const [key, label] of [["mirror", "Mirror"], ["swap", "Swap"], ["before", "As drawn"], ["remove", "Remove"]]) tool(key).setAttribute("aria-label", `${label}: ${name}`);
  tool("mirror").setAttribute("aria-pressed", String(figure.mirrored));
  tool("swap").setAttribute("aria-pressed", String(swapping === figure.number));
  tool("swap").hidden = state.figures.length < 2;
  write(tool("drop"), isOut ? "Use" : "Leave out");
  tool("drop").setAttribute("aria-label", `${isOut ? "Use" : "Leave out"}: ${name}`);
  tool("before").hidden = !read?.mended;
  if (!read?.mended) tool("before").setAttribute("aria-pressed", "false");
  tool("remove").hidden = figure.part !== null;
  const says = find(".says");
  says.className = `says ${read?.tone ?? ""}`;
  write(says, swapping === figure.number ? "Press Swap on the other figure." : read?.sentence ?? (isOut ? "Not used." : ""));
  says.hidden = !says.textContent;
  showPicture(card, figure, read);
}

/** The figure as it was read; before that, its place in the picture. */
function showPicture(card, figure, read) {
  const wantsBefore = card.querySelector('[data-tool="before"]').getAttribute("aria-pressed") === "true";
  const file = read && (read.mended && !wantsBefore ? read.mended : read.given);
  const key = file ? `${state.read.folder}/${file}` : `crop ${figure.mirrored}`;
  const frame = card.querySelector(".picture");
  if (frame.dataset.shown === key) return;
  frame.dataset.shown = key;
  frame.classList.toggle("mirrored", !file && figure.mirrored);
  if (file) {
    frame.replaceChildren(make("img", { src: at(`read/${key}`), alt: `${read.view}, cut out: its outline is red${file === read.mended ? ", what moved orange" : ""}` }));
    return;
  }
  frame.replaceChildren(make("img", { class: "crop", src: at(`figures/${figure.number}`), alt: nameOf(figure) }));
}

function compare(number, button) {
  button.setAttribute("aria-pressed", String(button.getAttribute("aria-pressed") !== "true"));
  fillCard(button.closest(".figure"), figureOf(number));
}

const freeView = () => form.views.find((view) => !state.figures.some((one) => one.view === view));

// ---- corrections

function change(number, { view = figureOf(number).view, mirrored = figureOf(number).mirrored }) {
  return send({ [number]: { view, mirrored } });
}

function send(figures) {
  return attempt(() => ask("POST", at("figures"), JSON.stringify({ figures })));
}

function choose(number, view) {
  const card = document.querySelector(`.figure[data-number="${number}"]`);
  if (view !== OTHER) return change(number, { view });
  card.querySelector(".angles").hidden = false;
  card.querySelector("[name=azimuth]").select();
}

function angles(number) {
  const card = document.querySelector(`.figure[data-number="${number}"]`);
  const [azimuth, elevation] = ["azimuth", "elevation"].map((name) => Number(card.querySelector(`[name=${name}]`).value) || 0);
  change(number, { view: elevation ? `${azimuth},${elevation}` : String(azimuth) });
}

function swap(number) {
  const other = figureOf(swapping ?? -1);
  swapping = other ? null : number;
  if (other && other.number !== number) {
    const figure = figureOf(number);
    send({ [number]: { ...pick(figure), view: other.view }, [other.number]: { ...pick(other), view: figure.view } });
  }
  drawFigures();
}

const pick = ({ view, mirrored }) => ({ view, mirrored });

// ---- making

const isActive = () => ["waiting", "running"].includes(state.job?.state);

function drawJob() {
  const job = state.job;
  const active = isActive();
  $("build").disabled = active || Boolean(state.problem) || !state.figures.length || state.busy;
  write($("missing"), !state.figures.length ? "Drop drawings first, or take an example." : state.problem ?? "");
  $("job").hidden = !active;
  $("job-problem").hidden = job?.state !== "failed";
  write($("job-problem"), job?.problem ?? "");
  $("refine").disabled = active;
  $("empty").hidden = Boolean(state.product);
  write($("empty").firstElementChild, active ? "The character is being made." : "The character appears here.");
  if (!active) return;
  const ahead = job.ahead ?? 0;
  const waits = ahead === 1 ? "One character is made before yours." : `${ahead} characters are made before yours.`;
  const stage = job.state === "waiting" ? waits : STAGES[job.stage] ?? "Beginning";
  write($("job-stage"), stage);
  write($("job-told"), stage);
  const left = job.left_s == null ? "" : `about ${leftText(job.left_s)} left`;
  write($("job-left"), [job.note, left].filter(Boolean).join(" · "));
  if (job.share == null) $("job-share").removeAttribute("value");
  else $("job-share").value = job.share;
}

const STAGES = {
  encode: "Reading the drawings", refine: "Adapting the model", bake: "Asking the field", pictures: "Pictures from all around", mesh: "Mesh and texture",
  files: "Writing files", formats: "Files for other programs", levels: "Levels of detail",
};

function leftText(seconds) {
  if (seconds < 10) return `${Math.round(seconds)} s`;
  return seconds < 100 ? `${5 * Math.round(seconds / 5)} s` : `${Math.round(seconds / 60)} min`;
}

const megabytes = (bytes) => (bytes < 1e6 ? `${Math.max(1, Math.round(bytes / 1e3))} kB` : `${(bytes / 1e6).toFixed(1)} MB`);

function build() {
  return attempt(() => ask("POST", at("build"), JSON.stringify(settings())), "build-problem");
}

// ---- what was made

function drawProduct() {
  const product = state.product;
  $("result").hidden = !product;
  if (!product) return;
  $("gone").hidden = product.can_look;
  $("looking").hidden = !product.can_look;
  write($("gone"), product.can_look ? "" : "The field is not in memory any more, to leave room for others. Build the character again to look at it.");
  if ($("result").dataset.folder === product.folder) return;
  $("result").dataset.folder = product.folder;
  const made = (name) => at(`made/${product.folder}/${name}`);
  showMesh(made, product);
  showFilm(made, product);
  $("panel-sheet").replaceChildren(make("img", { src: made("sheet.png"), alt: "Model sheet: the drawings above, eight views of the character below" }));
  write($("quality"), product.quality);
  $("report").href = made("report.html");
  drawList($("suggestions"), product.suggestions);
  $("again").hidden = !product.suggestions.some((one) => one.startsWith("Refine"));
  drawList($("notes"), product.notes);
  $("downloads").replaceChildren(...Object.entries(product.files).map(([name, what]) =>
    make("li", {}, make("a", { href: `${made(name)}?save`, download: name }, make("strong", {}, name), make("small", {}, `${what}, ${megabytes(product.sizes[name])}`)))));
  looked = null;
  showTab(document.querySelector('[role="tab"][aria-selected="true"]') ?? $("tab-mesh"));
}

function showMesh(made, product) {
  if (!document.querySelector("script[src='viewer.js']")) document.head.append(make("script", { src: "viewer.js" }));
  const select = $("level").querySelector("select");
  $("level").hidden = product.levels.length < 2;
  select.replaceChildren(...product.levels.map((level) => make("option", { value: level.file }, `${level.faces} faces`)));
  const show = () => $("mesh").firstElementChild.setAttribute("src", made(select.value));
  select.onchange = show;
  $("mesh").replaceChildren(make("charnerf-mesh", { label: `The mesh: ${product.mesh}` }));
  show();
}

function showFilm(made, product) {
  const source = made(product.film);
  $("panel-film").replaceChildren(product.film.endsWith(".mp4")
    ? make("video", { src: source, controls: true, loop: true, muted: true, playsinline: true, autoplay: !REDUCED.matches, "aria-label": "Turntable" })
    : make("img", { src: source, alt: "Turntable" }));
}

function showTab(chosen) {
  for (const tab of document.querySelectorAll('[role="tab"]')) {
    const on = tab === chosen;
    tab.setAttribute("aria-selected", String(on));
    tab.tabIndex = on ? 0 : -1;
    $(tab.getAttribute("aria-controls")).hidden = !on;
  }
  if (chosen.id === "tab-field") look();
  else turn(false);
}

function onTabKey(event) {
  const tabs = [...document.querySelectorAll('[role="tab"]')];
  const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (!step) return;
  event.preventDefault();
  const next = tabs[(tabs.indexOf(event.target) + step + tabs.length) % tabs.length];
  showTab(next);
  next.focus();
}

// ---- looking at the field: one question at a time, the latest one next; coarse while it moves

let looked = null, asking = false, turning = false;

async function look() {
  for (const name of ["azimuth", "elevation"]) write($(name).nextElementSibling, `${$(name).value}°`);
  if (asking || !state?.product?.can_look) return;
  asking = true;
  try {
    while (!$("panel-field").hidden && state.product?.can_look) {
      const where = `azimuth=${$("azimuth").value}&elevation=${$("elevation").value}`;
      const [seen, size] = looked?.split(" ") ?? [];
      if (seen === where && Number(size) === LOOK.still) break;
      const still = seen === where;
      const wanted = still ? LOOK.still : LOOK.moving;
      await showLook(`${where}&size=${wanted}${still ? "" : "&moving"}`);
      looked = `${where} ${wanted}`;
      if (turning) step();
    }
  } catch {
    // the state says why: there is nothing to look at
  } finally {
    asking = false;
  }
}

async function showLook(query) {
  const answer = await fetch(at(`look?${query}`));
  if (!answer.ok) throw new Error((await answer.json()).error);
  const before = $("look").src;
  $("look").src = URL.createObjectURL(await answer.blob());
  await $("look").decode();
  if (before.startsWith("blob:")) URL.revokeObjectURL(before);
}

function step() {
  $("azimuth").value = (Number($("azimuth").value) + 6) % 360;
  write($("azimuth").nextElementSibling, `${$("azimuth").value}°`);
}

function turn(on) {
  turning = on;
  $("turn").setAttribute("aria-pressed", String(on));
  if (!on) return;
  step();
  look();
}

function followPointer() {
  let from = null;
  const image = $("look");
  image.addEventListener("pointerdown", (event) => {
    turn(false);
    image.setPointerCapture(event.pointerId);
    from = { x: event.clientX, y: event.clientY, azimuth: Number($("azimuth").value), elevation: Number($("elevation").value) };
  });
  image.addEventListener("pointermove", (event) => {
    if (!from) return;
    $("azimuth").value = (((from.azimuth - 0.5 * (event.clientX - from.x)) % 360) + 360) % 360;
    $("elevation").value = from.elevation + 0.3 * (event.clientY - from.y);
    look();
  });
  for (const end of ["pointerup", "pointercancel"]) image.addEventListener(end, () => (from = null));
}

// ----

receiveDrops();
followPointer();
$("build").onclick = () => build();
$("refine").onclick = () => {
  $("field-refine").value = 30;
  build();
};
$("anew").onclick = () => attempt(async () => {
  for (const { number } of state.pictures) await ask("DELETE", at(`pictures/${number}`));
  $("choose").querySelector("input").focus();
});
$("cancel").onclick = () => attempt(() => ask("POST", at("cancel")), "build-problem");
$("turn").onclick = () => turn(!turning);
for (const name of ["azimuth", "elevation"]) $(name).addEventListener("input", () => {
  turn(false);
  look();
});
for (const tab of document.querySelectorAll('[role="tab"]')) {
  tab.onclick = () => showTab(tab);
  tab.onkeydown = onTabKey;
}
begin().catch(lost);
