import * as THREE from "three";
import type { Zone } from "../machine/plan.ts";

/** Zones may be endless; they are drawn up to this size [m]. */
const LARGEST = 4;

/** Returns the body of a zone; that of a half-space is a plate at its border. */
export function bodyOf(zone: Zone, material: THREE.Material): THREE.Mesh {
  if (zone.kind === "box") {
    const { low, high } = zone;
    const size = [0, 1, 2].map((i) => Math.min(LARGEST, (high[i] ?? 0) - (low[i] ?? 0))) as [number, number, number];
    const box = new THREE.Mesh(new THREE.BoxGeometry(...size), material);
    box.position.set((low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2);
    return box;
  }
  if (zone.kind === "cylinder") {
    const height = Math.min(LARGEST, zone.high - zone.low);
    const cylinder = new THREE.Mesh(new THREE.CylinderGeometry(zone.radius, zone.radius, height, 32), material);
    cylinder.rotation.x = Math.PI / 2;
    cylinder.position.set(zone.x, zone.y, zone.low + height / 2);
    return cylinder;
  }
  const plate = new THREE.Mesh(new THREE.BoxGeometry(LARGEST, LARGEST, 0.004), material);
  plate.position.set(...zone.point);
  plate.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), new THREE.Vector3(...zone.normal).normalize());
  return plate;
}
