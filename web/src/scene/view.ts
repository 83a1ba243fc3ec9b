import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import type { Config, MotionView, State, WorkspaceShape } from "../generated/api.ts";
import { token } from "../look/theme.ts";
import { meeting } from "../machine/kinematics.ts";
import type { Zone } from "../machine/plan.ts";
import { colourOf } from "./colours.ts";
import { PlacesLayer } from "./places.ts";
import { bodyOf, glass } from "./zones.ts";

export type View = "perspective" | "top" | "side";

/** What the picture needs of a state. One that is not `moving` is drawn as it is, and never continued. */
export type Pose = Pick<State, "joints" | "point" | "velocity" | "moving" | "gripper_closed">;

/** The longest time for which a motion is continued beyond the last state [s]. */
const FORESIGHT = 0.075;
const TRACE_SECONDS = 30;
const MOST_TRACE = 900;

/**
 * The robot in 3D. z is up, units are m. It draws a picture only when something has changed, and never before the page
 * itself is painted. Objects here are plain: nothing of three.js is reactive.
 */
export class RobotView {
  private readonly renderer: THREE.WebGLRenderer;
  private readonly scene = new THREE.Scene();
  private readonly camera = new THREE.PerspectiveCamera(38, 1, 0.05, 30);
  private readonly controls: OrbitControls;
  private readonly boom = new THREE.Group();
  private readonly gripper = new THREE.Group();
  private readonly lines: [THREE.Mesh, THREE.Mesh];
  private readonly lineMaterials: [THREE.MeshLambertMaterial, THREE.MeshLambertMaterial];
  private readonly plumb: THREE.Line;
  private readonly trace: THREE.Line;
  private readonly planned: THREE.Line;
  private readonly workspace = new THREE.Group();
  private readonly zones = new THREE.Group();
  private readonly parts = new THREE.Group();
  /** Taught places, and a zone that is being entered. */
  readonly places = new PlacesLayer(() => this.request());
  private fingers: THREE.Mesh[] = [];
  private readonly track: { at: number; x: number; y: number; z: number }[] = [];
  private latest: { state: Pose; at: number } | null = null;
  private given: readonly (readonly [number, number, number])[] | null = null;
  private tension: [number, number] | null = null;
  private asked = 0;
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
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.maxDistance = 8;
    this.controls.minDistance = 0.3;
    this.controls.addEventListener("change", () => this.request());
    this.lineMaterials = [lambert("c2"), lambert("c2")];
    this.lines = [rope(this.lineMaterials[0]), rope(this.lineMaterials[1])];
    this.plumb = dashed(2);
    this.planned = dashed(64);
    this.trace = new THREE.Line(buffered(MOST_TRACE), new THREE.LineBasicMaterial());
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x445566, 2.2), sun());
    this.scene.add(this.boom, this.gripper, ...this.lines, this.plumb, this.planned, this.trace, this.workspace, this.zones, this.parts, this.places.group);
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
    this.observer.disconnect();
    this.controls.dispose();
    this.scene.traverse((one) => {
      if (one instanceof THREE.Mesh || one instanceof THREE.Line) one.geometry.dispose();
    });
    this.renderer.dispose();
  }

  /** Shows a state; null when the connection is lost. Before homing the lines and the gripper have no known place. */
  setState(state: Pose | null): void {
    const before = this.latest;
    this.latest = state === null ? null : { state, at: performance.now() };
    if (state?.point && this.given === null && this.placeChanged(state)) {
      const [x, y, z] = state.point;
      this.track.push({ at: performance.now(), x, y, z });
    }
    if (state === null && before === null) return;
    this.request();
  }

  /** Draws these points as the trace, instead of the places of the last seconds. */
  setTrace(points: readonly (readonly [number, number, number])[]): void {
    this.given = points;
    this.request();
  }

  setTension(tension: [number, number] | null): void {
    this.tension = tension;
    this.request();
  }

  /** Draws the path of the motion under way. */
  setMotion(motion: MotionView | null): void {
    const points = (motion?.path ?? []).map((one) => one.point);
    fill(this.planned, points.map(([x, y, z]) => [x, y, z]));
    this.planned.computeLineDistances();
    this.request();
  }

  /** Draws the parts on the table, by name. */
  setParts(parts: Record<string, readonly number[] | null>): void {
    this.parts.clear();
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
    this.workspace.clear();
    if (shape !== null) {
      const [from, to] = shape.boom;
      const outline = shape.outline.map(([d, z]) => new THREE.Vector2(Math.max(0, d), z));
      const first = outline[0];
      if (first !== undefined) outline.push(first.clone());
      const glass = new THREE.Mesh(
        new THREE.LatheGeometry(outline, 48, from, to - from),
        new THREE.MeshLambertMaterial({ color: token("accent"), transparent: true, opacity: Number(token("glass")), side: THREE.DoubleSide, depthWrite: false }),
      );
      // A lathe turns about y, from z to x; the boom turns about z, from y to x. The scale swaps both.
      glass.rotation.set(Math.PI / 2, 0, 0);
      glass.scale.z = -1;
      this.workspace.add(glass);
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
    this.zones.clear();
    for (const zone of zones) {
      const body = bodyOf(zone, glass(token("warn"), 0.22));
      body.userData["token"] = "warn";
      this.zones.add(body);
    }
    this.request();
  }

  toggle(layer: "workspace" | "trace" | "path", shown: boolean): void {
    ({ workspace: this.workspace, trace: this.trace, path: this.planned })[layer].visible = shown;
    this.request();
  }

  show(view: View): void {
    const { height, length } = this.config.geometry;
    const middle = new THREE.Vector3(length * 0.36, length * 0.36, height * 0.52);
    this.camera.fov = this.camera.aspect < 1 ? 50 : 38;
    const radius = Math.hypot(length * 0.5, height * 0.46);
    const far = radius / Math.sin(((this.camera.fov / 2) * Math.PI) / 180) / Math.min(1, this.camera.aspect * 1.15);
    const from = {
      perspective: new THREE.Vector3(1.15, 1.25, 0.62),
      top: new THREE.Vector3(0, -0.001, 1),
      side: new THREE.Vector3(1, -0.001, 0.02),
    }[view].normalize();
    this.controls.target.copy(middle);
    this.camera.position.copy(middle).addScaledVector(from, far);
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

  private placeChanged(state: Pose): boolean {
    const last = this.track.at(-1);
    if (!last || !state.point) return true;
    return Math.hypot(state.point[0] - last.x, state.point[1] - last.y, state.point[2] - last.z) > 5e-4;
  }

  private build(): void {
    const { height, length, delta } = this.config.geometry;
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
    const beam = tinted(new THREE.BoxGeometry(0.07, length + 0.12, 0.07), "boom");
    beam.position.set(0, length / 2, height + 0.06);
    this.boom.add(beam);
    for (const d of [delta, length]) {
      const pulley = tinted(new THREE.TorusGeometry(0.03, 0.012, 10, 20), "steel");
      pulley.position.set(0, d, height);
      pulley.rotation.y = Math.PI / 2;
      this.boom.add(pulley);
    }
    const body = tinted(new THREE.CylinderGeometry(0.022, 0.022, this.config.geometry.gripper_height * 0.6, 16), "accent");
    body.rotation.x = Math.PI / 2;
    body.position.z = this.config.geometry.gripper_height * 0.7;
    this.gripper.add(body);
    for (const sign of [-1, 1]) {
      const finger = tinted(new THREE.BoxGeometry(0.012, 0.02, this.config.geometry.gripper_height * 0.4), "boom");
      finger.position.set(sign * 0.03, 0, this.config.geometry.gripper_height * 0.2);
      this.fingers.push(finger);
      this.gripper.add(finger);
    }
    this.plumb.userData["token"] = "ink-3";
    this.planned.userData["token"] = "ink";
    this.trace.userData["token"] = "accent";
  }

  private resize(): void {
    const frame = this.canvas.parentElement ?? this.canvas;
    const { clientWidth: width, clientHeight: height } = frame;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, false);
    const upright = this.camera.aspect < 1;
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (upright !== this.camera.aspect < 1) this.show("perspective");
    this.request();
  }

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
      if (goesOn) this.request();
    });
  }

  /** Puts the robot where it is now. Between two states its joints move on by their velocity. */
  private pose(): boolean {
    const latest = this.latest;
    const known = latest?.state.point && latest.state.joints;
    this.gripper.visible = this.lines[0].visible = this.lines[1].visible = this.plumb.visible = Boolean(known);
    if (!latest || !known) return false;
    const { joints, velocity } = latest.state;
    if (!joints) return false;
    const ahead = Math.min((performance.now() - latest.at) / 1000, FORESIGHT) * this.clockSpeed;
    const speeds = latest.state.moving ? velocity : [0, 0, 0];
    const [a, b, c] = [0, 1, 2].map((i) => (joints[i as 0] ?? 0) + (speeds[i] ?? 0) * ahead) as [number, number, number];
    const met = meeting(this.config.geometry, a, b, c);
    if (met === null) return false;
    const place = new THREE.Vector3(...met);
    this.boom.rotation.z = -a;
    const { height, delta, length, gripper_height: hang } = this.config.geometry;
    [delta, length].forEach((d, i) => {
      const line = this.lines[i as 0 | 1];
      stretch(line, new THREE.Vector3(d * Math.sin(a), d * Math.cos(a), height), place);
      this.lineMaterials[i as 0 | 1].color.copy(this.colourOfTension(i as 0 | 1));
    });
    this.gripper.position.set(place.x, place.y, place.z - hang);
    this.gripper.rotation.z = -a;
    const gap = latest.state.gripper_closed ? 0.018 : 0.034;
    this.fingers.forEach((finger, i) => (finger.position.x = i === 0 ? -gap : gap));
    fill(this.plumb, [[place.x, place.y, place.z - hang], [place.x, place.y, 0]]);
    this.plumb.computeLineDistances();
    this.drawTrace();
    return latest.state.moving && performance.now() - latest.at < FORESIGHT * 1000;
  }

  private colourOfTension(line: 0 | 1): THREE.Color {
    const calm = new THREE.Color(token("c2"));
    const value = this.tension?.[line] ?? 0;
    const limit = this.config.safety.tension_limit;
    return calm.lerp(new THREE.Color(token("stop")), Math.min(1, Math.max(0, (value - 0.7) / Math.max(0.1, limit - 0.7))));
  }

  private drawTrace(): void {
    if (this.given !== null) {
      fill(this.trace, this.given);
      return;
    }
    const since = performance.now() - TRACE_SECONDS * 1000;
    while (this.track.length > MOST_TRACE || (this.track[0]?.at ?? since) < since) this.track.shift();
    fill(this.trace, this.track.map((one) => [one.x, one.y, one.z]));
  }
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

function lambert(name: string): THREE.MeshLambertMaterial {
  return new THREE.MeshLambertMaterial({ color: token(name) });
}

function tinted(geometry: THREE.BufferGeometry, name: string): THREE.Mesh {
  const mesh = new THREE.Mesh(geometry, lambert(name));
  mesh.userData["token"] = name;
  return mesh;
}

function rope(material: THREE.Material): THREE.Mesh {
  return new THREE.Mesh(new THREE.CylinderGeometry(0.006, 0.006, 1, 8), material);
}

function stretch(line: THREE.Mesh, from: THREE.Vector3, to: THREE.Vector3): void {
  const way = new THREE.Vector3().subVectors(to, from);
  line.position.copy(from).addScaledVector(way, 0.5);
  line.scale.set(1, way.length(), 1);
  line.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), way.normalize());
}

function buffered(most: number): THREE.BufferGeometry {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(most * 3), 3));
  geometry.setDrawRange(0, 0);
  return geometry;
}

function dashed(most: number): THREE.Line {
  return new THREE.Line(buffered(most), new THREE.LineDashedMaterial({ dashSize: 0.02, gapSize: 0.015 }));
}

/** Replaces the points of a line, as far as its buffer holds them. */
function fill(line: THREE.Line, points: readonly (readonly [number, number, number])[]): void {
  const position = line.geometry.getAttribute("position") as THREE.BufferAttribute;
  const count = Math.min(points.length, position.count);
  for (let i = 0; i < count; i++) position.setXYZ(i, ...(points[i] as [number, number, number]));
  line.geometry.setDrawRange(0, count);
  position.needsUpdate = true;
  line.frustumCulled = false;
}

function grid(side: number, step: number, name: string, opacity: number): THREE.LineSegments {
  const points: THREE.Vector3[] = [];
  const [from, to] = [-0.3, side - 0.3];
  for (let at = Math.ceil(from / step) * step; at <= to + 1e-9; at += step) {
    points.push(new THREE.Vector3(from, at, 0.001), new THREE.Vector3(to, at, 0.001));
    points.push(new THREE.Vector3(at, from, 0.001), new THREE.Vector3(at, to, 0.001));
  }
  const lines = new THREE.LineSegments(
    new THREE.BufferGeometry().setFromPoints(points),
    new THREE.LineBasicMaterial({ transparent: true, opacity }),
  );
  lines.userData["token"] = name;
  return lines;
}
