import * as THREE from "three";

/** Returns a dashed line for at most `most` points, with dashes and gaps of these lengths [m]. */
export function dashed(most: number, dash = 0.02, gap = 0.015): THREE.Line {
  return new THREE.Line(buffered(most), new THREE.LineDashedMaterial({ dashSize: dash, gapSize: gap }));
}

/** Returns a line for at most `most` points. */
export function solid(most: number): THREE.Line {
  return new THREE.Line(buffered(most), new THREE.LineBasicMaterial());
}

/** Replaces the points of a line, as far as its buffer holds them. */
export function fill(line: THREE.Line, points: readonly (readonly [number, number, number])[]): void {
  const position = line.geometry.getAttribute("position") as THREE.BufferAttribute;
  const count = Math.min(points.length, position.count);
  for (let i = 0; i < count; i++) position.setXYZ(i, ...(points[i] as [number, number, number]));
  line.geometry.setDrawRange(0, count);
  position.needsUpdate = true;
  line.frustumCulled = false; // its bounds are those of the first points
}

function buffered(most: number): THREE.BufferGeometry {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(most * 3), 3));
  geometry.setDrawRange(0, 0);
  return geometry;
}
