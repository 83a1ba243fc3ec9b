import * as THREE from "three";
import type { Geometry, Point } from "../generated/api.ts";
import { meeting } from "../machine/kinematics.ts";
import { named } from "./materials.ts";

type Line = THREE.Mesh<THREE.CylinderGeometry, THREE.MeshLambertMaterial>;

const UP = new THREE.Vector3(0, 1, 0);

/** The parts of the robot that move: boom, lines and gripper. `paint` makes the material of a part from a token. */
export class Figure {
  readonly group = new THREE.Group();
  readonly lines: readonly [Line, Line];
  private readonly boom = new THREE.Group();
  private readonly gripper = new THREE.Group();
  private readonly fingers: THREE.Mesh[] = [];

  constructor(
    private readonly geometry: Geometry,
    private readonly paint: (name: string) => THREE.MeshLambertMaterial,
  ) {
    const { height, length, delta, gripper_height: hang } = geometry;
    const beam = this.part(new THREE.BoxGeometry(0.07, length + 0.12, 0.07), "boom");
    beam.position.set(0, length / 2, height + 0.06);
    this.boom.add(beam);
    for (const d of [delta, length]) {
      const pulley = this.part(new THREE.TorusGeometry(0.03, 0.012, 10, 20), "steel");
      pulley.position.set(0, d, height);
      pulley.rotation.y = Math.PI / 2;
      this.boom.add(pulley);
    }
    const body = this.part(new THREE.CylinderGeometry(0.022, 0.022, hang * 0.6, 16), "accent");
    body.rotation.x = Math.PI / 2;
    body.position.z = hang * 0.7;
    this.gripper.add(body);
    for (const sign of [-1, 1]) {
      const finger = this.part(new THREE.BoxGeometry(0.012, 0.02, hang * 0.4), "boom");
      finger.position.set(sign * 0.03, 0, hang * 0.2);
      this.fingers.push(finger);
      this.gripper.add(finger);
    }
    this.lines = [this.line(), this.line()];
    this.group.add(this.boom, this.gripper, ...this.lines);
  }

  /** Hides the gripper and the lines while nobody knows where they are; the boom stays. */
  set known(known: boolean) {
    this.gripper.visible = this.lines[0].visible = this.lines[1].visible = known;
  }

  set closed(closed: boolean) {
    const gap = closed ? 0.018 : 0.034;
    this.fingers.forEach((finger, i) => (finger.position.x = i === 0 ? -gap : gap));
  }

  /** Takes the posture of joints (rad, m, m). Returns the gripper point [m]; null if the lines cannot meet. */
  pose(a: number, b: number, c: number): Point | null {
    const met = meeting(this.geometry, a, b, c);
    if (met === null) return null;
    const { height, delta, length, gripper_height: hang } = this.geometry;
    const place = new THREE.Vector3(...met);
    this.boom.rotation.z = -a;
    [delta, length].forEach((d, i) => stretch(this.lines[i as 0 | 1], new THREE.Vector3(d * Math.sin(a), d * Math.cos(a), height), place));
    this.gripper.position.set(place.x, place.y, place.z - hang);
    this.gripper.rotation.z = -a;
    return [place.x, place.y, place.z - hang];
  }

  private part(geometry: THREE.BufferGeometry, name: string): THREE.Mesh {
    return named(new THREE.Mesh(geometry, this.paint(name)), name);
  }

  /** The colour of a line of the robot follows its tension, so it has no token. */
  private line(): Line {
    return new THREE.Mesh(new THREE.CylinderGeometry(0.006, 0.006, 1, 8), this.paint("slack"));
  }
}

function stretch(line: THREE.Mesh, from: THREE.Vector3, to: THREE.Vector3): void {
  const way = new THREE.Vector3().subVectors(to, from);
  line.position.copy(from).addScaledVector(way, 0.5);
  line.scale.set(1, way.length(), 1);
  line.quaternion.setFromUnitVectors(UP, way.normalize());
}
