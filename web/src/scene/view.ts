import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Config, MotionView, Point, State, WorkspaceShape } from "../generated/api.ts";
import { token } from "../look/theme.ts";
import type { Zone } from "../machine/plan.ts";
import { colourOf, SLACK } from "./colours.ts";
import { Figure } from "./figure.ts";
import { Ghost, type Ahead } from "./ghost.ts";
import { Grips } from "./grips.ts";
import { dashed, fill, solid } from "./line.ts";
import { empty, free, glass, lambert, named } from "./materials.ts";
import { PlacesLayer } from "./places.ts";
import { bodyOf } from "./zones.ts";

export type View = "perspective" | "top" | "side";

/** The parts of the picture that can be switched on and off. */
export type Layer = "workspace" | "trace" | "path" | "next";

/** The part of a state that the picture needs. One that is not `moving` is drawn as it is, and never continued. */
export type Pose = Pick<State, "joints" | "point" | "velocity" | "moving" | "gripper_closed">;

/** The longest time for which a motion is continued beyond the last state [s]. */
const FORESIGHT = 0.075;
const TRACE_SECONDS = 30;
const MOST_TRACE = 900;

/** Places closer than this look the same [m]. */
const SAME = 5e-4;

/** A change of a line's tension below this share of the range of colours is not seen. */
const SAME_COLOUR = 0.02;

/** Period at which the trace of a robot at rest gets shorter [ms]. */
const FADING = 1000;

/** Up to this distance a person can move the camera away [m]. */
const FARTHEST = 8;

/**
 * The robot in 3D. z is up, units are m. It draws a picture only when something has changed, and never before the page
 * itself is painted. Objects here are plain: nothing of three.js is reactive.
 */
export class RobotView {
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.PerspectiveCamera(38, 1, 0.05, 30);
  private readonly controls: OrbitControls;
  private readonly figure: Figure;
  private readonly ghost: Ghost;
  private readonly next = new THREE.Group();
  private readonly plumb = named(dashed(2), "ink-3");
  private readonly trace = named(solid(MOST_TRACE), "accent");
  private readonly planned = named(dashed(64), "ink");
  private readonly workspace = new THREE.Group();
  private readonly zones = new THREE.Group();
  private readonly parts = new THREE.Group();
  /** Taught places, and a zone that is being entered. */
  readonly places = new PlacesLayer(() => this.request());
  readonly grips: Grips;
  private readonly readers = new Set<() => void>();
  private readonly track: { at: number; point: Point }[] = [];
  private latest: { state: Pose; at: number } | null = null;
  private given: readonly (readonly [number, number, number])[] | null = null;
  private tension: [number, number] | null = null;
  /** The content of the last picture. */
  private shown: { state: Pose | null; shares: [number, number] } = { state: null, shares: [0, 0] };
  private view: View = "perspective";
  private turned = false;
  private asked = 0;
  private fading = 0;
  private drawn = 0;
  private readonly slow: boolean;
  private readonly observer: ResizeObserver;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly config: Config,
    private readonly clockSpeed: number,
  ) {
    const context = canvas.getContext("webgl2", { antialias: true, alpha: false });
    const name = context === null ? "" : rendererName(context);
    this.slow = /swiftshader|llvmpipe|software/i.test(name) && !new URLSearchParams(location.search).has("fine");
    this.renderer = new THREE.WebGLRenderer({ canvas, ...(context ? { context } : {}), antialias: !this.slow, alpha: false });
    this.renderer.setPixelRatio(this.slow ? 0.75 : Math.min(devicePixelRatio, 2));
    canvas.addEventListener("webglcontextrestored", this.restored);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    canvas.style.touchAction = "pan-y"; // a finger that moves up and down scrolls the page
    this.controls.minDistance = 0.3;
    this.controls.addEventListener("change", () => this.request());
    this.controls.addEventListener("start", () => (this.turned = true));
    this.grips = new Grips(this.camera, canvas);
    this.figure = new Figure(config.geometry, lambert);
    this.ghost = new Ghost(config.geometry);
    this.next.add(this.ghost.group);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x445566, 2.2), sun());
    this.scene.add(this.figure.group, this.plumb, this.planned, this.trace, this.next, this.workspace, this.zones, this.parts, this.places.group);
    this.build();
    this.paint();
    this.show("perspective");
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(canvas.parentElement ?? canvas);
    this.resize();
  }

  /** Ends everything that this view holds. */
  dispose(): void {
    cancelAnimationFrame(this.asked);
    clearTimeout(this.fading);
    this.observer.disconnect();
    this.canvas.removeEventListener("webglcontextrestored", this.restored);
    this.controls.dispose();
    free(this.scene);
    this.renderer.dispose();
    this.renderer.forceContextLoss(); // browsers keep few contexts, and free them late
  }

  /** Shows a state; null when the connection is lost. Before homing the lines and the gripper have no known place. */
  setState(state: Pose | null): void {
    this.latest = state === null ? null : { state, at: performance.now() };
    if (state?.point && this.given === null && !samePlace(state.point, this.track.at(-1)?.point)) {
      this.track.push({ at: performance.now(), point: state.point });
      this.shorten(); // a hidden page draws nothing for hours
    }
    if (!looksSame(state, this.shown.state)) this.request();
  }

  /** Draws these points as the trace, instead of the places of the last seconds. */
  setTrace(points: readonly (readonly [number, number, number])[]): void {
    this.given = points;
    this.request();
  }

  setTension(tension: [number, number] | null): void {
    this.tension = tension;
    if (this.shown.shares.some((share, i) => Math.abs(this.shareOfTension(i as 0 | 1) - share) > SAME_COLOUR)) this.request();
  }

  /** Draws the path of the motion under way. */
  setMotion(motion: MotionView | null): void {
    const points = (motion?.path ?? []).map((one) => one.point);
    fill(this.planned, points.map(([x, y, z]) => [x, y, z]));
    this.planned.computeLineDistances();
    this.request();
  }

  /** Draws the ghost of a motion that has not begun. Returns where it stands [m]; null if there is nothing to draw. */
  setAhead(ahead: Ahead | null): Point | null {
    this.request();
    return this.ghost.show(ahead);
  }

  /** Calls `reader` after each picture. Returns the function that ends this. */
  onDrawn(reader: () => void): () => void {
    this.readers.add(reader);
    return () => this.readers.delete(reader);
  }

  /** Draws the parts on the table, by name. */
  setParts(parts: Record<string, readonly number[] | null>): void {
    empty(this.parts);
    for (const [name, place] of Object.entries(parts)) {
      if (place === null) continue;
      const block = new THREE.Mesh(new THREE.BoxGeometry(0.04, 0.04, 0.04), new THREE.MeshLambertMaterial({ color: colourOf(name) }));
      block.position.set(place[0] ?? 0, place[1] ?? 0, (place[2] ?? 0) - 0.02);
      const foot = new THREE.Mesh(new THREE.CylinderGeometry(0.018, 0.022, Math.max(0.001, (place[2] ?? 0) - 0.04)), lambert("steel"));
      foot.rotation.x = Math.PI / 2;
      foot.position.set(place[0] ?? 0, place[1] ?? 0, ((place[2] ?? 0) - 0.04) / 2);
      this.parts.add(block, foot);
    }
    this.request();
  }

  /** Draws the shape of the workspace as glass: its section turned about axis a, and its two ends. */
  setWorkspace(shape: WorkspaceShape | null): void {
    empty(this.workspace);
    if (shape !== null) {
      const [from, to] = shape.boom;
      const outline = shape.outline.map(([d, z]) => new THREE.Vector2(Math.max(0, d), z));
      const first = outline[0];
      if (first !== undefined) outline.push(first.clone());
      const body = new THREE.Mesh(new THREE.LatheGeometry(outline, 48, from, to - from), glass(token("accent"), Number(token("glass"))));
      body.material.side = THREE.DoubleSide;
      // A lathe turns about y, from z to x; the boom turns about z, from y to x. The scale swaps both.
      body.rotation.set(Math.PI / 2, 0, 0);
      body.scale.z = -1;
      this.workspace.add(body);
      for (const a of [from, to]) {
        const edge = new THREE.BufferGeometry().setFromPoints(
          outline.map((one) => new THREE.Vector3(one.x * Math.sin(a), one.x * Math.cos(a), one.y)),
        );
        this.workspace.add(new THREE.Line(edge, new THREE.LineBasicMaterial({ color: token("accent"), transparent: true, opacity: 0.5 })));
      }
    }
    this.request();
  }

  /** Draws the zones to keep out of. */
  setZones(zones: readonly Zone[]): void {
    empty(this.zones);
    for (const zone of zones) {
      this.zones.add(named(bodyOf(zone, glass(token("warn"), 0.22)), "warn"));
    }
    this.request();
  }

  toggle(layer: Layer, shown: boolean): void {
    ({ workspace: this.workspace, trace: this.trace, path: this.planned, next: this.next })[layer].visible = shown;
    this.request();
  }

  show(view: View): void {
    this.view = view;
    this.turned = false;
    const { height, length } = this.config.geometry;
    const { minimum = 0, maximum = 0 } = this.config.axes?.["a"] ?? {};
    const ends = [0, 1 / 3, 2 / 3, 1].map((share) => minimum + share * (maximum - minimum));
    const whole = ends.map((a) => new THREE.Vector3(length * Math.sin(a), length * Math.cos(a), height + 0.1)).concat(new THREE.Vector3());
    const from = {
      perspective: new THREE.Vector3(1.15, 1.25, 0.62),
      top: new THREE.Vector3(0, -0.001, 1),
      side: new THREE.Vector3(1, -0.001, 0.02),
    }[view].normalize();
    this.camera.fov = this.camera.aspect < 1 ? 50 : 38;
    const { middle, distance } = framed(whole, from, this.camera);
    this.controls.maxDistance = Math.max(FARTHEST, distance); // the controls would bring the camera back, and cut the robot off
    this.controls.target.copy(middle);
    this.camera.position.copy(middle).addScaledVector(from, distance);
    this.camera.updateProjectionMatrix();
    this.controls.update();
    this.request();
  }

  /** Takes the colours of the present theme. */
  paint(): void {
    this.scene.background = new THREE.Color(token("surface"));
    this.scene.traverse((one) => {
      const name = one.userData["token"] as string | undefined;
      if (name === undefined || !(one instanceof THREE.Mesh || one instanceof THREE.Line)) return;
      (one.material as THREE.MeshLambertMaterial).color.set(token(name));
    });
    this.request();
  }

  private build(): void {
    const { height, length } = this.config.geometry;
    const side = length * 1.25;
    const table = tinted(new THREE.BoxGeometry(side, side, 0.03), "table");
    table.position.set(side / 2 - 0.3, side / 2 - 0.3, -0.016);
    this.scene.add(table, grid(side, 0.1, "line", 0.5), grid(side, 0.5, "line-strong", 0.5));
    const mast = tinted(new THREE.CylinderGeometry(0.045, 0.045, height + 0.05, 20), "steel");
    mast.rotation.x = Math.PI / 2;
    mast.position.z = height / 2;
    const foot = tinted(new THREE.CylinderGeometry(0.16, 0.18, 0.05, 28), "steel");
    foot.rotation.x = Math.PI / 2;
    foot.position.z = 0.025;
    this.scene.add(mast, foot);
  }

  private resize(): void {
    const frame = this.canvas.parentElement ?? this.canvas;
    const { clientWidth: width, clientHeight: height } = frame;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, false);
    const upright = this.camera.aspect < 1;
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (!this.turned || upright !== this.camera.aspect < 1) this.show(this.view); // the whole robot, until a person turns it
    this.places.setPixel((2 * Math.tan(((this.camera.fov / 2) * Math.PI) / 180)) / height);
    this.request();
  }

  /** The browser took the drawing context away, and has given another one, which is empty. */
  private readonly restored = (): void => this.request();

  /** Draws soon: at most once a frame, and on slow machines at most 20 times a second. */
  private request(): void {
    if (this.asked !== 0) return;
    this.asked = requestAnimationFrame((now) => {
      this.asked = 0;
      if (this.slow && now - this.drawn < 50) {
        this.request();
        return;
      }
      this.drawn = now;
      const goesOn = this.pose();
      this.renderer.render(this.scene, this.camera);
      for (const reader of this.readers) reader();
      clearTimeout(this.fading);
      if (goesOn) this.request();
      else if (this.track.length > 0) this.fading = window.setTimeout(() => this.request(), FADING);
    });
  }

  /** Puts the robot where it is now. Between two states its joints move on by their velocity. */
  private pose(): boolean {
    const latest = this.latest;
    this.shown = { state: latest?.state ?? null, shares: [this.shareOfTension(0), this.shareOfTension(1)] };
    this.drawTrace();
    const known = latest?.state.point && latest.state.joints;
    this.figure.known = this.plumb.visible = Boolean(known);
    if (!latest || !known) return false;
    const { joints, velocity } = latest.state;
    if (!joints) return false;
    const ahead = Math.min((performance.now() - latest.at) / 1000, FORESIGHT) * this.clockSpeed;
    const speeds = latest.state.moving ? velocity : [0, 0, 0];
    const place = this.figure.pose(...([0, 1, 2].map((i) => (joints[i as 0] ?? 0) + (speeds[i] ?? 0) * ahead) as Point));
    if (place === null) return false;
    this.figure.closed = latest.state.gripper_closed;
    this.figure.lines.forEach((line, i) => line.material.color.copy(this.colourOfTension(i as 0 | 1)));
    fill(this.plumb, [place, [place[0], place[1], 0]]);
    this.plumb.computeLineDistances();
    return latest.state.moving && performance.now() - latest.at < FORESIGHT * 1000;
  }

  private colourOfTension(line: 0 | 1): THREE.Color {
    return new THREE.Color(token("slack")).lerp(new THREE.Color(token("stop")), this.shareOfTension(line));
  }

  /** Returns where the tension of a line is between slack, 0, and its limit, 1. */
  private shareOfTension(line: 0 | 1): number {
    const value = this.tension?.[line] ?? 0;
    const limit = this.config.safety.tension_limit;
    return Math.min(1, Math.max(0, (value - SLACK) / Math.max(0.1, limit - SLACK)));
  }

  private shorten(): void {
    const since = performance.now() - TRACE_SECONDS * 1000;
    while (this.track.length > MOST_TRACE || (this.track[0]?.at ?? since) < since) this.track.shift();
  }

  private drawTrace(): void {
    if (this.given !== null) {
      fill(this.trace, this.given);
      return;
    }
    this.shorten();
    fill(this.trace, this.track.map((one) => one.point));
  }
}

function samePlace(one: Point, other: Point | undefined): boolean {
  return other !== undefined && Math.hypot(one[0] - other[0], one[1] - other[1], one[2] - other[2]) <= SAME;
}

/** Tells whether two states look the same; null is no state. A robot that moves never looks as it did. */
function looksSame(one: Pose | null, other: Pose | null): boolean {
  if (one === null || other === null) return one === other;
  if (one.moving || other.moving || one.gripper_closed !== other.gripper_closed) return false;
  if (!one.point || !other.point) return one.point === other.point;
  return samePlace(one.point, other.point);
}

/** Returns where a camera that looks from the direction `from` looks at, and its distance, so that it sees all points. */
function framed(points: THREE.Vector3[], from: THREE.Vector3, camera: THREE.PerspectiveCamera): { middle: THREE.Vector3; distance: number } {
  const right = new THREE.Vector3().crossVectors(camera.up, from).normalize();
  const up = new THREE.Vector3().crossVectors(from, right);
  const middle = new THREE.Vector3();
  for (const axis of [right, up, from]) {
    const places = points.map((point) => point.dot(axis));
    middle.addScaledVector(axis, (Math.min(...places) + Math.max(...places)) / 2);
  }
  const high = Math.tan(((camera.fov / 2) * Math.PI) / 180) / 1.1; // some room at the borders
  const needed = points.map((point) => {
    const away = point.clone().sub(middle);
    return away.dot(from) + Math.max(Math.abs(away.dot(right)) / (high * camera.aspect), Math.abs(away.dot(up)) / high);
  });
  return { middle, distance: Math.max(...needed) };
}

function rendererName(context: WebGL2RenderingContext): string {
  const info = context.getExtension("WEBGL_debug_renderer_info");
  return info === null ? "" : String(context.getParameter(info.UNMASKED_RENDERER_WEBGL));
}

function sun(): THREE.DirectionalLight {
  const light = new THREE.DirectionalLight(0xffffff, 1.6);
  light.position.set(2, 0.5, 4);
  return light;
}

function tinted(geometry: THREE.BufferGeometry, name: string): THREE.Mesh {
  return named(new THREE.Mesh(geometry, lambert(name)), name);
}

function grid(side: number, step: number, name: string, opacity: number): THREE.LineSegments {
  const points: THREE.Vector3[] = [];
  const [from, to] = [-0.3, side - 0.3];
  for (let at = Math.ceil(from / step) * step; at <= to + 1e-9; at += step) {
    points.push(new THREE.Vector3(from, at, 0.001), new THREE.Vector3(to, at, 0.001));
    points.push(new THREE.Vector3(at, from, 0.001), new THREE.Vector3(at, to, 0.001));
  }
  const geometry = new THREE.BufferGeometry().setFromPoints(points);
  return named(new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ transparent: true, opacity })), name);
}
