// <charnerf-mesh label="..." src="mesh.glb">: a mesh to be turned, as it is, as clay or as a wireframe.
//
// Where there is no src, a child <script type="text/plain"> holds the GLB in base64, so that one file needs no other. Nothing is
// fetched but src. The GPU is used only while the element is on the screen; frames are drawn only when something has changed.

import {
  AmbientLight, Box3, DirectionalLight, DoubleSide, LoadingManager, MeshBasicMaterial, MeshLambertMaterial, PerspectiveCamera,
  Scene, Sphere, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

const FIELD_OF_VIEW = 30; // degrees
const SECONDS_A_TURN = 12;
const STEP = Math.PI / 24; // of an arrow key
const ZOOM = 0.9; // of plus and minus
const CLAY = 0xc9c2b8;
const WAITING = "The mesh appears here.";
const NO_3D = "This browser shows no 3D: WebGL is off or missing. The mesh's file opens in Blender and in other viewers.";

const FRAME = `
<style>
  :host { display: block; color: inherit; font: inherit; }
  :host([hidden]), [hidden] { display: none !important; }
  .stage { position: relative; height: min(70vh, 30rem); border: 1px solid var(--rule, #8888); border-radius: 6px; overflow: hidden; }
  canvas { display: block; width: 100%; height: 100%; cursor: grab; }
  canvas:active { cursor: grabbing; }
  canvas:focus-visible, button:focus-visible { outline: 3px solid var(--focus, #4c8dff); outline-offset: -3px; }
  .note { position: absolute; inset: 0; display: grid; place-items: center; margin: 0; padding: 1rem; text-align: center; }
  .bar { display: flex; flex-wrap: wrap; gap: .4rem; margin-top: .4rem; }
  button { font: inherit; font-size: .88rem; color: inherit; background: var(--block, transparent); border: 1px solid var(--rule, #8888);
           border-radius: 4px; min-height: 2rem; padding: .1rem .7rem; cursor: pointer; }
  button[aria-pressed="true"] { background: var(--ink, #1d1f23); color: var(--paper, #fff); }
  .hint { font-size: .85rem; margin: .3rem 0 0; }
</style>
<div class="stage"><p class="note" role="status">${WAITING}</p></div>
<div class="bar" role="group" aria-label="How the mesh is shown">
  <button type="button" data-kind="textured">Textured</button>
  <button type="button" data-kind="clay">Clay</button>
  <button type="button" data-kind="wireframe">Wireframe</button>
  <button type="button" data-turn>Turning</button>
  <button type="button" data-front>From the front</button>
</div>
<p class="hint">Drag, or use the arrow keys, to turn; + and − to come nearer, Home for the front.</p>`;

class MeshElement extends HTMLElement {
  static observedAttributes = ["src"];

  constructor() {
    super();
    this.attachShadow({ mode: "open" }).innerHTML = FRAME;
    const find = (selector) => this.shadowRoot.querySelector(selector);
    [this.stage, this.note, this.turnButton] = [find(".stage"), find(".note"), find("[data-turn]")];
    this.kindButtons = [...this.shadowRoot.querySelectorAll("[data-kind]")];
    for (const button of this.kindButtons) button.onclick = () => this.show(button.dataset.kind);
    this.turnButton.onclick = () => this.turn(!this.turning);
    find("[data-front]").onclick = () => this.faceFront();
    this.show("textured");
    this.turn(!matchMedia("(prefers-reduced-motion: reduce)").matches);
  }

  connectedCallback() {
    this.visibility = new IntersectionObserver((seen) => (seen.at(-1).isIntersecting ? this.wake() : this.sleep()));
    this.visibility.observe(this);
  }

  disconnectedCallback() {
    this.visibility.disconnect();
    this.forget();
  }

  attributeChangedCallback(name, before, now) {
    if (before === now || !this.visibility) return;
    const wasAwake = Boolean(this.renderer);
    this.forget();
    if (wasAwake) this.wake();
  }

  /** Take the GPU, read the mesh if it is not there, and draw. */
  async wake() {
    if (this.renderer) return;
    try {
      this.renderer = new WebGLRenderer({ antialias: true, alpha: true });
    } catch {
      this.say(NO_3D);
      return;
    }
    const { domElement: canvas } = this.renderer;
    const loading = (this.loading ??= this.load());
    try {
      const loaded = await loading;
      if (this.loading === loading && this.renderer?.domElement === canvas) this.begin(loaded, canvas);
    } catch (error) {
      if (this.loading !== loading) return; // of a mesh that was changed for another meanwhile
      this.forget();
      this.say(`The mesh can not be shown: ${error.message}`);
    }
  }

  /** Read the mesh: its scene with the camera and its light, and its materials by kind. */
  async load() {
    const manager = new LoadingManager();
    manager.setURLModifier((url) => (/^(blob|data):/.test(url) ? url : "data:,")); // a mesh calls nobody
    const { scene: model } = await new GLTFLoader(manager).parseAsync(await this.bytes(), "");
    const meshes = [];
    model.traverse((each) => each.isMesh && meshes.push(each));
    if (!meshes.length) throw new Error("it holds no surface.");
    const clay = new MeshLambertMaterial({ color: CLAY, side: DoubleSide });
    const wireframe = new MeshBasicMaterial({ wireframe: true });
    for (const mesh of meshes) {
      if (!mesh.geometry.attributes.normal) mesh.geometry.computeVertexNormals();
      const { map, color, vertexColors } = mesh.material;
      // colors as the file has them, unlit: drawings carry their own shading
      const textured = new MeshBasicMaterial({ map, color, vertexColors, side: DoubleSide });
      mesh.material.dispose();
      mesh.userData.materials = { textured, clay, wireframe };
    }
    const { center, radius } = new Box3().setFromObject(model).getBoundingSphere(new Sphere());
    const camera = new PerspectiveCamera(FIELD_OF_VIEW, 1, radius / 50, radius * 50);
    const light = new DirectionalLight(0xffffff, 1.9);
    light.position.set(0.5, 0.8, 1); // over the viewer's shoulder
    camera.add(light);
    const world = new Scene();
    world.add(model, camera, new AmbientLight(0xffffff, 1.1));
    return { world, camera, meshes, wireframe, center, radius };
  }

  async bytes() {
    const source = this.getAttribute("src");
    if (source) {
      const answer = await fetch(source);
      if (!answer.ok) throw new Error(`its file came with status ${answer.status}.`);
      return answer.arrayBuffer();
    }
    const text = atob(this.querySelector("script[type='text/plain']").textContent.trim());
    return Uint8Array.from(text, (sign) => sign.charCodeAt(0)).buffer;
  }

  begin(loaded, canvas) {
    const isNew = this.loaded !== loaded;
    this.loaded = loaded;
    this.note.hidden = true;
    this.stage.prepend(canvas);
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "application");
    canvas.setAttribute("aria-label", `${this.getAttribute("label") ?? "Mesh"}: arrow keys turn it, plus and minus zoom, Home shows the front`);
    this.controls = new OrbitControls(loaded.camera, canvas);
    this.controls.target.copy(loaded.center);
    this.controls.enablePan = false;
    this.controls.enableZoom = false; // until it has the focus: the wheel belongs to the page
    this.controls.minDistance = loaded.radius * 1.2;
    this.controls.maxDistance = loaded.radius * 12;
    this.controls.autoRotateSpeed = 60 / SECONDS_A_TURN;
    canvas.style.touchAction = "pan-y"; // and so does a finger that goes up or down
    this.controls.addEventListener("change", () => this.draw());
    this.controls.addEventListener("start", () => this.turn(false));
    canvas.onfocus = () => (this.controls.enableZoom = true);
    canvas.onblur = () => (this.controls.enableZoom = false);
    canvas.onkeydown = (event) => this.onKey(event);
    this.resizing = new ResizeObserver(() => this.fit());
    this.resizing.observe(this.stage);
    this.fit();
    if (isNew) this.faceFront();
    this.show(this.kind);
    this.turn(this.turning);
  }

  /** Give the GPU back; the mesh, and where it is seen from, are kept. */
  sleep() {
    if (!this.renderer) return;
    const { domElement: canvas } = this.renderer;
    canvas.onblur = canvas.onfocus = null;
    this.renderer.setAnimationLoop(null);
    this.resizing?.disconnect();
    this.controls?.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
    canvas.remove();
    this.renderer = this.controls = this.resizing = null;
    this.say(WAITING);
  }

  forget() {
    this.sleep();
    this.loading?.then(({ meshes }) => {
      for (const { geometry, userData } of meshes) {
        geometry.dispose();
        userData.materials.textured.map?.dispose();
      }
    }, () => {});
    this.loading = this.loaded = null;
    this.say(WAITING);
  }

  say(text) {
    this.note.textContent = text;
    this.note.hidden = false;
  }

  fit() {
    const { clientWidth: width, clientHeight: height } = this.stage;
    if (!this.renderer || !width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.loaded.camera.aspect = width / height;
    this.loaded.camera.updateProjectionMatrix();
    this.draw();
  }

  draw() {
    const { world, camera, wireframe } = this.loaded;
    wireframe.color.set(getComputedStyle(this).color); // dark pages have light ink
    this.renderer.render(world, camera);
  }

  show(kind) {
    this.kind = kind;
    for (const button of this.kindButtons) button.setAttribute("aria-pressed", String(button.dataset.kind === kind));
    if (!this.controls) return;
    for (const mesh of this.loaded.meshes) mesh.material = mesh.userData.materials[kind];
    this.draw();
  }

  turn(on) {
    this.turning = on;
    this.turnButton.setAttribute("aria-pressed", String(on));
    if (!this.controls) return;
    this.controls.autoRotate = on;
    let before = performance.now();
    this.renderer.setAnimationLoop(on ? (now) => {
      this.controls.update(Math.max(0, now - before) / 1000);
      before = now;
    } : null);
  }

  faceFront() {
    if (!this.controls) return;
    const { camera, center, radius } = this.loaded;
    const half = Math.tan((FIELD_OF_VIEW * Math.PI) / 360) * Math.min(1, camera.aspect); // of the narrower side
    const away = radius / Math.sin(Math.atan(half));
    camera.position.set(center.x, center.y + 0.12 * away, center.z + away);
    this.controls.update();
    this.draw();
  }

  onKey(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const moves = {
      ArrowLeft: () => this.controls.rotateLeft(STEP),
      ArrowRight: () => this.controls.rotateLeft(-STEP),
      ArrowUp: () => this.controls.rotateUp(STEP),
      ArrowDown: () => this.controls.rotateUp(-STEP),
      "+": () => this.controls.dollyIn(ZOOM),
      "=": () => this.controls.dollyIn(ZOOM),
      "-": () => this.controls.dollyOut(ZOOM),
      Home: () => this.faceFront(),
    };
    if (!(event.key in moves)) return;
    event.preventDefault();
    this.turn(false);
    moves[event.key]();
    this.controls.update();
  }
}

if (!customElements.get("charnerf-mesh")) customElements.define("charnerf-mesh", MeshElement);
