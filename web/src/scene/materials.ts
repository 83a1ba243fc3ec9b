import * as THREE from "three";
import { token } from "../look/theme.ts";

/** Returns paint in a colour of tokens.css. */
export function lambert(name: string): THREE.MeshLambertMaterial {
  return new THREE.MeshLambertMaterial({ color: token(name) });
}

/** Returns transparent paint. */
export function glass(colour: string, opacity: number): THREE.MeshLambertMaterial {
  return new THREE.MeshLambertMaterial({ color: colour, transparent: true, opacity, depthWrite: false });
}

/** Remembers the token of a body's colour, so that a change of the theme finds it. */
export function named<Body extends THREE.Object3D>(body: Body, name: string): Body {
  body.userData["token"] = name;
  return body;
}

/** Frees the memory that a tree of objects has on the graphics card. */
export function free(tree: THREE.Object3D): void {
  tree.traverse((one) => {
    if (!(one instanceof THREE.Mesh || one instanceof THREE.Line || one instanceof THREE.Sprite)) return;
    if (!(one instanceof THREE.Sprite)) one.geometry.dispose(); // all sprites share one geometry
    const material = one.material as THREE.Material & { map?: THREE.Texture | null };
    material.map?.dispose();
    material.dispose();
  });
}

/** Removes all objects of a group and frees their memory. */
export function empty(group: THREE.Group): void {
  free(group);
  group.clear();
}
