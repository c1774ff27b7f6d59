// The view of a report in which the shapes can be turned. It draws when something has changed, and only then.

import {
  BackSide, DoubleSide, FrontSide, Group, Mesh, MeshLambertMaterial, PerspectiveCamera, Scene, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { coloured, geometry } from './mesh.js';
import { Rig } from './light.js';

/** As the page's pictures: from the front, a little from the right and from above. */
const DIRECTION = new Vector3(0.45, 0.35, 1).normalize();
/** Distance of the eye, in half diagonals. */
const EYE_DISTANCE = 5;
const MARGIN = 1.08;
/** So many turns about the upright are looked at to see what the first view must hold. */
const TURNS = 24;
/** Radians by which a key turns, and the factor by which one zooms. */
const TURN = Math.PI / 24;
const ZOOM = 1.15;

class View {
  constructor(root, data) {
    this.root = root;
    this.canvas = root.querySelector('canvas');
    this.scene = new Scene();
    this.rig = new Rig();
    this.scene.add(this.rig);
    this.shapes = shapes(data);
    this.scene.add(...Object.values(this.shapes));
    this.extent = extent([this.shapes.original, this.shapes.suspect].filter(Boolean));
    this.renderer = renderer(this.canvas);
    this.camera = new PerspectiveCamera();
    this.controls = this.turning();
    this.frames = 0;
    this.listen();
  }

  turning() {
    // Before the controls listen, so that they zoom for the first touch too.
    this.canvas.addEventListener('pointerdown', () => this.canvas.focus({ preventScroll: true }));
    const controls = new OrbitControls(this.camera, this.canvas);
    const { radius } = this.extent;
    Object.assign(controls, { minDistance: 0.5 * radius, maxDistance: 4 * EYE_DISTANCE * radius, enableZoom: false });
    // The wheel scrolls the page until the view is clicked, a finger that moves up or down always does.
    this.canvas.addEventListener('focus', () => (controls.enableZoom = true));
    this.canvas.addEventListener('blur', () => (controls.enableZoom = false));
    this.canvas.style.touchAction = 'pan-y';
    return controls;
  }

  listen() {
    this.controls.addEventListener('change', () => this.request());
    this.canvas.addEventListener('keydown', (event) => this.key(event));
    this.canvas.addEventListener('webglcontextrestored', () => this.request());
    for (const button of this.buttons()) {
      button.addEventListener('click', () => this.show(button.dataset.mode));
    }
    this.root.querySelector('[data-reset]').addEventListener('click', () => this.reset());
    new ResizeObserver(() => this.resize()).observe(this.canvas);
  }

  buttons() {
    return [...this.root.querySelectorAll('[data-mode]')];
  }

  /** Draws before the next picture of the screen, once however often it is asked. */
  request() {
    this.pending ??= requestAnimationFrame(() => this.draw());
  }

  draw() {
    this.pending = undefined;
    const distance = this.camera.position.length();
    const { radius } = this.extent;
    this.camera.near = Math.max(distance - 4 * radius, 0.01 * radius);
    this.camera.far = distance + 4 * radius;
    this.camera.updateProjectionMatrix();
    this.rig.quaternion.copy(this.camera.quaternion);
    this.renderer.render(this.scene, this.camera);
    this.root.dataset.frames = ++this.frames;
    this.root.dataset.eye = this.camera.position.toArray().map((c) => c.toFixed(3));
  }

  show(mode) {
    this.root.dataset.mode = mode;
    for (const button of this.buttons()) button.setAttribute('aria-pressed', button.dataset.mode === mode);
    for (const note of this.root.querySelectorAll('[data-for]')) note.hidden = note.dataset.for !== mode;
    this.shapes.original.visible = mode === 'original' || mode === 'both';
    if (this.shapes.suspect) this.shapes.suspect.visible = mode === 'suspect';
    if (this.shapes.veil) this.shapes.veil.visible = mode === 'both';
    if (this.shapes.distance) this.shapes.distance.visible = mode === 'distance';
    this.rig.soften(mode === 'distance');
    this.draw();
    this.root.dataset.drawn = drawn(this.canvas);
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width || !height) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    const half = Math.max(this.extent.up, this.extent.across / this.camera.aspect);
    this.camera.fov = (360 / Math.PI) * Math.atan(MARGIN * half);
    // At once: a canvas of a new size is empty until it is drawn on.
    this.draw();
  }

  reset() {
    this.camera.position.copy(DIRECTION).multiplyScalar(EYE_DISTANCE * this.extent.radius);
    this.controls.target.set(0, 0, 0);
    this.controls.update();
    this.request();
  }

  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const action = {
      ArrowLeft: () => this.turn(-TURN, 0),
      ArrowRight: () => this.turn(TURN, 0),
      ArrowUp: () => this.turn(0, -TURN),
      ArrowDown: () => this.turn(0, TURN),
      '+': () => this.zoom(1 / ZOOM),
      '=': () => this.zoom(1 / ZOOM),
      '-': () => this.zoom(ZOOM),
      0: () => this.reset(),
    }[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  /** Walks around the target: to the right and down, in radians. */
  turn(right, down) {
    const offset = this.camera.position.clone().sub(this.controls.target);
    const length = offset.length();
    const height = Math.asin(offset.y / length) - down;
    const around = Math.atan2(offset.x, offset.z) + right;
    const steepest = Math.PI / 2 - 0.001;
    const level = Math.cos(Math.min(Math.max(height, -steepest), steepest));
    offset.set(Math.sin(around) * level, Math.sin(Math.min(Math.max(height, -steepest), steepest)), Math.cos(around) * level);
    this.look(offset.multiplyScalar(length));
  }

  zoom(factor) {
    this.look(this.camera.position.clone().sub(this.controls.target).multiplyScalar(factor));
  }

  look(offset) {
    this.camera.position.copy(this.controls.target).add(offset);
    // The controls keep their limits, and ask for a drawing when the camera has moved.
    this.controls.update();
  }
}

/** The meshes of the scene by what they show. The inside of an open shape is darker and redder. */
function shapes(data) {
  const made = {};
  const original = geometry(data.shapes.original);
  made.original = clay(original);
  if (data.distances) {
    const material = new MeshLambertMaterial({ vertexColors: true, side: DoubleSide });
    made.distance = new Mesh(coloured(original, data), material);
  }
  if (data.shapes.suspect) {
    const suspect = geometry(data.shapes.suspect);
    made.suspect = clay(suspect);
    made.veil = new Mesh(suspect, veil());
  }
  return made;
}

function clay(geometry) {
  const outside = new MeshLambertMaterial({ color: 0xd6cbbc, side: FrontSide });
  const inside = new MeshLambertMaterial({ color: 0x967060, side: BackSide });
  const group = new Group();
  return group.add(new Mesh(geometry, outside), new Mesh(geometry, inside));
}

/** A tint for the suspect over the original; a little nearer to the eye, lest the two flicker where they are equal. */
function veil() {
  return new MeshLambertMaterial({
    color: 0x1f8a8c, side: DoubleSide, transparent: true, opacity: 0.55,
    polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -1,
  });
}

/**
 * How far shapes reach from the origin, and how far up and across they reach in the first view, as tangents of the angles
 * between its middle and their points, however they are turned about the upright.
 */
function extent(groups) {
  const points = groups.flatMap((group) => {
    const position = group.children[0].geometry.attributes.position;
    return Array.from({ length: position.count }, (_, i) => new Vector3().fromBufferAttribute(position, i));
  });
  const reach = { radius: points.reduce((most, p) => Math.max(most, p.length()), 0), up: 0, across: 0 };
  const [eye, level] = [EYE_DISTANCE * reach.radius, Math.hypot(DIRECTION.x, DIRECTION.z)];
  for (const { x, y, z } of points) {
    const around = Math.hypot(x, z);
    for (let turn = 0; turn < TURNS; turn++) {
      const angle = (2 * Math.PI * turn) / TURNS;
      const near = around * Math.cos(angle);
      const distance = eye - near * level - y * DIRECTION.y;
      reach.up = Math.max(reach.up, Math.abs(y * level - near * DIRECTION.y) / distance);
      reach.across = Math.max(reach.across, (around * Math.abs(Math.sin(angle))) / distance);
    }
  }
  return reach;
}

function renderer(canvas) {
  // Asked for here, because three complains loudly where there is none.
  const context = canvas.getContext('webgl2', { alpha: true, antialias: true });
  if (!context) throw new Error('no WebGL');
  const made = new WebGLRenderer({ canvas, context, alpha: true, antialias: true });
  made.setClearColor(0x000000, 0);
  return made;
}

/** About how many thousandths of the canvas show something, seen in the same turn in which it was drawn. */
function drawn(canvas) {
  const small = Object.assign(document.createElement('canvas'), { width: 40, height: 25 });
  const picture = small.getContext('2d');
  picture.drawImage(canvas, 0, 0, small.width, small.height);
  const { data } = picture.getImageData(0, 0, small.width, small.height);
  return data.filter((value, i) => i % 4 === 3 && value > 0).length;
}

/** The page hides the view until it is known to work. */
function start() {
  const root = document.getElementById('view');
  const missing = document.getElementById('view-missing');
  try {
    root.hidden = false;
    const view = new View(root, JSON.parse(document.getElementById('sombrero-scene').textContent));
    view.reset();
    view.resize();
    view.show(view.shapes.distance ? 'distance' : 'original');
    if (root.dataset.drawn === '0') throw new Error('nothing was drawn');
    missing.hidden = true;
    root.dataset.state = 'ready';
  } catch (error) {
    root.hidden = true;
    root.dataset.state = error.message;
  }
}

start();
